//! Films as cameras keep them: `vocc receive` reads the message out of H.264 of common quality, decoded with ffmpeg.
//!
//! Where ffmpeg is absent (`tests/run` installs it), this is skipped.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

use libtest_mimic::Arguments;
use vocc_tests::programs::{self, output};
use vocc_tests::trials::{self, Unready};

const MESSAGE: &str = "bend ahead";

fn main() -> ExitCode {
    let tests = [("h264_of_common_quality_is_received", |vocc: &PathBuf| {
        h264_of_common_quality_is_received(vocc)
    })];
    trials::run(&Arguments::from_args(), "films", tests, provide)
}

/// ffmpeg, and `vocc`.
fn provide() -> Result<PathBuf, Unready> {
    programs::provide("ffmpeg")?;
    programs::vocc()
}

fn h264_of_common_quality_is_received(vocc: &Path) {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    film(vocc, folder);
    for quality in ["18", "23", "28"] {
        let film = folder.join(format!("film-{quality}.mp4"));
        ffmpeg(
            Command::new("ffmpeg")
                .args(["-loglevel", "error", "-framerate", "100", "-i"])
                .arg(folder.join("frame-%06d.png"))
                .args(["-c:v", "libx264", "-crf", quality, "-pix_fmt", "yuv420p"])
                .arg(&film),
        );
        let received = Command::new(vocc).arg("receive").arg(&film).output();
        let received = received.expect("vocc runs");
        assert!(
            text(&received.stdout).contains(MESSAGE),
            "CRF {quality}: {}",
            text(&received.stderr)
        );
        for (format, decoded_as, received_as) in [
            ("yuv4mpegpipe", &[][..], &[][..]),
            ("rawvideo", &["-pix_fmt", "gray"], &["--raw", "320x240"]),
        ] {
            let stream = folder.join(format!("film-{quality}.{format}"));
            ffmpeg(
                Command::new("ffmpeg")
                    .args(["-loglevel", "error", "-i"])
                    .arg(&film)
                    .args(["-f", format])
                    .args(decoded_as)
                    .arg(&stream),
            );
            let received = receive(vocc, &stream, received_as);
            assert!(
                text(&received.stdout).contains(MESSAGE),
                "CRF {quality}, {format}: {}",
                text(&received.stderr)
            );
        }
    }
}

/// Writes 24 frames of a link on the day preset, in a smaller picture.
fn film(vocc: &Path, folder: &Path) {
    let output = programs::link(vocc, folder, MESSAGE, 24).output().expect("vocc runs");
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", text(&output.stderr));
}

fn ffmpeg(command: &mut Command) {
    if let Err(error) = output(command) {
        panic!("{error}");
    }
}

/// Receives what a file holds, on standard input.
fn receive(vocc: &Path, file: &Path, arguments: &[&str]) -> Output {
    Command::new(vocc)
        .args(["receive", "-"])
        .args(arguments)
        .stdin(std::fs::File::open(file).expect("the stream"))
        .output()
        .expect("vocc runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
