//! `vocc decode` on pictures of soft lenses, where LEDs run into each other.

mod common;

use common::{folder, json, vocc};
use serde_json::Value;

/// The bits that are wrong of each panel that is read, of 20.
fn wrong_through(blur_px: f64) -> Vec<u32> {
    let place = folder(&format!("soft-{blur_px}"));
    let blur = format!("camera.blur_sigma_px={blur_px}");
    let size = ["camera.width_px=640", "camera.height_px=480"];
    let read = (0..20).filter_map(|seed| {
        let picture = place.join(format!("{seed}.png"));
        let (seed, path) = (seed.to_string(), common::name(&picture));
        let render = ["render", "day", "--seed", &seed, "--out", path, "--json"];
        let settings = ["--set", &blur, "--set", size[0], "--set", size[1]];
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
    // The light of an LED spreads over its neighbours there, and single bits are lost: a complement is 64 wrong ones.
    assert!(wrong.iter().all(|&bits| bits <= 8), "{wrong:?}");
}
