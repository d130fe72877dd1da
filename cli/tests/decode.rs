//! `vocc decode`: pictures of soft lenses, where LEDs run into each other, and corners that are not the panel's.

mod common;

use common::{folder, json, refused, says, vocc};
use serde_json::Value;

/// Not the table's, so that the pictures stay the same whatever the table has.
const L2A: &str = "link.l2a=1.115";

/// The number of wrong bits of each panel that is read, out of 20.
fn wrong_through(blur_px: f64) -> Vec<u32> {
    let place = folder(&format!("soft-{blur_px}"));
    let blur = format!("camera.blur_sigma_px={blur_px}");
    let size = ["camera.width_px=640", "camera.height_px=480"];
    let read = (0..20).filter_map(|seed| {
        let picture = place.join(format!("{seed}.png"));
        let (seed, path) = (seed.to_string(), common::name(&picture));
        let render = ["render", "day", "--seed", &seed, "--out", path, "--json"];
        let settings = ["--set", &blur, "--set", size[0], "--set", size[1], "--set", L2A];
        let shown = json(&vocc(&[&render[..], &settings[..]].concat()));
        let seen = json(&vocc(&["decode", "--json", path]));
        let bits = |said: &Value| u64::from_str_radix(said["bits"].as_str().expect("bits"), 16);
        let is_found = seen["found"].as_bool().expect("an answer");
        is_found.then(|| (bits(&seen).expect("64 bits") ^ bits(&shown).expect("64 bits")).count_ones())
    });
    read.collect()
}

#[test]
fn a_soft_lens_makes_no_panel_its_complement() {
    assert_eq!(wrong_through(2.5), [0; 20]);
    let wrong = wrong_through(3.0);
    assert!(wrong.len() >= 5, "too few are read to show anything");
    // The light of an LED spreads over its neighbours, and single bits are lost; a complement has 64 wrong bits.
    assert!(wrong.iter().all(|&bits| bits <= 8), "{wrong:?}");
}

#[test]
fn a_search_that_leaves_places_out_names_the_option() {
    let path = folder("places").join("grey.pgm");
    let mut picture = b"P5 64 64 255\n".to_vec();
    picture.extend([99; 64 * 64]);
    std::fs::write(&path, picture).expect("a picture");
    let path = common::name(&path);
    says(&vocc(&["decode", path]), 1, &["--places 96"]);
    let all = vocc(&["decode", path, "--places", "96"]);
    assert_eq!((all.status.code(), all.stderr), (Some(1), Vec::new()));
    for places in ["0", "97", "2.5", "few"] {
        refused(&["decode", path, "--places", places], &[places]);
    }
}

type Points = [[f64; 2]; 4];

/// A picture of `day`, the corners of its panel and its bits.
fn picture(name: &str, settings: &[&str]) -> (std::path::PathBuf, Points, String) {
    let path = folder(name).join("day.png");
    let render = ["render", "day", "--seed", "7", "--out", common::name(&path), "--json"];
    let shown = json(&vocc(&[&render[..], settings].concat()));
    let corner = |i: usize| [0, 1].map(|axis| shown["corners_px"][i][axis].as_f64().expect("corners"));
    let bits = shown["bits"].as_str().expect("bits").to_owned();
    (path, [0, 1, 2, 3].map(corner), bits)
}

fn decoded_at(path: &std::path::Path, corners: Points) -> (Value, String) {
    let numbers: Vec<String> = corners.iter().flatten().map(f64::to_string).collect();
    let corners = format!("--corners={}", numbers.join(","));
    let ended = vocc(&["decode", "--json", common::name(path), &corners]);
    (json(&ended), String::from_utf8_lossy(&ended.stderr).into_owned())
}

#[test]
fn confidence_includes_whether_the_panel_is_at_the_corners() {
    let (path, corners, bits) = picture("corners", &[]);
    let (seen, said) = decoded_at(&path, corners);
    let confidence = |seen: &Value| seen["confidence"].as_f64().expect("a confidence");
    assert_eq!((&seen["place"], &seen["bits"]), (&"confirmed".into(), &bits.into()));
    assert!(confidence(&seen) > 0.99 && said.is_empty(), "{seen} {said}");

    // An LED to the right; and one corner an LED off.
    let pitch = (corners[1][0] - corners[0][0]) / 7.0;
    let beside = corners.map(|[x, y]| [x + pitch, y]);
    let mut bent = corners;
    bent[0][0] += pitch;
    for (wrong, most) in [(beside, 0.51), (bent, 0.95)] {
        let (seen, said) = decoded_at(&path, wrong);
        assert_eq!(seen["place"], "elsewhere", "{seen}");
        assert!(
            confidence(&seen) < most && said.contains("shows a panel with --corners="),
            "{seen} {said}"
        );
        for (shown, true_corner) in seen["elsewhere_px"].as_array().expect("corners").iter().zip(corners) {
            let off = [0, 1].map(|axis| shown[axis].as_f64().expect("pixels") - true_corner[axis]);
            assert!(off[0].hypot(off[1]) < 0.2 * pitch, "{seen}");
        }
    }

    // Nothing is there.
    let (seen, said) = decoded_at(&path, corners.map(|[x, y]| [x + 300.0, y]));
    assert!(
        seen["found"] == false || seen["place"] == "unconfirmed" && said.contains("does not confirm"),
        "{seen} {said}"
    );
}

#[test]
fn a_drawing_marks_the_leds_that_are_on() {
    let (path, _, bits) = picture("drawing", &[]);
    let seen = path.with_file_name("seen");
    let answer = vocc(&["decode", common::name(&path), "--show", common::name(&seen)]);
    says(&answer, 0, &[]);
    let drawing = image::open(seen.join("day-panel.png")).expect("a drawing").into_rgb8();
    let count = |channel: usize, other: usize| {
        let is_marked = |pixel: &&image::Rgb<u8>| u16::from(pixel[channel]) > 2 * u16::from(pixel[other]);
        drawing.pixels().filter(is_marked).count() as f64
    };
    let (on, off) = (count(1, 0), count(0, 1));
    let share = f64::from(u64::from_str_radix(&bits, 16).expect("64 bits").count_ones()) / 64.0;
    assert!(on + off > 1000.0, "{on} {off}");
    assert!((on / (on + off) - share).abs() < 0.01, "{on} {off} {share}");
}

#[test]
fn corners_that_turn_the_panel_are_named() {
    let (path, [a, b, c, d], _) = picture("turned", &[]);
    let (seen, said) = decoded_at(&path, [b, c, d, a]);
    assert_eq!((&seen["place"], &seen["turned_deg"]), (&"confirmed".into(), &90.into()), "{seen}");
    assert!(said.contains("turn the panel by 90° clockwise"), "{said}");
}

#[test]
fn near_panels_are_read_at_given_corners() {
    // LEDs 109 px apart.
    let (path, corners, bits) = picture("near", &["--set", "pose.distance_m=2"]);
    let (seen, _) = decoded_at(&path, corners);
    assert_eq!((&seen["bits"], &seen["place"]), (&bits.into(), &"confirmed".into()), "{seen}");
}
