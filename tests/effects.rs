//! Effects keep the bounds that they state: over random scenes, each forced on and off.

use link::panel::PanelFrame;
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use sim::accuracy::Level;
use sim::effects;
use sim::plan::Plan;
use sim::renderer::canvas::Canvas;
use sim::renderer::{Renderer, Shown};
use sim::scene::{Pose, Scene};
use vocc_tests::cases;

/// Random scenes in which every effect but the photograph has something to do; [`scene`] adds two more panels.
fn scenes() -> impl Strategy<Value = Vec<String>> {
    let geometry = (
        20.0..70.0f64,
        0.4..2.0f64,
        -15.0..15.0f64,
        -30.0..30.0f64,
        -0.2..0.2f64,
    );
    let light = (
        0.3..0.5f64,
        0.2..4.0f64,
        0.3..2.5f64,
        30.0..20_000.0f64,
        0.3..1.0f64,
    );
    let time = (
        0.0..1.0f64,
        -500.0..500.0f64,
        1e3..1e5f64,
        0u32..5,
        0.0..0.009f64,
        -20.0..20.0f64,
    );
    let extras = (0.0..0.05f64, -0.2..0.2f64, 0.02..0.5f64, any::<bool>());
    (geometry, light, time, extras).prop_map(|(geometry, light, time, extras)| {
        let (distance, interval, roll, yaw, x) = geometry;
        let (reflectance, l2a, sigma, illuminance, transmission) = light;
        let (phase, ppm, pwm_hz, scan_rows, readout, speed) = time;
        let (spread, k1, board, airlight) = extras;
        vec![
            format!("pose.distance_m={distance}"),
            format!("panel.interval={interval}"),
            format!("pose.roll_deg={roll}"),
            format!("pose.yaw_deg={yaw}"),
            format!("pose.x_m={}", x * distance),
            format!("pose.velocity_m_s=[{speed}, 0, {speed}]"),
            format!("panel.reflectance={reflectance}"),
            format!("panel.led_spread={spread}"),
            format!("panel.pwm_hz={pwm_hz}"),
            format!("panel.scan_rows={scan_rows}"),
            format!("panel.board_reflectance={board}"),
            format!("link.l2a={l2a}"),
            format!("link.phase={phase}"),
            format!("link.clock_ppm={ppm}"),
            format!("camera.blur_sigma_px={sigma}"),
            format!("camera.readout_s={readout}"),
            format!("camera.distortion_k1={k1}"),
            "camera.vignetting=true".into(),
            format!("ambient.illuminance_lx={illuminance}"),
            format!("atmosphere.transmission_at_70m={transmission}"),
            format!("atmosphere.airlight={airlight}"),
        ]
    })
}

/// The unrounded grey of the panel's surroundings in frame `frame`, with random bits.
fn draw(scene: &Scene, region_of: &Renderer, frame: u64) -> Vec<f64> {
    let renderer = Renderer::new(scene, Level::Reference).expect("a visible scene");
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(frame);
    let shown = (0..scene.panels.len()).map(|index| Shown {
        symbols: std::array::from_fn(|_| PanelFrame::from_bits(random.next_u64())),
        ..renderer.steady(index, PanelFrame::default())
    });
    let shown: Vec<Shown> = shown.collect();
    let mut canvas = Canvas::<f64>::new(region_of.surroundings(0));
    renderer.draw_exact(&renderer.moment(frame), &shown, &mut canvas);
    canvas
        .values()
        .iter()
        .map(|&linear| renderer.curve().unrounded(linear))
        .collect()
}

fn greatest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// The scene with the effects of `modes` set.
fn scene(
    settings: &[String],
    modes: impl IntoIterator<Item = (&'static str, &'static str)>,
) -> Scene {
    let modes = modes
        .into_iter()
        .map(|(name, mode)| format!("effects.{name}={mode}"));
    let settings: Vec<String> = settings.iter().cloned().chain(modes).collect();
    let mut scene = Scene::load("paper", &settings).expect("a valid scene");
    // Another vehicle, above the first in the picture and clear of it.
    let above = Pose {
        distance_m: 70.0,
        x_m: scene.pose.x_m * 70.0 / scene.pose.distance_m,
        y_m: -2.2,
        ..Pose::default()
    };
    // And one behind the first, partly hidden by it and going the other way.
    let [x, _, z] = scene.pose.velocity_m_s;
    let behind = Pose {
        distance_m: 80.0,
        x_m: scene.pose.x_m * 80.0 / scene.pose.distance_m + 0.3,
        y_m: 0.1,
        velocity_m_s: [-x, 0.0, z],
        ..Pose::default()
    };
    scene
        .panels
        .extend([above, behind].map(|pose| sim::scene::Panel {
            pose: Some(pose),
            board_reflectance: scene.panels[0].board_reflectance,
            ..Default::default()
        }));
    scene
}

/// The effects that change the mean image: all but the noise, whose bound is a quantile and is tested by itself.
fn deterministic() -> Vec<&'static str> {
    effects::names()
        .into_iter()
        .filter(|&name| name != "noise")
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(8, 96), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn leaving_one_effect_out_changes_no_more_than_its_bound(settings in scenes(), others in any::<bool>(), frame in 0u64..50) {
        let rest = if others { "on" } else { "off" };
        for name in deterministic() {
            let modes = |mode| deterministic().into_iter().map(move |other| (other, if other == name { mode } else { rest }));
            let with = scene(&settings, modes("on"));
            let renderer = Renderer::new(&with, Level::Reference).expect("a visible scene");
            let bound = renderer.plan().decisions.iter().find(|d| d.effect == name).expect("a decision on each").bound_grey;
            let difference = greatest_difference(&draw(&with, &renderer, frame), &draw(&scene(&settings, modes("off")), &renderer, frame));
            prop_assert!(difference <= bound + 1e-9, "{name} with the others {rest}: {difference} > {bound}");
        }
    }

    #[test]
    fn under_auto_the_image_is_within_the_sum_of_the_bounds_left_out(settings in scenes(), frame in 0u64..50, tolerance in 0.0..40.0f64) {
        let all = scene(&settings, deterministic().into_iter().map(|name| (name, "on")));
        let mut auto = scene(&settings, []);
        auto.effects.tolerance_grey = tolerance;
        let renderer = Renderer::new(&all, Level::Reference).expect("a visible scene");
        let planned = Renderer::new(&auto, Level::Reference).expect("a visible scene");
        let left_out: f64 = planned.plan().decisions.iter().filter(|d| !d.included && d.effect != "noise").map(|d| d.bound_grey).sum();
        let difference = greatest_difference(&draw(&all, &renderer, frame), &draw(&auto, &renderer, frame));
        prop_assert!(difference <= left_out + 1e-9, "{difference} > {left_out}");
    }
}

#[test]
fn an_effect_at_its_neutral_value_changes_no_byte() {
    let neutral = ["atmosphere.transmission_at_70m=1".to_string()];
    // Other panels are no neutral value.
    let alone = |modes: Vec<(&'static str, &'static str)>| {
        let mut scene = scene(&neutral, modes);
        scene.panels.truncate(1);
        scene
    };
    let but_blur = deterministic().into_iter().filter(|&name| name != "blur");
    let without = alone(but_blur.map(|name| (name, "off")).collect());
    let renderer = Renderer::new(&without, Level::Reference).expect("a visible scene");
    let plain = draw(&without, &renderer, 3);
    for name in deterministic() {
        let with = alone(vec![(name, "on")]);
        assert_eq!(draw(&with, &renderer, 3), plain, "{name}");
    }
}

#[test]
fn clear_air_is_called_for_at_70_m_and_not_at_30() {
    for (distance, called_for) in [(30, false), (70, true)] {
        let scene =
            Scene::load("paper", &[format!("pose.distance_m={distance}")]).expect("a valid scene");
        let plan = Plan::of(&sim::view::View::new(&scene).expect("a visible scene"));
        assert_eq!(plan.includes("atmosphere"), called_for, "{distance} m");
    }
}
