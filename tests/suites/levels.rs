//! The levels `fine` and `fast` stay within their declared error of the reference, over random scenes.

use link::panel::PanelFrame;
use properties::prelude::prop::sample::select;
use properties::prelude::*;
use sim::accuracy::Level;
use sim::renderer::canvas::Canvas;
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::{Encoding, Scene};
use vocc_tests::cases;

/// Blurs from zero to far wider than an LED; chords are least accurate for sharp ones.
fn blurs() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.001..0.05f64, 0.05..0.5f64, 0.5..5.0f64]
}

/// Panels from a few pixels to the sensor's height, upright or rotated, with or without a board.
fn scenes() -> impl Strategy<Value = Vec<String>> {
    let geometry = (
        5.0..100.0f64,
        0.5..3.0f64,
        // LED diameter relative to the paper's, as large as the panel fits the sensor.
        0.2..2.0f64,
        prop_oneof![
            Just([0.0; 3]),
            (-180.0..180.0f64).prop_map(|roll| [roll, 0.0, 0.0]),
            (-180.0..180.0f64, -60.0..60.0f64, -60.0..60.0f64).prop_map(|(roll, yaw, pitch)| [roll, yaw, pitch])
        ],
    );
    let light = (0.05..1.0f64, -2.0..1.0f64, 0.05..0.5f64, 1.0..3.0f64);
    let board = prop::option::of(0.02..0.9f64);
    let camera = (select(&Encoding::NAMES), prop_oneof![Just(0.0), 0.0..64.0f64]);
    (geometry, light, blurs(), board, camera).prop_map(|(geometry, light, sigma_px, board, camera)| {
        let (distance_m, interval, size, [roll, yaw, pitch]) = geometry;
        let (reflectance, l2a_exponent, background, gamma) = light;
        let largest_m = 0.9 * 7.4e-3 / 25e-3 * distance_m / (8.0 * (1.0 + interval)) / 1.5;
        let mut settings = vec![
            "effects.blur=on".into(),
            "effects.perspective=on".into(),
            format!("pose.distance_m={distance_m}"),
            format!("pose.roll_deg={roll}"),
            format!("pose.yaw_deg={yaw}"),
            format!("pose.pitch_deg={pitch}"),
            format!("panel.interval={interval}"),
            format!("panel.led_diameter_m={}", (0.03 * size).min(largest_m)),
            format!("panel.reflectance={reflectance}"),
            format!("link.l2a={}", 10f64.powf(l2a_exponent)),
            format!("camera.blur_sigma_px={sigma_px}"),
            format!("camera.gamma={gamma}"),
            format!("ambient.background_reflectance={background}"),
            format!("camera.encoding={}", camera.0),
            format!("camera.black_grey={}", camera.1),
        ];
        settings.extend(board.map(|reflectance| format!("panel.board_reflectance={reflectance}")));
        settings
    })
}

/// The first panel's exposure, shifted by a fraction of a pixel.
fn shown(renderer: &Renderer, bits: u64, shift_px: [f64; 2]) -> PanelExposure {
    PanelExposure {
        shift_px,
        ..renderer.steady(0, PanelFrame::from_bits(bits))
    }
}

properties! {
    #![cases(cases(20, 200))]

    #[test]
    fn a_level_is_within_its_bound_of_the_reference(
        settings in scenes(),
        bits in any::<u64>(),
        shift_px in [0.0..1.0f64, 0.0..1.0f64],
    ) {
        keeps_its_bound(settings, bits, shift_px)?;
    }
}

properties! {
    #![cases(cases(6, 60))]

    #[test]
    fn a_level_is_within_its_bound_under_a_blur_of_any_shape(
        settings in scenes(),
        (psf, aspect) in (prop_oneof![Just("gauss"), Just("disc")], 0.5..2.0f64),
        sigma_px in 0.4..4.0f64,
        // Shorter distances take minutes at the reference level.
        distance_m in 25.0..100.0f64,
        bits in any::<u64>(),
        shift_px in [0.0..1.0f64, 0.0..1.0f64],
    ) {
        let blur = [
            format!("camera.psf={psf}"),
            format!("camera.blur_aspect={aspect}"),
            format!("camera.blur_sigma_px={sigma_px}"),
            format!("pose.distance_m={distance_m}"),
            "panel.led_diameter_m=0.03".into(),
            "effects.point_spread=on".into(),
        ];
        keeps_its_bound(settings.into_iter().chain(blur).collect(), bits, shift_px)?;
    }
}

fn keeps_its_bound(settings: Vec<String>, bits: u64, shift_px: [f64; 2]) -> Result<(), TestCaseError> {
    let scene = Scene::load("paper", &settings).expect("a valid scene");
    // Panels that are too small or outside the sensor are rejected.
    let Ok(reference) = Renderer::new(&scene, Level::Reference) else {
        return Err(TestCaseError::reject("not visible"));
    };
    let region = reference.surroundings(0);
    let mut exact = Canvas::<f64>::new(region);
    let moment = reference.moment(1, 0);
    reference.draw_exact(&moment, &[shown(&reference, bits, shift_px)], &mut exact);
    for level in [Level::Fine, Level::Fast] {
        let renderer = Renderer::new(&scene, level).expect("a visible scene");
        let mut canvas = Canvas::<f32>::new(region);
        renderer.draw(&moment, &[shown(&renderer, bits, shift_px)], &mut canvas);
        let grey = |linear: f64| reference.curve().unrounded(linear);
        let pairs = canvas.values().iter().zip(exact.values());
        let worst = pairs
            .map(|(&ours, &exact)| (grey(ours.into()) - grey(exact)).abs())
            .fold(0.0, f64::max);
        let bound = level.error_bound_grey();
        prop_assert!(worst <= bound, "{level:?}: {worst} grey levels, at most {bound} allowed");
    }
    Ok(())
}
