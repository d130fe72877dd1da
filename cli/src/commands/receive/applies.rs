//! Rejects options that do not apply to the source.

use anyhow::ensure;

use super::{Arguments, Source};
use crate::frames::live::Live;

/// Checks that each option applies to the source.
pub fn check(arguments: &Arguments, source: &Source) -> anyhow::Result<()> {
    let name = match source {
        Source::Files(frames) if frames.files.len() > 1 => "a series of pictures".into(),
        _ => source.name(),
    };
    let is_live = matches!(source, Source::Live(_));
    ensure!(
        arguments.ffmpeg.trim().is_empty() || matches!(source, Source::Live(live) if live.is_decoded(arguments.raw)),
        "--ffmpeg is for live sources that ffmpeg decodes, and {name} is not one: omit --ffmpeg"
    );
    ensure!(
        arguments.recorded.start().is_none() || !is_live,
        "--start is for films, and each frame of the live source {name} has its own time: omit --start"
    );
    ensure!(
        arguments.raw.is_none() || matches!(source, Source::Input | Source::Live(Live::Input | Live::Pipe(_))),
        "--raw is for standard input and named pipes, and {name} is neither: omit --raw"
    );
    ensure!(
        !arguments.progressive || !matches!(source, Source::Files(_)),
        "--progressive is for films and streams, and {name} is neither: omit --progressive"
    );
    Ok(())
}
