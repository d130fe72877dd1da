//! Poses of panels: `vocc decode` and `vocc receive` with a camera's geometry.

mod common;

use common::{folder, json, name, refused, says, text, vocc};
use serde_json::Value;

/// OpenCV's calibration of the scenes' camera, from frames of 640×480.
const OPENCV: &str = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   \
    dt: d\n   data: [ 3636.3636363636365, 0., 319.5, 0., 3636.3636363636365, 239.5, 0., 0., 1. ]\n\
    distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -0.5, 0., 0., 0., 0. ]\n";
const PANEL: [&str; 4] = ["--interval", "1", "--led-diameter", "0.03"];
const SIZE: [&str; 4] = ["--set", "camera.width_px=640", "--set", "camera.height_px=480"];

/// Whether a number of a pose is within four standard deviations of the true one.
fn assert_is(pose: &Value, key: &str, truth: f64) {
    let unit = ["_m_s", "_deg", "_m"].into_iter().find(|unit| key.ends_with(unit)).expect("a unit");
    let stem = key.strip_suffix(unit).expect("a name");
    let sigma = pose[format!("{stem}_sigma{unit}")].as_f64().expect("a deviation");
    let value = pose[key].as_f64().expect("a number");
    assert!((value - truth).abs() < 4.0 * sigma, "{key}: {value} ± {sigma}, not {truth}");
}

#[test]
fn a_panel_is_where_the_scene_has_it_through_a_distorting_lens() {
    let folder = folder("pose-decode");
    let path = |file: &str| name(&folder.join(file)).to_owned();
    let (camera, other, bent) = (path("camera.yaml"), path("other.yaml"), path("bent.yaml"));
    std::fs::write(&camera, OPENCV).unwrap();
    std::fs::write(&other, OPENCV.replace("640", "320")).unwrap();
    std::fs::write(&bent, OPENCV.replace("319.5", ".nan")).unwrap();
    let scene = ["x_m=2.5", "y_m=-1.5", "distance_m=40", "yaw_deg=25", "pitch_deg=-10", "roll_deg=5"].map(|key| format!("pose.{key}"));
    let frame = path("frame.png");
    let mut render = vec!["render", "day", "--out", &frame, "--set", "camera.distortion_k1=-0.5"];
    render.extend(SIZE);
    scene.iter().for_each(|key| render.extend(["--set", key]));
    says(&vocc(&render), 0, &[]);

    let told = [&["decode", &frame, "--camera", &camera][..], &PANEL].concat();
    let pose = json(&vocc(&[&told[..], &["--json"]].concat()))["pose"].clone();
    let range_m = (40f64.powi(2) + 2.5f64.powi(2) + 1.5f64.powi(2)).sqrt();
    assert_is(&pose, "range_m", range_m);
    assert_is(&pose, "azimuth_deg", (2.5f64 / 40.0).atan().to_degrees());
    assert_is(&pose, "elevation_deg", (1.5 / 40f64.hypot(2.5)).atan().to_degrees());
    assert_is(&pose, "roll_deg", 5.0);
    assert_is(&pose, "yaw_deg", 25.0);
    assert_is(&pose, "pitch_deg", -10.0);
    assert!(pose["range_sigma_m"].as_f64().unwrap() < 0.1);
    assert_eq!(pose["covariance"].as_array().unwrap().len(), 6);
    let printed = text(&vocc(&told).stdout);
    assert!(printed.contains(" m away, azimuth 3.5"), "{printed}");

    // Missing input is named.
    let unknown = |arguments: &[&str]| {
        let told = [&["decode", &frame, "--json"][..], arguments].concat();
        let pose = json(&vocc(&told))["pose"].clone();
        assert_eq!(pose["known"], false);
        pose["why"].as_str().unwrap().to_owned()
    };
    assert!(unknown(&PANEL).contains("no focal length: give focal_px in --camera"));
    assert!(unknown(&["--camera", &camera]).contains("no panel size: give the LEDs"));
    let other = [&["--camera", &other][..], &PANEL].concat();
    assert!(unknown(&other).contains("calibrated with frames of 320 × 480"));
    says(&vocc(&["decode", &frame, "--interval=-1"]), 2, &["interval of -1"]);
    says(&vocc(&["decode", &frame, "--led-diameter", "nan"]), 2, &["NaN m is not"]);
    says(&vocc(&["decode", &frame, "--camera", &bent]), 2, &["bent.yaml", "principal point"]);
}

#[test]
fn a_camera_that_cannot_be_is_refused() {
    let folder = folder("pose-refused");
    let matrix = |first: &str| OPENCV.replacen("[ 3636.3636363636365", first, 1);
    for (file, content, wrong) in [
        ("zero.toml", "focal_px = 0\n".to_owned(), "focal length of 0 px"),
        ("nan.toml", "focal_px = nan\n".into(), "focal length of NaN px"),
        ("less.toml", "focal_px = [900, -900]\n".into(), "focal length of -900 px"),
        ("half.toml", "focal_length_mm = 25\n".into(), "focal length is incomplete"),
        (
            "pitch.toml",
            "focal_length_mm = 25\npixel_pitch_um = 0\n".into(),
            "a pixel pitch of 0 µm",
        ),
        (
            "many.toml",
            "focal_px = 900\ndistortion = [0, 0, 0]\n".into(),
            "3 distortion coefficients",
        ),
        (
            "bent.toml",
            "focal_px = 900\ndistortion = [inf]\n".into(),
            "distortion coefficient of inf",
        ),
        ("word.toml", "focal_px = 900\ndistortion = \"none\"\n".into(), "distortion"),
        ("zero.yaml", matrix("[ 0."), "focal length of 0 px"),
        ("short.yaml", OPENCV.replace("0., 0., 1. ]", "0., 1. ]"), "8 numbers instead of 3"),
        ("broken.yaml", matrix("[["), "calibration cannot be read"),
        ("word.yaml", OPENCV.replace("-0.5", "barrel"), "calibration cannot be read"),
        ("other.yaml", "camera: front\nwidth: 640\n".into(), "other.yaml"),
    ] {
        let path = folder.join(file);
        std::fs::write(&path, content).unwrap();
        for command in ["decode", "receive"] {
            refused(&[command, "frame.png", "--camera", name(&path)], &[file, wrong]);
        }
    }
}

#[test]
fn a_panel_that_comes_nearer_says_when_it_is_here() {
    let folder = folder("pose-receive");
    let path = |file: &str| name(&folder.join(file)).to_owned();
    let film = path("film");
    let mut link = vec!["link", "day", "--message", "ice", "--save", &film, "--frames", "60"];
    link.extend(SIZE);
    link.extend([
        "--set",
        "pose.velocity_m_s=[0, 0, -10]",
        "--set",
        "pose.distance_m=30",
        "--seed",
        "1",
    ]);
    vocc(&link);
    std::fs::write(folder.join("camera.toml"), "focal_length_mm = 25\npixel_pitch_um = 6.875\n").unwrap();
    let told = ["receive", &film, "--bits", "--json", "--camera", &path("camera.toml")];
    let output = vocc(&[&told[..], &PANEL].concat());
    let unknown = vocc(&[&["receive", &film, "--bits"][..], &PANEL].concat());
    assert!(text(&unknown.stdout).contains("pose unknown: no focal length: give focal_px"));
    let printed = text(&output.stdout);
    let frames: Vec<Value> = printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let last = frames.iter().rev().find(|line| line["bits"].is_string()).expect("a frame");
    let pose = &last["pose"];
    let range_m = 30.0 - 10.0 * last["frame"].as_f64().unwrap() / 100.0;
    assert_is(pose, "range_m", range_m);
    assert_is(pose, "closing_speed_m_s", 10.0);
    assert!(pose["closing_speed_sigma_m_s"].as_f64().unwrap() < 1.0);
    let time_s = pose["time_to_collision_s"].as_f64().unwrap();
    let sigma_s = pose["time_to_collision_sigma_s"].as_f64().unwrap();
    assert!((time_s - range_m / 10.0).abs() < 4.0 * sigma_s, "{time_s} ± {sigma_s}");
}

#[test]
fn a_panel_that_says_how_large_it_is_need_not_be_told() {
    let folder = folder("pose-said");
    let path = |file: &str| name(&folder.join(file)).to_owned();
    let (film, camera) = (path("film"), path("camera.toml"));
    let mut link = vec!["link", "day", "--message", "ice", "--save", &film];
    // 5 panels of the message, then 3 of the size, at 90 a second.
    link.extend(["--frames", "20", "--set", "link.tells_size=true"]);
    link.extend(SIZE);
    link.extend(["--set", "panel.interval=1.5", "--set", "pose.distance_m=30"]);
    says(&vocc(&link), 0, &[]);
    std::fs::write(&camera, OPENCV.replace("-0.5", "0.")).unwrap();
    let told = ["receive", &film, "--bits", "--json", "--camera", &camera];
    let output = vocc(&told);
    let said = text(&output.stderr);
    assert!(said.contains("LEDs of 0.03 m, at an interval of 1.5"), "{said}");
    let printed = text(&output.stdout);
    let frames: Vec<Value> = printed
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap())
        .filter(|line| line["bits"].is_string())
        .collect();
    let (first, last) = (&frames[0]["pose"], &frames[frames.len() - 1]["pose"]);
    assert_eq!(first["known"], false);
    assert!(first["why"].as_str().unwrap().contains("wait until the panel announces"));
    assert_is(last, "range_m", 30.0);
}

#[test]
fn a_size_that_no_panel_has_is_not_transmitted() {
    let transmit = |diameter: &str, interval: &str| {
        let told = [diameter, interval].map(|told| format!("--{told}"));
        vocc(&["transmit", "--message", "ice", &told[0], &told[1]])
    };
    let (diameter, interval) = ("led-diameter=0.03", "interval=1");
    says(&transmit(diameter, interval), 0, &[]);
    for wrong in ["0", "-1", "NaN", "1.1", "inf"] {
        let told = transmit(&format!("led-diameter={wrong}"), interval);
        says(&told, 2, &["wide", "0.0001 to 1 m", wrong]);
    }
    for wrong in ["-1", "NaN", "16", "inf"] {
        let told = transmit(diameter, &format!("interval={wrong}"));
        says(&told, 2, &["interval", "0 to 16", wrong]);
    }
    refused(&["transmit", "--message", "ice", "--led-diameter=1"], &["--interval"]);
}
