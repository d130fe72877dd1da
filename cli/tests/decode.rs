//! `vocc decode` on pictures of soft lenses, where LEDs run into each other.

mod common;

use common::{folder, json, vocc};

/// How many of 20 panels are read; all that are have to be right.
fn read_through(blur_px: f64) -> usize {
    let place = folder(&format!("soft-{blur_px}"));
    let blur = format!("camera.blur_sigma_px={blur_px}");
    let size = ["camera.width_px=640", "camera.height_px=480"];
    let read = (0..20).filter(|seed| {
        let picture = place.join(format!("{seed}.png"));
        let (seed, path) = (seed.to_string(), picture.to_str().expect("a plain name"));
        let render = ["render", "day", "--seed", &seed, "--out", path, "--json"];
        let settings = ["--set", &blur, "--set", size[0], "--set", size[1]];
        let shown = json(&vocc(&[&render[..], &settings[..]].concat()));
        let seen = json(&vocc(&["decode", "--json", path]));
        let is_found = seen["found"].as_bool().expect("an answer");
        if is_found {
            assert_eq!(seen["bits"], shown["bits"], "seed {seed}: {seen}");
        }
        is_found
    });
    read.count()
}

#[test]
fn a_soft_lens_makes_no_panel_its_complement() {
    assert_eq!(read_through(2.5), 20);
    assert!(read_through(3.0) >= 5, "too few are read to show anything");
}
