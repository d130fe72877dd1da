//! Pictures of panels with known truth.

use std::f64::consts::PI;

use crate::parallel::map;
use link::camera::Encoding;
use link::panel::PanelFrame;
use properties::cases;
use rand::{Rng, RngExt};
use sim::accuracy::Level;
use sim::random::{Purpose, normal, stream};
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::scene::Scene;

use super::*;

const PERIOD_NS: f64 = 7776.0;
/// The pulse below which the driver's light falls, in proportion to the difference.
const SHORTEST_NS: f64 = 100.0;
/// The pulse with the loss [`CLEAN`].
const TRULY_CLEAN_NS: f64 = SHORTEST_NS * (1.0 - CLEAN);
const FULL_CD_M2: f64 = 26_000.0;
const ILLUMINANCE_LX: f64 = 10_000.0;
const REFLECTANCE: f64 = 0.4;
const CARD: f64 = 0.18;
/// Ripple of the dimming, between pictures.
const RIPPLE: f64 = 0.01;
/// Full luminance over the light.
const TRUE_FULL: f64 = FULL_CD_M2 / ILLUMINANCE_LX;
const PULSES_NS: [f64; 8] = [32.0, 64.0, 128.0, 256.0, 1024.0, 2048.0, 4096.0, 7776.0];

/// A camera at 5 m that exposes for the panel, before a wall as grey as the card.
fn bench(settings: &[&str]) -> Renderer {
    let always = [
        "camera.width_px=640",
        "camera.height_px=480",
        "pose.distance_m=5",
        "atmosphere.transmission_at_70m=1",
        "ambient.illuminance_lx=10000",
        "ambient.background_reflectance=0.18",
        "camera.exposure_bias_ev=-4",
        "panel.pwm_hz=0",
        "panel.reflectance=0.4",
    ];
    let settings: Vec<String> = always.iter().chain(settings).map(|&set| set.into()).collect();
    let scene = Scene::load("day", &settings).expect("a scene");
    Renderer::new(&scene, Level::Fine).expect("in view")
}

fn view(bench: &Renderer) -> CameraSetup {
    CameraSetup {
        corners: bench.corners_in(bench.sensor(), &bench.moment(1, 0)).expect("in view"),
        interval: 1.0,
        card: Area {
            x: 20,
            y: 100,
            width: 100,
            height: 200,
        },
        encoding: Encoding::default(),
        black_grey: 0.0,
        blur_sigma_px: 1.5,
        unevenness: None,
    }
}

/// A picture of a random panel.
fn picture(bench: &Renderer, seed: u64, frame: u64, light: f64) -> Vec<u8> {
    let mut random = stream(seed, frame, Purpose::Bits);
    let panel = PanelFrame::from_bits(random.next_u64());
    let ripple = 1.0 + RIPPLE * normal(&mut random);
    exposed(bench, seed, frame, panel, FULL_CD_M2 * light * ripple)
}

fn exposed(bench: &Renderer, seed: u64, frame: u64, panel: PanelFrame, cd_m2: f64) -> Vec<u8> {
    let sensor = bench.sensor();
    let mut shown = bench.steady(0, panel);
    shown.light = bench.lit(0, cd_m2);
    let mut canvas = Canvas::new(bench.lit_region());
    let mut grey = vec![0; sensor.width * sensor.height];
    let moment = bench.moment(seed, frame);
    bench.frame(seed, &moment, &[shown], &mut canvas, &mut grey);
    grey
}

/// The light of a pulse of a driver that is not clean below [`SHORTEST_NS`].
fn light_of(pulse_ns: f64) -> f64 {
    pulse_ns / PERIOD_NS * (pulse_ns / SHORTEST_NS).min(1.0)
}

/// Two pictures of each pulse, with its duty.
fn pictures(bench: &Renderer, seed: u64, pulses_ns: &[f64]) -> Vec<(f64, Vec<u8>)> {
    let twice = pulses_ns.iter().flat_map(|&pulse_ns| [pulse_ns; 2]);
    (0..)
        .zip(twice)
        .map(|(frame, pulse_ns)| {
            let grey = picture(bench, seed, frame, light_of(pulse_ns));
            (pulse_ns / PERIOD_NS, grey)
        })
        .collect()
}

/// The readable ones among them.
fn shots(bench: &Renderer, view: &CameraSetup, pictures: &[(f64, Vec<u8>)]) -> Vec<Shot> {
    let width = bench.sensor().width;
    let shot = |(duty, grey): &(f64, Vec<u8>)| {
        let reading = view.read(grey, width).ok()?;
        Some(Shot { duty: *duty, reading })
    };
    pictures.iter().filter_map(shot).collect()
}

fn calibrated(bench: &Renderer, view: &CameraSetup, seed: u64) -> Result<PanelCalibration, PhotometryError> {
    let pictures = pictures(bench, seed, &PULSES_NS);
    calibrate(&shots(bench, view, &pictures), CARD, PERIOD_NS)
}

/// The same with doubt about the encoding.
fn doubted(bench: &Renderer, view: &CameraSetup, seed: u64) -> Result<PanelCalibration, PhotometryError> {
    let pictures = pictures(bench, seed, &PULSES_NS);
    let by = |encoding: Encoding| shots(bench, &CameraSetup { encoding, ..*view }, &pictures);
    let others = USUAL.iter().filter(|&&usual| usual != view.encoding);
    let others: Vec<Vec<Shot>> = others.map(|&usual| by(usual)).collect();
    calibrate_in_doubt(&by(view.encoding), &others, CARD, PERIOD_NS)
}

/// Results of many series of pictures.
fn series<T: Send>(run: impl Fn(u64) -> T + Sync) -> Vec<T> {
    map(0..u64::from(cases(40, 100)), run)
}

fn luminances(runs: &[PanelCalibration]) -> Vec<Estimate> {
    runs.iter().map(|run| run.full_cd_m2_per_lx).collect()
}

/// The least number of 95 % intervals that contain the truth, except in one case in 250.
fn fewest(count: usize) -> usize {
    let (mut held, mut fewer) = (0, 0.0);
    let mut exactly = 0.05f64.powi(count as i32);
    while fewer + exactly <= 1.0 / 250.0 {
        fewer += exactly;
        exactly *= 19.0 * (count - held) as f64 / (held + 1) as f64;
        held += 1;
    }
    held
}

/// Checks the share of runs whose interval holds the truth, and its width relative to the error: as claimed.
fn is_honest(what: &str, runs: &[Estimate], truth: f64) {
    let count = runs.len();
    let [held, error, reach] = held(runs, truth, |run| run.interval_95);
    println!(
        "measured: {what} {truth:.4} in {held} of {count} intervals, error {:.2} %, interval {:.2} % to each side",
        100.0 * error,
        100.0 * reach
    );
    assert!(held >= fewest(count) as f64, "{what}: {held} of {count}");
    assert!(reach < 4.0 * error, "{what}: {reach}");
}

/// The same for the intervals with doubt about the encoding: at least as often, and narrow enough.
fn is_honest_in_doubt(what: &str, runs: &[Estimate], truth: f64, widest: f64) {
    let count = runs.len();
    let [held, error, reach] = held(runs, truth, |run| run.doubted_95);
    println!(
        "measured: {what} {truth:.4} in {held} of {count} doubted intervals, error {:.2} %, interval {:.2} % to each side",
        100.0 * error,
        100.0 * reach
    );
    assert!(held >= fewest(count) as f64, "{what}: {held} of {count}");
    assert!(reach < widest, "{what}: {reach}");
}

/// The number of intervals that hold the truth; the error and their reach to each side, relative to it.
fn held(runs: &[Estimate], truth: f64, interval: fn(&Estimate) -> [f64; 2]) -> [f64; 3] {
    let count = runs.len() as f64;
    let holds = |[low, high]: [f64; 2]| (low..=high).contains(&truth);
    let held = runs.iter().filter(|run| holds(interval(run))).count();
    let squares = runs.iter().map(|run| (run.value / truth - 1.0).powi(2));
    let reach = runs.iter().map(|run| interval(run)[1] - run.value);
    [
        held as f64,
        (squares.sum::<f64>() / count).sqrt(),
        reach.sum::<f64>() / count / truth,
    ]
}

/// The pulses' limit is where all runs place it, nine in ten of them this closely.
fn is_clean_from(runs: &[PanelCalibration], closely: f64) {
    for run in runs {
        let between = run.unclean_pulse_ns..=run.shortest_pulse_ns;
        assert!(between.contains(&TRULY_CLEAN_NS), "{run:?}");
    }
    let is_close = |run: &&PanelCalibration| run.shortest_pulse_ns < closely * SHORTEST_NS;
    let close = runs.iter().filter(is_close).count();
    println!(
        "measured: shortest pulse below {closely} times the driver's in {close} of {} runs",
        runs.len()
    );
    assert!(close as f64 >= 0.9 * runs.len() as f64, "{close}");
}

#[test]
fn intervals_hold_the_truth_as_often_as_is_claimed() {
    let bench = bench(&[]);
    let view = view(&bench);
    let runs = series(|seed| calibrated(&bench, &view, seed).expect("enough pictures"));
    is_honest("luminance", &luminances(&runs), TRUE_FULL);
    let reflectances: Vec<Estimate> = runs.iter().map(|run| run.reflectance).collect();
    is_honest("reflectance", &reflectances, REFLECTANCE);
    is_clean_from(&runs, 2.6);
}

#[test]
fn a_camera_that_is_not_as_was_told_is_refused_or_doubted_enough() {
    let runs = series(|seed| {
        let mut random = stream(seed, 0, Purpose::Phase);
        let mut within = |low: f64, high: f64| random.random_range(low..high);
        let camera = [
            format!("camera.gamma={}", within(2.0, 2.4)),
            format!("camera.blur_sigma_px={}", within(1.0, 2.0)),
        ];
        let bench = bench(&camera.each_ref().map(String::as_str));
        let [dx, dy] = [within(-2.0, 2.0), within(-2.0, 2.0)];
        let mut view = view(&bench);
        view.corners = view.corners.shifted(dx as f32, dy as f32).expect("a panel");
        doubted(&bench, &view, seed)
    });
    let is_bent = |run: &&_| matches!(run, Err(PhotometryError::Bent { .. }));
    let (count, refused) = (runs.len(), runs.iter().filter(is_bent).count());
    println!("measured: {refused} of {count} cameras whose gamma is 2 to 2.4, not 2.2, are refused");
    let runs: Vec<PanelCalibration> = runs.into_iter().flatten().collect();
    assert_eq!(runs.len() + refused, count);
    assert!(5 * runs.len().min(refused) >= count, "{refused}");
    is_honest_in_doubt("luminance, camera mistaken", &luminances(&runs), TRUE_FULL, 0.15);
    let reflectances: Vec<Estimate> = runs.iter().map(|run| run.reflectance).collect();
    is_honest_in_doubt("reflectance, camera mistaken", &reflectances, REFLECTANCE, 0.05);
}

#[test]
fn a_camera_of_another_usual_encoding_is_refused_or_doubted_enough() {
    for (truth, name, exposure) in [
        (Some(USUAL[0]), "gamma", -4),
        (Some(Encoding::Srgb), "srgb", -4),
        (Some(Encoding::Rec709), "rec709", -4),
        // Its shoulder is unknown and starts at grey 150: On LEDs must stay below.
        (None, "shoulder", -5),
    ] {
        let bench = bench(&[&format!("camera.encoding={name}"), &format!("camera.exposure_bias_ev={exposure}")]);
        for encoding in USUAL {
            let view = CameraSetup { encoding, ..view(&bench) };
            let what = format!("{encoding:?} for {name}");
            match doubted(&bench, &view, 1) {
                Ok(found) => {
                    let full = found.full_cd_m2_per_lx;
                    println!("measured: {what}: luminance {full:.4?}");
                    let [low, high] = full.doubted_95;
                    assert!((low..=high).contains(&TRUE_FULL), "{what}: {full:?}");
                    let [low, high] = found.reflectance.doubted_95;
                    assert!((low..=high).contains(&REFLECTANCE), "{what}: {found:?}");
                }
                Err(PhotometryError::Bent { by }) => {
                    println!("measured: {what}: refused, bent by {by:.3}");
                    assert!(truth != Some(encoding), "{what}");
                }
                Err(other) => panic!("{what}: {other}"),
            }
        }
    }
}

/// The limitation in docs/calibration.md.
#[test]
fn a_shoulder_that_on_leds_reach_may_be_taken_for_srgb() {
    let bench = bench(&["camera.encoding=shoulder"]);
    let view = CameraSetup {
        encoding: Encoding::Srgb,
        ..view(&bench)
    };
    let full = doubted(&bench, &view, 1).map(|found| found.full_cd_m2_per_lx);
    println!("measured: Srgb for shoulder, above grey 150: luminance {full:.4?}");
    assert!(full.is_ok_and(|full| full.doubted_95[1] < TRUE_FULL));
}

#[test]
fn light_that_strays_onto_off_leds_is_no_reflectance() {
    // Stray light of On LEDs that looks like a higher reflectance: 0.2 % of it everywhere.
    let reflectance = |light: f64| REFLECTANCE + 0.002 * light * PI * TRUE_FULL;
    let benches: Vec<Renderer> = PULSES_NS
        .iter()
        .map(|&pulse_ns| {
            let strays = format!("panel.reflectance={}", reflectance(light_of(pulse_ns)));
            bench(&[&strays])
        })
        .collect();
    let view = view(&benches[0]);
    let runs = series(|seed| {
        let twice = PULSES_NS.iter().zip(&benches).flat_map(|pair| [pair; 2]);
        let shots: Vec<Shot> = (0..)
            .zip(twice)
            .filter_map(|(frame, (&pulse_ns, bench))| {
                let grey = picture(bench, seed, frame, light_of(pulse_ns));
                let reading = view.read(&grey, bench.sensor().width).ok()?;
                let duty = pulse_ns / PERIOD_NS;
                Some(Shot { duty, reading })
            })
            .collect();
        calibrate(&shots, CARD, PERIOD_NS).expect("enough pictures")
    });
    let reflectances: Vec<Estimate> = runs.iter().map(|run| run.reflectance).collect();
    is_honest("reflectance, stray light", &reflectances, REFLECTANCE);
}

#[test]
fn a_sheet_evens_vignetting() {
    // A short lens at 1 m, which darkens the card by 15 % relative to the panel.
    let short = ["camera.vignetting=true", "camera.focal_length_mm=5", "pose.distance_m=1"];
    let bench = bench(&short);
    let sheet = self::bench(
        &[
            &short[..],
            &[
                "ambient.background_reflectance=0.7",
                "panel.reflectance=0.7",
                "camera.exposure_bias_ev=0",
            ],
        ]
        .concat(),
    );
    let dark = PanelFrame::from_bits(0);
    let sheet = exposed(&sheet, 1, 0, dark, 0.0);
    let uneven = view(&bench);
    let width = bench.sensor().width;
    let even = CameraSetup {
        unevenness: Some(uneven.read_sheet(&sheet, width).expect("a sheet")),
        ..uneven
    };
    let runs = series(|seed| calibrated(&bench, &even, seed).expect("enough pictures"));
    is_honest("luminance, vignetting and a sheet", &luminances(&runs), TRUE_FULL);
    let panel = picture(&bench, 1, 0, 1.0);
    let no_sheet = uneven.read_sheet(&panel, width);
    assert!(matches!(no_sheet, Err(PictureError::NoSheet(_))), "{no_sheet:?}");
    let without = calibrated(&bench, &uneven, 1).expect("enough pictures");
    let error = without.full_cd_m2_per_lx.value / TRUE_FULL - 1.0;
    println!("measured: without the sheet, luminance is off by {:.1} %", 100.0 * error);
    assert!(error > 0.08, "the sheet has something to do: {error}");
}

#[test]
fn clipped_duties_are_left_out_and_the_others_tell() {
    let bench = bench(&["camera.exposure_bias_ev=-2.5"]);
    let view = view(&bench);
    let runs = series(|seed| {
        let shots = shots(&bench, &view, &pictures(&bench, seed, &PULSES_NS));
        let longest = shots.iter().map(|shot| shot.duty).fold(0.0, f64::max);
        assert!(longest < 1.0, "{longest}");
        calibrate(&shots, CARD, PERIOD_NS).expect("enough pictures")
    });
    is_honest("luminance, clipping", &luminances(&runs), TRUE_FULL);
    is_clean_from(&runs, 10.3);
}

#[test]
fn leds_that_differ_are_averaged_honestly() {
    let uneven = ["panel.led_spread=0.1", "panel.seed=3"];
    let bench = self::bench(&uneven);
    let view = view(&bench);
    // The mean of all LEDs, from two pictures without noise that are complements.
    let quiet = self::bench(&[&uneven[..], &["effects.noise=off"]].concat());
    let half = [0x5555_5555_5555_5555, 0xaaaa_aaaa_aaaa_aaaa].map(|bits| {
        let panel = PanelFrame::from_bits(bits);
        let grey = exposed(&quiet, 1, 0, panel, FULL_CD_M2);
        let width = quiet.sensor().width;
        let reading = view.read(&grey, width).expect("a reading");
        // Without noise the card's level is rounded to one side; its light is 4 stops below grey 118's.
        reading.own * reading.card * 16.0
    });
    let truth = (half[0] + half[1]) / 2.0 * CARD / PI;
    let runs = series(|seed| calibrated(&bench, &view, seed).expect("enough pictures"));
    is_honest("luminance, LEDs that differ", &luminances(&runs), truth);
}

#[test]
fn another_encoding_than_the_cameras_is_noticed() {
    let bench = bench(&[]);
    let wrong = CameraSetup {
        encoding: Encoding::Gamma(1.8),
        ..view(&bench)
    };
    let refused = calibrated(&bench, &wrong, 1);
    assert!(matches!(refused, Err(PhotometryError::Bent { .. })), "{refused:?}");
}

#[test]
fn pictures_that_tell_nothing_are_refused() {
    let bench = bench(&[]);
    let good = view(&bench);
    let width = bench.sensor().width;
    let of = |light| picture(&bench, 1, 0, light);
    let clipped = good.read(&of(8.0), width);
    assert!(matches!(clipped, Err(PictureError::Clipped(_))), "{clipped:?}");
    assert_eq!(good.read(&of(0.0), width), Err(PictureError::Alike));
    let outside = CameraSetup {
        card: Area { x: 600, ..good.card },
        ..good
    };
    assert_eq!(outside.read(&of(0.5), width), Err(PictureError::Outside("card")));
    // A tenth of the exposure shows another symbol.
    let before = exposed(&bench, 1, 0, PanelFrame::from_bits(0x00ff_00ff_00ff_00ff), 0.1 * FULL_CD_M2);
    let then = exposed(&bench, 1, 1, PanelFrame::from_bits(0x0f0f_0f0f_0f0f_0f0f), 0.9 * FULL_CD_M2);
    let across: Vec<u8> = before.iter().zip(&then).map(|(&a, &b)| a.max(b)).collect();
    assert_eq!(good.read(&across, width), Err(PictureError::Changing));
    let far = self::bench(&["pose.distance_m=20"]);
    let small = view(&far).read(&picture(&far, 1, 0, 0.5), width);
    assert!(matches!(small, Err(PictureError::Small { .. })), "{small:?}");
    let dark: Vec<u8> = of(0.5).iter().map(|grey| grey / 8).collect();
    let dark = good.read(&dark, width);
    assert!(matches!(dark, Err(PictureError::Dark { .. })), "{dark:?}");

    let one_duty = shots(&bench, &good, &pictures(&bench, 1, &[4096.0; 3]));
    let few = calibrate(&one_duty, CARD, PERIOD_NS);
    assert!(matches!(few, Err(PhotometryError::TooFew { duties: 1, .. })), "{few:?}");
    let mut unsteady = shots(&bench, &good, &pictures(&bench, 1, &PULSES_NS));
    unsteady[0].reading.card *= 1.2;
    let unsteady = calibrate(&unsteady, CARD, PERIOD_NS);
    assert!(matches!(unsteady, Err(PhotometryError::Unsteady { .. })), "{unsteady:?}");
}
