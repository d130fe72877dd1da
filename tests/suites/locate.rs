//! The locator over its whole range, with and without photographs, and without panels. The example `range` runs the same test at a thousand
//! times the size.

use std::path::Path;

use vocc_tests::sightings::{photographs, search_empty, search_scenes};
use vocc_tests::{all_cases, cases};

const SIZE: [usize; 2] = [480, 360];

fn clutter() -> Vec<image::GrayImage> {
    photographs(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../studies/photographs"))).expect("readable photographs")
}

#[test]
fn panels_are_found_within_three_frames() {
    let mut failures = Vec::new();
    // If one in a hundred may be lost, this limit is exceeded in about 2 % of runs.
    let (count, lost) = if all_cases() { (60, 2) } else { (20, 1) };
    let tally = search_scenes(0..count, 0.0, SIZE, &clutter(), |line| failures.push(line.to_owned()));
    assert_eq!(tally.wrong, 0, "{failures:#?}");
    assert!(tally.lost <= lost, "{} of {count}: {failures:#?}", tally.lost);
    let mut errors = tally.errors_px;
    errors.sort_by(f64::total_cmp);
    assert!(errors[errors.len() / 2] < 0.15, "{errors:?}");
}

#[test]
fn photographs_without_a_panel_show_none() {
    let mut failures = Vec::new();
    let seen = search_empty(0..cases(10, 40).into(), SIZE, &clutter(), |line| failures.push(line.to_owned()));
    assert_eq!(seen, 0, "{failures:#?}");
}
