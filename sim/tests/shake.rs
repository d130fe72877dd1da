//! The frames of a vibrating camera equal those of a camera that is rotated by hand.

use glam::{DMat3, DVec2, DVec3, EulerRot};
use image::{GrayImage, Luma};
use link::panel::PanelFrame;
use sim::accuracy::Level;
use sim::camera::shake::Shake;
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::scene::{PRESETS, Pose, Scene};
use sim::view::View;

const BITS: PanelFrame = PanelFrame::from_bits(0x0f0f_3333_5555_8001);

fn scene(settings: &[&str]) -> Scene {
    let usual = ["effects.noise=off", "effects.perspective=on", "effects.atmosphere=off"];
    let settings = usual.iter().chain(settings).map(|setting| setting.to_string());
    Scene::load("paper", &settings.collect::<Vec<_>>()).expect("a valid scene")
}

/// The pose, after a rotation of the camera, of a panel that had another pose before.
fn turned(pose: &Pose, turn: DMat3) -> Pose {
    let rotation = turn
        * DMat3::from_rotation_z(pose.roll_deg.to_radians())
        * DMat3::from_rotation_y(pose.yaw_deg.to_radians())
        * DMat3::from_rotation_x(pose.pitch_deg.to_radians());
    let (roll, yaw, pitch) = rotation.to_euler(EulerRot::ZYX);
    let centre = turn * DVec3::new(pose.x_m, pose.y_m, pose.distance_m);
    Pose {
        x_m: centre.x,
        y_m: centre.y,
        distance_m: centre.z,
        roll_deg: roll.to_degrees(),
        yaw_deg: yaw.to_degrees(),
        pitch_deg: pitch.to_degrees(),
        ..pose.clone()
    }
}

#[test]
fn a_frame_is_the_mean_of_what_the_camera_sees_on_its_way() {
    let settings = [
        "camera.shake_deg=0.3",
        "camera.shake_roll_deg=1",
        "camera.shake_highest_hz=40",
        "camera.exposure_max_s=0.01",
        "ambient.illuminance_lx=100",
        "pose.distance_m=20",
        "pose.x_m=1",
        "pose.yaw_deg=20",
        "panel.board_reflectance=0.1",
    ];
    let shaken = scene(&settings);
    let renderer = Renderer::new(&shaken, Level::Reference).expect("a visible scene");
    let moment = renderer.moment(5, 7);
    let region = renderer.surroundings(0);
    let mut canvas = Canvas::<f64>::new(region);
    renderer.draw_exact(&moment, &[renderer.steady(0, BITS)], &mut canvas);
    let vibration = Shake::of(&shaken.camera).of_run(5);
    let steps = 100;
    let mut mean = vec![0.0; canvas.values().len()];
    let (mut first, mut last) = (DVec2::ZERO, DVec2::ZERO);
    for step in 0..steps {
        let part = (f64::from(step) + 0.5) / f64::from(steps);
        let mut still = shaken.clone();
        (still.camera.shake_deg, still.camera.shake_roll_deg) = (0.0, 0.0);
        still.pose = turned(&shaken.pose, vibration.turn(moment.start_s + part * moment.exposure_s));
        let renderer = Renderer::new(&still, Level::Reference).expect("a visible scene");
        let mut image = Canvas::<f64>::new(region);
        renderer.draw_exact(&moment, &[renderer.steady(0, BITS)], &mut image);
        for (mean, value) in mean.iter_mut().zip(image.values()) {
            *mean += value / f64::from(steps);
        }
        last = DVec2::from_array(renderer.corner_leds_px(0)[0]);
        first = if step == 0 { last } else { first };
    }
    // The error of quarter-pixel steps under a blur of 1.5 px is at most (1/4)²/24/1.5² of an LED's light.
    assert!((last - first).length() > 2.0, "there is too little to see");
    let most = renderer.plan().range.peak * (0.25f64 / 1.5).powi(2) / 24.0;
    for (drawn, mean) in canvas.values().iter().zip(mean) {
        assert!((drawn - mean).abs() < most, "{drawn} for {mean}");
    }
}

#[test]
fn each_line_is_exposed_at_its_own_time() {
    let settings = [
        "camera.shake_deg=0.2",
        "camera.readout_s=0.009",
        "camera.shake_highest_hz=20",
        "pose.distance_m=10",
    ];
    let scene = scene(&settings);
    let renderer = Renderer::new(&scene, Level::Reference).expect("a visible scene");
    let vibration = Shake::of(&scene.camera).of_run(1);
    let [x, y] = scene.camera.principal_px();
    let mut farthest = 0f64;
    for frame in 0..50 {
        let moment = renderer.moment(1, frame);
        let corners = renderer.corner_leds_in(renderer.sensor(), &moment);
        let at_once = |[_, row]: [f64; 2]| moment.middle_s() + scene.camera.readout_s * row / (scene.camera.height_px - 1) as f64;
        for (corner, (column, row)) in corners.into_iter().zip([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) {
            let at = DVec3::new(column * 0.21, row * 0.21, scene.pose.distance_m);
            let seen = |time_s: f64| {
                let p = vibration.turn(time_s) * at;
                DVec2::new(x, y) + p.truncate() / p.z * scene.camera.focal_px()
            };
            let (there, globally) = (seen(at_once(corner)), seen(moment.middle_s()));
            assert!(
                (there - DVec2::from_array(corner)).length() < 0.02,
                "frame {frame}: {corner:?} for {there}"
            );
            farthest = farthest.max((there - globally).length());
        }
    }
    assert!(farthest > 2.0, "a global shutter would show the same: {farthest}");
}

#[test]
fn a_frame_of_a_run_is_the_same_whatever_came_before_and_another_in_another_run() {
    let scene = Scene::load("day-driving", &["camera.width_px=320".into(), "camera.height_px=240".into()]).expect("a preset");
    let renderer = Renderer::new(&scene, Level::Fast).expect("a visible scene");
    let mut canvas = Canvas::new(renderer.lit_region());
    let mut frame = |seed: u64, number: u64| {
        let mut grey = vec![0; 320 * 240];
        let moment = renderer.moment(seed, number);
        renderer.frame(1, &moment, &[renderer.steady(0, BITS)], &mut canvas, &mut grey);
        (grey, renderer.corner_leds_in(renderer.sensor(), &moment)[0])
    };
    let alone = frame(1, 9);
    let (before, other_run) = (frame(1, 8), frame(2, 9));
    assert_eq!(frame(1, 9), alone);
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    assert!(apart(before.1, alone.1) > 0.1 && apart(other_run.1, alone.1) > 0.1);
    assert!(before.0 != alone.0 && other_run.0 != alone.0);
}

#[test]
fn a_photograph_moves_with_the_panels() {
    let settings = [
        "camera.shake_deg=0.2",
        "camera.shake_roll_deg=0.5",
        "camera.width_px=640",
        "camera.height_px=480",
    ];
    let scene = scene(&settings);
    // A bright spot of some pixels, away from the panel.
    let spot = DVec2::new(150.0, 130.0);
    let picture = GrayImage::from_fn(640, 480, |x, y| {
        let near = (DVec2::new(x.into(), y.into()) - spot).abs().max_element() < 3.0;
        Luma([if near { 250 } else { 20 }])
    });
    let view = View::before(&scene, &picture).expect("a visible scene");
    let renderer = Renderer::of(view, Level::Fine);
    let [x, y] = scene.camera.principal_px();
    let (principal, focal) = (DVec2::new(x, y), scene.camera.focal_px());
    let mut canvas = Canvas::<f32>::new(renderer.lit_region());
    assert_eq!(canvas.region(), renderer.sensor());
    for frame in 0..5 {
        let moment = renderer.moment(3, frame);
        renderer.draw(&moment, &[renderer.steady(0, BITS)], &mut canvas);
        let ray = Shake::of(&scene.camera).of_run(3).turn(moment.middle_s()) * ((spot - principal) / focal).extend(1.0);
        let expected = principal + ray.truncate() / ray.z * focal;
        let (mut sum, mut weight) = (DVec2::ZERO, 0.0);
        for (k, &value) in canvas.values().iter().enumerate() {
            let at = DVec2::new((k % 640) as f64, (k / 640) as f64);
            // The light above its surroundings.
            let light = f64::from(value - canvas.values()[0]);
            if (at - expected).length() < 12.0 {
                sum += at * light;
                weight += light;
            }
        }
        let seen = sum / weight;
        assert!((seen - expected).length() < 0.05, "frame {frame}: {seen} for {expected}");
        assert!((expected - spot).length() > 0.5, "nothing has moved");
    }
}

#[test]
fn a_camera_that_stands_still_is_that_of_the_preset() {
    for name in ["day", "dusk", "night"] {
        let driving = format!("{name}-driving");
        assert!(PRESETS.iter().any(|preset| preset.name == driving));
        let mut driving = Scene::load(&driving, &[]).expect("a preset");
        (driving.camera.shake_deg, driving.camera.shake_roll_deg) = (0.0, 0.0);
        assert_eq!(driving, Scene::load(name, &[]).expect("a preset"));
    }
}

/// A half car: the body's bounce and pitch, and an axle at either end, over a road of ISO 8608.
struct HalfCar {
    body_kg: f64,
    body_kg_m2: f64,
    /// Distances from the centre of gravity to the front and to the rear axle.
    to_axle_m: [f64; 2],
    axle_kg: f64,
    spring_n_m: f64,
    damper_n_s_m: f64,
    tyre_n_m: f64,
}

/// A car of usual size: 1.1 and 1.3 Hz on its springs, with a damping of 0.3 and a wheel hop at 11 Hz.
const CAR: HalfCar = HalfCar {
    body_kg: 1200.0,
    body_kg_m2: 1800.0,
    to_axle_m: [1.2, 1.5],
    axle_kg: 80.0,
    spring_n_m: 36_000.0,
    damper_n_s_m: 3000.0,
    tyre_n_m: 360_000.0,
};

impl HalfCar {
    /// The squared pitch of the body per unit of the road's height at a frequency: the rear axle follows at the distance of a wheelbase.
    fn pitch_rad_m(&self, hz: f64, speed_m_s: f64) -> f64 {
        let omega = std::f64::consts::TAU * hz;
        let [a, b] = self.to_axle_m;
        // Complex numbers as 2 × 2 blocks; the unknowns are bounce, pitch, front axle and rear axle.
        let mut rows = [[[0.0; 2]; 5]; 4];
        let (spring, tyre) = ([self.spring_n_m, self.damper_n_s_m * omega], [self.tyre_n_m, 0.0]);
        let add = |rows: &mut [[[f64; 2]; 5]; 4], row: usize, column: usize, value: [f64; 2], factor: f64| {
            rows[row][column][0] += value[0] * factor;
            rows[row][column][1] += value[1] * factor;
        };
        add(&mut rows, 0, 0, [-self.body_kg * omega * omega, 0.0], 1.0);
        add(&mut rows, 1, 1, [-self.body_kg_m2 * omega * omega, 0.0], 1.0);
        let late = omega * (a + b) / speed_m_s;
        for (axle, (arm, road)) in [(2, (-a, [1.0, 0.0])), (3, (b, [late.cos(), -late.sin()]))] {
            // The ends of the spring: the body at its arm, and the axle.
            let ends = [(0, 1.0), (1, arm), (axle, -1.0)];
            for (row, of_row) in ends {
                for (column, of_column) in ends {
                    add(&mut rows, row, column, spring, of_row * of_column);
                }
            }
            add(&mut rows, axle, axle, [self.tyre_n_m - self.axle_kg * omega * omega, 0.0], 1.0);
            add(&mut rows, axle, 4, product(tyre, road), 1.0);
        }
        let pitch = solved(rows)[1];
        pitch[0] * pitch[0] + pitch[1] * pitch[1]
    }

    /// Root mean square of its pitch on a road with that unevenness at 0.1 cycles a metre, in degrees.
    fn pitch_rms_deg(&self, unevenness_m3: f64, speed_m_s: f64) -> f64 {
        const STEPS: i32 = 2000;
        let (lowest, highest) = (0.5f64, 40.0f64);
        let part = |step: i32| {
            let hz = lowest * (highest / lowest).powf((f64::from(step) + 0.5) / f64::from(STEPS));
            let road_m2_hz = unevenness_m3 * 0.1 * 0.1 * speed_m_s / (hz * hz);
            self.pitch_rad_m(hz, speed_m_s) * road_m2_hz * hz * (highest / lowest).ln() / f64::from(STEPS)
        };
        (0..STEPS).map(part).sum::<f64>().sqrt().to_degrees()
    }
}

fn product([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a * c - b * d, a * d + b * c]
}

/// Gauss–Jordan elimination; the body's rows are never small at the frequencies used here.
fn solved(mut rows: [[[f64; 2]; 5]; 4]) -> [[f64; 2]; 4] {
    for pivot in 0..4 {
        let [re, im] = rows[pivot][pivot];
        let inverse = [re / (re * re + im * im), -im / (re * re + im * im)];
        rows[pivot] = rows[pivot].map(|value| product(value, inverse));
        let own = rows[pivot];
        for (_, row) in rows.iter_mut().enumerate().filter(|(row, _)| *row != pivot) {
            let factor = row[pivot];
            for (value, own) in row.iter_mut().zip(own) {
                let taken = product(factor, own);
                *value = [value[0] - taken[0], value[1] - taken[1]];
            }
        }
    }
    rows.map(|row| row[4])
}

#[test]
fn a_passenger_car_pitches_on_a_road_of_class_b_about_as_the_presets_do() {
    let preset = Scene::load("day-driving", &[]).expect("a preset").camera.shake_deg;
    // Class B, geometric mean, at 50, 72 and 120 km/h.
    let rms = [14.0, 20.0, 33.0].map(|speed_m_s| CAR.pitch_rms_deg(64e-6, speed_m_s));
    let [slow, _, fast] = rms;
    assert!(fast < preset && preset < slow, "{rms:?}");
    // As printed in docs/physics.md.
    assert!((slow - 0.12).abs() < 0.005 && (fast - 0.07).abs() < 0.005, "{rms:?}");
}
