//! A table as bytes: what goes over the serial port and into the transmitter's flash.
//!
//! All numbers are little-endian and exactly those of the table, so a table and its image are one and the same:
//!
//! | bytes | what |
//! |---|---|
//! | 1 | [`FORMAT`] |
//! | 1 | n, illuminances: 1 to 16 |
//! | 1 | m, intervals: 1 to 8 |
//! | 1 | 0 |
//! | 4·n | illuminances, 1/4096 lx |
//! | 2·m | intervals, 1/4096 |
//! | 2·n·m | L2A, 1/8192, row by row of one illuminance |

use super::{ILLUMINANCES_MAX, INTERVALS_MAX, Illuminance, Interval, L2a, L2aTable, TableError, Vec};
use crate::checksum::crc32c;

/// The format of the image.
pub const FORMAT: u8 = 1;
/// Bytes of the largest table's image.
pub const IMAGE_MAX: usize = HEADER + 4 * ILLUMINANCES_MAX + 2 * INTERVALS_MAX + 2 * ILLUMINANCES_MAX * INTERVALS_MAX;

const HEADER: usize = 4;

/// A table as bytes.
pub type Image = Vec<u8, IMAGE_MAX>;

/// Why bytes are no table.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// They begin with another format's number.
    #[error("the table's image has format {found}, {FORMAT} is known: update the older side")]
    Format {
        /// The number found; 0 where there are no bytes at all.
        found: u8,
    },
    /// There are more or fewer than the axes need.
    #[error("the table's image has {found} bytes, its axes need {needed}: send it again")]
    Length {
        /// Bytes found.
        found: usize,
        /// Bytes needed.
        needed: usize,
    },
    /// They hold numbers that no table may hold.
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
    /// assert_eq!(L2aTable::from_image(&table.image()), Ok(table));
    /// # Ok::<(), link::l2a_table::TableError>(())
    /// ```
    pub fn image(&self) -> Image {
        let (rows, columns) = (self.illuminances.len() as u8, self.intervals.len() as u8);
        let illuminances = self.illuminances.iter().flat_map(|e| e.to_le_bytes());
        let intervals = self.intervals.iter().flat_map(|i| i.to_le_bytes());
        let values = self.values.iter().flat_map(|r| r.to_le_bytes());
        [FORMAT, rows, columns, 0]
            .into_iter()
            .chain(illuminances)
            .chain(intervals)
            .chain(values)
            .collect()
    }

    /// The table of these bytes.
    ///
    /// # Errors
    ///
    /// [`ImageError`] where they are not exactly the image of a table that [`L2aTable::new`] would take.
    pub fn from_image(bytes: &[u8]) -> Result<Self, ImageError> {
        let (&[format, rows, columns, reserved], numbers) = bytes.split_first_chunk().ok_or(ImageError::Length {
            found: bytes.len(),
            needed: HEADER,
        })?;
        if format != FORMAT || reserved != 0 {
            return Err(ImageError::Format { found: format });
        }
        let (rows, columns) = (usize::from(rows), usize::from(columns));
        let wrong_length = ImageError::Length {
            found: bytes.len(),
            needed: HEADER + 4 * rows + 2 * columns + 2 * rows * columns,
        };
        let (illuminances, rest) = numbers.split_at_checked(4 * rows).ok_or(wrong_length)?;
        let (intervals, values) = rest.split_at_checked(2 * columns).ok_or(wrong_length)?;
        if values.len() != 2 * rows * columns {
            return Err(wrong_length);
        }
        Ok(Self::from_fixed(
            &numbers_of::<_, 4, ILLUMINANCES_MAX>(illuminances, Illuminance::from_le_bytes)
                .map_err(|()| super::Quantity::IlluminanceLx.wrong_length(rows, ILLUMINANCES_MAX))?,
            &numbers_of::<_, 2, INTERVALS_MAX>(intervals, Interval::from_le_bytes)
                .map_err(|()| super::Quantity::Interval.wrong_length(columns, INTERVALS_MAX))?,
            &numbers_of::<_, 2, { ILLUMINANCES_MAX * INTERVALS_MAX }>(values, L2a::from_le_bytes).map_err(|()| wrong_length)?,
        )?)
    }

    /// CRC-32C of the image: which table it is.
    pub fn crc(&self) -> u32 {
        crc32c(&[&self.image()])
    }
}

/// The numbers of `SIZE` bytes each; an error where there are more than `MOST`.
fn numbers_of<T, const SIZE: usize, const MOST: usize>(bytes: &[u8], number: impl Fn([u8; SIZE]) -> T) -> Result<Vec<T, MOST>, ()> {
    let mut numbers = Vec::new();
    for &chunk in bytes.as_chunks().0 {
        numbers.push(number(chunk)).map_err(|_| ())?;
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    /// The largest table there can be.
    fn largest() -> L2aTable {
        let illuminances: std::vec::Vec<f32> = (0..16).map(|n| 0.01 * 3.3_f32.powi(n)).collect();
        let intervals: std::vec::Vec<f32> = (1..=8).map(|n| 0.05 * n as f32).collect();
        let values: std::vec::Vec<f32> = (0..128).map(|n| 0.2 + 3.8 / 127.0 * n as f32).collect();
        L2aTable::new(&illuminances, &intervals, &values).unwrap()
    }

    #[test]
    fn the_largest_table_comes_back_and_fills_the_image() {
        let image = largest().image();
        assert_eq!(image.len(), IMAGE_MAX);
        assert_eq!(L2aTable::from_image(&image), Ok(largest()));
    }

    #[test]
    fn the_ends_of_the_ranges_come_back() {
        let table = L2aTable::new(&[0.01, 1e6], &[0.05, 15.0], &[0.2, 4.0, 4.0, 0.2]).unwrap();
        assert_eq!(L2aTable::from_image(&table.image()), Ok(table));
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
                prop_assert_eq!(&table.image()[..], &bytes[..]);
            }
            let mut short = std::vec![FORMAT, rows, columns, 0];
            short.resize(4 + 4 * usize::from(rows) + 2 * usize::from(columns) * (1 + usize::from(rows)), byte);
            if let Ok(table) = L2aTable::from_image(&short) {
                prop_assert_eq!(&table.image()[..], &short[..]);
            }
        }
    }
}
