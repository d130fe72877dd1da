//! Only ordinary files of a reasonable size are read, and their contents are taken literally.
#![cfg(target_os = "linux")]

mod common;

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{folder, refused, says};

/// Time limit for an error; an idle machine needs some milliseconds.
const PATIENCE: Duration = Duration::from_secs(120);

/// Asserts that a command fails soon, in 2 GB of address space, with one of `words`.
fn refused_soon(place: &Path, arguments: &[&str], words: &[&str]) {
    let begun = Instant::now();
    let mut child = Command::new("prlimit")
        .args(["--as=2000000000", env!("CARGO_BIN_EXE_vocc")])
        .args(arguments)
        .current_dir(place)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("prlimit runs");
    while child.try_wait().expect("it runs").is_none() {
        if begun.elapsed() > PATIENCE {
            child.kill().expect("it runs");
            panic!("{arguments:?} was waited for");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    says(&child.wait_with_output().expect("it ran"), 2, words);
}

#[test]
fn what_may_have_no_end_is_not_read() {
    let place = folder("endless");
    common::bounded::pipe(&place.join("pipe"));
    let pipe = place.join("pipe");
    let pipe = common::name(&pipe);
    let ordinary = &["not an ordinary file"][..];
    for endless in ["/dev/zero", pipe] {
        for arguments in [
            &["plan", endless][..],
            &["evaluate", "--frames", "1000", endless],
            &["table", "show", endless],
            &["table", "check", endless],
            &["sweep", endless],
            &["merge", endless],
            &["decode", endless],
            &["receive", endless],
            &["decode", "x.png", "--camera", endless],
            &["link", "--camera", endless],
            &["plan", "--set", &format!("ambient.background_image={endless}")],
            &["link", "--set", &format!("ambient.background_image={endless}")],
            &["plan", "--set", "link.l2a=table", "--set", &format!("link.table={endless}")],
        ] {
            // A film may come through a pipe, so the program waits for the writer.
            if (arguments[0], endless) != ("receive", pipe) {
                refused_soon(&place, arguments, ordinary);
            }
        }
    }
    refused_soon(&place, &["transmit", "--message-file", "/dev/zero"], &["1024"]);
}

#[test]
fn what_is_too_large_is_not_read() {
    let place = folder("too-large");
    let large = std::fs::File::create(place.join("large.toml")).expect("a file");
    large.set_len(1 << 40).expect("room that is not used");
    for arguments in [
        &["plan", "large.toml"][..],
        &["sweep", "large.toml"],
        &["table", "show", "large.toml"],
        &["decode", "x.png", "--camera", "large.toml"],
    ] {
        refused_soon(&place, arguments, &["more than", "bytes"]);
    }
    let panels = "[[panel]]\n".repeat(4097);
    std::fs::write(place.join("panels.toml"), panels).expect("written");
    refused_soon(&place, &["plan", "panels.toml"], &["4097 panels", "1 to 4096"]);
    let panels = "[[panel]]\n".repeat(100_000);
    std::fs::write(place.join("panels.toml"), panels).expect("written");
    refused_soon(&place, &["plan", "panels.toml"], &["100000 panels"]);
}

#[test]
fn pictures_have_a_size() {
    let place = folder("sizes");
    image::GrayImage::new(1_000_000, 1).save(place.join("wide.png")).expect("a file");
    std::fs::write(place.join("huge.pgm"), "P5\n60000 60000\n255\n").expect("a file");
    std::fs::write(place.join("none.pgm"), "P5\n0 0\n255\n").expect("a file");
    // A header alone claims more than any memory holds.
    let mut png = std::fs::read(place.join("wide.png")).expect("there");
    png[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    std::fs::write(place.join("claims.png"), &png).expect("a file");
    for name in ["wide.png", "huge.pgm", "none.pgm", "claims.png"] {
        let background = format!("ambient.background_image={name}");
        for arguments in [
            &["decode", name][..],
            &["receive", name],
            &["plan", "--set", &background],
            &["render", "--out", "x.png", "--set", &background],
        ] {
            refused_soon(&place, arguments, &[name]);
        }
    }
    refused_soon(&place, &["decode", "wide.png"], &["1000000 × 1", "8192 × 8192"]);
}

#[test]
fn settings_are_taken_to_the_letter() {
    for set in [
        "pose.distance_m=5\nlink.l2a=3",
        "pose.distance_m=5\r\n",
        "pose.distance_m=5\n",
        "pose.distance_m\n=5",
    ] {
        refused(&["plan", "--set", set], &["one line"]);
    }
    let place = folder("letters");
    std::fs::write(
        place.join("plan.toml"),
        "frames = 256\n[grid]\npose.distance_m = [30, 40]\n\"pose.distance_m \" = [50, 60]\n",
    )
    .expect("written");
    refused_soon(&place, &["sweep", "plan.toml"], &["pose.distance_m is listed twice"]);
    // Headers of a stream and of its frames.
    for stream in [
        "YUV4MPEG29 W2 H1 Cmono\nFRAME\nxx",
        "YUV4MPEG2 W2 H1 Cmono\nFRAMEX\nxx",
        "YUV4MPEG2 W2 H1 Cmono\nFRAME\nxx\nFRAME\nxx",
        "YUV4MPEG2 W2 H1 Cmono\n\n",
        "YUV4MPEG2 W2 H1 Cmono",
        "YUV4MPEG2 W2 H1 Cmono\nFRAME",
        "YUV4MPEG2 W2 W3 H1 Cmono\n",
    ] {
        let mut receive = Command::new(env!("CARGO_BIN_EXE_vocc"))
            .args(["receive", "-"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("vocc runs");
        let mut input = receive.stdin.take().expect("a pipe");
        input.write_all(stream.as_bytes()).expect("it reads");
        drop(input);
        says(&receive.wait_with_output().expect("it ran"), 2, &[]);
    }
}
