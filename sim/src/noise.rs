//! Shot noise and read noise of the sensor.
//!
//! A pixel at grey 255 holds `full_well_e`·100/ISO electrons. Their number is Poisson distributed, the amplifier adds a
//! normal number of `read_noise_e`, and the result is clipped and encoded (the linear camera model of EMVA 1288).

use libm::erfc;
use rand::Rng;
use rand_distr::{Distribution, Poisson};

use crate::exposure::Exposure;
use crate::grey::{self, Encoder};
use crate::random;
use crate::scene::Scene;

/// The noise of one camera at one exposure.
#[derive(Clone, Debug)]
pub struct Noise {
    electrons_per_linear: f64,
    read_noise_e: f64,
    gamma: f64,
    encoder: Encoder,
}

/// A normal number exceeds this many standard deviations on either side in one of 10⁹ cases.
const RARE: f64 = 6.11;

impl Noise {
    /// The noise of the scene's camera at `exposure`.
    pub fn new(scene: &Scene, exposure: &Exposure) -> Self {
        let camera = &scene.camera;
        Self {
            electrons_per_linear: camera.full_well_e * 100.0
                / exposure.iso
                / grey::linear(255.0, camera.gamma),
            read_noise_e: camera.read_noise_e,
            gamma: camera.gamma,
            encoder: Encoder::new(camera.gamma),
        }
    }

    /// The grey level that a pixel of a linear value is read as.
    pub fn read(&self, linear: f32, random: &mut impl Rng) -> u8 {
        let expected = f64::from(linear).max(0.0) * self.electrons_per_linear;
        let caught = Poisson::new(expected).map_or(0.0, |poisson| poisson.sample(random));
        let read = caught + self.read_noise_e * random::normal(random);
        self.encoder.grey((read / self.electrons_per_linear) as f32)
    }

    /// The change of unrounded grey, up or down, that one reading in 10⁹ of a pixel of that linear value exceeds.
    ///
    /// The Poisson part's longer upper tail is allowed for by the first term of its Cornish–Fisher expansion.
    pub fn rare_change_grey(&self, linear: f64) -> f64 {
        let expected = linear * self.electrons_per_linear;
        let spread = RARE * (expected + self.read_noise_e.powi(2)).sqrt();
        let skew = (RARE * RARE - 1.0) / 6.0;
        let level =
            |electrons: f64| grey::unrounded(electrons / self.electrons_per_linear, self.gamma);
        let centre = level(expected);
        (level(expected + spread + skew) - centre).max(centre - level(expected - spread))
    }

    /// The distribution of the grey level that a pixel of a linear value is read as: 256 probabilities.
    pub fn distribution(&self, linear: f64) -> [f64; 256] {
        let expected = linear.max(0.0) * self.electrons_per_linear;
        let reach = 9.0 * expected.sqrt() + 20.0;
        let (first, last) = (
            (expected - reach).max(0.0) as u64,
            (expected + reach) as u64,
        );
        let mut probability = [0.0; 256];
        for electrons in first..=last {
            let n = electrons as f64;
            let weight = if expected > 0.0 {
                (n * expected.ln() - expected - libm::lgamma(n + 1.0)).exp()
            } else {
                f64::from(u8::from(electrons == 0))
            };
            let mut below = 0.0;
            for (level, p) in probability.iter_mut().enumerate() {
                let up_to = if level == 255 {
                    1.0
                } else {
                    self.read_below(n, grey::linear(level as f64 + 0.5, self.gamma))
                };
                *p += weight * (up_to - below);
                below = up_to;
                if up_to == 1.0 {
                    break;
                }
            }
        }
        let sum: f64 = probability.iter().sum();
        probability.map(|p| p / sum)
    }

    /// The chance that `electrons` are read as less than a linear value.
    fn read_below(&self, electrons: f64, linear: f64) -> f64 {
        let distance = linear * self.electrons_per_linear - electrons;
        if self.read_noise_e == 0.0 {
            return f64::from(u8::from(distance > 0.0));
        }
        0.5 * erfc(-distance / self.read_noise_e * std::f64::consts::FRAC_1_SQRT_2)
    }
}

/// Draws grey levels of pixels of one linear value, by Walker's alias method: one random word a pixel.
#[derive(Clone, Debug)]
pub struct FlatNoise {
    /// For each of 256 equally likely columns: the part of it, of 2²⁴, that is its own level, and the other level.
    columns: [(u32, u8); 256],
}

impl FlatNoise {
    /// For pixels of the linear value `linear` under `noise`.
    pub fn new(noise: &Noise, linear: f64) -> Self {
        let mut part = noise.distribution(linear).map(|p| p * 256.0);
        let mut columns = [(1 << 24, 0); 256];
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..256).partition(|&i| part[i] < 1.0);
        while let (Some(&less), Some(&more)) = (small.last(), large.last()) {
            small.pop();
            columns[less] = ((part[less] * f64::from(1 << 24)).round() as u32, more as u8);
            part[more] -= 1.0 - part[less];
            if part[more] < 1.0 {
                large.pop();
                small.push(more);
            }
        }
        Self { columns }
    }

    /// Fills a row.
    pub fn fill(&self, row: &mut [u8], random: &mut impl Rng) {
        for pair in row.chunks_mut(2) {
            let word = random.next_u64();
            for (pixel, half) in pair.iter_mut().zip([word as u32, (word >> 32) as u32]) {
                let own = (half >> 24) as u8;
                let (part, other) = self.columns[usize::from(own)];
                *pixel = if half & 0x00ff_ffff < part {
                    own
                } else {
                    other
                };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    fn noise_at(illuminance: &str) -> (Noise, Exposure) {
        let scene =
            Scene::load("paper", &[format!("ambient.illuminance_lx={illuminance}")]).unwrap();
        let exposure = Exposure::of(&scene);
        (Noise::new(&scene, &exposure), exposure)
    }

    /// Pearson's χ² of drawn counts against the exact distribution, levels expected less than 10 times pooled.
    fn chi_square(counts: &[u64; 256], probability: &[f64; 256]) -> (f64, usize) {
        let draws: u64 = counts.iter().sum();
        let (mut sum, mut bins, mut rest_seen, mut rest_expected) = (0.0, 0, 0.0, 0.0);
        for (&seen, &p) in counts.iter().zip(probability) {
            let expected = p * draws as f64;
            if expected < 10.0 {
                rest_seen += seen as f64;
                rest_expected += expected;
            } else {
                sum += (seen as f64 - expected).powi(2) / expected;
                bins += 1;
            }
        }
        if rest_expected > 1.0 {
            sum += (rest_seen - rest_expected).powi(2) / rest_expected;
            bins += 1;
        }
        (sum, bins)
    }

    #[test]
    fn both_samplers_follow_the_exact_distribution() {
        for illuminance in ["50", "1000", "16000"] {
            let (noise, _) = noise_at(illuminance);
            for linear in [0.05, 1.0, 3.0] {
                let probability = noise.distribution(linear);
                let draws = 200_000;
                let mut random = stream(5, 0, Purpose::Noise);
                let mut single = [0u64; 256];
                for _ in 0..draws {
                    single[usize::from(noise.read(linear as f32, &mut random))] += 1;
                }
                let mut row = vec![0; draws];
                FlatNoise::new(&noise, linear).fill(&mut row, &mut random);
                let mut flat = [0u64; 256];
                row.iter().for_each(|&grey| flat[usize::from(grey)] += 1);
                for (name, counts) in [("single", single), ("flat", flat)] {
                    let (chi, bins) = chi_square(&counts, &probability);
                    // Mean bins − 1, variance 2·(bins − 1): six standard deviations.
                    let limit = bins as f64 + 6.0 * (2.0 * bins as f64).sqrt();
                    assert!(
                        chi < limit,
                        "{name} at {illuminance} lx, {linear}: χ² {chi} over {bins} levels (seed 5)"
                    );
                }
            }
        }
    }

    #[test]
    fn a_dozen_electrons_make_middle_grey_at_night() {
        let (noise, exposure) = noise_at("50");
        assert!(
            (noise.electrons_per_linear * exposure.background - 11.6).abs() < 0.5,
            "{}",
            noise.electrons_per_linear
        );
    }

    #[test]
    fn changes_beyond_the_rare_one_are_rare() {
        let (noise, _) = noise_at("50");
        let bound = noise.rare_change_grey(1.0);
        let beyond: f64 = noise
            .distribution(1.0)
            .iter()
            .enumerate()
            .filter(|&(level, _)| (level as f64 - 118.0).abs() > bound + 0.5)
            .map(|(_, p)| p)
            .sum();
        assert!(beyond < 1e-9, "{beyond} beyond {bound}");
    }
}
