//! Live sources: cameras, addresses, named pipes, and films at their own pace.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::ensure;

use super::{address, cameras, files, film, secrets};

/// Protocols that an address may redirect to: no local files.
const NETWORK: &str = "rtsp,rtsps,rtp,srtp,udp,tcp,tls,http,https,httpproxy,crypto,data,srt,rtmp";
/// Decodes each frame at once, after at most half a second of format detection, and keeps its time.
const AT_ONCE: [&str; 7] = [
    "-copyts",
    "-flags",
    "low_delay",
    "-thread_type",
    "slice",
    "-analyzeduration",
    "500000",
];

/// A live source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Live {
    /// A local camera's device.
    Camera(PathBuf),
    Address(String),
    Pipe(PathBuf),
    /// A film at its own pace.
    Film(PathBuf),
    Input,
}

impl Live {
    /// The live source of that name, if it is one.
    pub fn of(source: &Path) -> Option<Self> {
        let text = source.to_string_lossy();
        if let Some(device) = text.strip_prefix("v4l2:") {
            return Some(Self::Camera(device.into()));
        }
        if text.starts_with("/dev/v4l") || text.starts_with("/dev/video") {
            return Some(Self::Camera(source.into()));
        }
        if let Some(scheme) = address::scheme(source).filter(|scheme| address::is_read(scheme)) {
            // ffmpeg knows it in lower case alone.
            return Some(Self::Address(format!("{scheme}{}", &text[scheme.len()..])));
        }
        // A shell's /dev/fd/63 may be a single picture.
        let is_named = !source.starts_with("/dev") && !source.starts_with("/proc");
        (is_named && is_pipe(source) && !files::is_picture(source)).then(|| Self::Pipe(source.into()))
    }

    /// The name, without an address's password.
    pub fn name(&self) -> String {
        match self {
            Self::Camera(path) | Self::Pipe(path) | Self::Film(path) => path.display().to_string(),
            Self::Address(address) => secrets::masked(address),
            Self::Input => "standard input".into(),
        }
    }

    /// The address, if it has one.
    pub fn address(&self) -> Option<&str> {
        match self {
            Self::Address(address) => Some(address),
            _ => None,
        }
    }

    /// Whether ffmpeg decodes it; `raw` is the size of raw frames, if given.
    pub fn is_decoded(&self, raw: Option<(usize, usize)>) -> bool {
        match self {
            Self::Camera(_) | Self::Address(_) | Self::Film(_) => true,
            Self::Pipe(path) => raw.is_none() && !film::is_plain(path),
            Self::Input => false,
        }
    }

    /// Whether it can come back after it disappears.
    pub fn returns(&self) -> bool {
        matches!(self, Self::Camera(_) | Self::Address(_) | Self::Pipe(_))
    }

    /// Whether silence means that it is gone. A pipe waits for its writers.
    pub fn goes_silently(&self) -> bool {
        matches!(self, Self::Camera(_) | Self::Address(_))
    }

    /// Checks that the source can exist.
    pub fn check(&self) -> anyhow::Result<()> {
        if let Self::Camera(device) = self {
            ensure!(
                device.exists(),
                "there is no camera {}: {}",
                device.display(),
                cameras::advice(&cameras::list())
            );
        }
        Ok(())
    }

    /// ffmpeg's options for the source, with the user's `options`.
    pub fn input(&self, options: &str) -> Vec<OsString> {
        let mut input: Vec<OsString> = match self {
            Self::Film(_) => vec!["-re".into()],
            _ => AT_ONCE.map(OsString::from).into(),
        };
        input.extend(options.split_whitespace().map(OsString::from));
        let mut add = |words: &[&str]| input.extend(words.iter().map(OsString::from));
        match self {
            // Stamps of the wall clock instead of the time since boot.
            Self::Camera(device) => {
                add(&["-f", "v4l2", "-ts", "abs", "-i"]);
                input.push(device.into());
            }
            Self::Address(address) => {
                if address.starts_with("rtsp") {
                    add(&["-rtsp_flags", "prefer_tcp"]);
                } else if address.starts_with("udp") {
                    add(&["-overrun_nonfatal", "1"]);
                }
                add(&["-protocol_whitelist", NETWORK, "-i", address]);
            }
            Self::Pipe(path) | Self::Film(path) => input.extend(film::local(path)),
            Self::Input => {}
        }
        input
    }
}

#[cfg(unix)]
fn is_pipe(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    path.metadata().is_ok_and(|there| there.file_type().is_fifo())
}

#[cfg(not(unix))]
fn is_pipe(_: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_live_by_their_names() {
        let camera = |device: &str| Some(Live::Camera(device.into()));
        assert_eq!(Live::of(Path::new("/dev/video0")), camera("/dev/video0"));
        assert_eq!(Live::of(Path::new("v4l2:/dev/video2")), camera("/dev/video2"));
        for address in ["rtsp://10.0.0.7/live", "udp://127.0.0.1:5000?fifo_size=1000", "http://[::1]:8080/"] {
            assert_eq!(Live::of(Path::new(address)), Some(Live::Address(address.into())));
        }
        let shouted = Live::of(Path::new("RTSP://User@Host/Path"));
        assert_eq!(shouted, Some(Live::Address("rtsp://User@Host/Path".into())));
        for other in [
            "road.mp4",
            "frames",
            "-",
            "ftp://host/film.mp4",
            "file:///etc/passwd",
            "/dev/stdin",
            "concat:a|b",
        ] {
            assert_eq!(Live::of(Path::new(other)), None, "{other}");
        }
    }

    #[test]
    fn an_address_leads_to_no_file() {
        let input = Live::Address("http://host/list.m3u8".into()).input("");
        let whitelist = input.iter().position(|word| word == "-protocol_whitelist").expect("a list");
        let protocols = input[whitelist + 1].to_str().expect("text");
        assert!(
            protocols
                .split(',')
                .all(|protocol| !["file", "concat", "subfile", "pipe"].contains(&protocol))
        );
    }
}
