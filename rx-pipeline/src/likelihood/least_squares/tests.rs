//! A panel so far away that its LEDs' images all but merge: the operator is nearly singular.

use super::*;
use crate::likelihood::crop::{Crop, ImagePrior};
use crate::likelihood::model::Model;
use crate::synthetic::Scene;
use link::camera::Camera;
use nalgebra::{SMatrix, SVector};
use std::boxed::Box;
use std::vec::Vec;

const PANELS: u64 = 32;
const PIXELS: usize = 1024;

/// LEDs 1.8 px apart under a blur of 1.5 px, as at 150 m, in the noise of a night; half of them are On.
fn scene(panel: u64) -> Scene {
    let key = |led: &u64| {
        let mixed = (led + 1 + 64 * panel).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 31
    };
    let mut order: Vec<u64> = (0..64).collect();
    order.sort_by_key(key);
    Scene {
        bits: order[..32].iter().fold(0, |bits, led| bits | 1 << led),
        pitch_px: 1.8,
        fill: 0.4,
        noise_grey: 5.0,
        width: 24,
        height: 24,
        centre: [11.6, 12.2],
        ..Scene::PLAIN
    }
}

/// The bits that are wrong if the 32 LEDs of most light are On.
fn errors<T: PartialOrd>(light: &[T; LEDS], bits: u64) -> u32 {
    let mut order: [usize; LEDS] = core::array::from_fn(|led| led);
    order.sort_by(|&a, &b| light[b].partial_cmp(&light[a]).expect("a number"));
    let read = order[..32].iter().fold(0u64, |read, led| read | 1 << led);
    (read ^ bits).count_ones()
}

/// The naive way: the plain normal equations, solved exactly, with a known background.
fn inverse(image: &Image<PIXELS>, centre: &[[f32; 2]; LEDS], variance: f64) -> [f64; LEDS] {
    let mut normal = Box::new(SMatrix::<f64, LEDS, LEDS>::zeros());
    let mut right = SVector::<f64, LEDS>::zeros();
    let [width, height] = image.size;
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let shares = SVector::<f64, LEDS>::from_fn(|led, _| {
            let [cx, cy] = centre[led].map(f64::from);
            let square = (x as f64 - cx).powi(2) + (y as f64 - cy).powi(2);
            (-0.5 * square / variance).exp() / (core::f64::consts::TAU * variance)
        });
        let seen = image.seen[y * image.stride + x];
        normal.ger(1.0, &shares, &shares, 1.0);
        right += shares * f64::from(seen * seen - image.offset - 1.0);
    }
    normal.lu().solve(&right).expect("regular").into()
}

#[test]
fn merged_leds_are_told_apart_where_the_inverse_amplifies_noise() {
    let mut model = Box::new(Model::<PIXELS>::new());
    model.prepare(Camera::default(), crate::settings::LikelihoodSettings::DEFAULT);
    let (mut ours, mut naive) = (0, 0);
    for panel in 0..PANELS {
        let scene = scene(panel);
        let diameter = scene.fill * scene.pitch_px;
        let levels = Levels {
            background: 1.0,
            off: 0.0,
            contrast: 0.0,
            variance: 1.5 * 1.5 + diameter * diameter / 16.0 + 1.0 / 12.0,
            shift: [0.0; 2],
            noise: 1e-3,
        };
        let image_prior = ImagePrior {
            is_plain_around: true,
            spot_sigma_px: 0.0,
        };
        let rendered = scene.render();
        let crop = Crop::new(&rendered.frame(), &scene.corners(), PIXELS, image_prior);
        let found = model.least_squares(&rendered.frame(), &crop, &levels);
        ours += errors(&found.expect("a panel").light, scene.bits);
        let light = inverse(&model.image, &crop.centre, levels.variance.into());
        naive += errors(&light, scene.bits);
    }
    let [ours, naive] = [ours, naive].map(|errors| f64::from(errors) / (64 * PANELS) as f64);
    std::println!("BER {ours:.3}, {naive:.3} by the inverse");
    assert!(naive > 0.35, "{naive}");
    // Without the ridge it is 0.194.
    assert!(ours < 0.17, "{ours}");
}
