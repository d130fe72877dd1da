//! 8 bits of pictures of 9 to 16.
//!
//! Sensors count light; 8 bits of a count drown the dark half of a picture in steps. So where samples are in proportion to light, they
//! are encoded by a γ of 2.2 first, as an 8-bit camera does: the steps then are about as fine as the noise of electrons everywhere. A
//! full well of 20 000 electrons has 0.9 of such a step, of which rounding adds a twentieth (0.29² to 0.9² and more).

use std::ops::RangeInclusive;

use link::camera::Encoding;

/// A gamma that is learnt of samples in proportion to light.
const AS_GOOD_AS_LINEAR: RangeInclusive<f32> = 0.8..=1.25;

/// Whether samples of the encoding told are encoded for the receiver: those in proportion to light, as they are taken to be where nobody
/// tells.
pub fn encodes(told: Option<Encoding>) -> bool {
    told.unwrap_or(Encoding::LINEAR) == Encoding::LINEAR
}

/// The encoding of samples that were encoded for the receiver, of that which it has `learnt` of the pixels.
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

/// The grey level of each sample, up to the white of a depth.
pub struct Compander {
    white: u16,
    grey: Vec<u8>,
    encoding: Encoding,
    /// Whether the depth was given, or has been found.
    fixed: bool,
    /// The largest sample of the last picture.
    most: u16,
}

impl Compander {
    /// For samples of `depth` bits, by default as many as they need, in that encoding; levels below `black` of 255 are black.
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

    /// Keeps white as the pictures so far have made it: what is brighter in those to come is white. Before the first it changes nothing.
    pub fn fix(&mut self) {
        self.fixed |= self.white > 0;
    }

    /// The white of the pictures so far; 0 before the first.
    pub fn white(&self) -> u16 {
        self.white
    }

    /// The largest sample of the last picture, if it is beyond white and so has become white.
    pub fn clipped(&self) -> Option<u16> {
        (self.most > self.white).then_some(self.most)
    }

    /// The grey levels of a picture's samples. Where no depth was given, white is the end of the first depth that holds all samples so
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
        // A 64th of white is 4 of 255 by plain division.
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
