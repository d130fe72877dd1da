use crate::likelihood::tests::random_bits;
use crate::likelihood::{Experience, MaximumLikelihood};
use crate::synthetic::Scene;
use link::camera::{Camera, Encoding};
use std::boxed::Box;

/// LEDs whose images overlap, in the noise of electrons.
const OVERLAPPING: Scene = Scene {
    pitch_px: 3.4,
    background: |_| 0.3,
    light: [1.2, 7.0],
    shot_noise: 0.02,
    ..Scene::PLAIN
};

/// LEDs whose images do not overlap, before black.
const ISOLATED: Scene = Scene {
    pitch_px: 7.6,
    fill: 0.25,
    blur_px: [1.0; 2],
    background: |_| 0.1,
    light: [1.2, 6.0],
    noise_grey: 1.0,
    ..Scene::PLAIN
};

/// A detector with the configured curve `told`, after `frames` frames of a scene.
fn after(frames: u64, scene: &Scene, told: Encoding) -> Box<MaximumLikelihood<16384>> {
    let camera = Camera {
        encoding: told,
        ..Camera::default()
    };
    let mut detector = Box::new(MaximumLikelihood::new(camera));
    for seed in 1..=frames {
        let bits = random_bits(seed);
        let scene = Scene { bits, ..*scene };
        let rendered = scene.render();
        let found = detector.detect(&rendered.frame(), &scene.corners()).unwrap();
        let wrong = (found.bits.bits() ^ bits).count_ones();
        assert!(seed <= 20 || wrong == 0, "{wrong} in frame {seed}");
    }
    detector
}

fn learnt(scene: &Scene, told: Encoding) -> Encoding {
    after(40, scene, told).learnt().unwrap().camera.encoding
}

#[test]
fn the_curve_is_learnt_where_leds_overlap() {
    for (gamma, told) in [(1.0, 2.2), (1.4, 2.2), (2.6, 1.0), (2.2, 1.0), (1.0, 2.6)] {
        let scene = Scene { gamma, ..OVERLAPPING };
        let Encoding::Gamma(found) = learnt(&scene, Encoding::Gamma(told)) else {
            panic!("no exponent")
        };
        assert!((found - gamma).abs() < 0.5, "γ = {gamma}, told {told}: {found}");
    }
}

#[test]
fn what_was_told_stays_where_it_explains_the_frames() {
    for (gamma, told) in [(1.0, Encoding::LINEAR), (2.2, Encoding::Gamma(2.2)), (2.5, Encoding::Gamma(2.5))] {
        let scene = Scene { gamma, ..OVERLAPPING };
        assert_eq!(learnt(&scene, told), told, "γ = {gamma}");
    }
}

#[test]
fn leds_apart_tell_no_curve() {
    for gamma in [1.0, 1.8, 2.6] {
        let scene = Scene { gamma, ..ISOLATED };
        let told = Encoding::default();
        assert_eq!(learnt(&scene, told), told, "γ = {gamma}");
    }
}

/// A codec's errors do not grow with light as a sensor's noise does.
#[test]
fn errors_that_are_no_sensors_tell_no_curve() {
    for gamma in [1.0, 2.2] {
        let scene = Scene {
            gamma,
            noise_grey: 3.0,
            shot_noise: 0.0,
            ..OVERLAPPING
        };
        let told = Encoding::Gamma(gamma);
        assert_eq!(learnt(&scene, told), told);
    }
}

#[test]
fn a_curve_is_handed_on_with_what_else_was_learnt() {
    let scene = Scene { gamma: 1.0, ..OVERLAPPING };
    let one = after(40, &scene, Encoding::default());
    let mut other = after(0, &scene, Encoding::default());
    other.set_experience(one.experience());
    assert_eq!(other.learnt(), one.learnt());
    other.set_experience(Experience::NONE);
    assert_eq!(other.learnt(), None);
    assert_eq!(other.model.camera, Camera::default());
}
