//! `vocc receive` on films that ffmpeg decodes. Here, ffmpeg is a script, so that it can be absent, fail and hang. `tests/suites/films.rs`
//! uses the real one.
#![cfg(target_os = "linux")]

mod common;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::ffmpeg::{Place, wait_for};
use common::recording::MESSAGE;
use common::{says, text};

#[test]
fn a_film_is_received_by_its_name_and_at_its_rate() {
    let place = Place::with_frames("film", "echo \"$@\" > told; /bin/cat times >&2; exec /bin/cat frames");
    let received = place.received(&["film.mp4", "--json"]);
    says(&received, 0, &[]);
    assert!(text(&received.stdout).contains(MESSAGE), "{received:?}");
    let told = std::fs::read_to_string(place.0.join("told")).expect("arguments");
    assert!(told.contains("-i file:film.mp4"), "{told}");
    // A wrong rate finds nothing; the right one is in the film's header.
    let slow = place.received(&["film.mp4", "--fps", "37", "--symbol-rate", "90"]);
    assert_eq!(slow.status.code(), Some(2), "{slow:?}");
}

#[test]
fn plain_films_need_no_ffmpeg() {
    let place = Place::with_frames("plain", "");
    std::fs::rename(place.0.join("frames"), place.0.join("film.y4m")).expect("renamed");
    let received = place.received(&["film.y4m"]);
    says(&received, 0, &[]);
    assert!(text(&received.stdout).contains(MESSAGE), "{received:?}");
}

#[test]
fn what_hinders_is_said() {
    let absent = Place::new("absent", "");
    let words = ["not on the PATH", "yuv4mpegpipe", "receive film.y4m"];
    says(&absent.received(&["film.mp4"]), 2, &words);
    says(&absent.received(&["other.mp4"]), 2, &["cannot read other.mp4"]);
    let two = absent.received(&["film.mp4", "film.mp4"]);
    says(&two, 2, &["if it is the only source"]);
    let broken = Place::new("broken", "echo 'moov atom not found' >&2; exit 1");
    let words = ["cannot decode film.mp4", "moov atom not found"];
    says(&broken.received(&["film.mp4"]), 2, &words);
    let silent = Place::new("silent", "exit 0");
    says(&silent.received(&["film.mp4"]), 2, &["no frames"]);
}

#[test]
fn what_came_before_a_fault_is_kept() {
    let script = "/bin/cat times >&2; /bin/cat frames; echo 'invalid data' >&2; exit 69";
    let place = Place::with_frames("fault", script);
    let received = place.received(&["film.mp4"]);
    says(&received, 2, &["cannot decode film.mp4", "invalid data"]);
    assert!(text(&received.stdout).contains(MESSAGE), "{received:?}");
    let place = Place::with_frames("blemish", "/bin/cat times >&2; /bin/cat frames; echo 'one packet lost' >&2");
    says(&place.received(&["film.mp4"]), 0, &["one packet lost"]);
}

#[test]
fn what_is_wrong_with_frames_is_said_and_not_that_the_pipe_was_closed() {
    let place = Place::new("closed", "/bin/cat frames || { echo 'Broken pipe' >&2; exit 1; }");
    for (header, words) in [
        ("It W320 H240", ["the film is flagged as interlaced", "--progressive"]),
        ("W8200 H240", ["8200 × 240 pixels, and at most 8192 × 8192", "-vf scale=8192:-2"]),
    ] {
        let frame = [b"FRAME\n".to_vec(), vec![0; 320 * 240]].concat();
        let frames = [format!("YUV4MPEG2 {header} Cmono\n").into_bytes(), frame.repeat(60)].concat();
        std::fs::write(place.0.join("frames"), frames).expect("frames");
        let refused = place.received(&["film.mp4"]);
        says(&refused, 2, &words);
        assert!(!text(&refused.stderr).contains("Broken pipe"), "{refused:?}");
    }
    let none = Place::new("no-pictures", "echo \"[error] Stream map '0:V:0' matches no streams.\" >&2; exit 1");
    says(&none.received(&["film.mp4"]), 2, &["film.mp4 has no video"]);
}

#[test]
fn frames_that_are_told_no_times_are_counted() {
    let place = Place::with_frames("untimed", "exec 2>&-; exec /bin/cat frames");
    let received = place.received(&["film.mp4"]);
    says(&received, 0, &[]);
    assert!(text(&received.stdout).contains(MESSAGE), "{received:?}");
}

#[test]
fn a_signal_ends_ffmpeg_too() {
    // A process that was started by nohup ignores HUP.
    let signals = ["TERM", "INT", "HUP"];
    for signal in &signals[..if ignores_hup() { 2 } else { 3 }] {
        let script = "echo $$ > pid; exec /bin/sleep 120";
        let place = Place::new(&format!("signal-{signal}"), script);
        let mut receive = place.receive(&["film.mp4"]);
        let mut receive = receive.stderr(Stdio::null()).spawn().expect("vocc runs");
        let pid = place.0.join("pid");
        let number = wait_for(|| {
            let text = std::fs::read_to_string(&pid).ok()?;
            text.trim().parse::<u32>().ok()
        });
        let id = receive.id().to_string();
        let kill = Command::new("kill").args([&format!("-{signal}"), &id]).status();
        assert!(kill.expect("kill runs").success());
        let begun = Instant::now();
        receive.wait().expect("an end");
        assert!(begun.elapsed() < Duration::from_secs(60), "{signal}");
        let process = format!("/proc/{number}");
        wait_for(|| (!Path::new(&process).exists()).then_some(()));
    }
}

/// Whether this process, and so its child processes, ignore the signal HUP.
fn ignores_hup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = u64::from_str_radix(ignored.expect("signals").trim(), 16).expect("bits");
    ignored & 1 == 1
}
