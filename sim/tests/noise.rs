//! Compares drawn grey levels with their exact law: the whole distribution, tails and moments.

use sim::camera::curve::Curve;
use sim::camera::exposure::Exposure;
use sim::camera::noise::{FlatNoise, Noise, PixelNoise};
use sim::random::{Purpose, stream};
use sim::scene::Scene;

const SEED: u64 = 5;
const DRAWS: usize = 1 << 19;

/// Cameras in 50 to 20 000 lx, which is ISO 32 000 to 100, without and with much read noise, with many and with few electrons.
const CAMERAS: [[&str; 3]; 8] = [
    ["ambient.illuminance_lx=20000", "camera.read_noise_e=3", ""],
    ["ambient.illuminance_lx=4000", "camera.read_noise_e=0", ""],
    ["ambient.illuminance_lx=500", "camera.read_noise_e=3", ""],
    ["ambient.illuminance_lx=50", "camera.read_noise_e=3", ""],
    ["ambient.illuminance_lx=50", "camera.read_noise_e=0", ""],
    ["ambient.illuminance_lx=50", "camera.read_noise_e=200", ""],
    ["ambient.illuminance_lx=50", "camera.read_noise_e=0.5", "camera.full_well_e=3000"],
    ["ambient.illuminance_lx=9000", "camera.read_noise_e=10", "camera.full_well_e=900"],
];
/// From black to white.
const LINEAR: [f32; 6] = [0.0, 0.004, 0.21, 1.0, 3.17, 5.3];

fn noise(camera: &[&str]) -> Noise {
    let set = camera.iter().filter(|set| !set.is_empty());
    let overrides: Vec<String> = set.map(|set| set.to_string()).collect();
    let scene = Scene::load("paper", &overrides).expect("a valid scene");
    Noise::new(&scene, &Exposure::of(&scene), Curve::of(&scene.camera))
}

fn count(grey: &[u8]) -> [f64; 256] {
    let mut counts = [0.0; 256];
    for &level in grey {
        counts[usize::from(level)] += 1.0;
    }
    counts
}

/// Pearson's χ² of counts in bins, relative to its own mean, in standard deviations. Neighbouring levels share a bin until it expects 10
/// counts, so that the tails are bins of their own.
fn chi_square(counts: &[f64; 256], law: &[f64; 256], draws: f64) -> f64 {
    let (mut sum, mut bins, mut seen, mut expected) = (0.0, 0.0, 0.0, 0.0);
    let total: f64 = law.iter().sum();
    let mut ahead = total * draws;
    for (count, p) in counts.iter().zip(law) {
        seen += count;
        expected += p * draws;
        ahead -= p * draws;
        // The rest at the upper end joins the last bin.
        if expected >= 10.0 && (ahead >= 10.0 || ahead <= 0.0) {
            sum += (seen - expected) * (seen - expected) / expected;
            bins += 1.0;
            (seen, expected) = (0.0, 0.0);
        }
    }
    if expected > 0.0 {
        sum += (seen - expected) * (seen - expected) / expected;
        bins += 1.0;
    }
    let freedom: f64 = bins - 1.0;
    if freedom < 1.0 {
        return 0.0;
    }
    (sum - freedom) / (2.0 * freedom).sqrt()
}

/// Mean, variance and third central moment, and the variance of each estimate of them from one draw.
fn moments(law: &[f64; 256]) -> [(f64, f64); 3] {
    let mean: f64 = law.iter().enumerate().map(|(level, p)| p * level as f64).sum();
    let central = |order: i32| -> f64 {
        let terms = law.iter().enumerate();
        terms.map(|(level, p)| p * (level as f64 - mean).powi(order)).sum()
    };
    let [m2, m3, m4, m6] = [2, 3, 4, 6].map(central);
    [
        (mean, m2),
        (m2, m4 - m2 * m2),
        (m3, m6 - m3 * m3 - 6.0 * m4 * m2 + 9.0 * m2 * m2 * m2),
    ]
}

fn check(name: &str, grey: &[u8], law: &[f64; 256]) {
    let (counts, draws) = (count(grey), grey.len() as f64);
    let chi = chi_square(&counts, law, draws);
    // With many bins χ² is nearly normal; with few it has a longer tail.
    assert!(chi < 8.0, "{name}: χ² is {chi} standard deviations beyond its mean (seed {SEED})");
    let drawn = moments(&counts.map(|count| count / draws));
    for (moment, (drawn, exact)) in ["mean", "variance", "skewness"].iter().zip(drawn.into_iter().zip(moments(law))) {
        let error = (exact.1 / draws).sqrt();
        // The sampler's own error is added: a thousandth of the variance.
        let own = if *moment == "mean" { 0.0 } else { 1e-3 * exact.0.abs() };
        assert!(
            (drawn.0 - exact.0).abs() <= 5.5 * error + own + 1e-9,
            "{name}: {moment} {} for {} ± {error} (seed {SEED})",
            drawn.0,
            exact.0
        );
    }
}

#[test]
fn pixels_of_one_value_follow_the_law() {
    let mut grey = vec![0; DRAWS];
    for (frame, camera) in CAMERAS.iter().enumerate() {
        let noise = noise(camera);
        for linear in LINEAR {
            let law = noise.distribution(linear.into());
            let mut random = stream(SEED, frame as u64, Purpose::Background);
            FlatNoise::new(&noise, linear.into()).fill(&mut grey, &mut random);
            check(&format!("flat, {camera:?}, linear {linear}"), &grey, &law);
        }
    }
}

#[test]
fn pixels_of_any_value_follow_the_law() {
    let mut grey = vec![0; DRAWS];
    for (frame, camera) in CAMERAS.iter().enumerate() {
        let noise = noise(camera);
        let pixels = PixelNoise::new(&noise);
        for linear in LINEAR {
            let law = noise.distribution(linear.into());
            let mut random = stream(SEED, frame as u64, Purpose::Noise);
            pixels.read(&vec![linear; DRAWS], &mut random, &mut grey);
            check(&format!("any, {camera:?}, linear {linear}"), &grey, &law);
        }
    }
}

#[test]
fn neighbouring_pixels_are_independent() {
    let noise = noise(&["ambient.illuminance_lx=50"]);
    let pixels = PixelNoise::new(&noise);
    let mut grey = vec![0; DRAWS];
    pixels.read(&vec![1.0; DRAWS], &mut stream(SEED, 0, Purpose::Noise), &mut grey);
    let [(mean, variance), ..] = moments(&noise.distribution(1.0));
    for lag in [1, 2, 64, 256] {
        let pairs = grey.iter().zip(&grey[lag..]);
        let sum: f64 = pairs.map(|(&a, &b)| (f64::from(a) - mean) * (f64::from(b) - mean)).sum();
        let correlation = sum / variance / DRAWS as f64;
        assert!(
            correlation.abs() < 5.5 / (DRAWS as f64).sqrt(),
            "{correlation} at lag {lag} (seed {SEED})"
        );
    }
}

#[test]
fn what_is_drawn_does_not_depend_on_how_pixels_are_grouped_by_256() {
    let pixels = PixelNoise::new(&noise(&["ambient.illuminance_lx=50"]));
    let linear: Vec<f32> = (0..1000).map(|i| i as f32 * 0.005).collect();
    let (mut whole, mut parts) = (vec![0; 1000], vec![0; 1000]);
    pixels.read(&linear, &mut stream(SEED, 1, Purpose::Noise), &mut whole);
    let mut random = stream(SEED, 1, Purpose::Noise);
    for (linear, grey) in linear.chunks(512).zip(parts.chunks_mut(512)) {
        pixels.read(linear, &mut random, grey);
    }
    assert_eq!(whole, parts);
}
