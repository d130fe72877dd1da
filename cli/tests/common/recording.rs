//! Frames of simulated links, as files and as a y4m stream.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::{command, folder, text, words};

/// What is sent.
pub const MESSAGE: &str = "bend ahead";

/// How a command ends.
pub fn run(command: &mut Command) -> Output {
    command.output().expect("the program runs")
}

/// A fresh folder with the frames of a link on the day preset, in a smaller picture.
pub fn filmed(name: &str, frames: u32) -> PathBuf {
    film(name, MESSAGE, frames, 90)
}

/// The same of any message, with so many symbols a second.
pub fn film(name: &str, message: &str, frames: u32, symbol_rate_hz: u32) -> PathBuf {
    film_with(name, message, frames, &[&format!("link.symbol_rate_hz={symbol_rate_hz}")])
}

/// The same, with these keys of the scene.
pub fn film_with(name: &str, message: &str, frames: u32, keys: &[&str]) -> PathBuf {
    let folder = folder(name);
    let mut link = command(&words("link day --level fast --set camera.width_px=320 --set camera.height_px=240"));
    for key in keys {
        link.args(["--set", *key]);
    }
    link.args(["--message", message, "--frames", &frames.to_string(), "--save"])
        .arg(&folder);
    let output = run(&mut link);
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", text(&output.stderr));
    folder
}

/// The frames of a folder.
pub fn pixels(folder: &Path) -> Vec<Vec<u8>> {
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    names.sort();
    names
        .iter()
        .map(|name| image::open(name).expect("a frame").into_luma8().into_raw())
        .collect()
}

/// The same as a y4m stream.
pub fn y4m(folder: &Path) -> Vec<u8> {
    y4m_at(folder, 100)
}

/// The same of that many frames a second.
pub fn y4m_at(folder: &Path, rate_hz: u32) -> Vec<u8> {
    let mut stream = format!("YUV4MPEG2 W320 H240 F{rate_hz}:1 Ip C420jpeg\n").into_bytes();
    for frame in pixels(folder) {
        stream.extend(b"FRAME\n");
        stream.extend(frame);
        stream.extend([128; 160 * 120 * 2]);
    }
    stream
}
