//! An ffmpeg that is a script, so that it can be absent, fail and hang.

use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use super::bounded::{self, PATIENCE};
use super::recording::{film, filmed, y4m_at};
use super::{command, folder};

/// Films at its n-th run the film `film-n`, again and again until a file `over-n` exists, and is silent then if `silent-n` exists. Times
/// begin with the wall clock.
const FILMS: &str = r#"
echo "$@" >> runs
run=$(/usr/bin/wc -l < runs)
echo '[showinfo@times @ 0x55] [info] config in time_base: 1/100, frame_rate: 100/1' >&2
/bin/cat film-$run/header
time=$(/bin/date +%s)00
until [ -e over-$run ]; do
    echo "[showinfo@times @ 0x55] [info] n:0 pts:$time pts_time:0 fmt:yuv420p" >&2
    /bin/cat film-$run/$((time % 100))
    time=$((time + 1))
    /bin/sleep 0.01
done
[ ! -e silent-$run ] || exec /bin/sleep 600
"#;

/// A folder with a film, and an ffmpeg that does what the script says.
pub struct Place(pub PathBuf);

impl Place {
    pub fn new(name: &str, script: &str) -> Self {
        let place = folder(name);
        std::fs::create_dir(place.join("bin")).expect("a folder");
        if !script.is_empty() {
            let program = place.join("bin/ffmpeg");
            std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("a script");
            std::fs::set_permissions(&program, PermissionsExt::from_mode(0o755)).expect("set");
        }
        std::fs::write(place.join("film.mp4"), "not for vocc to read").expect("a film");
        Self(place)
    }

    /// The same with frames beside the film, for the script to give.
    pub fn with_frames(name: &str, script: &str) -> Self {
        Self::with_frames_at(name, script, 100, &(0..16).collect::<Vec<_>>())
    }

    /// The same with a frame for each of these times, in periods of the frame rate.
    pub fn with_frames_at(name: &str, script: &str, rate_hz: u32, times: &[u32]) -> Self {
        let frames = y4m_at(&filmed(&format!("{name}-frames"), times.len() as u32), rate_hz);
        let place = Self::new(name, script);
        std::fs::write(place.0.join("frames"), frames).expect("frames");
        // ffmpeg tells when each frame was taken before it writes the frame.
        let times = (0..).zip(times);
        let times = times.map(|(n, time)| format!("[showinfo@times @ 0x55] [info] n:{n:4} pts:{time:7} pts_time:{time} fmt:yuv420p\n"));
        let rate = format!("[showinfo@times @ 0x55] [info] config in time_base: 1/{rate_hz}, frame_rate: {rate_hz}/1\n");
        std::fs::write(place.0.join("times"), rate + &times.collect::<String>()).expect("times");
        place
    }

    /// A folder with an ffmpeg that films one of these messages at each of its runs, at most at the pace of reading.
    pub fn filming(name: &str, messages: &[&str]) -> Self {
        let place = Self::new(name, FILMS);
        for (run, message) in (1..).zip(messages) {
            // At 90 symbols a second, 100 frames are whole symbols: the film has no seam.
            let stream = y4m_at(&film(&format!("{name}-{run}"), message, 100, 90), 100);
            let header = stream.iter().position(|&byte| byte == b'\n').expect("a header") + 1;
            let folder = place.0.join(format!("film-{run}"));
            std::fs::create_dir(&folder).expect("a folder");
            std::fs::write(folder.join("header"), &stream[..header]).expect("a header");
            for (number, frame) in stream[header..].chunks((stream.len() - header) / 100).enumerate() {
                std::fs::write(folder.join(number.to_string()), frame).expect("a frame");
            }
        }
        place
    }

    /// Makes an empty file: a device, or a word to the ffmpeg that films.
    pub fn mark(&self, name: &str) {
        std::fs::write(self.0.join(name), "").expect("a file");
    }

    pub fn receive(&self, arguments: &[&str]) -> Command {
        let mut receive = command(&["receive"]);
        receive.args(arguments).current_dir(&self.0);
        receive.env("PATH", self.0.join("bin"));
        receive
    }

    pub fn received(&self, arguments: &[&str]) -> Output {
        bounded::run(&mut self.receive(arguments))
    }
}

/// Looks again and again until there is something.
pub fn wait_for<T>(mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "it never came");
        std::thread::sleep(Duration::from_millis(20));
    }
}
