//! Counter-based random numbers: what frame k of seed s draws does not depend on any other frame.

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
