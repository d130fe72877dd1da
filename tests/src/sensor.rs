//! A camera sensor: light to grey levels, with noise.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Converts light to grey levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Electrons at white; the read noise is 6 electrons.
    pub white_e: f64,
    /// Exponent of the encoding.
    pub gamma: f64,
}

impl Sensor {
    /// The sensor of these films.
    pub const USUAL: Self = Self {
        white_e: 8000.0,
        gamma: 2.2,
    };

    /// The grey level of a light, relative to white, with noise of `deviate` standard deviations.
    pub(crate) fn grey(&self, light: f32, deviate: f64) -> u8 {
        let noise = (f64::from(light).max(0.0) / self.white_e + (6.0 / self.white_e).powi(2)).sqrt();
        let seen = (f64::from(light) + noise * deviate).clamp(0.0, 1.0);
        (255.0 * seen.powf(1.0 / self.gamma)).round() as u8
    }
}

/// A normal deviate (Box and Muller 1958).
pub(crate) fn gauss(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
}
