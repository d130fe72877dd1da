//! Counter-based random numbers: what frame k of seed s draws does not depend on any other frame.

use link::scramble::{GOLDEN, mix64};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What numbers are drawn for. Each purpose has its own stream, so that drawing more for one changes no other.
/// Its number goes into the stream: it stays, and one that is given up is not given again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// The bits of a panel that nobody named.
    Bits = 0,
    /// A random frame's symbols, sub-pixel phase and reflectance.
    Phase = 1,
    /// Shot and read noise of the pixels that are drawn.
    Noise = 2,
    /// Noise of the plain background around them.
    Background = 3,
    /// What is fixed for a panel.
    Panel = 4,
    /// Resampling of results.
    Resampling = 6,
    /// The steps of a splitting towards rare errors.
    Splitting = 7,
    /// Which of a panel's LEDs are broken.
    BrokenLeds = 8,
    /// What each pixel makes of light.
    PhotoResponse = 9,
    /// What each pixel reads in the dark.
    DarkSignal = 10,
    /// Which pixels are hot.
    HotPixels = 11,
    /// Phases and frequencies of the camera's vibration.
    Shake = 12,
    /// The scene's keys that a study draws for each frame.
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

/// What is fixed for each pixel of a sensor: 64 random bits by the pixel's place, of a seed and for one purpose.
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
    /// Of that seed, for that purpose.
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

/// [`bell`] is never farther than this from 0.
pub(crate) const BELL_MOST: f64 = 4.881;

/// A number of mean 0 and deviation 1, nearly normal: the sum of the eight bytes of `bits`, which has no outliers.
#[inline(always)]
pub fn bell(bits: u64) -> f64 {
    const PAIRS: u64 = 0x00ff_00ff_00ff_00ff;
    /// Of eight bytes, each with a variance of (256² − 1)/12.
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
        // A normal law has 3; eight bytes have 0.15 less.
        assert!((moment(4) - 2.85).abs() < 0.08, "{}", moment(4));
    }
}
