//! An hour of symbols and of light, and 10⁹ samples.

use fixed::types::{I32F32, U12F20};
use link::panel::{PanelFrame, SoftPanel};
use rx_pipeline::symbols::SymbolClock;
use sim::camera::clock::Moment;
use sim::camera::exposure::Exposure;
use sim::scene::Scene;
use studies::statistics::{FrameErrors, Moments};
use tx_firmware::ambient::{Ambient, DARKEST_LX, Smoothing};
use vocc_tests::{all_cases, naive};

/// Frames in an hour at 100 frames per second.
const HOUR: u64 = 360_000;

#[test]
fn a_simulated_hour_of_two_clocks_gathers_no_error() {
    let overrides = ["link.symbol_rate_hz=90.9", "link.clock_ppm=200", "link.phase=0.25"];
    let scene = Scene::load("paper", &overrides.map(String::from)).expect("a scene");
    let exposure = Exposure::of(&scene);
    let mut worst = 0.0f64;
    for frame in 0..=HOUR {
        let moment = Moment::of(&scene, &exposure, 1, frame);
        // 90.9 symbols per second, 1.0002 times as fast, 0.01 s per frame: in units of 10⁻⁸ symbols.
        let exact = u128::from(frame) * 909 * 10_002 * 10 + 25_000_000;
        let (whole, rest) = (exact / 100_000_000, exact % 100_000_000);
        let apart = (moment.symbol as f64 - whole as f64) + (moment.since_change_s / moment.symbol_s - rest as f64 * 1e-8);
        worst = worst.max(apart.abs());
        assert!((moment.shares(0.0).iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
    assert!(worst < 1e-9, "{worst:e} symbols");
}

/// Equal clocks, every frame at the start of a symbol: summing periods loses symbols, dividing does not.
#[test]
fn frames_that_begin_with_their_symbols_stay_in_them_for_an_hour() {
    let scene = Scene::load("paper", &["link.phase=0".into()]).expect("a scene");
    let exposure = Exposure::of(&scene);
    let mut time_s = 0.0;
    let mut naive_wrong = 0;
    for frame in 0..=HOUR {
        naive_wrong += usize::from((time_s / 0.01) as u64 != frame);
        time_s += 0.01;
        let moment = Moment::of(&scene, &exposure, 1, frame);
        assert_eq!((moment.symbol, moment.middle_symbol(0.0)), (frame, 0));
    }
    assert!(naive_wrong > 1000, "{naive_wrong}");
}

/// A pseudo-random panel for each symbol.
fn shown(symbol: u64) -> SoftPanel {
    let mixed = (symbol + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    SoftPanel::certain(PanelFrame::from_bits(mixed ^ mixed >> 27), 10)
}

#[test]
fn the_receiver_counts_an_hour_of_drifting_symbols_to_the_last_one() {
    for ppm in [-190.0, 0.0, 190.0] {
        let per_frame = 0.9 * (1.0 + ppm * 1e-6);
        let symbol_of = |frame: u64| (0.35 + frame as f64 * per_frame) as u64;
        let mut clock = SymbolClock::new(0.9).expect("a rate");
        let mut expected = 0;
        for frame in 0..HOUR {
            if let Some(symbol) = clock.push(frame, &shown(symbol_of(frame))) {
                assert_eq!(symbol.panel.hard(), shown(expected).hard(), "{ppm} ppm, frame {frame}");
                assert_eq!(u64::from(symbol.index), expected, "{ppm} ppm, frame {frame}");
                expected = symbol_of(frame);
            }
        }
        // From the frame number alone.
        let naive = (0.35 + (HOUR - 1) as f64 * 0.9) as u64;
        let last = symbol_of(HOUR - 1);
        assert_eq!(clock.current().map(u64::from), Some(last));
        assert_eq!(naive.abs_diff(last) > 50, ppm != 0.0, "{naive} and {last}");
    }
}

/// A truncating filter in steps of 1/4096 lx stops where its fraction of the difference is below a step.
#[test]
fn an_hour_of_steady_light_is_read_as_it_is() {
    let share_bits = 7;
    let (mut naive, target) = (0u32, (0.02f64 * 4096.0) as u32);
    for _ in 0..36_000 {
        naive += (target - naive) >> share_bits;
    }
    assert!(f64::from(naive) < 0.5 * f64::from(target), "{naive} of {target}");
    for light in [0.02, 1.0, 317.0, 100_000.0] {
        // Start values slightly darker and brighter, within the filter's slowest band.
        for start in [0.93, 1.07] {
            let mut ambient = Ambient::new(U12F20::ONE, Smoothing::default());
            let reading = I32F32::from_num(light);
            ambient.sense(I32F32::from_num(start * light));
            for _ in 0..36_000 {
                ambient.sense(reading);
            }
            let read = ambient.illuminance_lx().expect("light").to_num::<f64>();
            // A step of the type, plus the truncation error in steps of 2⁻²⁶ octaves at a fraction of 1/100.
            let bound = 1.0 / 4096.0 + light * 2e-5;
            assert!((read - light).abs() <= bound, "{read} lx of {light}");
        }
    }
    let mut dark = Ambient::new(U12F20::ONE, Smoothing::default());
    (0..36_000).for_each(|_| {
        dark.sense(I32F32::ZERO);
    });
    assert_eq!(dark.illuminance_lx(), Some(DARKEST_LX));
}

/// 2¹⁰ values about a large offset with exactly known mean and variance.
fn values() -> impl Iterator<Item = f64> + Clone {
    (0..1024u32).map(|k| 1e6 + f64::from(k * 389 % 1024) / 1024.0)
}

/// The 2¹⁰ fractions are all multiples of 1/1024 from 0: their variance is (n² − 1)/12 in units of 1/n².
const VARIANCE: f64 = (1024.0 * 1024.0 - 1.0) / 12.0 / (1024.0 * 1024.0);
const MEAN: f64 = 1e6 + 1023.0 / 2048.0;

#[test]
fn a_thousand_million_samples_keep_mean_and_variance() {
    let mut sorted: Vec<f64> = values().collect();
    sorted.sort_by(f64::total_cmp);
    assert!(sorted.windows(2).all(|pair| pair[1] - pair[0] == 1.0 / 1024.0));
    // Counting in f32 stops at 2²⁴.
    let end = (1u32 << 24) as f32;
    assert_eq!(end + 1.0, end);
    // 2²⁰ shards of 2¹⁰ each, merged pairwise like a run's chunks.
    let shard = Moments::of(&values().map(|x| [x, -x]).collect::<Vec<_>>());
    let mut total = shard;
    let mut one_by_one = Moments::default();
    for doubling in 0..20 {
        let half = total;
        total.merge(&half);
        // And many small ones merged into a large one.
        for _ in 0..1 << doubling {
            one_by_one.merge(&shard);
        }
    }
    assert_eq!(total.count(), 1 << 30);
    assert_eq!(one_by_one.count(), (1 << 30) - 1024);
    for moments in [total, one_by_one] {
        assert!((moments.mean()[0] - MEAN).abs() < 1e-9, "{:?}", moments.mean());
        let [[xx, xy], _] = moments.covariance();
        assert!((xx / VARIANCE - 1.0).abs() < 1e-12 && xy == -xx, "{xx}");
    }
}

#[test]
fn a_thousand_million_frames_keep_their_error_rate() {
    let mut errors = FrameErrors::default();
    for frame in 0..1024u32 {
        errors.push(if frame.is_multiple_of(16) { 4 } else { 0 });
    }
    for _ in 0..20 {
        let half = errors;
        errors.merge(&half);
    }
    assert_eq!((errors.frames(), errors.errors()), (1 << 30, 1 << 28));
    assert_eq!(errors.rate(), 1.0 / 256.0);
    let [low, high] = errors.interval_95();
    // Binomial over frames: 4/64 · √(1/16·15/16/2³⁰).
    let deviation = 4.0 / 64.0 * (1.0f64 / 16.0 * 15.0 / 16.0).sqrt() / 2f64.powi(15);
    assert!((high - low - 3.92 * deviation).abs() < 0.4 * deviation, "{low} to {high}");
}

/// The same one value at a time: a million, or with all cases 10⁹ in half a minute.
#[test]
fn samples_one_by_one_keep_mean_and_variance() {
    let count = if all_cases() { 1 << 30 } else { 1 << 20 };
    let mut moments = Moments::default();
    for x in values().cycle().take(count) {
        moments.push([x, -x]);
    }
    let [[xx, _], _] = moments.covariance();
    let (_, naive) = naive::variance_by_squares(values().cycle().take(count));
    println!(
        "ours {:e}, mean {:e}, naive {:e}",
        xx / VARIANCE - 1.0,
        moments.mean()[0] - MEAN,
        naive / VARIANCE - 1.0
    );
    assert!((moments.mean()[0] - MEAN).abs() < 1e-9, "{:?}", moments.mean());
    assert!((xx / VARIANCE - 1.0).abs() < 1e-10, "{xx}");
    assert!((naive / VARIANCE - 1.0).abs() > 1e-3, "{naive}");
}
