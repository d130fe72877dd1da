//! The stated uncertainty of the learnt camera agrees with its actual errors.

use super::*;

/// Cameras (count), and frames per camera.
const CAMERAS: u64 = 120;
const FRAMES: u64 = 10;
/// Accepted share of 95 % intervals that hold the truth.
const COVERED: core::ops::RangeInclusive<f64> = 0.90..=0.99;

#[test]
fn the_blur_is_as_sure_as_stated() {
    let mut within = 0;
    for case in 0..CAMERAS {
        let mut random = random_bits(case << 8 | 77);
        let mut between = |low: f32, high: f32| {
            random = random.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ random >> 23;
            low + (high - low) * (random >> 40) as f32 / (1u64 << 24) as f32
        };
        let scene = Scene {
            blur_px: [between(0.8, 2.0); 2],
            pitch_px: between(4.0, 7.0),
            fill: 1.0 / (1.0 + between(0.5, 2.0)),
            roll_deg: between(-10.0, 10.0),
            noise_grey: between(0.5, 4.0),
            light: [between(0.5, 2.0), between(5.0, 10.0)],
            ..Scene::PLAIN
        };
        let mut detector = detector();
        for frame in 0..FRAMES {
            let bits = random_bits(case << 16 | frame);
            let _ = detector.detect(&Scene { bits, ..scene }.render().frame(), &scene.corners());
        }
        let learnt = detector.learnt().unwrap();
        let off = learnt.camera.blur_sigma_px - scene.blur_px[0];
        within += u32::from(off.abs() <= 1.96 * learnt.blur_deviation_px.unwrap());
    }
    let share = f64::from(within) / CAMERAS as f64;
    assert!(COVERED.contains(&share), "{share}");
}

/// Larger pixels change spots and curve, so that these are not the camera's.
#[test]
fn larger_pixels_say_nothing_of_blur_and_curve() {
    let mut detector = detector();
    let scene = Scene {
        pitch_px: 3.4,
        gamma: 1.4,
        noise_grey: 1.0,
        blur_px: [1.5; 2],
        ..Scene::PLAIN
    };
    let read_all = |detector: &mut MaximumLikelihood<16384>, seeds: core::ops::Range<u64>| {
        for bits in seeds.map(random_bits) {
            read(detector, &Scene { bits, ..scene });
        }
        detector.learnt().unwrap()
    };
    detector.go_on_in_pixels(2, 0.5);
    let near = read_all(&mut detector, 0..24);
    assert_eq!((near.camera, near.blur_deviation_px), (Camera::default(), None));
    assert_ne!(near.seen.encoding, near.camera.encoding);
    detector.go_on_in_pixels(1, 0.0);
    let far = read_all(&mut detector, 24..48);
    assert_eq!(far.camera.encoding, Encoding::Gamma(1.4));
    detector.go_on_in_pixels(2, 0.5);
    let near_again = read_all(&mut detector, 48..60);
    assert_eq!(near_again.camera, far.camera);
    assert_eq!(near_again.blur_deviation_px, far.blur_deviation_px);
}
