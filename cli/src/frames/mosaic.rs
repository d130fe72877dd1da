//! Interpolates the mosaic of a sensor's colour filters at every pixel.

use anyhow::ensure;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use reception::colour::Channel;

/// The colours of 2×2 pixels, the rows from the top (Bayer, US patent 3 971 065): 0 red, 1 green, 2 blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mosaic([[u8; 2]; 2]);

impl std::str::FromStr for Mosaic {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.to_ascii_uppercase().as_str() {
            "RGGB" => Ok(Self([[0, 1], [1, 2]])),
            "BGGR" => Ok(Self([[2, 1], [1, 0]])),
            "GRBG" => Ok(Self([[1, 0], [2, 1]])),
            "GBRG" => Ok(Self([[1, 2], [0, 1]])),
            _ => Err(format!(
                "{text:?} is not an order of colour filters: give RGGB, BGGR, GRBG or GBRG, as they begin at the top-left pixel"
            )),
        }
    }
}

impl<'de> Deserialize<'de> for Mosaic {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

impl Serialize for Mosaic {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let letter = |colour: u8| ["R", "G", "B"][usize::from(colour)];
        serializer.serialize_str(&self.0.as_flattened().iter().map(|&colour| letter(colour)).collect::<String>())
    }
}

impl Mosaic {
    /// A channel at every pixel: its own samples, and elsewhere the mean of the nearest ones.
    pub fn channel<T: Copy + Ord + Into<u32> + TryFrom<u32>>(
        self,
        samples: &[T],
        (width, height): (usize, usize),
        channel: Channel,
    ) -> anyhow::Result<Vec<T>> {
        ensure!(
            width.is_multiple_of(2) && height.is_multiple_of(2) && width > 0 && height > 0,
            "a mosaic of {width} × {height} pixels is not whole: each side has to be even; give the sensor's own frame, or crop an even \
             number of pixels"
        );
        let rows: Vec<&[T]> = samples.chunks_exact(width).collect();
        let mut channels = Vec::with_capacity(samples.len());
        for y in 0..height {
            let near_rows = [mirrored(y, -1, height), y, mirrored(y, 1, height)].map(|y| rows[y]);
            for x in 0..width {
                let near = [mirrored(x, -1, width), x, mirrored(x, 1, width)];
                channels.push(channel.of(self.colours(near_rows.map(|row| near.map(|x| row[x])), x, y)));
            }
        }
        Ok(channels)
    }

    /// Red, green and blue at the centre of 3×3 samples.
    fn colours<T: Copy + Into<u32> + TryFrom<u32>>(self, near: [[T; 3]; 3], x: usize, y: usize) -> [T; 3] {
        let own = self.0[y % 2][x % 2];
        let mut sums = [(0u32, 0u32); 3];
        for (j, row) in near.iter().enumerate() {
            for (i, &sample) in row.iter().enumerate() {
                let colour = self.0[(y + j + 1) % 2][(x + i + 1) % 2];
                // A pixel's own colour is its own sample.
                if colour != own || (i, j) == (1, 1) {
                    let (sum, count) = &mut sums[usize::from(colour)];
                    (*sum, *count) = (*sum + sample.into(), *count + 1);
                }
            }
        }
        sums.map(|(sum, count)| T::try_from((sum + count / 2) / count.max(1)).unwrap_or(near[1][1]))
    }
}

/// The neighbour of pixel `at`; beyond the edge, the one of the same colour inside.
fn mirrored(at: usize, by: isize, length: usize) -> usize {
    match at.checked_add_signed(by) {
        Some(beside) if beside < length => beside,
        _ => at.saturating_add_signed(-by),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_colours_are_found_under_each_filter() {
        for (name, [[a, b], [c, d]]) in [
            ("RGGB", [[9u8, 5], [5, 1]]),
            ("bggr", [[1, 5], [5, 9]]),
            ("GRBG", [[5, 9], [1, 5]]),
            ("GBRG", [[5, 1], [9, 5]]),
        ] {
            let mosaic: Mosaic = name.parse().unwrap();
            let samples = [a, b, a, b, c, d, c, d, a, b, a, b, c, d, c, d];
            for (channel, value) in [(Channel::Red, 9), (Channel::Green, 5), (Channel::Blue, 1), (Channel::Brightest, 9)] {
                let read = mosaic.channel(&samples, (4, 4), channel).unwrap();
                assert_eq!(read, [value; 16], "{name}");
            }
        }
    }

    #[test]
    fn what_is_no_mosaic_is_refused() {
        assert!("RGBG".parse::<Mosaic>().unwrap_err().contains("RGGB"));
        let odd = "RGGB".parse::<Mosaic>().unwrap();
        assert!(odd.channel(&[0u8; 12], (3, 4), Channel::Red).is_err());
    }
}
