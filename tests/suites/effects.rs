//! Effects keep their declared bounds over random scenes, each forced on and off.

use link::panel::PanelFrame;
use properties::prelude::prop::sample::select;
use properties::prelude::*;
use rand::{Rng, SeedableRng};
use sim::accuracy::Level;
use sim::effects;
use sim::plan::Plan;
use sim::renderer::canvas::{Canvas, Region};
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::{Encoding, Pose, Scene};
use vocc_tests::cases;

/// Random scenes that activate every effect but the photograph; [`scene`] adds two more panels.
fn scenes() -> impl Strategy<Value = Vec<String>> {
    let geometry = (20.0..70.0f64, 0.4..2.0f64, -15.0..15.0f64, -30.0..30.0f64, -0.2..0.2f64);
    let light = (0.3..0.5f64, 0.2..4.0f64, 0.3..2.5f64, 30.0..20_000.0f64, 0.3..1.0f64);
    let time = (0.0..1.0f64, -500.0..500.0f64, 1e3..1e5f64, 0u32..5, 0.0..0.009f64, -20.0..20.0f64);
    let extras = (0.0..0.05f64, -0.2..0.2f64, 0.02..0.5f64, any::<bool>());
    let camera = (select(&Encoding::NAMES), 0.0..40.0f64, 0.0..3.0f64, 0.0..10.0f64, 0.0..2000.0f64);
    let leds = (0u8..4, 0u8..4, 0u8..8, 0.0..1.0f64, any::<u32>());
    let shake = (-4.0..-1.0f64, -4.0..-0.5f64, 0.1..5.0f64, 1.0..6.0f64);
    let lamp = (-4.0..-0.5f64, -40.0..40.0f64, -30.0..30.0f64);
    (geometry, light, time, extras, camera, leds, shake, lamp).prop_map(|(geometry, light, time, extras, camera, leds, shake, lamp)| {
        let (distance, interval, roll, yaw, x) = geometry;
        let (reflectance, l2a, sigma, illuminance, transmission) = light;
        let (phase, ppm, pwm_hz, scan_rows, readout, speed) = time;
        let (spread, k1, board, airlight) = extras;
        let (encoding, black, prnu, dsnu, hot) = camera;
        let (dead, stuck, row, row_light, seed) = leds;
        let (angle, shaken_roll, lowest, times) = shake;
        let (lamp, lamp_x, lamp_y) = lamp;
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
            format!("link.carrier_cycles={}", 2 + seed % 29),
            format!("camera.blur_sigma_px={sigma}"),
            format!("camera.readout_s={readout}"),
            format!("camera.distortion_k1={k1}"),
            "camera.vignetting=true".into(),
            format!("ambient.illuminance_lx={illuminance}"),
            format!("atmosphere.transmission_at_70m={transmission}"),
            format!("atmosphere.airlight={airlight}"),
            format!("camera.encoding={encoding}"),
            format!("camera.black_grey={black}"),
            "camera.mosaic=true".into(),
            format!("panel.colour=[1, {row_light}, 0.05]"),
            format!("camera.prnu_percent={prnu}"),
            format!("camera.dsnu_e={dsnu}"),
            format!("camera.hot_pixels_ppm={hot}"),
            format!("camera.seed={seed}"),
            format!("panel.dead_leds={dead}"),
            format!("panel.stuck_leds={stuck}"),
            format!("panel.dim_row={row}"),
            format!("panel.dim_row_light={row_light}"),
            format!("panel.seed={seed}"),
            format!("camera.shake_deg={}", 10f64.powf(angle)),
            format!("camera.shake_roll_deg={}", 10f64.powf(shaken_roll)),
            format!("camera.shake_lowest_hz={lowest}"),
            format!("camera.shake_highest_hz={}", lowest * times),
            format!("ambient.lamp_lx={}", illuminance * 10f64.powf(lamp)),
            format!("ambient.lamp_x_deg={lamp_x}"),
            format!("ambient.lamp_y_deg={lamp_y}"),
        ]
    })
}

/// The unrounded grey levels of a region in frame `frame`, with random bits.
fn draw(scene: &Scene, region: Region, frame: u64) -> Vec<f64> {
    let renderer = Renderer::new(scene, Level::Reference).expect("a visible scene");
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(frame);
    let shown = (0..scene.panels.len()).map(|index| PanelExposure {
        symbols: std::array::from_fn(|_| PanelFrame::from_bits(random.next_u64())),
        ..renderer.steady(index, PanelFrame::default())
    });
    let shown: Vec<PanelExposure> = shown.collect();
    let mut canvas = Canvas::<f64>::new(region);
    renderer.draw_exact(&renderer.moment(1, frame), &shown, &mut canvas);
    canvas.values().iter().map(|&linear| renderer.curve().unrounded(linear)).collect()
}

/// The unrounded grey levels of a region with a still panel, at the renderer's own level.
fn draw_still(renderer: &Renderer, region: Region, panel: PanelFrame) -> Vec<f64> {
    let mut canvas = Canvas::<f32>::new(region);
    renderer.draw(&renderer.moment(1, 0), &[renderer.steady(0, panel)], &mut canvas);
    let greys = canvas.values().iter().map(|&linear| renderer.curve().unrounded(linear.into()));
    greys.collect()
}

/// The bound that a renderer has planned with for an effect.
fn bound_grey(renderer: &Renderer, effect: &str) -> f64 {
    let decision = renderer.plan().decisions.iter().find(|decision| decision.effect == effect);
    decision.expect("a decision on each").bound_grey
}

fn greatest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The scene with the given effect modes.
fn scene(settings: &[String], modes: impl IntoIterator<Item = (&'static str, &'static str)>) -> Scene {
    let modes = modes.into_iter().map(|(name, mode)| format!("effects.{name}={mode}"));
    let settings: Vec<String> = settings.iter().cloned().chain(modes).collect();
    let mut scene = Scene::load("paper", &settings).expect("a valid scene");
    // Another vehicle, above the first in the image without overlap.
    let above = Pose {
        distance_m: 70.0,
        x_m: scene.pose.x_m * 70.0 / scene.pose.distance_m,
        y_m: -2.2,
        ..Pose::default()
    };
    // A third vehicle behind the first, partly hidden and driving the other way.
    let [x, _, z] = scene.pose.velocity_m_s;
    let behind = Pose {
        distance_m: 80.0,
        x_m: scene.pose.x_m * 80.0 / scene.pose.distance_m + 0.3,
        y_m: 0.1,
        velocity_m_s: [-x, 0.0, z],
        ..Pose::default()
    };
    scene.panels.extend([above, behind].map(|pose| sim::scene::Panel {
        pose: Some(pose),
        board_reflectance: scene.panels[0].board_reflectance,
        ..Default::default()
    }));
    scene
}

/// The effects on the mean image: all except noise, whose bound is a quantile with its own test.
fn deterministic() -> Vec<&'static str> {
    effects::names().into_iter().filter(|&name| name != "noise").collect()
}

properties! {
    #![cases(cases(2, 96))]

    #[test]
    fn leaving_one_effect_out_changes_no_more_than_its_bound(settings in scenes(), others in any::<bool>(), frame in 0u64..50) {
        let (rest, opposite) = if others { ("on", "off") } else { ("off", "on") };
        let all_alike = scene(&settings, deterministic().into_iter().map(|name| (name, rest)));
        // One of each effect's two images is common to all effects, and drawn once.
        let mut drawn: Option<(Region, Vec<f64>)> = None;
        for name in deterministic() {
            let one_apart = scene(&settings, deterministic().into_iter().map(|other| (other, if other == name { opposite } else { rest })));
            let with = if others { &all_alike } else { &one_apart };
            let renderer = Renderer::new(with, Level::Reference).expect("a visible scene");
            let bound = bound_grey(&renderer, name);
            let region = renderer.surroundings(0);
            let image = match drawn.take_if(|(of, _)| *of == region) {
                Some((_, image)) => image,
                None => draw(&all_alike, region, frame),
            };
            let difference = greatest_difference(&image, &draw(&one_apart, region, frame));
            drawn = Some((region, image));
            prop_assert!(difference <= bound + 1e-9, "{name} with the others {rest}: {difference} > {bound}");
        }
    }

    #[test]
    fn the_blur_s_shape_changes_no_more_than_its_bound(
        psf in prop_oneof![Just("gauss"), Just("disc")],
        aspect in 0.5..2.0f64,
        sigma in 0.4..3.0f64,
        distance in 25.0..60.0f64,
        yaw in -30.0..30.0f64,
        board in 0.02..0.9f64,
    ) {
        let greys = |mode: &str| {
            let settings = [
                format!("camera.psf={psf}"),
                format!("camera.blur_aspect={aspect}"),
                format!("camera.blur_sigma_px={sigma}"),
                format!("pose.distance_m={distance}"),
                format!("pose.yaw_deg={yaw}"),
                format!("panel.board_reflectance={board}"),
                format!("effects.point_spread={mode}"),
            ];
            let scene = Scene::load("paper", &settings).expect("a valid scene");
            let renderer = Renderer::new(&scene, Level::Fine).expect("a visible scene");
            let bound = bound_grey(&renderer, "point_spread");
            let sensor = Region { x: 860, y: 440, width: 200, height: 200 };
            (draw_still(&renderer, sensor, PanelFrame::from_bits(0x0f0f_3333_5555_8001)), bound)
        };
        let ((with, bound), (without, _)) = (greys("on"), greys("off"));
        let difference = greatest_difference(&with, &without);
        // Both include the error of `fine`.
        prop_assert!(difference <= bound + 0.02, "{difference} > {bound}");
    }

    #[test]
    fn under_auto_the_image_is_within_the_sum_of_the_bounds_left_out(settings in scenes(), frame in 0u64..50, tolerance in 0.0..40.0f64) {
        let all = scene(&settings, deterministic().into_iter().map(|name| (name, "on")));
        let mut auto = scene(&settings, []);
        auto.effects.tolerance_grey = tolerance;
        let renderer = Renderer::new(&all, Level::Reference).expect("a visible scene");
        let planned = Renderer::new(&auto, Level::Reference).expect("a visible scene");
        let left_out: f64 = planned.plan().decisions.iter().filter(|d| !d.included && d.effect != "noise").map(|d| d.bound_grey).sum();
        let difference = greatest_difference(&draw(&all, renderer.surroundings(0), frame), &draw(&auto, renderer.surroundings(0), frame));
        prop_assert!(difference <= left_out + 1e-9, "{difference} > {left_out}");
    }
}

#[test]
fn an_effect_at_its_neutral_value_changes_no_byte() {
    let neutral = ["atmosphere.transmission_at_70m=1".to_string()];
    // Other panels have no neutral value.
    let alone = |modes: Vec<(&'static str, &'static str)>| {
        let mut scene = scene(&neutral, modes);
        scene.panels.truncate(1);
        scene
    };
    let but_blur = deterministic().into_iter().filter(|&name| name != "blur");
    let without = alone(but_blur.map(|name| (name, "off")).collect());
    let renderer = Renderer::new(&without, Level::Reference).expect("a visible scene");
    let plain = draw(&without, renderer.surroundings(0), 3);
    for name in deterministic() {
        let with = alone(vec![(name, "on")]);
        assert_eq!(draw(&with, renderer.surroundings(0), 3), plain, "{name}");
    }
}

#[test]
fn flare_keeps_its_bound_on_the_whole_sensor() {
    // The field of view ends at 14.8° and at 8.4°.
    for [x, y, lx] in [
        ["3", "2", "1"],
        ["3", "2", "0.0001"],
        ["14", "-8", "30"],
        ["16", "0", "300"],
        ["20", "5", "3000"],
        ["40", "0", "3000"],
    ] {
        let scene = |mode: &str| {
            let settings = [
                format!("ambient.lamp_x_deg={x}"),
                format!("ambient.lamp_y_deg={y}"),
                format!("ambient.lamp_lx={lx}"),
                format!("effects.flare={mode}"),
            ];
            Scene::load("day", &settings).expect("a valid scene")
        };
        let [with, without] = ["on", "off"].map(|mode| Renderer::new(&scene(mode), Level::Fine).expect("a visible scene"));
        let bound = bound_grey(&with, "flare");
        let [with, without] = [with, without].map(|renderer| draw_still(&renderer, renderer.sensor(), PanelFrame::default()));
        let most = greatest_difference(&with, &without);
        // Off LEDs are darker than the background, where the bound is that of a panel in the brightest place.
        assert!(most <= bound + 1e-3 && most > bound / 3.0, "{x}°, {y}°, {lx} lx: {most} of {bound}");
    }
}

#[test]
fn clear_air_is_called_for_at_70_m_and_not_at_30() {
    for (distance, called_for) in [(30, false), (70, true)] {
        let scene = Scene::load("paper", &[format!("pose.distance_m={distance}")]).expect("a valid scene");
        let plan = Plan::of(&sim::view::View::new(&scene).expect("a visible scene"));
        assert_eq!(plan.includes("atmosphere"), called_for, "{distance} m");
    }
}

/// Noisy grey levels of the panel's surroundings: from a part, and as the part of a whole frame.
fn read_out(scene: &Scene, region: Region) -> [Vec<u8>; 2] {
    let renderer = Renderer::new(scene, Level::Fast).expect("a visible scene");
    let shown = [renderer.steady(0, PanelFrame::from_bits(0x0f0f_3333_5555_8001))];
    let moment = renderer.moment(1, 3);
    let mut canvas = Canvas::new(region);
    renderer.draw(&moment, &shown, &mut canvas);
    let mut part = vec![0; region.width * region.height];
    renderer.read_out(7, 3, &canvas, &mut part);
    let sensor = renderer.sensor();
    let mut canvas = Canvas::new(renderer.lit_region());
    let mut frame = vec![0; sensor.width * sensor.height];
    renderer.frame(7, &moment, &shown, &mut canvas, &mut frame);
    let rows = frame.chunks(sensor.width).skip(region.y).take(region.height);
    let cut = rows.flat_map(|row| row[region.x..region.x + region.width].to_vec());
    [part, cut.collect()]
}

#[test]
fn what_is_done_to_encoded_levels_keeps_its_bound() {
    for (key, values, name) in [
        ("camera.sharpening", ["0.1", "0.7", "4"], "sharpening"),
        ("camera.jpeg_quality", ["20", "75", "98"], "codec"),
    ] {
        for value in values {
            let scene = |mode: &str| {
                let settings = [format!("{key}={value}"), format!("effects.{name}={mode}")];
                Scene::load("night", &settings).expect("a valid scene")
            };
            let renderer = Renderer::new(&scene("on"), Level::Fast).expect("a visible scene");
            let decision = renderer.plan().decisions.iter().find(|d| d.effect == name);
            let bound = decision.expect("a decision on each").bound_grey;
            let region = renderer.surroundings(0);
            let [with, without] = ["on", "off"].map(|mode| read_out(&scene(mode), region));
            let apart = with[0].iter().zip(&without[0]).map(|(a, b)| a.abs_diff(*b));
            let most = f64::from(apart.max().expect("pixels"));
            assert!(most > 0.0 && most <= bound + 0.5, "{key}={value}: {most} > {bound}");
        }
    }
}

#[test]
fn a_panel_s_surroundings_are_processed_as_in_the_whole_frame() {
    for settings in [
        &["camera.sharpening=1"][..],
        &["camera.jpeg_quality=60"],
        &["camera.sharpening=1", "camera.jpeg_quality=60", "camera.sharpening_radius_px=2"],
    ] {
        let quiet = ["effects.noise=off", "pose.x_m=0.7"];
        let settings = settings.iter().chain(&quiet).map(|set| set.to_string());
        let settings: Vec<String> = settings.collect();
        let scene = Scene::load("day", &settings).expect("a valid scene");
        let renderer = Renderer::new(&scene, Level::Fast).expect("a visible scene");
        let [part, whole] = read_out(&scene, renderer.surroundings(0));
        assert_eq!(part, whole, "{settings:?}");
    }
}

#[test]
fn a_camera_s_effects_are_left_out_below_the_tolerance() {
    for (name, little, much) in [
        ("encoding", "camera.black_grey=0", "camera.encoding=rec709"),
        ("point_spread", "camera.blur_aspect=1.0001", "camera.psf=disc"),
        ("fixed_pattern", "camera.prnu_percent=0.001", "camera.prnu_percent=1"),
        ("hot_pixels", "camera.hot_pixels_ppm=0", "camera.hot_pixels_ppm=1"),
        ("sharpening", "camera.sharpening=0.001", "camera.sharpening=0.3"),
        ("codec", "camera.gamma=2.2", "camera.jpeg_quality=90"),
        ("broken_leds", "panel.dim_row_light=0.1", "panel.stuck_leds=1"),
        ("carrier", "link.carrier_cycles=0", "link.carrier_cycles=16"),
        ("shake", "camera.shake_deg=0.000001", "camera.shake_roll_deg=0.1"),
        ("flare", "ambient.lamp_lx=0.00001", "ambient.lamp_lx=1"),
    ] {
        for (setting, called_for) in [(little, false), (much, true)] {
            let scene = Scene::load("day", &[setting.to_string()]).expect("a valid scene");
            let plan = Plan::of(&sim::view::View::new(&scene).expect("a visible scene"));
            assert_eq!(plan.includes(name), called_for, "{name} under {setting}");
        }
    }
}

#[test]
fn pixels_that_read_too_little_break_no_bound() {
    // So few electrons that pixels with low response read 0 in dim light.
    let settings = [
        "ambient.illuminance_lx=50",
        "camera.dsnu_e=5",
        "camera.prnu_percent=3",
        "camera.vignetting=true",
        "atmosphere.transmission_at_70m=0.999",
        "atmosphere.airlight=true",
        "panel.board_reflectance=0.17",
        "pose.x_m=5",
    ]
    .map(String::from);
    let alone = |modes: [(&'static str, &'static str); 1]| {
        let mut scene = scene(&settings, modes);
        scene.panels.truncate(1);
        scene
    };
    for name in ["vignetting", "atmosphere", "airlight", "board", "fixed_pattern"] {
        let (with, without) = (alone([(name, "on")]), alone([(name, "off")]));
        let renderer = Renderer::new(&with, Level::Reference).expect("a visible scene");
        let decisions = &renderer.plan().decisions;
        let decision = decisions.iter().find(|decision| decision.effect == name);
        let bound = decision.expect("a decision on each").bound_grey;
        let region = renderer.surroundings(0);
        let difference = greatest_difference(&draw(&with, region, 3), &draw(&without, region, 3));
        assert!(difference <= bound + 1e-9, "{name}: {difference} > {bound}");
    }
}

#[test]
fn a_red_lamp_is_seen_by_red_pixels() {
    let settings = [
        "camera.mosaic=true",
        "panel.colour=[1, 0.15, 0]",
        "pose.distance_m=5",
        "effects.noise=off",
    ];
    let scene = Scene::load("day", &settings.map(String::from)).expect("a valid scene");
    let renderer = Renderer::new(&scene, Level::Fine).expect("a visible scene");
    let values = |bits: u64| {
        let shown = [renderer.steady(0, PanelFrame::from_bits(bits))];
        let mut canvas = Canvas::<f32>::new(renderer.sensor());
        renderer.draw(&renderer.moment(1, 0), &shown, &mut canvas);
        canvas.values().to_vec()
    };
    let (on, off) = (values(u64::MAX), values(0));
    let [x, y] = renderer.corner_leds_px(0)[0].map(|place| place.round() as usize / 2 * 2);
    let width = renderer.sensor().width;
    let gain = |x: usize, y: usize| on[y * width + x] - off[y * width + x];
    let (red, greens, blue) = (gain(x, y), [gain(x + 1, y), gain(x, y + 1)], gain(x + 1, y + 1));
    assert!(red > 1.0 && blue == 0.0, "{red} {blue}");
    for green in greens {
        assert!((green / red - 0.15).abs() < 0.01, "{green} of {red}");
    }
}
