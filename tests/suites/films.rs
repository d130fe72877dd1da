//! Films from cameras and recorders: qualities, containers, bare streams, gaps, irregular frames, cover pictures and interlacing, decoded
//! with ffmpeg.
//!
//! Skipped if ffmpeg is absent (`tests/run` installs it). `cli/tests/films.rs` and `cli/tests/formats.rs` have the tests without ffmpeg.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

use tempfile::TempDir;
use vocc_tests::programs::{self, output};
use vocc_tests::tests;
use vocc_tests::trials::{self, Unready};

const MESSAGE: &str = "bend ahead";
const FRAMES: usize = 48;
/// High-quality encoding without visible loss.
const X264: [&str; 6] = ["-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p"];
/// Keeps a filter's frame times, in milliseconds.
const UNSTEADY: [&str; 4] = ["-vsync", "passthrough", "-enc_time_base", "1/1000"];

/// `vocc`, and frames of a link at 100 frames per second.
struct Ready {
    vocc: PathBuf,
    frames: TempDir,
}

type Test = fn(&Ready);

fn main() -> ExitCode {
    let tests = tests![
        films_of_all_kinds_are_received,
        a_gap_is_skipped_and_unsteady_frames_are_counted_by_their_times,
        a_cover_is_no_film,
        interlaced_films_are_named_or_let_in,
        frames_that_are_too_wide_are_named,
        h264_of_common_quality_is_received,
    ];
    trials::run("films", None, tests, provide)
}

fn provide() -> Result<Ready, Unready> {
    programs::provide("ffmpeg")?;
    let vocc = programs::vocc()?;
    let frames = tempfile::tempdir()?;
    output(&mut programs::link(&vocc, frames.path(), MESSAGE, FRAMES as u64))?;
    Ok(Ready { vocc, frames })
}

impl Ready {
    /// Encodes the frames as a film with this rate.
    fn film(&self, name: &str, rate: &str, arguments: &[&str]) -> PathBuf {
        let film = self.path(name);
        let mut ffmpeg = Command::new("ffmpeg");
        ffmpeg.args(["-y", "-loglevel", "error", "-framerate", rate, "-i"]);
        ffmpeg.arg(self.frames.path().join("frame-%06d.png"));
        made(ffmpeg.args(arguments).arg(&film));
        film
    }

    fn path(&self, name: &str) -> PathBuf {
        self.frames.path().join(name)
    }

    fn receive(&self, film: &Path, arguments: &[&str]) -> Output {
        let mut receive = Command::new(&self.vocc);
        receive.arg("receive").arg(film).args(arguments);
        receive.output().expect("vocc runs")
    }

    /// Receives a file on standard input.
    fn receive_piped(&self, file: &Path, arguments: &[&str]) -> Output {
        let mut receive = Command::new(&self.vocc);
        receive.args(["receive", "-"]).args(arguments);
        receive
            .stdin(std::fs::File::open(file).expect("the stream"))
            .output()
            .expect("vocc runs")
    }

    /// Asserts that a film's message arrives, and returns the number of frames read.
    fn delivers(&self, film: &Path, arguments: &[&str]) -> usize {
        let received = self.receive(film, &[&["--bits"], arguments].concat());
        let told = text(&received.stdout);
        assert!(told.contains(MESSAGE), "{}: {}", film.display(), text(&received.stderr));
        told.lines().filter(|line| line.starts_with("frame ")).count()
    }
}

/// Runs ffmpeg.
fn made(ffmpeg: &mut Command) {
    if let Err(error) = output(ffmpeg) {
        panic!("{error}");
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn films_of_all_kinds_are_received(ready: &Ready) {
    for ending in ["mkv", "ts", "m2ts", "flv", "mov"] {
        let film = ready.film(&format!("film.{ending}"), "100", &X264);
        assert_eq!(ready.delivers(&film, &[]), FRAMES, "{ending}");
    }
    // Cameras name their MP4 files so.
    let mp4 = ready.film("film.mp4", "100", &X264);
    for ending in ["insv", "lrv"] {
        let film = ready.path(&format!("film.{ending}"));
        std::fs::copy(&mp4, &film).expect("room");
        assert_eq!(ready.delivers(&film, &[]), FRAMES, "{ending}");
    }
    let jpeg = ["-f", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p"];
    for (ending, codec) in [("h264", &X264[..]), ("mjpeg", &jpeg), ("mjpg", &jpeg)] {
        let film = ready.film(&format!("film.{ending}"), "100", codec);
        // A bare stream has no frame rate.
        assert_eq!(ready.delivers(&film, &["--fps", "100"]), FRAMES, "{ending}");
        let untold = ready.receive(&film, &[]);
        assert!(
            text(&untold.stderr).contains("does not state its frame rate: give it with --fps"),
            "{ending}"
        );
    }
}

fn a_gap_is_skipped_and_unsteady_frames_are_counted_by_their_times(ready: &Ready) {
    for (name, filter, frames) in [
        ("gap.mkv", "setpts='PTS+if(gte(N,24),600/TB,0)'", FRAMES),
        ("unsteady.mp4", "setpts='PTS+mod(7*N,5)*0.001/TB'", FRAMES),
        ("lost.mp4", "select='mod(n,7)-4'", FRAMES - 7),
    ] {
        let film = ready.film(name, "100", &[&["-vf", filter], &UNSTEADY[..], &X264].concat());
        assert_eq!(ready.delivers(&film, &[]), frames, "{name}");
    }
}

fn a_cover_is_no_film(ready: &Ready) {
    let film = ready.film("plain.mp4", "100", &X264);
    let covered = ready.path("covered.mp4");
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-y", "-loglevel", "error", "-i"]).arg(ready.path("frame-000000.png"));
    ffmpeg
        .arg("-i")
        .arg(&film)
        .args(["-map", "0", "-map", "1", "-c", "copy", "-disposition:v:0", "attached_pic"]);
    made(ffmpeg.arg(&covered));
    assert_eq!(ready.delivers(&covered, &[]), FRAMES);
    let sound = ready.path("sound.mp4");
    made(
        Command::new("ffmpeg")
            .args(["-y", "-loglevel", "error", "-f", "lavfi", "-i", "sine", "-t", "1"])
            .arg(&sound),
    );
    let refused = ready.receive(&sound, &[]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("has no video"), "{}", text(&refused.stderr));
}

fn interlaced_films_are_named_or_let_in(ready: &Ready) {
    let codec = |filter: &'static str| -> Vec<&str> {
        let codec = "-c:v mpeg2video -q:v 1 -flags +ildct+ilme -pix_fmt yuv420p";
        ["-vf", filter].into_iter().chain(codec.split(' ')).collect()
    };
    for name in ["flagged.mts", "flagged.mkv", "flagged.mpg"] {
        let film = ready.film(name, "25", &codec("setfield=tff"));
        let frames = ready.delivers(&film, &["--fps", "100"]);
        assert_eq!(ready.delivers(&film, &["--progressive", "--fps", "100"]), frames, "{name}");
        let film = ready.film(&format!("woven-{name}"), "25", &codec("tinterlace=interleave_top,setfield=tff"));
        let refused = text(&ready.receive(&film, &[]).stderr);
        assert!(
            refused.contains("the film is interlaced") && refused.contains("--progressive"),
            "{name}: {refused}"
        );
        assert!(!refused.contains("Broken pipe"), "{name}: {refused}");
    }
}

fn frames_that_are_too_wide_are_named(ready: &Ready) {
    let film = ready.film("wide.avi", "25", &["-vf", "scale=8200:64", "-c:v", "mjpeg", "-pix_fmt", "yuvj420p"]);
    let refused = text(&ready.receive(&film, &[]).stderr);
    assert!(
        refused.contains("8200 × 64 pixels") && refused.contains("-vf scale=8192:-2") && !refused.contains("Broken pipe"),
        "{refused}"
    );
    // As it says.
    let scaled = ready.path("scaled.y4m");
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-loglevel", "error", "-i"]).arg(&film);
    made(ffmpeg.args(["-vf", "scale=8192:-2", "-f", "yuv4mpegpipe"]).arg(&scaled));
    let received = ready.receive_piped(&scaled, &[]);
    assert!(
        text(&received.stderr).contains(&format!("no message in {FRAMES} frames")),
        "{received:?}"
    );
}

fn h264_of_common_quality_is_received(ready: &Ready) {
    for quality in ["18", "23", "28"] {
        let codec = ["-frames:v", "24", "-c:v", "libx264", "-crf", quality, "-pix_fmt", "yuv420p"];
        let film = ready.film(&format!("film-{quality}.mp4"), "100", &codec);
        ready.delivers(&film, &[]);
        for (format, decoded_as, received_as) in [
            ("yuv4mpegpipe", &[][..], &[][..]),
            ("rawvideo", &["-pix_fmt", "gray"], &["--raw", "320x240"]),
        ] {
            let stream = ready.path(&format!("film-{quality}.{format}"));
            let mut ffmpeg = Command::new("ffmpeg");
            ffmpeg.args(["-loglevel", "error", "-i"]).arg(&film);
            made(ffmpeg.args(["-f", format]).args(decoded_as).arg(&stream));
            let received = ready.receive_piped(&stream, received_as);
            assert!(
                text(&received.stdout).contains(MESSAGE),
                "CRF {quality}, {format}: {}",
                text(&received.stderr)
            );
        }
    }
}
