//! Converts pictures of 9 to 16 bits to 8 bits.
//!
//! A sensor's count is proportional to light, and 8 bits of it leave the dark half of a picture with few steps. Samples that are
//! proportional to light are therefore first encoded with a γ of 2.2, as an 8-bit camera does. The steps are then about as fine as the shot
//! noise everywhere. At a full well of 20 000 electrons, the noise is at least 0.9 of such a step, and rounding, 0.29 of a step, adds at
//! most a twentieth to it.

use std::ops::RangeInclusive;

use link::camera::Encoding;

/// Range of a learnt γ, relative to the encoding's, within which samples count as proportional to light.
const AS_GOOD_AS_LINEAR: RangeInclusive<f32> = 0.8..=1.25;

/// The kind of a picture's samples. The same level is different light in each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// Grey levels of 8 bits.
    Plain,
    /// Levels of more than 8 bits.
    Deep,
    /// Numbers in proportion to light.
    Light,
}

impl SampleKind {
    /// Whether they are encoded for the receiver, if this encoding is configured for the camera.
    pub fn are_encoded(self, configured: Option<Encoding>) -> bool {
        match self {
            Self::Plain => false,
            Self::Deep => encodes(configured),
            Self::Light => true,
        }
    }
}

impl std::fmt::Display for SampleKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Plain => "levels of 8 bits",
            Self::Deep => "levels of more than 8 bits",
            Self::Light => "numbers in proportion to light",
        })
    }
}

/// Whether samples of the configured encoding are encoded for the receiver: those proportional to light are, and those whose encoding is
/// not configured.
pub fn encodes(configured: Option<Encoding>) -> bool {
    configured.unwrap_or(Encoding::LINEAR) == Encoding::LINEAR
}

/// The encoding of the samples themselves, if they were encoded for the receiver and it has `learnt` the encoding of the pixels.
pub fn of_samples(learnt: Encoding) -> Encoding {
    let Encoding::Gamma(gamma) = learnt else {
        return learnt;
    };
    let gamma = gamma / Encoding::USUAL_GAMMA as f32;
    match AS_GOOD_AS_LINEAR.contains(&gamma) {
        true => Encoding::LINEAR,
        false => Encoding::Gamma(gamma),
    }
}

/// Converts samples to grey levels, up to the white level of a bit depth.
pub struct Compander {
    white: u16,
    grey: Vec<u8>,
    encoding: Encoding,
    /// Whether white is final: the depth was given, or has been found.
    fixed: bool,
    /// The largest sample of the last picture.
    most: u16,
}

impl Compander {
    /// A compander of samples of `depth` bits in that encoding. Without a depth, it takes as many bits as the samples need.
    pub fn new(depth: Option<u8>, encoding: Encoding) -> Self {
        let mut compander = Self {
            white: 0,
            grey: Vec::new(),
            encoding,
            fixed: depth.is_some(),
            most: 0,
        };
        if let Some(depth) = depth {
            compander.widen(u16::MAX >> (16 - u32::from(depth.clamp(1, 16))));
        }
        compander
    }

    /// Keeps the white level that the pictures so far have set: brighter samples will be white. Before the first picture, it does nothing.
    pub fn fix(&mut self) {
        self.fixed |= self.white > 0;
    }

    /// The white of the pictures so far; 0 before the first.
    pub fn white(&self) -> u16 {
        self.white
    }

    /// The largest sample of the last picture, if it exceeded white and was clipped.
    pub fn clipped(&self) -> Option<u16> {
        (self.most > self.white).then_some(self.most)
    }

    /// The grey levels of a picture's samples. Without a given depth, white is the maximum of the first depth that holds all samples so
    /// far, until it is [fixed](Self::fix).
    pub fn grey(&mut self, samples: &[u16]) -> Vec<u8> {
        let most = samples.iter().copied().max().unwrap_or_default();
        self.most = most;
        if !self.fixed && (most > self.white || self.white == 0) {
            let bits = (u16::BITS - most.leading_zeros()).max(9);
            self.widen(u16::MAX >> (u16::BITS - bits));
        }
        samples
            .iter()
            .map(|&sample| self.grey.get(usize::from(sample)).copied().unwrap_or(u8::MAX))
            .collect()
    }

    fn widen(&mut self, white: u16) {
        self.white = white;
        let encoded = Encoding::default();
        let full = encoded.light(255.0);
        self.grey = (0..=white)
            .map(|sample| {
                let share = f32::from(sample) / f32::from(white);
                let grey = if self.encoding == Encoding::LINEAR {
                    encoded.grey(share * full)
                } else {
                    255.0 * share
                };
                grey.round() as u8
            })
            .collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dark_half_of_a_count_keeps_its_steps() {
        let mut linear = Compander::new(Some(12), Encoding::LINEAR);
        // Plain division would give a 64th of white the level 4 of 255.
        let dark = linear.grey(&[0, 16, 32, 64, 4095]);
        assert_eq!(dark, [0, 21, 28, 39, 255]);
        let mut encoded = Compander::new(Some(10), Encoding::Srgb);
        assert_eq!(encoded.grey(&[0, 512, 1023, 1024]), [0, 128, 255, 255]);
    }

    #[test]
    fn depth_is_as_many_bits_as_are_needed() {
        let mut compander = Compander::new(None, Encoding::LINEAR);
        assert_eq!(compander.grey(&[900])[0], 241);
        assert_eq!(compander.white(), 1023);
        assert_eq!(compander.grey(&[5000, 100]).len(), 2);
        assert_eq!(compander.white(), 8191);
        compander.grey(&[3]);
        assert_eq!(compander.white(), 8191);
    }

    #[test]
    fn white_that_is_fixed_halves_no_levels() {
        let mut compander = Compander::new(None, Encoding::LINEAR);
        compander.fix();
        let before = compander.grey(&[900]);
        compander.fix();
        assert_eq!((compander.clipped(), compander.white()), (None, 1023));
        assert_eq!(compander.grey(&[900, 1024]), [before[0], 255]);
        assert_eq!((compander.clipped(), compander.white()), (Some(1024), 1023));
    }
}
