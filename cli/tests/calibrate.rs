//! Errors of `vocc device calibrate`. A simulated transmitter and `studies::photometry` test its results.

mod common;

use std::path::{Path, PathBuf};

use common::grey_card::{PLACES, SCENE};
use common::{folder, json, name, refused, says, text, vocc};

const GAMMA: [&str; 2] = ["--encoding", "2.2"];

/// A picture of a panel at 5 m with this L2A.
fn picture(path: &Path, l2a: &str, more: &[&str]) {
    let light = ["panel.pwm_hz=0", l2a];
    let sets = SCENE.iter().chain(&light).chain(more);
    let sets = sets.flat_map(|&set| ["--set", set]);
    let render = ["render", "day", "--bits", "0123456789abcdef", "--out", name(path)];
    let made = vocc(&render.into_iter().chain(sets).collect::<Vec<_>>());
    says(&made, 0, &[]);
}

/// A folder with identical pictures of these names.
fn pictures(of: &str, names: &[&str]) -> PathBuf {
    let place = folder(of);
    let one = place.join("one.png");
    picture(&one, "link.l2a=8", &[]);
    let pictures = place.join("pictures");
    std::fs::create_dir_all(&pictures).expect("a folder");
    for name in names {
        std::fs::copy(&one, pictures.join(name)).expect("a picture");
    }
    pictures
}

fn calibrate<'a>(frames: &'a Path, options: &[&'a [&'a str]]) -> Vec<&'a str> {
    [&["device", "calibrate", "--frames", name(frames)], &options.concat()[..]].concat()
}

#[test]
fn what_was_not_told_is_asked_for() {
    let frames = pictures("calibrate-untold", &["duty-1.png"]);
    refused(&calibrate(&frames, &[&PLACES]), &["--encoding", "linear"]);
    refused(&calibrate(&frames, &[&PLACES[..2], &GAMMA]), &["--card"]);
    refused(&calibrate(&frames, &[&PLACES[2..], &GAMMA]), &["--corners"]);
    let out = frames.join("panel.toml");
    let into = ["--out", name(&out)];
    refused(&calibrate(&frames, &[&PLACES, &GAMMA, &into]), &["--illuminance-lx"]);
    assert!(!out.exists());
}

#[test]
fn numbers_out_of_range_are_refused_with_the_range() {
    let frames = pictures("calibrate-ranges", &["duty-1.png"]);
    for (option, value, range) in [
        ("--card-reflectance", "0", "0.02 to 1"),
        ("--card-reflectance", "nan", "0.02 to 1"),
        ("--interval", "9", "0.5 to 3"),
        ("--period-ns", "1", "100 to 10000000"),
        ("--illuminance-lx", "0", "0.1 to 200000"),
        ("--card", "1,2,3", "left,top,width,height"),
        ("--card", "0,0,0,5", "left,top,width,height"),
        ("--corners", "1,2", "corner"),
    ] {
        let places: &[&str] = match option {
            "--card" => &PLACES[..2],
            "--corners" => &PLACES[2..],
            _ => &PLACES,
        };
        let given = [option, value];
        refused(&calibrate(&frames, &[places, &GAMMA, &given]), &[range]);
    }
}

#[test]
fn pictures_that_cannot_be_are_refused_by_name() {
    for (index, (file, wanted)) in [
        ("IMG_1.png", "duty-0.05.png"),
        ("duty-0.png", "above 0, at most 1"),
        ("duty-5.png", "above 0, at most 1"),
        ("duty-1e-3.png", "above 0, at most 1"),
        ("duty-5%.png", "above 0, at most 1"),
    ]
    .into_iter()
    .enumerate()
    {
        let frames = pictures(&format!("calibrate-names-{index}"), &[file]);
        refused(&calibrate(&frames, &[&PLACES, &GAMMA]), &[file, wanted]);
    }
    let frames = pictures("calibrate-sizes", &["duty-0.5.png"]);
    picture(
        &frames.join("duty-1.png"),
        "link.l2a=8",
        &["camera.width_px=320", "camera.height_px=240", "pose.distance_m=10"],
    );
    refused(&calibrate(&frames, &[&PLACES, &GAMMA]), &["duty-1.png", "320 × 240"]);
    refused(&calibrate(&frames.join("none"), &[&PLACES, &GAMMA]), &["does not exist", "none"]);
}

#[test]
fn pictures_that_tell_nothing_are_left_out_by_name_and_too_few_are_refused() {
    let frames = pictures("calibrate-few", &["duty-1.png", "duty-1-again.png"]);
    picture(&frames.join("duty-0.5.png"), "link.l2a=10", &["camera.exposure_bias_ev=-2"]);
    picture(&frames.join("duty-0.1.png"), "link.l2a=0.01", &[]);
    refused(
        &calibrate(&frames, &[&PLACES, &GAMMA]),
        &["duty-0.5.png", "clipped at white", "duty-0.1.png", "on: 2", "among them: 1"],
    );
}

#[test]
fn what_is_there_stays() {
    let frames = pictures("calibrate-stays", &["duty-1.png"]);
    let out = frames.join("panel.toml");
    std::fs::write(&out, "mine").expect("written");
    let into = ["--illuminance-lx", "10000", "--out", name(&out)];
    refused(&calibrate(&frames, &[&PLACES, &GAMMA, &into]), &["exists"]);
    assert_eq!(std::fs::read_to_string(&out).expect("there"), "mine");
}

#[test]
fn a_panel_is_found_by_its_pictures() {
    let frames = folder("calibrate-found");
    // The light is proportional to the duty, on LEDs with a reflectance of 0.4.
    for (duty, l2a) in [("1", 8.0), ("0.5", 4.0), ("0.25", 2.0), ("0.125", 1.0)] {
        for again in ["", "-again"] {
            let path = frames.join(format!("duty-{duty}{again}.png"));
            let l2a = format!("link.l2a={l2a}");
            picture(&path, &l2a, &["panel.reflectance=0.4"]);
        }
    }
    let found = vocc(&calibrate(&frames, &[&PLACES, &GAMMA, &["--json"]]));
    says(&found, 0, &[]);
    let found = json(&found);
    assert_eq!(found["left_out"].as_array().map(Vec::len), Some(0), "{found}");
    let ends = [0, 1].map(|end| found["reflectance_95"][end].as_f64().expect("a number"));
    assert!((ends[0]..=ends[1]).contains(&0.4), "{found}");
    let told = vocc(&calibrate(&frames, &[&PLACES, &GAMMA]));
    says(&told, 0, &[]);
    assert!(text(&told.stdout).contains("shortest clean pulse 972 ns"));
}
