//! A panel at 150 m, whose LEDs' images all but merge: the operator to be inverted is nearly singular.

use link::panel::PanelFrame;
use rx_pipeline::detect::Detector;
use rx_pipeline::features::Features;
use rx_pipeline::{cells::CellMap, frame::Frame};
use sim::accuracy::Level;
use sim::camera::grey;
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, Settings};
use vocc_tests::least_squares::{Operator, brighter_half};

const FRAMES: u64 = 32;

/// 150 m at night: noise of ISO 32 000.
fn scene() -> Scene {
    let overrides = [
        "pose.distance_m=150",
        "panel.interval=1.5",
        "ambient.illuminance_lx=50",
        "link.l2a=2",
        "effects.noise=on",
    ];
    Scene::load("paper", &overrides.map(String::from)).expect("a scene")
}

/// 32 LEDs On, which ones looks random.
fn half_on(frame: u64) -> PanelFrame {
    let key = |led: &u64| {
        let mixed = (led + 1 + 64 * frame).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb) >> 31
    };
    let mut order: Vec<u64> = (0..64).collect();
    order.sort_by_key(key);
    PanelFrame::from_bits(order[..32].iter().fold(0, |bits, led| bits | 1 << led))
}

#[test]
fn least_squares_at_150_m_are_chance_without_a_ridge_and_better_than_otsu_with_one() {
    let scene = scene();
    let renderer = Renderer::new(&scene, Level::Fast).expect("a visible scene");
    let region = renderer.cells_region(0);
    let corners = renderer.corners_in(region).expect("a panel");
    let (camera, panel) = (&scene.camera, &scene.panels[0]);
    let diameter_px = f64::from(corners.pitch_px()) / (1.0 + panel.interval);
    let variance_px2 = camera.blur_sigma_px.powi(2) + diameter_px.powi(2) / 16.0 + 1.0 / 12.0;
    let operator = Operator::new(&corners, variance_px2, [region.width, region.height]);
    // An LED's light is half the contrast away from their mean; shot noise at middle grey.
    let exposure = &renderer.view().exposure;
    let electrons = camera.full_well_e * 100.0 / exposure.iso / grey::linear(255.0, camera.gamma);
    let light = renderer.steady(0, PanelFrame::default()).light;
    let contrast = (light.on - light.off) * std::f64::consts::PI * (diameter_px / 2.0).powi(2);
    let signal_to_noise = operator.gain() * (contrast / 2.0).powi(2) * electrons;
    let (condition, ridge) = (operator.condition(), operator.ridge(signal_to_noise));
    println!(
        "condition number {condition:.1e}, signal to noise {signal_to_noise:.1e}, ridge {ridge:.1e}"
    );
    assert!(condition > 1e4 && ridge > 0.0, "{condition:e}");
    let (mut canvas, mut greys) = (Canvas::new(region), vec![0; region.width * region.height]);
    let mut errors = [0; 3];
    for frame in 0..FRAMES {
        let bits = half_on(frame);
        renderer.draw(
            &renderer.moment(frame),
            &[renderer.steady(0, bits)],
            &mut canvas,
        );
        renderer.read_out(7, frame, &canvas, &mut greys);
        let pixels: Vec<f64> = greys
            .iter()
            .map(|&g| grey::linear(g.into(), camera.gamma))
            .collect();
        let map = CellMap::<16_384>::new(&corners, region.width, region.height).expect("cells");
        let picture = Frame::new(&greys, region.width, region.height).expect("a frame");
        let features = Features::measure(&picture, &map).expect("features");
        let otsu = Detector::Otsu.decide(&features).unwrap_or_default();
        let read = [0.0, ridge]
            .map(|ridge| PanelFrame::from_bits(brighter_half(&operator.solve(&pixels, ridge))));
        for (sum, read) in errors.iter_mut().zip([read[0], read[1], otsu]) {
            *sum += read.distance(bits);
        }
    }
    let [unregularised, regularised, otsu] =
        errors.map(|errors| f64::from(errors) / (64 * FRAMES) as f64);
    println!(
        "BER {unregularised:.3} without a ridge, {regularised:.3} with it, {otsu:.3} by Otsu (seed 7)"
    );
    assert!((unregularised - 0.5).abs() < 0.06, "{unregularised}");
    assert!(
        regularised <= otsu && regularised < 0.45,
        "{regularised} against {otsu}"
    );
}

#[test]
fn the_likeliest_bits_at_150_m_are_no_worse_than_otsu_s_and_near_the_genie_s() {
    let rate = |detector| {
        let settings = Settings {
            frames: FRAMES,
            seed: 7,
            random_reflectance: true,
            detector,
            level: Level::Fast,
        };
        let evaluator = Evaluator::new(&scene(), settings).expect("a visible scene");
        evaluator
            .run(|_| true)
            .expect("measurable frames")
            .errors
            .rate()
    };
    let [kmeans, otsu, found, genie] = [
        DetectorChoice::KMeans,
        DetectorChoice::Otsu,
        DetectorChoice::MaximumLikelihood,
        DetectorChoice::Genie,
    ]
    .map(rate);
    println!(
        "BER {kmeans:.3} by k-means, {otsu:.3} by Otsu, {found:.3} the likeliest bits, {genie:.3} the genie (seed 7)"
    );
    assert!(
        (0.30..0.42).contains(&otsu) && kmeans > 0.3,
        "{otsu}, {kmeans}"
    );
    assert!(
        found <= otsu && found <= 1.5 * genie,
        "{found} between {genie} and {otsu}"
    );
}
