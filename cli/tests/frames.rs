//! `vocc frames` writes the frames that `vocc evaluate` evaluates.

mod common;

use std::path::Path;

use common::{folder, json, name, refused, says, text, vocc, words};
use link::panel::{LEDS, PanelFrame};
use rx_pipeline::cells::CellMap;
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::Detector;
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;

/// LEDs three pixels apart in noise: k-means makes errors, and exposures contain two symbols.
const HARD: &str = "night --seed 3 --random-reflectance --set pose.distance_m=65 --set panel.interval=0.5";
const FRAMES: usize = 300;

/// Runs `vocc` with the words of a line and more arguments.
fn run(line: &str, more: &[&str]) -> std::process::Output {
    vocc(&[words(line).as_slice(), more].concat())
}

/// The shape and the numbers of an NPY file.
fn npy(bytes: &[u8], kind: &str) -> (Vec<usize>, Vec<u8>) {
    let (header, numbers) = bytes.split_at(128);
    let about = std::str::from_utf8(&header[10..]).expect("plain text");
    assert!(about.starts_with(&format!("{{'descr': '{kind}', ")), "{about}");
    let (_, shape) = about.split_once('(').expect("a shape");
    let (shape, _) = shape.split_once(')').expect("its end");
    let sides = shape.split(',').map(str::trim).filter(|side| !side.is_empty());
    (sides.map(|side| side.parse().expect("a side")).collect(), numbers.into())
}

fn read_npy(folder: &Path, file: &str, kind: &str) -> (Vec<usize>, Vec<u8>) {
    npy(&std::fs::read(folder.join(file)).expect("a file"), kind)
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    let (numbers, _) = bytes.as_chunks::<4>();
    numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()
}

fn panels(bytes: &[u8]) -> Vec<PanelFrame> {
    let panels = bytes.chunks_exact(LEDS);
    let bits = |leds: &[u8]| leds.iter().enumerate().fold(0, |bits, (led, &on)| bits | u64::from(on) << led);
    panels.map(|leds| PanelFrame::from_bits(bits(leds))).collect()
}

/// The library's features of a picture with these corners.
fn measured(grey: &[u8], [height, width]: [usize; 2], corners: &[f32]) -> Features {
    let points = std::array::from_fn(|corner| [corners[2 * corner], corners[2 * corner + 1]]);
    let mut map = Box::new(CellMap::<{ 128 * 128 }>::empty());
    map.build(&Corners::new(points).expect("corners"), width, height).expect("cells");
    Features::measure(&Frame::new(grey, width, height).expect("a frame"), &map).expect("features")
}

/// The bits that the library's k-means reads.
fn read_by_kmeans(features: &Features) -> PanelFrame {
    Detector::KMeans.decide(features).unwrap_or_default()
}

/// Numbers of wrong bits, and of panels with a wrong bit.
fn errors(read: &[PanelFrame], truth: &[PanelFrame]) -> (u64, u64) {
    assert_eq!(read.len(), truth.len());
    let wrong = read.iter().zip(truth).map(|(read, truth)| u64::from(read.distance(*truth)));
    wrong.fold((0, 0), |(bits, panels), wrong| (bits + wrong, panels + u64::from(wrong > 0)))
}

fn counted(evaluation: &serde_json::Value) -> (u64, u64) {
    let count = |key: &str| evaluation[key].as_u64().expect("a count");
    (count("bit_errors"), count("panel_errors"))
}

#[test]
fn kmeans_reads_the_written_frames_with_exactly_the_errors_of_evaluate() {
    let place = folder("frames-npy");
    let out = place.join("set");
    let output = run(&format!("frames {HARD} --count {FRAMES} --features --json --out"), &[name(&out)]);
    says(&output, 0, &[]);
    let evaluated = json(&run(&format!("evaluate {HARD} --frames {FRAMES} --json"), &[]));
    let (shape, images) = read_npy(&out, "frames.npy", "|u1");
    let [n, height, width] = shape[..] else { panic!("{shape:?}") };
    assert_eq!(n, FRAMES);
    let (shape, truth) = read_npy(&out, "truth.npy", "|b1");
    assert_eq!(shape, [FRAMES, LEDS]);
    let truth = panels(&truth);
    let (shape, corners) = read_npy(&out, "corners.npy", "<f4");
    assert_eq!(shape, [FRAMES, 4, 2]);
    let pictures = images.chunks_exact(height * width);
    let corners = floats(&corners);
    let measured: Vec<Features> = pictures
        .zip(corners.chunks_exact(8))
        .map(|(grey, corners)| measured(grey, [height, width], corners))
        .collect();
    let read: Vec<PanelFrame> = measured.iter().map(read_by_kmeans).collect();
    let (bits, wrong_panels) = errors(&read, &truth);
    assert!(
        bits > 100 && wrong_panels < FRAMES as u64,
        "{bits} wrong bits in {wrong_panels} panels"
    );
    assert_eq!((bits, wrong_panels), counted(&evaluated));
    let (shape, features) = read_npy(&out, "features.npy", "<f4");
    assert_eq!(shape, [FRAMES, LEDS, 3]);
    for (written, own) in floats(&features).chunks_exact(3 * LEDS).zip(&measured) {
        let ngr = own.ngr();
        let triples = (0..LEDS).flat_map(|led| [own.agr[led], own.gri[led], ngr[led]]);
        assert_eq!(written, triples.collect::<Vec<_>>());
    }
    let (shape, across) = read_npy(&out, "across.npy", "|b1");
    assert_eq!(shape, [FRAMES]);
    let across_count = across.iter().map(|&across| u64::from(across)).sum::<u64>();
    assert!(across_count > 0 && Some(across_count) == evaluated["frames_across"].as_u64());
    // The description of the frames.
    let about: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("frames.json")).expect("there")).expect("JSON");
    let printed = json(&output);
    for key in ["frames", "seed", "first_frame", "size_px", "origin_px", "level"] {
        assert_eq!(about[key], printed[key], "{key}");
    }
    assert_eq!(about["size_px"], serde_json::json!([width, height]));
    assert_eq!(about["scene"]["pose"]["distance_m"], 65.0);
}

#[test]
fn what_a_detector_reads_is_what_evaluate_counts() {
    let place = folder("frames-read");
    for (detector, frames) in [("kmeans", FRAMES), ("ml", 40), ("fisher", 100)] {
        let out = place.join(detector);
        let output = run(
            &format!("frames {HARD} --count {frames} --detector {detector} --json --out"),
            &[name(&out)],
        );
        says(&output, 0, &[]);
        let [read, truth] = ["read.npy", "truth.npy"].map(|file| panels(&read_npy(&out, file, "|b1").1));
        let evaluated = json(&run(
            &format!("evaluate {HARD} --frames {frames} --detector {detector} --json"),
            &[],
        ));
        assert_eq!(errors(&read, &truth), counted(&evaluated), "{detector}");
        assert_eq!(json(&output)["bit_errors"], evaluated["bit_errors"]);
    }
}

#[test]
fn frames_are_the_same_in_an_archive_from_any_number_on_and_by_any_threads() {
    let place = folder("frames-same");
    let [whole, part, archive] = ["whole", "part", "all.npz"].map(|file| place.join(file));
    let begun = format!("frames {HARD} --features --detector kmeans --out");
    says(&run(&begun, &[name(&whole), "--count", "300", "--threads", "1"]), 0, &[]);
    says(&run(&begun, &[name(&archive), "--count", "300", "--threads", "2"]), 0, &[]);
    says(&run(&begun, &[name(&part), "--count", "20", "--first", "270"]), 0, &[]);
    let bytes = std::fs::read(&archive).expect("an archive");
    for file in ["frames", "truth", "corners", "across", "features", "read"] {
        let all = std::fs::read(whole.join(format!("{file}.npy"))).expect("a file");
        assert_eq!(bytes.windows(all.len()).filter(|window| *window == all).count(), 1, "{file}");
        let some = std::fs::read(part.join(format!("{file}.npy"))).expect("a file");
        let each = (all.len() - 128) / 300;
        assert_eq!(some[128..], all[128 + 270 * each..][..20 * each], "{file}");
    }
    // Written again, the file is identical; existing files stay.
    let again = place.join("again.npz");
    says(&run(&begun, &[name(&again), "--count", "300"]), 0, &[]);
    assert!(std::fs::read(&again).expect("an archive") == bytes);
    says(&run(&begun, &[name(&again), "--count", "1"]), 2, &["again.npz exists"]);
    assert!(std::fs::read(&again).expect("an archive") == bytes);
    #[cfg(unix)]
    {
        let link = place.join("null.npz");
        std::os::unix::fs::symlink("/dev/null", &link).expect("a link");
        says(
            &run(&begun, &[name(&link)]),
            2,
            &["cannot write", "a device or a pipe", "give a file"],
        );
    }
}

#[test]
fn pictures_and_a_table_say_the_same() {
    let place = folder("frames-png");
    let out = place.join("set");
    let output = run(
        &format!("frames {HARD} --count 40 --first 7 --format png --detector kmeans --json --out"),
        &[name(&out)],
    );
    says(&output, 0, &[]);
    let table = std::fs::read_to_string(out.join("truth.csv")).expect("a table");
    let mut lines = table.lines();
    let head = lines.next().expect("a head");
    assert_eq!(
        head,
        "frame,file,bits,across,top_left_x_px,top_left_y_px,top_right_x_px,top_right_y_px,bottom_right_x_px,bottom_right_y_px,\
         bottom_left_x_px,bottom_left_y_px,read"
    );
    let panel = |bits: &str| PanelFrame::from_bits(u64::from_str_radix(bits, 16).expect("a word"));
    let (mut truth, mut told, mut read) = (Vec::new(), Vec::new(), Vec::new());
    for (number, line) in (7..).zip(lines) {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields[..2], [number.to_string(), format!("frame-{number:06}.png")]);
        let picture = image::open(out.join(fields[1])).expect("a picture").into_luma8();
        let size = [picture.height() as usize, picture.width() as usize];
        let corners: Vec<f32> = fields[4..12].iter().map(|field| field.parse().expect("a number")).collect();
        read.push(read_by_kmeans(&measured(&picture, size, &corners)));
        truth.push(panel(fields[2]));
        told.push(panel(fields[12]));
    }
    assert_eq!(told, read);
    assert_eq!(truth.len(), 40);
    assert_eq!(json(&output)["bit_errors"], errors(&read, &truth).0);
    assert!(out.join("frames.json").exists());
}

#[test]
fn what_cannot_be_written_is_refused() {
    let place = folder("frames-refused");
    let there = place.join("there");
    says(&run("frames --count 2 --out", &[name(&there)]), 0, &[]);
    let files = || std::fs::read_dir(&there).expect("a folder").count();
    let before = files();
    let file = place.join("file");
    std::fs::write(&file, "mine").expect("room");
    // Bits that a detector has read in an earlier run.
    let stale = place.join("stale");
    std::fs::create_dir(&stale).expect("room");
    std::fs::write(stale.join("read.npy"), "old").expect("room");
    let new = name(&place.join("new")).to_owned();
    let archive = name(&place.join("new.npz")).to_owned();
    let cases: [(&[&str], &[&str]); 13] = [
        (
            &["--out", name(&there)],
            &["already holds frames, such as frames.npy", "give a new folder"],
        ),
        (
            &["--out", name(&there), "--format", "png"],
            &["already holds frames, such as frames.npy"],
        ),
        (&["--out", name(&stale)], &["already holds frames, such as read.npy"]),
        (&["--out", name(&file)], &["is not a folder: give a folder, or FILE.npz"]),
        (&["--out", "frames.npy"], &["give a folder for several files, or FILE.npz for one"]),
        (&["--out", &archive, "--format", "png"], &["--format png needs a folder"]),
        (&["--out", &new, "--format", "png", "--features"], &["omit one of the two"]),
        (&["--out", &new, "--count", "0"], &["give a whole number from 1 to 10000000"]),
        (&["--out", &new, "--count", "10000001"], &["give a whole number from 1 to 10000000"]),
        (
            &["--out", &new, "--first", "18446744073709551615"],
            &["give a whole number from 0 to 9007199254740992"],
        ),
        (
            &["--out", &archive, "--count", "10000000"],
            &["more than 4294967295: give at most", "or a folder"],
        ),
        (&["--out", &new, "--detector", "guess"], &["no detector \"guess\""]),
        (&["--out", &new, "--level", "reference"], &["choose fine or fast"]),
    ];
    for (arguments, said) in cases {
        refused(&[&["frames"], arguments].concat(), said);
    }
    assert_eq!(files(), before);
    assert!(!place.join("new.npz").exists() && !Path::new("frames.npy").exists());
    // The last numbers.
    let last = place.join("last");
    says(&run("frames --count 200 --first 9007199254740992 --out", &[name(&last)]), 0, &[]);
    assert!(last.join("frames.json").exists());
    // The stated maximum for an archive is accepted: the remaining error is that of the scene.
    let told = text(&run("frames --count 10000000 --out", &[&archive]).stderr);
    let (_, most) = told.split_once("give at most ").expect("a number");
    let (most, _) = most.split_once(',').expect("its end");
    let most: u64 = most.parse().expect("a number");
    assert!((1_000_000..10_000_000).contains(&most), "{most}");
}
