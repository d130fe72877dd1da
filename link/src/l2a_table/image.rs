//! A table as bytes, for the serial port and the transmitter's flash.
//!
//! All numbers are little-endian and exactly those of the table, so a table and its image are equivalent:
//!
//! | bytes | content |
//! |---|---|
//! | 1 | [`FORMAT`] |
//! | 1 | n, illuminances: 1 to 16 |
//! | 1 | m, intervals: 1 to 8 |
//! | 1 | 0 |
//! | 4·n | illuminances, 1/4096 lx |
//! | 2·m | intervals, 1/4096 |
//! | 2·n·m | L2A, 1/8192, row by row of one illuminance |

use super::{FINER, ILLUMINANCES_MAX, INTERVALS_MAX, Illuminance, Interval, L2a, L2aTable, TableError, VALUES_MAX, Vec, check_lengths};
use crate::checksum::crc32c;

/// The format of the image.
pub const FORMAT: u8 = 1;
/// Bytes of the largest table's image.
pub const IMAGE_MAX: usize = HEADER + 4 * ILLUMINANCES_MAX + 2 * INTERVALS_MAX + 2 * VALUES_MAX;

const HEADER: usize = 4;

/// A table as bytes.
pub(super) type Image = Vec<u8, IMAGE_MAX>;

/// The image of these numbers.
pub(super) fn of(illuminances: &[Illuminance], intervals: &[Interval], values: &[L2a]) -> Image {
    let header = [FORMAT, illuminances.len() as u8, intervals.len() as u8, 0];
    let illuminances = illuminances.iter().flat_map(|e| e.to_le_bytes());
    let intervals = intervals.iter().flat_map(|i| i.to_le_bytes());
    let values = values.iter().flat_map(|r| r.to_le_bytes());
    header.into_iter().chain(illuminances).chain(intervals).chain(values).collect()
}

/// The numbers of an image, in place.
pub(super) struct Parts<'a> {
    illuminances: &'a [[u8; 4]],
    intervals: &'a [[u8; 2]],
    values: &'a [[u8; 2]],
}

impl<'a> Parts<'a> {
    /// The parts of an image whose length matches its axes.
    pub fn of(image: &'a [u8]) -> Self {
        let (rows, columns) = match *image {
            [_, rows, columns, ..] => (usize::from(rows), usize::from(columns)),
            _ => (0, 0),
        };
        let numbers = image.get(HEADER..).unwrap_or_default();
        let (illuminances, rest) = numbers.split_at_checked(4 * rows).unwrap_or_default();
        let (intervals, values) = rest.split_at_checked(2 * columns).unwrap_or_default();
        Self {
            illuminances: illuminances.as_chunks().0,
            intervals: intervals.as_chunks().0,
            values: values.as_chunks().0,
        }
    }

    pub fn illuminances(&self) -> impl Iterator<Item = Illuminance> + 'a {
        self.illuminances.iter().map(|&bytes| Illuminance::from_le_bytes(bytes))
    }

    pub fn intervals(&self) -> impl Iterator<Item = Interval> + 'a {
        self.intervals.iter().map(|&bytes| Interval::from_le_bytes(bytes))
    }

    pub fn values(&self) -> impl Iterator<Item = L2a> + 'a {
        self.values.iter().map(|&bytes| L2a::from_le_bytes(bytes))
    }

    /// A value with [`FINER`] extra fractional bits.
    pub fn finer_value(&self, row: usize, column: usize) -> i64 {
        let value = self.values.get(row * self.intervals.len() + column);
        i64::from(value.map_or(0, |&bytes| u16::from_le_bytes(bytes))) << FINER
    }
}

/// Why an image was rejected.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// They start with the number of another format.
    #[error("the table's image has format {found}, and only {FORMAT} is known: update the older side")]
    Format {
        /// The number found; 0 if there are no bytes.
        found: u8,
    },
    /// Their number does not match the axes.
    #[error("the table's image has {found} bytes, its axes need {needed}: send it again")]
    Length {
        /// Bytes found.
        found: usize,
        /// Bytes needed.
        needed: usize,
    },
    /// They hold invalid numbers.
    #[error(transparent)]
    Table(#[from] TableError),
}

impl L2aTable {
    /// The table as bytes.
    ///
    /// ```
    /// use link::l2a_table::L2aTable;
    /// let table = L2aTable::new(&[50.0, 5000.0], &[1.0], &[2.0, 1.8])?;
    /// assert_eq!(table.image().len(), 4 + 4 * 2 + 2 + 2 * 2);
    /// assert_eq!(L2aTable::from_image(table.image()), Ok(table));
    /// # Ok::<(), link::l2a_table::TableError>(())
    /// ```
    pub fn image(&self) -> &[u8] {
        &self.image
    }

    /// The table of these bytes.
    ///
    /// # Errors
    ///
    /// [`ImageError`] unless they are exactly the image of a table that [`L2aTable::new`] would accept.
    pub fn from_image(bytes: &[u8]) -> Result<Self, ImageError> {
        let &[format, rows, columns, reserved] = bytes.first_chunk().ok_or(ImageError::Length {
            found: bytes.len(),
            needed: HEADER,
        })?;
        if format != FORMAT || reserved != 0 {
            return Err(ImageError::Format { found: format });
        }
        let (rows, columns) = (usize::from(rows), usize::from(columns));
        let (found, needed) = (bytes.len(), HEADER + 4 * rows + 2 * columns + 2 * rows * columns);
        let wrong_length = ImageError::Length { found, needed };
        if found != needed {
            return Err(wrong_length);
        }
        check_lengths(rows, columns)?;
        let image = Image::from_slice(bytes).map_err(|_| wrong_length)?;
        Ok(Self::of(image).checked()?)
    }

    /// CRC-32C of the image, which identifies the table.
    pub fn crc(&self) -> u32 {
        crc32c(&[&self.image])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    /// The largest possible table.
    fn largest() -> L2aTable {
        let illuminances: std::vec::Vec<f32> = (0..16).map(|n| 0.01 * 3.3_f32.powi(n)).collect();
        let intervals: std::vec::Vec<f32> = (1..=8).map(|n| 0.05 * n as f32).collect();
        let values: std::vec::Vec<f32> = (0..128).map(|n| 0.2 + 3.8 / 127.0 * n as f32).collect();
        L2aTable::new(&illuminances, &intervals, &values).unwrap()
    }

    #[test]
    fn the_largest_table_comes_back_and_fills_the_image() {
        let table = largest();
        assert_eq!(table.image().len(), IMAGE_MAX);
        assert_eq!(L2aTable::from_image(table.image()), Ok(table));
    }

    #[test]
    fn the_ends_of_the_ranges_come_back() {
        let table = L2aTable::new(&[0.01, 1e6], &[0.05, 15.0], &[0.2, 4.0, 4.0, 0.2]).unwrap();
        assert_eq!(L2aTable::from_image(table.image()), Ok(table));
    }

    #[test]
    fn every_shorter_or_longer_image_is_refused() {
        let mut bytes = largest().image().to_vec();
        for length in 0..bytes.len() {
            assert!(L2aTable::from_image(&bytes[..length]).is_err(), "{length}");
        }
        bytes.push(0);
        assert_eq!(
            L2aTable::from_image(&bytes),
            Err(ImageError::Length {
                found: IMAGE_MAX + 1,
                needed: IMAGE_MAX
            })
        );
    }

    properties! {
        #[test]
        fn bytes_are_refused_or_are_the_image_of_the_table_they_give(
            place in 0..IMAGE_MAX, byte: u8, rows in 0_u8..20, columns in 0_u8..12,
        ) {
            let mut bytes = largest().image().to_vec();
            bytes[place] = byte;
            if let Ok(table) = L2aTable::from_image(&bytes) {
                prop_assert_eq!(table.image(), &bytes[..]);
            }
            let mut short = std::vec![FORMAT, rows, columns, 0];
            short.resize(4 + 4 * usize::from(rows) + 2 * usize::from(columns) * (1 + usize::from(rows)), byte);
            if let Ok(table) = L2aTable::from_image(&short) {
                prop_assert_eq!(table.image(), &short[..]);
            }
        }
    }
}
