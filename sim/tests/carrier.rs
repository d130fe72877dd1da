//! A carrier in rendered frames: the light of an exposure, line by line. Without a carrier nothing changes.

use link::panel::{LEDS, PanelFrame};
use link::waveform::Waveform;
use sim::accuracy::Level;
use sim::renderer::canvas::Canvas;
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::Scene;

const SYMBOLS: [u64; 4] = [0x0f0f_3333_5555_8001, 0x1234_5678_9abc_def0, !0, 0x8001_5555_3333_0f0f];

fn renderer(settings: &[&str]) -> Renderer {
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    Renderer::new(&Scene::load("day", &settings).expect("a valid scene"), Level::Fine).expect("a visible scene")
}

fn linear(renderer: &Renderer, frame: u64, symbols: [PanelFrame; 4]) -> Vec<f64> {
    let shown = PanelExposure {
        symbols,
        ..renderer.steady(0, PanelFrame::default())
    };
    let mut canvas = Canvas::<f32>::new(renderer.surroundings(0));
    renderer.draw(&renderer.moment(1, frame), &[shown], &mut canvas);
    canvas.values().iter().map(|&value| value.into()).collect()
}

#[test]
fn a_frame_is_the_mean_of_its_moments() {
    const MOMENTS: usize = 400;
    let carrier = Waveform::new(16).expect("a carrier");
    for readout in ["camera.readout_s=0", "camera.readout_s=0.008"] {
        // A change of symbols falls into the second frame's exposures.
        let times = ["link.phase=0.1", "camera.frame_rate_hz=100", readout];
        let whole = renderer(&[&times[..], &["link.carrier_cycles=16"]].concat());
        // The mean of still panels at successive moments.
        let still = renderer(&[&times[..], &["effects.symbol_change=off"]].concat());
        let camera = &whole.view().scene.camera;
        let row_s = camera.readout_s / (camera.height_px - 1) as f64;
        for frame in [0, 1, 9] {
            let moment = whole.moment(1, frame);
            let mut mean: Vec<f64> = Vec::new();
            for k in 0..MOMENTS {
                let into_exposure_s = (k as f64 + 0.5) / MOMENTS as f64 * moment.exposure_s;
                let is_on = |led: usize| {
                    let row = whole.view().panels[0].ellipses[led].centre.y;
                    let at = (moment.since_change_s + row_s * row + into_exposure_s) / moment.symbol_s;
                    carrier.is_on(SYMBOLS[at as usize] >> led & 1 == 1, at)
                };
                let bits = (0..LEDS).filter(|&led| is_on(led)).fold(0, |bits, led| bits | 1 << led);
                let now = linear(&still, frame, [PanelFrame::from_bits(bits); 4]);
                mean.resize(now.len(), 0.0);
                mean.iter_mut().zip(&now).for_each(|(mean, now)| *mean += now / MOMENTS as f64);
            }
            let drawn = linear(&whole, frame, SYMBOLS.map(PanelFrame::from_bits));
            let brightest = mean.iter().copied().fold(0.0, f64::max);
            let apart = drawn.iter().zip(&mean).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 0.01 * brightest, "{readout}, frame {frame}: {apart} of {brightest}");
        }
    }
}

#[test]
fn without_a_carrier_no_byte_changes() {
    for effect in ["effects.carrier=auto", "effects.carrier=on"] {
        let [plain, none] = [&[effect][..], &[effect, "link.carrier_cycles=0"]].map(|settings| {
            let renderer = renderer(settings);
            assert_eq!(renderer.plan().includes("carrier"), effect.ends_with("on"));
            linear(&renderer, 1, SYMBOLS.map(PanelFrame::from_bits))
        });
        assert_eq!(plain, none);
        assert_eq!(plain, linear(&renderer(&[]), 1, SYMBOLS.map(PanelFrame::from_bits)));
    }
}

#[test]
fn half_of_the_leds_light_is_there_whatever_they_say() {
    // An exposure of two whole cycles.
    let settings = ["link.symbol_rate_hz=100", "link.carrier_cycles=20", "link.clock_ppm=0"];
    let renderer = renderer(&[&settings[..], &["ambient.illuminance_lx=500"]].concat());
    assert!((renderer.moment(1, 0).exposure_s * 2000.0 - 2.0).abs() < 1e-9);
    let [one, other] = [0, SYMBOLS[0]].map(|bits| linear(&renderer, 3, [PanelFrame::from_bits(bits); 4]));
    for (one, other) in one.iter().zip(&other) {
        assert!((one - other).abs() < 1e-4 * one, "{one}, {other}");
    }
}

#[test]
fn a_carrier_that_no_transmitter_shows_is_refused() {
    for (cycles, rate, words) in [
        ("1", "90", "90 Hz"),
        ("40", "90", "3600 Hz"),
        ("16", "9", "144 Hz"),
        ("334", "90", "0 to 333"),
    ] {
        let settings = [format!("link.carrier_cycles={cycles}"), format!("link.symbol_rate_hz={rate}")];
        let fault = Scene::load("day", &settings).expect_err("no carrier").to_string();
        assert!(fault.contains("link.carrier_cycles") && fault.contains(words), "{fault}");
    }
}
