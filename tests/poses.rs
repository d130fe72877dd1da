//! Poses measured in rendered frames, held to their own covariance and to the Cramér–Rao bound, as estimators are tested (Bar-Shalom, Li &
//! Kirubarajan 2001, section 5.4). `cargo run --release -p vocc-tests --example poses -- 10000 30 70` does the same at length.

use vocc_tests::poses::{Range, Trial, Trials};

/// Panels up to 30° aside by day, all of which have a pose.
fn trials(count: u64, distance_m: [f64; 2]) -> Vec<Trial> {
    let mut trials = Trials::new(Range {
        preset: "day",
        distance_m,
        turned_deg: 30.0,
        is_followed: false,
    });
    (0..count)
        .map(|seed| {
            trials
                .draw(seed)
                .unwrap_or_else(|why| panic!("pose {seed} is unknown: {why}"))
        })
        .collect()
}

fn mean(trials: &[Trial], of: impl Fn(&Trial) -> f64) -> f64 {
    trials.iter().map(of).sum::<f64>() / trials.len() as f64
}

/// Within the band that holds the mean of so many NEES of six numbers in 999 of 1000 tests.
fn assert_honest(trials: &[Trial]) {
    let nees = mean(trials, Trial::nees);
    let band = 3.29 * (12.0 / trials.len() as f64).sqrt();
    assert!((nees - 6.0).abs() < band, "NEES {nees}, not 6 ± {band}");
}

#[test]
fn errors_are_what_the_covariance_says_and_near_the_bound() {
    let trials = trials(200, [30.0, 70.0]);
    assert_honest(&trials);
    let in_bounds = mean(&trials, |trial| {
        (trial.range_error_m() / trial.range_bound_m).powi(2)
    });
    assert!(in_bounds.sqrt() < 1.3, "{}", in_bounds.sqrt());
}

#[test]
fn a_panel_is_ranged_to_a_decimetre_at_50_m_by_day() {
    let trials = trials(60, [50.0, 50.0]);
    let squared = mean(&trials, |trial| trial.range_error_m().powi(2));
    assert!(squared.sqrt() < 0.1, "{} m", squared.sqrt());
}

/// Where a panel and its mirror image look nearly alike, and the LEDs run into each other.
#[test]
fn a_panel_is_ranged_to_three_quarters_of_a_metre_at_100_m_by_day() {
    let trials = trials(60, [100.0, 100.0]);
    assert_honest(&trials);
    let squared = mean(&trials, |trial| trial.range_error_m().powi(2));
    assert!(squared.sqrt() < 0.75, "{} m", squared.sqrt());
}
