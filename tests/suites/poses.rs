//! Poses measured in rendered frames, compared with their covariance and with the Cramér–Rao bound, as in Bar-Shalom, Li & Kirubarajan
//! 2001, section 5.4. `cargo run --release -p vocc-tests --example poses -- 10000 30 70` runs more trials.

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rx_pipeline::pose::Closing;
use vocc_tests::poses::{Range, Trial, Trials};

/// By day, yaw up to 30°.
const fn aside(distance_m: [f64; 2]) -> Range {
    Range {
        preset: "day",
        // Not the table's, so that the panels stay the same whatever the table has.
        l2a: Some(1.115),
        distance_m,
        yaw_deg: [0.0, 30.0],
        pitch_deg: 30.0,
    }
}

/// Panels with a yaw up to 30°, all with a measured pose.
fn trials(count: u64, distance_m: [f64; 2]) -> Vec<Trial> {
    all_of(count, Trials::new(aside(distance_m)))
}

fn all_of(count: u64, mut trials: Trials) -> Vec<Trial> {
    (0..count)
        .map(|seed| trials.draw(seed).unwrap_or_else(|why| panic!("pose {seed} is unknown: {why}")))
        .collect()
}

fn mean(trials: &[Trial], of: impl Fn(&Trial) -> f64) -> f64 {
    trials.iter().map(of).sum::<f64>() / trials.len() as f64
}

/// Asserts that the mean NEES of six parameters is within the band of 999 of 1000 tests.
fn assert_honest(trials: &[Trial]) {
    let nees = mean(trials, Trial::nees);
    let band = 3.29 * (12.0 / trials.len() as f64).sqrt();
    assert!((nees - 6.0).abs() < band, "NEES {nees}, not 6 ± {band}");
}

#[test]
fn errors_are_what_the_covariance_says_and_near_the_bound() {
    let trials = trials(200, [30.0, 70.0]);
    assert_honest(&trials);
    let in_bounds = mean(&trials, |trial| (trial.range_error_m() / trial.range_bound_m).powi(2));
    assert!(in_bounds.sqrt() < 1.3, "{}", in_bounds.sqrt());
}

#[test]
fn a_panel_is_ranged_to_a_decimetre_at_50_m_by_day() {
    let trials = trials(60, [50.0, 50.0]);
    let squared = mean(&trials, |trial| trial.range_error_m().powi(2));
    assert!(squared.sqrt() < 0.1, "{} m", squared.sqrt());
}

/// Here a panel and its mirror image look nearly alike, and the LEDs merge.
#[test]
fn a_panel_is_ranged_to_three_quarters_of_a_metre_at_100_m_by_day() {
    let trials = trials(60, [100.0, 100.0]);
    assert_honest(&trials);
    let squared = mean(&trials, |trial| trial.range_error_m().powi(2));
    assert!(squared.sqrt() < 0.75, "{} m", squared.sqrt());
}

#[test]
fn a_usual_fit_is_as_good_as_one_that_is_settled_to_the_last() {
    let range = aside([30.0, 100.0]);
    let usual = all_of(40, Trials::new(range));
    for (usual, settled) in usual.iter().zip(all_of(40, Trials::settling_to(range, 1e-3))) {
        for i in 0..6 {
            let sigma = settled.pose.covariance[i][i].sqrt();
            let off = (usual.error()[i] - settled.error()[i]).abs();
            assert!(off < 0.1 * sigma, "{i}: {off}, σ {sigma}");
            let told = usual.pose.covariance[i][i].sqrt();
            assert!((told / sigma - 1.0).abs() < 0.05, "{i}: σ {told}, not {sigma}");
        }
    }
}

#[test]
fn a_panel_nearly_edge_on_is_told_honestly_or_not_at_all() {
    let edge_on = |distance_m: f64, yaw_deg: [f64; 2]| Range {
        yaw_deg,
        ..aside([distance_m; 2])
    };
    assert_honest(&all_of(60, Trials::new(edge_on(20.0, [60.0, 80.0]))));
    let mut far = Trials::new(edge_on(50.0, [60.0, 80.0]));
    let far: Vec<_> = (0..60).map(|seed| far.draw(seed)).collect();
    let told: Vec<Trial> = far.into_iter().flatten().collect();
    assert!((10..60).contains(&told.len()), "{}", told.len());
    assert_honest(&told);
}

#[test]
fn a_panel_of_a_pixel_a_pitch_has_no_pose() {
    let why = Trials::new(aside([200.0; 2])).draw(0).err();
    let why = why.expect("too small").to_string();
    assert!(why.contains("at least 1.5 px"), "{why}");
}

#[test]
fn a_panel_that_comes_at_40_m_s_is_told_to() {
    let (count, mut squares) = (20, 0.0);
    for seed in 0..count {
        let mut trials = Trials::new(aside([30.0, 70.0]));
        let approach = trials.approach(seed, 40.0, 60.0, 30).expect("poses");
        let mut closing = Closing::new();
        for (time_s, trial) in &approach {
            closing.take(*time_s, &trial.pose);
        }
        let speed = closing.speed_m_s().expect("known");
        assert!(speed.sigma < 1.0, "{speed:?}");
        squares += ((speed.value - 40.0) / speed.sigma).powi(2) / count as f64;
        let time = closing.time_to_collision_s().expect("it comes");
        let (.., last) = approach.last().expect("frames");
        let truth = last.truth.0.length() / 40.0;
        assert!((time.value - truth).abs() < 5.0 * time.sigma, "{time:?}, {truth}");
    }
    // Limit of the mean of 20 squared normal numbers in 999 of 1000 tests; a constant speed varies less than the model assumes.
    assert!(squares < 2.27, "{squares}");
}

/// Three minutes of frames with the noise of a pose at 50 m.
#[test]
fn a_panel_that_stands_still_for_minutes_is_told_to() {
    let seen = &trials(1, [50.0; 2])[0].pose;
    let covariance = Matrix3::from_fn(|i, j| seen.covariance[i][j]);
    let root = covariance.cholesky().expect("a covariance").l();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut closing, mut squares, mut count) = (Closing::new(), 0.0, 0);
    for frame in 0..3 * 60 * 60 {
        let noise = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
        let mut pose = *seen;
        let place = Vector3::from(pose.translation_m) + root * noise;
        pose.translation_m = place.into();
        closing.take(f64::from(frame) / 60.0, &pose);
        // One second apart, when earlier frames have no influence.
        if frame % 60 == 59 {
            let speed = closing.speed_m_s().expect("known");
            assert!(speed.value.is_finite() && (1e-3..1.0).contains(&speed.sigma), "{speed:?}");
            (squares, count) = (squares + (speed.value / speed.sigma).powi(2), count + 1);
        }
    }
    // A constant speed varies less than the model assumes, but the filter is not overconfident.
    let square = squares / f64::from(count);
    assert!((0.1..1.4).contains(&square), "{square}");
}
