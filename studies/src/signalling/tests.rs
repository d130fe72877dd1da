use super::*;

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
    let tried = &advice.tried;
    assert!(tried.iter().all(|tried| tried.net_bit_s() <= best.net_bit_s()));
    // Every code is tried at one rate, and one code at every rate.
    assert_eq!(tried.len(), rates(&scene(&[]), advice.whole_exposures).len() + Code::ALL.len() - 1);
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
