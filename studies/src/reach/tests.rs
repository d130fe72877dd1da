use rand::Rng;
use sim::random::{Purpose, normal, stream, uniform};

use super::crossing::{Crossing, log_odds};
use super::*;
use crate::monte_carlo::Evaluation;
use crate::optimum::Sample;

/// The tolerable share of wrong bits.
const RATE: f64 = 0.08;
/// The ratio of greatest synthetic reach.
const BEST: f64 = 1.7;
/// That reach, m.
const FARTHEST_M: f64 = 90.0;

/// A synthetic reach, m: a parabola of logarithms.
fn reach_m(l2a: f64) -> f64 {
    FARTHEST_M * (-0.1 * (l2a / BEST).ln().powi(2)).exp()
}

fn ratios() -> Vec<f64> {
    (0..=LAST).step_by(2).map(|number| ratio([0.2, 4.0], number)).collect()
}

/// Frames at the two distances about the synthetic reach of each ratio. Each frame is easier or harder to read, the same at all ratios.
fn crossings(seed: u64) -> Vec<Crossing> {
    const BATCHES: usize = 16;
    const FRAMES: usize = 8;
    let mut random = stream(seed, 0, Purpose::Phase);
    let ease: Vec<f64> = (0..BATCHES * FRAMES)
        .map(|_| (0.3 * normal(&mut random)).clamp(-0.9, 0.9))
        .collect();
    let mut at = |l2a: f64, distance_m: f64| {
        let odds = log_odds(RATE) + 10.0 * (reach_m(l2a) / distance_m).ln();
        let batches = ease.chunks(FRAMES).map(|frames| {
            let mut batch = Evaluation::default();
            for ease in frames {
                let wrong = 1.0 / (1.0 + odds.exp());
                // In proportion, so that the mean stays.
                batch.errors.push(misread(wrong * (1.0 - ease), &mut random));
            }
            batch
        });
        Sample::of(l2a, batches.collect())
    };
    let crossing = |l2a: f64| {
        let step = (16.0 * (reach_m(l2a) / 5.0).log2()) as u32;
        let steps = [step, step + 1];
        let [near, far] = steps.map(|step| at(l2a, 5.0 * (f64::from(step) / 16.0).exp2()));
        Crossing {
            l2a,
            steps,
            near,
            far: Some(far),
        }
    };
    ratios().into_iter().map(crossing).collect()
}

fn misread(rate: f64, random: &mut impl Rng) -> u32 {
    (0..64).filter(|_| uniform(random) < rate).count() as u32
}

fn judged(seed: u64, choice: Choice) -> Judgement {
    let crossings = crossings(seed);
    let crossings: Vec<&Crossing> = crossings.iter().collect();
    Curve::of(&crossings, RATE, seed).judged(choice).expect("a curve")
}

#[test]
fn the_intervals_hold_the_truth_in_95_of_100_cases() {
    // 1 % of the reach is lost where 0.1·ln² is 0.01005.
    let least = BEST * (-(0.01005f64 / 0.1).sqrt()).exp();
    let mut held = [0; 3];
    for seed in 0..100 {
        let judged = judged(seed, Choice::LeastLight);
        let cases = [(judged.best_95, BEST), (judged.reach_m_95, FARTHEST_M), (judged.chosen_95, least)];
        for (held, ([low, high], truth)) in held.iter_mut().zip(cases) {
            *held += usize::from(low <= truth && truth <= high);
        }
    }
    // 95 ± 2.2 of 100 cases; frames as uneven as these, and straight lines between ratios, cost one or two more.
    assert!(held.iter().all(|&held| held >= 88), "seeds 0 to 99: {held:?}");
}

#[test]
fn what_is_chosen_loses_no_more_than_it_may() {
    let curve = || Curve::through(ratios().into_iter().map(|l2a| (l2a, reach_m(l2a))));
    let at = |choice| curve().judged(choice).expect("a curve").verdict;
    let best = at(Choice::Best);
    assert!((best.best / BEST - 1.0).abs() < 0.01 && best.chosen == best.best, "{best:?}");
    let least = at(Choice::LeastLight).chosen;
    assert!((reach_m(least) / FARTHEST_M - 0.99).abs() < 0.002 && least < BEST, "{least}");
    // A parabola is symmetric.
    let margin = at(Choice::Margin).chosen;
    assert!((margin / BEST - 1.0).abs() < 0.02, "{margin}");
    assert!(!best.is_flat(), "{best:?}");
}

#[test]
fn a_reach_that_hardly_changes_is_flat_and_takes_the_least_light() {
    let rises = |l2a: f64| 100.0 * (1.0 - 0.05 * (-2.0 * l2a).exp());
    let curve = Curve::through(ratios().into_iter().map(|l2a| (l2a, rises(l2a))));
    let verdict = curve.judged(Choice::LeastLight).expect("a curve").verdict;
    assert!(verdict.is_flat() && verdict.best > 3.0, "{verdict:?}");
    assert!((0.7..0.95).contains(&verdict.chosen), "{verdict:?}");
    assert_eq!(curve.reach_m(0.01), curve.reach_m(0.2), "beyond its ends it is as there");
}

#[test]
fn points_of_any_order_are_a_curve() {
    let points = [(0.5, 40.0), (1.0, 50.0), (2.0, 48.0), (4.0, 30.0)];
    let ascending = Curve::through(points.into_iter());
    let broken = [(f64::NAN, 45.0), (-1.0, 45.0), (3.0, 0.0), (1.0, 20.0), (f64::INFINITY, 45.0)];
    let mixed = Curve::through(points.into_iter().rev().chain(broken));
    assert_eq!(mixed, ascending);
    let judged = ascending.judged(Choice::Margin);
    assert!(judged.is_some() && mixed.judged(Choice::Margin) == judged);
}

/// At the limit of distinguishable LEDs all ratios reach equally far, and a parabola through steep sides rises above them all.
#[test]
fn a_plateau_loses_nothing() {
    let points = [(0.5, 80.0), (1.0, 100.0), (1.5, 100.0), (2.0, 100.0), (4.0, 80.0)];
    let curve = Curve::through(points.into_iter());
    for choice in [Choice::Margin, Choice::LeastLight, Choice::Best] {
        let judged = curve.judged(choice).expect("a verdict");
        let Verdict {
            best,
            chosen,
            loses_nothing: [low, high],
            ..
        } = judged.verdict;
        assert!(low <= 1.0 && high >= 2.0 && low > 0.9 && high < 2.2);
        assert!((0.5..=4.0).contains(&best) && (low..=high).contains(&chosen));
    }
}

fn search() -> ReachSearch {
    ReachSearch {
        frames: 64,
        detector: DetectorChoice::KMeans,
        ..ReachSearch::default()
    }
}

fn night() -> Scene {
    let settings = ["ambient.illuminance_lx=300", "panel.interval=0.5"].map(String::from);
    Scene::load("night", &settings).expect("a scene")
}

#[test]
fn a_search_goes_on_from_any_of_its_crossings() {
    let mut told = Vec::new();
    let whole = reach_from(&night(), &search(), &[], |crossing| told.push(crossing.clone()));
    let whole = whole.expect("a reach");
    // Every third is known, in reverse.
    let known: Vec<Crossing> = told.iter().rev().step_by(3).cloned().collect();
    let mut new = 0;
    let resumed = reach_from(&night(), &search(), &known, |_| new += 1).expect("a reach");
    assert_eq!(resumed, whole);
    assert_eq!(new, told.len() - known.len());
}

#[test]
fn the_distance_of_the_scene_is_no_matter() {
    let mut far = night();
    far.pose.distance_m = 12.0;
    let [one, two] = [night(), far].map(|scene| reach(&scene, &search()).expect("a reach"));
    assert_eq!(one, two);
}

#[test]
fn senseless_searches_are_refused() {
    let refused = |search: ReachSearch| reach(&night(), &search).expect_err("nonsense").to_string();
    let range = ReachSearch {
        range: [4.0, 0.2],
        ..search()
    };
    assert!(refused(range).contains("must ascend"));
    let frames = ReachSearch { frames: 63, ..search() };
    assert!(refused(frames).contains("at least 64"));
    let tolerance = ReachSearch {
        tolerance: f64::NAN,
        ..search()
    };
    assert!(refused(tolerance).contains("NaN"));
    let rate = ReachSearch {
        raw_error_rate: 0.5,
        ..search()
    };
    assert!(refused(rate).contains("less than 0.5"));
}

#[test]
fn more_is_asked_where_there_is_less_time() {
    let rate = |within_s| {
        let demand = Demand {
            message_bytes: 8,
            within_s,
            ..Demand::default()
        };
        demand.raw_error_rate(90.0, 1).expect("time enough")
    };
    assert!(rate(0.15) < rate(0.4));
    let in_no_time = Demand {
        within_s: 0.1,
        ..Demand::default()
    };
    let complaint = in_no_time.raw_error_rate(90.0, 1).expect_err("no time").to_string();
    assert!(complaint.contains("26 symbols") && complaint.contains("there are 9"), "{complaint}");
    let empty = Demand {
        message_bytes: 0,
        ..Demand::default()
    };
    assert!(matches!(empty.raw_error_rate(90.0, 1), Err(DemandError::Message(_))));
    let sure = Demand {
        probability: 1.0,
        ..Demand::default()
    };
    assert!(matches!(sure.raw_error_rate(90.0, 1), Err(DemandError::Probability { .. })));
}

#[test]
fn erased_symbols_leave_room_for_fewer_wrong_bits() {
    let demand = short_messages();
    let still = demand.raw_error_rate(90.0, 1).expect("time enough");
    let carried = demand.raw_error_rate_with_carrier(90.0, 1).expect("time enough");
    assert!(carried < still && carried > 0.7 * still, "{carried} of {still}");
    // Every symbol counts if the message just fits.
    let short = Demand {
        within_s: 26.0 / 90.0 + 1e-9,
        probability: 0.99,
        ..Demand::default()
    };
    assert!(short.raw_error_rate(90.0, 1).is_ok());
    let complaint = short.raw_error_rate_with_carrier(90.0, 1).expect_err("erased").to_string();
    assert!(
        complaint.contains("8 % of the symbols") && complaint.contains("more time"),
        "{complaint}"
    );
}

/// Of fewer and smaller code words than the usual demand's, because decoding takes most of the time.
fn short_messages() -> Demand {
    Demand {
        message_bytes: 8,
        within_s: 0.4,
        ..Demand::default()
    }
}

/// A short search by k-means for a panel with a carrier.
fn with_carrier(exposure: &str) -> Result<Reach, ReachError> {
    let overrides = ["link.carrier_cycles=16".into(), format!("camera.exposure_s={exposure}")];
    let scene = sim::scene::Scene::load("day", &overrides).expect("a scene");
    let search = ReachSearch {
        raw_error_rate: short_messages().raw_error_rate_with_carrier(90.0, 1).expect("time enough"),
        frames: 128,
        tolerance: 1.0,
        detector: DetectorChoice::KMeans,
        ..ReachSearch::default()
    };
    reach(&scene, &search)
}

#[test]
fn a_carrier_has_a_reach_of_its_own() {
    // A still panel reaches 107 m.
    let found = with_carrier("0.00025").expect("a reach");
    assert!(
        (50.0..90.0).contains(&found.judged.verdict.reach_m),
        "{}",
        found.judged.verdict.reach_m
    );
    // An exposure of a whole cycle shows nothing.
    let blind = with_carrier("0.000694444444444");
    assert!(matches!(blind, Err(ReachError::Unread { .. })), "{blind:?}");
}
