//! An ffmpeg that is a script, so that it can be absent, fail and hang.

use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use super::recording::{filmed, run, y4m};
use super::{command, folder};

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
        let frames = y4m(&filmed(&format!("{name}-frames"), 16));
        let place = Self::new(name, script);
        std::fs::write(place.0.join("frames"), frames).expect("frames");
        // ffmpeg tells when each frame was taken before it writes the frame.
        let times = (0..16).map(|n| format!("[showinfo@times @ 0x55] [info] n:{n:4} pts:{n:7} pts_time:{n}e-2 fmt:yuv420p\n"));
        let rate = "[showinfo@times @ 0x55] [info] config in time_base: 1/100, frame_rate: 100/1\n";
        std::fs::write(place.0.join("times"), rate.to_owned() + &times.collect::<String>()).expect("times");
        place
    }

    pub fn receive(&self, arguments: &[&str]) -> Command {
        let mut receive = command(&["receive"]);
        receive.args(arguments).current_dir(&self.0);
        receive.env("PATH", self.0.join("bin"));
        receive
    }

    pub fn received(&self, arguments: &[&str]) -> Output {
        run(&mut self.receive(arguments))
    }
}

/// Looks again and again until there is something.
pub fn wait_for<T>(mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "it never came");
        std::thread::sleep(Duration::from_millis(20));
    }
}
