//! Files are written whole or not at all, wherever the disk ends.
#![cfg(target_os = "linux")]

mod common;

use std::path::Path;
use std::process::{Command, Output};

use common::{folder, says, text, vocc};

/// The program, where no file may grow beyond so many KiB: writing more fails as it does on a full disk.
fn vocc_on_full_disk(folder: &Path, kib: u32, arguments: &str) -> Output {
    let vocc = env!("CARGO_BIN_EXE_vocc");
    Command::new("bash")
        .current_dir(folder)
        .args([
            "-c",
            &format!("trap '' XFSZ; ulimit -f {kib}; exec {vocc} {arguments}"),
        ])
        .output()
        .expect("bash runs")
}

/// The names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into()
        })
        .collect();
    names.sort();
    names
}

#[test]
fn a_picture_that_has_no_room_leaves_the_old_one() {
    let place = folder("full-render");
    let render = "render --crop --set pose.distance_m=20 --out c.png --linear c.npy";
    let old = vocc_on_full_disk(&place, 1024, render);
    says(&old, 0, &[]);
    let read = |name: &str| std::fs::read(place.join(name)).expect("there");
    let before = [read("c.png"), read("c.npy")];
    let kib = before[0].len() as u32 / 1024;
    assert!(
        kib > 0 && !before[0].len().is_multiple_of(1024),
        "{} bytes",
        before[0].len()
    );
    // The picture's last bytes, and all of the matrix.
    for (kib, arguments) in [
        (
            kib,
            "render --crop --set pose.distance_m=20 --out c.png --seed 2",
        ),
        (kib, &format!("{render} --seed 2")),
        (0, "render --crop --out c.png"),
    ] {
        let full = vocc_on_full_disk(&place, kib, arguments);
        says(&full, 2, &["cannot write c."]);
        assert!(text(&full.stdout).is_empty(), "{full:?}");
        assert_eq!([read("c.png"), read("c.npy")], before, "{arguments}");
        assert_eq!(names(&place), ["c.npy", "c.png"]);
    }
}

#[test]
fn frames_and_panels_that_have_no_room_are_not_half_there() {
    let place = folder("full-frames");
    let link = vocc_on_full_disk(&place, 4, "link --frames 1 --save frames");
    says(&link, 2, &["cannot write frames/frame-000000.png"]);
    assert!(names(&place.join("frames")).is_empty());
    let panels = vocc_on_full_disk(
        &place,
        4,
        "transmit --message A --count 1000 --symbols panels.txt",
    );
    says(&panels, 2, &["cannot write panels.txt"]);
    assert_eq!(names(&place), ["frames"]);
}

#[test]
fn a_full_device_is_no_place_for_anything() {
    let place = folder("full-device");
    says(
        &vocc(&["render", "--crop", "--out", "/dev/full"]),
        2,
        &["/dev/full", "No space left"],
    );
    let both = [
        "render",
        "--crop",
        "--out",
        "/dev/null",
        "--linear",
        "/dev/full",
    ];
    says(&vocc(&both), 2, &["/dev/full", "No space left"]);
    let panels = ["transmit", "--message", "A", "--symbols", "/dev/full"];
    says(&vocc(&panels), 2, &["/dev/full", "No space left"]);
    let frames = place.join("frames");
    let frames = frames.to_str().expect("a plain path");
    says(&vocc(&["link", "--frames", "3", "--save", frames]), 1, &[]);
    let camera = ["receive", frames, "--save-camera", "/dev/full"];
    says(&vocc(&camera), 2, &["/dev/full", "No space left"]);
}

#[test]
fn pipes_and_standard_output_are_written_to() {
    let png = vocc(&["render", "--crop", "--out", "/dev/stdout"]);
    says(&png, 0, &[]);
    assert!(png.stdout.starts_with(b"\x89PNG"));
    let place = folder("pipe");
    let script = format!(
        "mkfifo pipe; cat pipe > panels & {} transmit --message A --symbols pipe && wait && test -p pipe",
        env!("CARGO_BIN_EXE_vocc")
    );
    let piped = Command::new("bash")
        .current_dir(&place)
        .args(["-c", &script])
        .output()
        .expect("bash runs");
    assert!(piped.status.success(), "{piped:?}");
    let panels = std::fs::read_to_string(place.join("panels")).expect("there");
    assert_eq!(panels, text(&vocc(&["transmit", "--message", "A"]).stdout));
}
