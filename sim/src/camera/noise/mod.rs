//! Shot noise and read noise of the sensor.
//!
//! A pixel at grey 255 holds `full_well_e`·100/ISO electrons. Their number is Poisson distributed, the amplifier adds a normal number of
//! `read_noise_e`, and the result is clipped and encoded (the linear camera model of EMVA 1288).
//!
//! [`Noise`] is the model and its distribution. [`FlatNoise`] draws pixels of one linear value, exactly; [`PixelNoise`] draws pixels of
//! any, within [`LAW_ERROR`]. Both look a grey level up by random bits, with Walker's alias method: no logarithm, no rejection.

mod alias;
mod flat;
mod law;
mod pixel;

pub use flat::FlatNoise;
pub use pixel::{LAW_ERROR, PixelLaw, PixelNoise, Site};

use crate::camera::curve::Curve;
use crate::camera::exposure::Exposure;
use crate::scene::Scene;
use law::Law;

/// The noise of one camera at one exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    electrons_per_linear: f64,
    read_noise_e: f64,
    curve: Curve,
}

/// A normal number exceeds this many standard deviations on either side in one of 10⁹ cases, even if they are larger by a thousandth, as
/// those of [`PixelNoise`] may be.
const RARE: f64 = 6.12;

/// A number of electrons that is never read, because levels below black do not occur.
const NEVER_E: f64 = -1e12;

/// Electrons of a pixel of linear value 1.
pub fn electrons_per_linear(scene: &Scene, exposure: &Exposure) -> f64 {
    let camera = &scene.camera;
    camera.full_well_e * 100.0 / exposure.iso / Curve::of(camera).linear(255.0)
}

impl Noise {
    /// The noise of the scene's camera at `exposure`, with grey levels by `curve`.
    pub fn new(scene: &Scene, exposure: &Exposure, curve: Curve) -> Self {
        Self {
            electrons_per_linear: electrons_per_linear(scene, exposure),
            read_noise_e: scene.camera.read_noise_e,
            curve,
        }
    }

    /// The change of unrounded grey, up or down, that one reading in 10⁹ of a pixel of that linear value exceeds.
    ///
    /// The first term of the Cornish–Fisher expansion covers the longer upper tail of the Poisson part.
    pub(crate) fn rare_change_grey(&self, linear: f64) -> f64 {
        let expected = linear * self.electrons_per_linear;
        let spread = RARE * (expected + self.read_noise_e.powi(2)).sqrt();
        let skew = (RARE * RARE - 1.0) / 6.0;
        let level = |electrons: f64| self.curve.unrounded(electrons / self.electrons_per_linear);
        let centre = level(expected);
        (level(expected + spread + skew) - centre).max(centre - level(expected - spread))
    }

    /// The distribution of the grey level of a pixel of a linear value: 256 probabilities.
    pub fn distribution(&self, linear: f64) -> [f64; 256] {
        let law = self.law().exact(linear.max(0.0) * self.electrons_per_linear);
        let sum: f64 = law.iter().sum();
        std::array::from_fn(|level| law[level] / sum)
    }

    /// The distribution of the grey level.
    fn law(&self) -> Law {
        let threshold = |level: i32| {
            let below = f64::from(level) - 0.5;
            if below < self.curve.black_grey() {
                NEVER_E
            } else {
                self.curve.linear(below) * self.electrons_per_linear
            }
        };
        Law::new((1..256).map(threshold).collect(), self.read_noise_e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise_at(illuminance: &str, read_noise: &str) -> (Noise, Exposure) {
        let overrides = [
            format!("ambient.illuminance_lx={illuminance}"),
            format!("camera.read_noise_e={read_noise}"),
        ];
        let scene = Scene::load("paper", &overrides).unwrap();
        let exposure = Exposure::of(&scene);
        let curve = Curve::of(&scene.camera);
        (Noise::new(&scene, &exposure, curve), exposure)
    }

    #[test]
    fn a_dozen_electrons_make_middle_grey_at_night() {
        let (noise, exposure) = noise_at("50", "3");
        assert!(
            (noise.electrons_per_linear * exposure.background - 11.6).abs() < 0.5,
            "{}",
            noise.electrons_per_linear
        );
    }

    #[test]
    fn changes_beyond_the_rare_one_are_rare() {
        for (illuminance, read_noise) in [("50", "3"), ("50", "0"), ("1000", "0"), ("16000", "3"), ("50", "50")] {
            let (noise, _) = noise_at(illuminance, read_noise);
            let pixels = PixelNoise::new(&noise);
            for linear in [0.001f32, 0.03, 0.2, 1.0, 1.37, 2.9, 5.2] {
                let centre = noise.curve.unrounded(linear.into());
                let bound = noise.rare_change_grey(linear.into());
                for law in [noise.distribution(linear.into()), pixels.distribution(linear)] {
                    let beyond: f64 = (0..256)
                        .filter(|&level| (level as f64 - centre).abs() > bound + 0.5)
                        .map(|level| law[level])
                        .sum();
                    assert!(
                        beyond < 1e-9,
                        "{illuminance} lx, {read_noise} e, linear {linear}: {beyond} beyond {bound}"
                    );
                }
            }
        }
    }
}
