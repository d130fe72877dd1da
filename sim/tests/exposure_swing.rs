//! An automatic exposure that hunts during a film.

use rx_pipeline::detect::Method;
use sim::road::{LinkSettings, Road};
use sim::scene::Scene;

fn scene(settings: &[&str]) -> Scene {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.into()).collect();
    Scene::load("day", &settings).expect("a scene")
}

/// Grey levels of the background in the first four frames: 118·2^(EV/γ) at γ 2.2.
#[test]
fn the_background_swings_by_a_stop_to_both_sides() {
    let swing = [
        "camera.exposure_swing_ev=1",
        "camera.exposure_swing_s=0.04",
        "effects.noise=off",
        "ambient.illuminance_lx=500",
    ];
    let settings = LinkSettings::new(b"ice".to_vec(), Method::default(), 1);
    let mut road = Road::new(&scene(&swing), &settings).expect("a road");
    let background = [0, 1, 2, 3].map(|frame| road.frame(frame).expect("a frame").grey[0]);
    assert_eq!(background, [118, 162, 118, 86]);
}

#[test]
fn a_message_arrives_although_the_exposure_hunts() {
    let swing = ["camera.exposure_swing_ev=1", "camera.exposure_swing_s=0.5"];
    let settings = LinkSettings::new(b"ice on the bridge ahead".to_vec(), Method::default(), 1);
    let mut road = Road::new(&scene(&swing), &settings).expect("a road");
    let delivered = (0..60).find_map(|frame| road.frame(frame).expect("a frame").delivered);
    assert_eq!(delivered.map(|received| received.message), Some(settings.message));
}
