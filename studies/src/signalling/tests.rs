use std::sync::atomic::AtomicBool;

use link::panel::PanelFrame;

use super::*;
use crate::flicker::low_risk_times;

fn scene(overrides: &[&str]) -> Scene {
    let small = ["camera.width_px=160", "camera.height_px=120"];
    let all: Vec<String> = small.iter().chain(overrides).map(|s| (*s).into()).collect();
    Scene::load("day", &all).expect("a scene")
}

/// Two runs a setting of a short message.
fn advice(overrides: &[&str]) -> Result<Advice, SignallingError> {
    let search = Search {
        bytes: 8,
        runs: 2,
        seed: 1,
    };
    search.run(&scene(overrides), Stop::NEVER, || {}, |_| {})
}

#[test]
fn a_camera_of_short_exposures_is_shown_nearly_a_symbol_a_frame() {
    let advice = advice(&[]).expect("advice");
    assert_eq!(advice.whole_exposures.hz(), 90.0);
    let best = advice.best();
    assert!(best.rate.hz() >= 90.0, "{}", best.rate);
    assert_eq!((best.delivered, best.runs), (2, 2));
    let trials = &advice.trials;
    assert!(trials.iter().all(|trial| trial.net_bit_s() <= best.net_bit_s()));
    assert!(trials.iter().all(|trial| trial.bit_error_rate().is_some()));
    // Every code is tried at one rate, and one code at every rate.
    assert_eq!(trials.len(), rates(&scene(&[]), advice.whole_exposures).len() + Code::ALL.len() - 1);
}

#[test]
fn long_exposures_and_slow_readout_ask_for_longer_symbols() {
    let of = |overrides: &[&str]| whole_exposures(&scene(overrides)).expect("a rate").hz();
    let long = of(&["camera.frame_rate_hz=30", "camera.exposure_max_s=0.02", "camera.f_number=22"]);
    assert!((long - 1.0 / (1.0 / 30.0 + 0.02)).abs() < 1e-3, "{long}");
    // Only some of the lines see the panel.
    let slow = of(&["camera.readout_s=0.009"]);
    assert!((1.0 / 0.02..90.0).contains(&slow), "{slow}");
    let too_slow = advice(&["camera.frame_rate_hz=8"]).expect_err("too slow").to_string();
    assert!(
        too_slow.contains("8 frames a second") && too_slow.contains("9 to 300"),
        "{too_slow}"
    );
}

#[test]
fn pulses_beat_with_the_frames_unless_an_exposure_holds_whole_ones() {
    let beat = |hz: &str| dimming::beats(&scene(&[hz])).expect("beats")[0];
    let slow = beat("panel.pwm_hz=210");
    assert!(slow.is_seen() && (slow.beat_hz - 10.0).abs() < 1e-9, "{slow:?}");
    let fast = beat("panel.pwm_hz=5000000");
    assert!(!fast.is_seen() && fast.stray < slow.stray, "{fast:?}");
    assert!(dimming::beats(&scene(&["panel.pwm_hz=0"])).expect("beats").is_empty());
}

#[test]
fn what_cannot_be_tried_is_refused() {
    let search = Search {
        bytes: 8,
        runs: 1,
        seed: 1,
    };
    let run = |search: Search| search.run(&scene(&[]), Stop::NEVER, || {}, |_| {});
    for wrong in [Search { bytes: 0, ..search }, Search { bytes: 1025, ..search }] {
        assert!(run(wrong).expect_err("no message").to_string().contains("message"));
    }
    assert!(matches!(run(Search { runs: 0, ..search }), Err(SignallingError::NoRuns)));
}

/// Beacons and a message.
fn shown() -> [Vec<PanelFrame>; 2] {
    [None, Some(b"Ice".as_slice())].map(|message| panels(message).expect("a message"))
}

#[test]
fn a_carrier_keeps_apart_from_frame_rates_is_of_low_risk_and_seen() {
    for (frames_hz, rate_hz, exposure_s) in [(30.0, 27.0, 0.001), (60.0, 54.0, 0.0005), (100.0, 90.0, 0.00025)] {
        let camera = carrier::Camera {
            frames_hz,
            exposure_s,
            readout_s: 0.01,
        };
        let rate = SymbolRate::from_hz(rate_hz).expect("a rate");
        let found = camera.candidates(rate, &shown(), Stop::NEVER);
        assert!(!found.is_empty());
        for (carrier, times) in found {
            let hz = carrier.hz();
            assert!((1250.0..=3000.0).contains(&hz) && times <= 1.0, "{hz} Hz, {times} times");
            for frames_hz in USUAL_FRAMES_HZ.into_iter().chain([frames_hz]) {
                let off_hz = hz - (2.0 * hz / frames_hz).round() * 0.5 * frames_hz;
                assert!(off_hz.abs() >= 2.0, "{hz} Hz and {frames_hz} frames a second");
            }
            // The greatest contrast over the phases, by the waveform itself.
            let (waveform, rate_hz) = (carrier.timing.waveform(), carrier.timing.rate().hz());
            let contrasts = (0..1000).map(|step| f64::from(step) / 1000.0 / f64::from(waveform.cycles()));
            let contrasts: Vec<f64> = contrasts.map(|at| waveform.contrast(at, at + rate_hz * exposure_s).abs()).collect();
            let most = contrasts.iter().copied().fold(0.0, f64::max);
            let mean = contrasts.iter().sum::<f64>() / 1000.0;
            assert!((most - carrier.contrast).abs() < 0.01, "{most} and {}", carrier.contrast);
            assert!(
                (mean - carrier.mean_contrast()).abs() < 0.01,
                "{mean} and {}",
                carrier.mean_contrast()
            );
            assert!(most >= 0.2);
        }
    }
}

/// Transmitters show it until they are told another one.
#[test]
fn the_default_carrier_keeps_apart_from_frame_rates_and_is_of_low_risk() {
    let timing = SymbolTiming::CARRIER;
    let carrier_hz = timing.rate().hz() * f64::from(timing.waveform().cycles());
    assert_eq!(parked_at(carrier_hz).collect::<Vec<_>>(), [0.0; 0]);
    for message in [None, Some(1), Some(8), Some(128), Some(1024)] {
        let message = message.map(|bytes| vec![b'x'; bytes]);
        let panels = panels(message.as_deref()).expect("a message");
        let times = low_risk_times(&panels, timing.waveform(), timing.rate().hz(), Stop::NEVER).expect("no stop");
        assert!(times <= 1.0, "{message:?}: {times} times");
    }
}

#[test]
fn long_exposures_are_told_which_one_would_do() {
    let camera = carrier::Camera {
        frames_hz: 30.0,
        exposure_s: 0.002,
        readout_s: 0.0,
    };
    let rate = SymbolRate::from_hz(27.0).expect("a rate");
    assert_eq!(camera.candidates(rate, &shown(), Stop::NEVER), []);
    let none = camera.no_candidate(rate, &shown(), 3, Stop::NEVER);
    let NoCarrier::Exposure { needed_s, carrier_hz, .. } = none else {
        panic!("{none}")
    };
    assert!((1.0 / 2900.0..1.0 / 2600.0).contains(&needed_s) && (needed_s * carrier_hz - 0.5).abs() < 1e-9);
    let shorter = carrier::Camera {
        exposure_s: needed_s,
        ..camera
    };
    let found = shorter.candidates(rate, &shown(), Stop::NEVER);
    assert!(
        !found.is_empty() && found.iter().all(|(carrier, _)| carrier.contrast > 0.8),
        "{found:?}"
    );
}

#[test]
fn a_carrier_is_recommended_if_its_messages_arrive() {
    let search = Search {
        bytes: 8,
        runs: 2,
        seed: 1,
    };
    let found = search.carrier(&scene(&["camera.exposure_max_s=0.00025"]), Stop::NEVER, || {}, |_| {});
    let advice = found.expect("trials").expect("a carrier");
    assert_eq!((advice.trial.delivered, advice.trial.runs), (2, 2));
    assert_eq!(advice.trial.waveform, advice.carrier.timing.waveform());
    assert!(!advice.trial.waveform.is_still() && advice.carrier.contrast == 1.0);
    assert_eq!(advice.trial.bit_error_rate(), None);
    let missed = CarrierAdvice {
        trial: TrialOutcome {
            delivered: 1,
            ..advice.trial
        },
        ..advice
    };
    let none = carrier::best(vec![missed], 0.001).expect("a trial").expect_err("too few");
    assert!(none.to_string().contains("1 of 2 messages"), "{none}");
}

#[test]
fn the_reason_for_no_carrier_names_what_can_be_set() {
    let rate = SymbolRate::from_hz(27.0).expect("a rate");
    // No frequency is 2 Hz from all multiples of 2 Hz.
    let slow = carrier::Camera {
        frames_hz: 4.0,
        exposure_s: 0.001,
        readout_s: 0.0,
    };
    let none = slow.no_candidate(rate, &shown(), 3, Stop::NEVER);
    assert!(matches!(none, NoCarrier::FrameRates { frames_hz: 4.0, .. }), "{none}");
    assert!(none.to_string().contains("camera.frame_rate_hz"), "{none}");
    // After a stop, no carrier counts as of low risk.
    static STOPPED: AtomicBool = AtomicBool::new(true);
    let camera = carrier::Camera { frames_hz: 30.0, ..slow };
    let none = camera.no_candidate(rate, &shown(), 3, Stop::at(&STOPPED));
    assert!(matches!(none, NoCarrier::LowRisk { bytes: 3, .. }), "{none}");
    assert!(none.to_string().contains("another length, 1 to 1024 bytes"), "{none}");
}
