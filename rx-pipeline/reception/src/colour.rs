//! One channel of a colour picture.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The channel that is read from a colour picture.
///
/// A lamp of any colour is bright in the brightest channel. Red alone distinguishes a red lamp from a white wall.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Channel {
    /// The brightest of the three, for each pixel.
    #[default]
    Brightest,
    /// Red alone.
    Red,
    /// Green alone.
    Green,
    /// Blue alone.
    Blue,
    /// Luma as in BT.709: 0.2126 red, 0.7152 green, 0.0722 blue.
    Grey,
}

impl Channel {
    /// The names of the channels for users, each with its description.
    pub const NAMES: [(&'static str, &'static str, Self); 5] = [
        ("brightest", "The brightest of the three, pixel by pixel", Self::Brightest),
        ("red", "", Self::Red),
        ("green", "", Self::Green),
        ("blue", "", Self::Blue),
        ("grey", "Luma as in BT.709: 0.2126 red, 0.7152 green, 0.0722 blue", Self::Grey),
    ];

    /// The channel's value of one pixel.
    pub fn of<T: Copy + Ord + Into<u32> + TryFrom<u32>>(self, [red, green, blue]: [T; 3]) -> T {
        match self {
            Self::Brightest => red.max(green).max(blue),
            Self::Red => red,
            Self::Green => green,
            Self::Blue => blue,
            Self::Grey => {
                let sum = 2126 * red.into() + 7152 * green.into() + 722 * blue.into();
                // The mean of three samples is within the range of a sample.
                T::try_from((sum + 5000) / 10_000).unwrap_or(green)
            }
        }
    }

    /// The channel's values of rows of red, green and blue.
    pub fn of_rgb<T: Copy + Ord + Into<u32> + TryFrom<u32>>(self, rgb: &[T]) -> Vec<T> {
        let (pixels, _) = rgb.as_chunks::<3>();
        pixels.iter().map(|&pixel| self.of(pixel)).collect()
    }

    /// The difference of the channel and luma in 8-bit BT.601 or BT.709 video with the colour differences `cb` and `cr`, which are 128 for
    /// grey.
    pub fn above_luma(self, cb: u8, cr: u8, standard: Standard) -> i16 {
        let [cb, cr] = [cb, cr].map(|c| f32::from(c) - 128.0);
        let [red, green_cb, green_cr, blue] = match standard {
            Standard::Bt601 => [1.402, -0.344, -0.714, 1.772],
            Standard::Bt709 => [1.5748, -0.1873, -0.4681, 1.8556],
        };
        let [red, green, blue] = [red * cr, green_cb * cb + green_cr * cr, blue * cb];
        let above = match self {
            Self::Brightest => red.max(green).max(blue),
            Self::Red => red,
            Self::Green => green,
            Self::Blue => blue,
            Self::Grey => 0.0,
        };
        above.round() as i16
    }
}

impl FromStr for Channel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::NAMES.iter().find(|(name, ..)| *name == text);
        known
            .map(|&(.., channel)| channel)
            .ok_or_else(|| format!("no channel {text:?}: choose brightest, red, green, blue or grey"))
    }
}

/// The standard of a video's colours, by its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standard {
    /// Up to 576 lines.
    Bt601,
    /// Larger ones.
    Bt709,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lamp_of_any_colour_is_bright() {
        for lamp in [[250u8, 10, 10], [10, 250, 10], [10, 10, 250], [250; 3]] {
            assert_eq!(Channel::Brightest.of(lamp), 250);
        }
        assert_eq!(Channel::Grey.of([200u16, 200, 200]), 200);
        assert_eq!(Channel::Grey.of([255u8, 0, 0]), 54);
        assert_eq!(Channel::Red.of_rgb(&[1u8, 2, 3, 4, 5, 6]), [1, 4]);
    }

    #[test]
    fn video_gives_the_channels_it_was_made_of() {
        // A red of (200, 50, 50) in BT.709: luma 82, Cb 111, Cr 203.
        let channel = |channel: Channel| 82 + channel.above_luma(111, 203, Standard::Bt709);
        assert!((channel(Channel::Red) - 200).abs() <= 1);
        assert!((channel(Channel::Green) - 50).abs() <= 1);
        assert!((channel(Channel::Blue) - 50).abs() <= 1);
        assert_eq!(channel(Channel::Brightest), channel(Channel::Red));
        for standard in [Standard::Bt601, Standard::Bt709] {
            assert_eq!(Channel::Brightest.above_luma(128, 128, standard), 0);
        }
    }
}
