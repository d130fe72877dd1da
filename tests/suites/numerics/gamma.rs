//! Light to grey levels at the extremes: gamma, ISO, exposure and LED-to-ambient ratio.

use link::panel::PanelFrame;
use micromath::F32Ext;
use sim::accuracy::Level;
use sim::camera::encoder::CURVE_ERROR_GREY;
use sim::camera::exposure::Exposure;
use sim::camera::grey::{self, GammaEncoder};
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::scene::{L2a, Scene};

const GAMMAS: [f64; 5] = [1.0, 1.8, 2.2, 2.4, 4.0];

/// Linear values that are invalid, or at the limits of the type.
const ODD: [f32; 14] = [
    0.0,
    -0.0,
    -1.0,
    f32::NEG_INFINITY,
    f32::NAN,
    1e-45,
    f32::MIN_POSITIVE / 2.0,
    f32::MIN_POSITIVE,
    1e-20,
    1.0,
    5.446,
    1e20,
    f32::MAX,
    f32::INFINITY,
];

#[test]
fn the_gamma_curve_is_defined_at_0_at_subnormal_and_at_huge_light() {
    for gamma in GAMMAS {
        let encoder = GammaEncoder::new(gamma);
        for light in ODD {
            let exact = grey::unrounded(light.into(), gamma);
            assert!((0.0..=255.0).contains(&exact), "{light} at γ {gamma}: {exact}");
            let error = f64::from(encoder.unrounded(light)) - exact;
            assert!(error.abs() < CURVE_ERROR_GREY, "{light} at γ {gamma}: {error}");
            assert_eq!(f64::from(encoder.grey(light)), exact.round());
        }
        for light in [0.0, 5e-324, f64::MIN_POSITIVE, f64::MAX, f64::INFINITY] {
            assert!((0.0..=255.0).contains(&grey::unrounded(light, gamma)));
        }
        for level in -1..=256 {
            let light = grey::linear(f64::from(level), gamma);
            let back = grey::unrounded(light, gamma);
            let level = f64::from(level.clamp(0, 255));
            assert!((back - level).abs() < 1e-12, "level {level}: {back}");
        }
    }
    // The bare definition returns NaN for negative light.
    assert!((118.0 * (-1f64).powf(1.0 / 2.2)).is_nan());
}

/// The curve with `micromath`'s powers, without rounding.
fn by_micromath(light: f32) -> f64 {
    (118.0 * F32Ext::powf(light, 1.0 / 2.2)).min(255.0).into()
}

#[test]
fn the_curve_is_nowhere_off_by_a_thousandth_of_a_grey_level_and_never_falls() {
    let mut naive_worst = 0.0f64;
    for gamma in GAMMAS {
        let encoder = GammaEncoder::new(gamma);
        let mut last = 0.0;
        // From grey 0 to 255, in steps of about a thousandth of the value.
        let bits = 1e-21f32.to_bits()..1e4f32.to_bits();
        for light in bits.step_by(8191).map(f32::from_bits) {
            let exact = grey::unrounded(light.into(), gamma);
            let ours = encoder.unrounded(light);
            let error = (f64::from(ours) - exact).abs();
            assert!(error < CURVE_ERROR_GREY, "{light} at γ {gamma}: {error}");
            assert!(ours >= last - 1e-4, "{light} at γ {gamma}: {ours} after {last}");
            last = ours;
            if gamma == 2.2 {
                naive_worst = naive_worst.max((by_micromath(light) - exact).abs());
            }
        }
    }
    assert!(naive_worst > 5.0, "{naive_worst}");
}

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).into()).collect();
    Scene::load("paper", &overrides).expect("a valid scene")
}

#[test]
fn the_automatic_exposure_stays_within_its_limits_from_starlight_to_snow() {
    for illuminance in ["0.1", "1", "50", "16000", "200000"] {
        for background in ["0.01", "0.18", "1"] {
            for (iso_min, iso_max) in [("1", "1"), ("100", "32000"), ("1", "1e7"), ("1e6", "1e7")] {
                for bias in ["-8", "0", "8"] {
                    let scene = scene(&[
                        &format!("ambient.illuminance_lx={illuminance}"),
                        &format!("ambient.background_reflectance={background}"),
                        &format!("camera.iso_max={iso_max}"),
                        &format!("camera.iso_min={iso_min}"),
                        &format!("camera.exposure_bias_ev={bias}"),
                    ]);
                    let exposure = Exposure::of(&scene);
                    let camera = &scene.camera;
                    assert!((camera.iso_min..=camera.iso_max).contains(&exposure.iso));
                    assert!(exposure.time_s > 0.0 && exposure.time_s <= camera.exposure_max_s);
                    assert!(exposure.background > 0.0 && exposure.background.is_finite());
                    // Within the ISO limits, the background is at the meter's target.
                    let is_free = exposure.iso > camera.iso_min && exposure.iso < camera.iso_max;
                    let wanted = 2f64.powf(camera.exposure_bias_ev);
                    assert!(!is_free || (exposure.background / wanted - 1.0).abs() < 1e-12);
                }
            }
        }
    }
}

#[test]
fn the_ratio_is_finite_for_leds_without_light_and_without_reflection() {
    let scene = scene(&[]);
    let exposure = Exposure::of(&scene);
    let panel = &scene.panels[0];
    // L/(E·R) of a panel without reflection.
    let [luminance, reflected] = [0.0f64, 0.0];
    assert!((luminance / reflected).is_nan());
    for reflectance in [0.0, 0.01, 0.4, 1.0] {
        for l2a in [0.0, 1e-6, 4.0, 1e6] {
            let light = exposure.led_light(&scene, panel, reflectance, l2a);
            assert!(light.off.is_finite() && light.on.is_finite(), "{light:?}");
            assert!(light.on >= light.off && light.off >= 0.0, "{light:?}");
            if l2a == 0.0 {
                assert_eq!(light.on, light.off);
            }
        }
    }
}

#[test]
fn light_that_cannot_be_is_refused_with_its_value() {
    for (key, values) in [
        ("ambient.illuminance_lx", ["0", "-5", "nan", "inf"]),
        ("camera.exposure_max_s", ["0", "-0.001", "nan", "inf"]),
        ("camera.gamma", ["0", "-2.2", "nan", "inf"]),
        ("camera.iso_max", ["0", "-100", "nan", "inf"]),
        ("link.l2a", ["0", "1e6", "nan", "-inf"]),
    ] {
        for value in values {
            let error = Scene::load("paper", &[format!("{key}={value}")]).expect_err("no scene");
            let text = error.to_string();
            assert!(text.contains(key) && text.contains("must be"), "{text}");
        }
    }
    // Scenes without a file are validated too.
    for illuminance in [0.0, -5.0, f64::NAN, f64::INFINITY] {
        let mut scene = scene(&[]);
        scene.ambient.illuminance_lx = illuminance;
        assert!(Renderer::new(&scene, Level::Fast).is_err(), "{illuminance}");
    }
    for l2a in [0.0, 1e6, f64::NAN] {
        let mut scene = scene(&[]);
        scene.link.l2a = L2a::Ratio(l2a);
        assert!(Renderer::new(&scene, Level::Fast).is_err(), "{l2a}");
    }
}

#[test]
fn frames_at_the_ends_of_every_light_hold_numbers() {
    for illuminance in ["0.1", "200000"] {
        for l2a in ["0.01", "10"] {
            for iso in ["1", "1e7"] {
                let scene = scene(&[
                    &format!("ambient.illuminance_lx={illuminance}"),
                    &format!("link.l2a={l2a}"),
                    &format!("camera.iso_max={iso}"),
                    "camera.iso_min=1",
                    "effects.noise=on",
                ]);
                let renderer = Renderer::new(&scene, Level::Fine).expect("a visible scene");
                let mut canvas = Canvas::new(renderer.cells_region(0));
                let bits = PanelFrame::from_bits(0x0f0f_3355_aaff_0001);
                let moment = renderer.moment(1, 0);
                renderer.draw(&moment, &[renderer.steady(0, bits)], &mut canvas);
                let values = canvas.values();
                assert!(values.iter().all(|&light: &f32| light.is_finite() && light >= 0.0));
                let mut grey = vec![0; values.len()];
                renderer.read_out(1, 0, &canvas, &mut grey);
            }
        }
    }
}
