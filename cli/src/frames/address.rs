//! URLs among the names of sources.

use std::path::Path;

/// URL schemes that are read.
pub const SCHEMES: [&str; 9] = ["rtsp", "rtsps", "rtp", "udp", "tcp", "http", "https", "srt", "rtmp"];

/// The scheme of a URL in lower case, unless it is a file's name.
pub fn scheme(source: &Path) -> Option<String> {
    let text = source.to_string_lossy();
    let (scheme, _) = text.split_once("://")?;
    let is_one = !scheme.is_empty() && scheme.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte));
    (is_one && !source.exists()).then(|| scheme.to_ascii_lowercase())
}

/// Whether URLs of that scheme are read.
pub fn is_read(scheme: &str) -> bool {
    SCHEMES.contains(&scheme)
}
