//! Panels are opaque, and move as a whole.

use link::panel::PanelFrame;
use sim::accuracy::Level;
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;

use sim::scene::{Panel, Pose, Scene};

const ALL_ON: u64 = u64::MAX;

fn paper(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|set| set.to_string()).collect();
    Scene::load("paper", &overrides).expect("a valid scene")
}

/// The linear image around the first panel, each panel showing its bits.
fn draw(scene: &Scene, region_of: &Renderer, bits: &[u64]) -> Canvas<f64> {
    let renderer = Renderer::new(scene, Level::Reference).expect("a visible scene");
    let mut canvas = Canvas::new(region_of.surroundings(0));
    let shown: Vec<_> = bits
        .iter()
        .enumerate()
        .map(|(index, &bits)| renderer.steady(index, PanelFrame::from_bits(bits)))
        .collect();
    renderer.draw_exact(&renderer.moment(1, 0), &shown, &mut canvas);
    canvas
}

/// A panel of large LEDs at 30 m before one at 70 m.
fn one_behind_the_other(settings: &[&str]) -> Scene {
    let near = ["pose.distance_m=30", "panel.led_diameter_m=0.1", "panel.interval=0.5"];
    let mut scene = paper(&[&near[..], settings].concat());
    scene.panels.push(Panel {
        pose: Some(Pose {
            distance_m: 70.0,
            ..Pose::default()
        }),
        ..Panel::default()
    });
    scene
}

fn greatest(a: &Canvas<f64>, b: &Canvas<f64>) -> f64 {
    let pairs = a.values().iter().zip(b.values());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_board_hides_what_is_behind_it() {
    let scene = one_behind_the_other(&["panel.board_reflectance=0.05"]);
    let renderer = Renderer::new(&scene, Level::Reference).expect("a visible scene");
    let [dark, lit] = [0, ALL_ON].map(|far| draw(&scene, &renderer, &[0x1248_1248_1248_1248, far]));
    assert!(greatest(&dark, &lit) < 1e-9, "{}", greatest(&dark, &lit));
}

#[test]
fn a_dark_led_hides_a_bright_one() {
    let scene = one_behind_the_other(&[]);
    let renderer = Renderer::new(&scene, Level::Reference).expect("a visible scene");
    let [dark, lit] = [0, ALL_ON].map(|far| draw(&scene, &renderer, &[0, far]));
    // The far panel's LEDs show between the near ones ...
    assert!(greatest(&dark, &lit) > 0.5, "{}", greatest(&dark, &lit));
    // ... but not in the middle of one, 4 standard deviations of the blur away from its rim.
    let region = dark.region();
    let [x, y] = near_led(&renderer);
    let pixel = (y - region.y) * region.width + x - region.x;
    let change = lit.values()[pixel] - dark.values()[pixel];
    assert!(change.abs() < 2e-3, "{change}");
}

/// The pixel at the centre of an LED in the middle of the first panel.
fn near_led(renderer: &Renderer) -> [usize; 2] {
    let [[left, top], _, [right, bottom], _] = renderer.corner_leds_px(0);
    let at = |from: f64, to: f64| from + (to - from) * 3.0 / 7.0;
    [at(left, right), at(top, bottom)].map(|place| place.round() as usize)
}

/// A row of panels at 50 m with this distance in pixels, every other one with a board.
fn row_of(panels: usize, apart_px: f64) -> Scene {
    let mut scene = paper(&["camera.width_px=640", "camera.height_px=480"]);
    let focal_px = scene.camera.focal_px();
    let middle = (panels - 1) as f64 / 2.0;
    scene.panels = (0..panels)
        .map(|index| Panel {
            board_reflectance: (index % 2 == 1).then_some(0.5),
            pose: Some(Pose {
                distance_m: 50.0 + 0.1 * index as f64,
                x_m: (index as f64 - middle) * apart_px * 50.0 / focal_px,
                ..Pose::default()
            }),
            ..Panel::default()
        })
        .collect();
    scene
}

#[test]
fn a_part_of_the_sensor_is_drawn_as_in_the_whole() {
    for apart_px in [20.0, 50.0] {
        let scene = row_of(7, apart_px);
        for level in [Level::Fast, Level::Fine] {
            let renderer = Renderer::new(&scene, level).expect("a visible scene");
            let shown: Vec<_> = (0..7)
                .map(|index| renderer.steady(index, PanelFrame::from_bits(0x0123_4567_89ab_cdef << index)))
                .collect();
            let drawn = |region| {
                let mut canvas = Canvas::new(region);
                renderer.draw(&renderer.moment(1, 0), &shown, &mut canvas);
                canvas
            };
            let (whole, part) = (drawn(renderer.sensor()), renderer.surroundings(3));
            let rows = whole.values().chunks_exact(whole.region().width);
            let same: Vec<f32> = rows
                .skip(part.y)
                .take(part.height)
                .flat_map(|row| row[part.x..part.x + part.width].to_vec())
                .collect();
            assert!(same == drawn(part).values(), "{apart_px} px apart, {level:?}");
        }
    }
}

#[test]
fn as_many_lie_one_behind_the_other_as_meet_and_not_all_there_are() {
    let layers = |apart_px| {
        let renderer = Renderer::new(&row_of(6, apart_px), Level::Fast).expect("a visible scene");
        renderer.view().layers
    };
    // A panel's LEDs span 31 px, with 40 px on either side of them.
    assert_eq!([114.0, 80.0, 20.0].map(layers), [1, 3, 6]);
}

#[test]
fn no_pixel_is_brighter_than_the_brightest_led() {
    for settings in [&[][..], &["panel.board_reflectance=0.3"]] {
        let scene = one_behind_the_other(settings);
        let renderer = Renderer::new(&scene, Level::Reference).expect("a visible scene");
        let canvas = draw(&scene, &renderer, &[ALL_ON, ALL_ON]);
        let range = renderer.plan().range;
        for &value in canvas.values() {
            assert!(value < range.peak + 1e-9 && value > range.floor - 1e-9, "{value}");
        }
    }
}

#[test]
fn a_moving_panel_is_the_mean_of_its_moments_with_its_board() {
    let settings = [
        "panel.board_reflectance=0.9",
        "pose.velocity_m_s=[30, 4, 0]",
        "effects.motion=on",
        "effects.perspective=on",
        "effects.atmosphere=off",
        "ambient.illuminance_lx=1000",
    ];
    let scene = paper(&settings);
    let renderer = Renderer::new(&scene, Level::Reference).expect("a visible scene");
    let moving = draw(&scene, &renderer, &[0x0f0f_3333_5555_8001]);
    // One step per quarter pixel of the motion of 2.2 px.
    let (steps, exposure_s) = (9, renderer.view().exposure.time_s);
    let mut mean = vec![0.0; moving.values().len()];
    for step in 0..steps {
        let after_s = ((f64::from(step) + 0.5) / f64::from(steps) - 0.5) * exposure_s;
        let mut still = paper(&settings[..1]);
        still.effects = scene.effects.clone();
        still.ambient = scene.ambient.clone();
        still.pose = Pose {
            velocity_m_s: [0.0; 3],
            ..scene.pose.after(after_s)
        };
        let image = draw(&still, &renderer, &[0x0f0f_3333_5555_8001]);
        for (mean, value) in mean.iter_mut().zip(image.values()) {
            *mean += value / f64::from(steps);
        }
    }
    for (moving, mean) in moving.values().iter().zip(mean) {
        assert!((moving - mean).abs() < 1e-9, "{moving} for {mean}");
    }
}
