//! Counter-based random numbers: those of frame k of seed s do not depend on any other frame.

use link::scramble::{GOLDEN, mix64};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The purpose of random numbers. Each has its own stream, so that drawing more numbers for one changes no other. Its number goes into the
/// stream and must not change; a retired number is not used again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// The bits of panels, if they are not given.
    Bits = 0,
    /// A random frame's symbols, sub-pixel phase and reflectance.
    Phase = 1,
    /// Shot and read noise of the drawn pixels.
    Noise = 2,
    /// Noise of the plain background around them.
    Background = 3,
    /// Fixed properties of a panel.
    Panel = 4,
    /// Resampling of results.
    Resampling = 6,
    /// The steps of a splitting towards rare errors.
    Splitting = 7,
    /// The broken LEDs of a panel.
    BrokenLeds = 8,
    /// The gain of each pixel.
    PhotoResponse = 9,
    /// The dark offset of each pixel.
    DarkSignal = 10,
    /// The hot pixels.
    HotPixels = 11,
    /// Phases and frequencies of the camera's vibration.
    Shake = 12,
    /// The scene keys that a study draws for each frame.
    Setting = 13,
}

/// The random numbers of frame `frame` of seed `seed` for one purpose.
///
/// ```
/// use rand::Rng;
/// use sim::random::{Purpose, stream};
/// let draw = |frame| stream(1, frame, Purpose::Bits).next_u64();
/// assert_eq!(draw(7), draw(7));
/// assert_ne!(draw(7), draw(8));
/// ```
pub fn stream(seed: u64, frame: u64, purpose: Purpose) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&(purpose as u64).to_le_bytes());
    let mut random = ChaCha8Rng::from_seed(key);
    random.set_stream(frame);
    random
}

/// A number from 0 up to 1.
pub fn uniform(random: &mut impl Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A standard normal number.
pub fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Fixed properties of a sensor's pixels: 64 random bits by the pixel's position, for a seed and a purpose.
///
/// ```
/// use sim::random::{Fixed, Purpose};
/// let fixed = Fixed::new(1, Purpose::HotPixels);
/// assert_eq!(fixed.at(3, 4), fixed.at(3, 4));
/// assert_ne!(fixed.at(3, 4), fixed.at(4, 3));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Fixed(u64);

impl Fixed {
    /// For that seed and purpose.
    pub fn new(seed: u64, purpose: Purpose) -> Self {
        Self(mix64(mix64(seed).wrapping_add(purpose as u64)))
    }

    /// The bits of the pixel (`x`, `y`).
    #[inline(always)]
    pub fn at(self, x: usize, y: usize) -> u64 {
        let place = (y as u64) << 32 | x as u64;
        mix64(self.0.wrapping_add(place.wrapping_mul(GOLDEN)))
    }
}

/// The greatest magnitude of [`bell`].
pub(crate) const BELL_MOST: f64 = 4.881;

/// A number of mean 0 and deviation 1, nearly normal: the sum of the eight bytes of `bits`, which has no outliers.
#[inline(always)]
pub fn bell(bits: u64) -> f64 {
    const PAIRS: u64 = 0x00ff_00ff_00ff_00ff;
    /// The deviation of eight bytes, each with a variance of (256² − 1)/12.
    const DEVIATION: f64 = 209.020_1;
    let pairs = (bits & PAIRS) + (bits >> 8 & PAIRS);
    let sum = pairs.wrapping_mul(0x0001_0001_0001_0001) >> 48;
    (sum as f64 - 1020.0) / DEVIATION
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bell_is_nearly_normal_and_bounded() {
        assert!(bell(u64::MAX) <= BELL_MOST && bell(0) >= -BELL_MOST);
        let fixed = Fixed::new(7, Purpose::PhotoResponse);
        let values: Vec<f64> = (0..100_000).map(|k| bell(fixed.at(k % 317, k / 317))).collect();
        let moment = |power: i32| values.iter().map(|v| v.powi(power)).sum::<f64>() / 1e5;
        assert!(moment(1).abs() < 0.015, "{}", moment(1));
        assert!((moment(2) - 1.0).abs() < 0.02, "{}", moment(2));
        // The kurtosis of a normal law is 3, that of eight bytes 0.15 less.
        assert!((moment(4) - 2.85).abs() < 0.08, "{}", moment(4));
    }
}
