//! Writes grey images and matrices.

use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use crate::files;

/// Writes a grey image as PNG, atomically.
pub fn write_png(path: &Path, grey: &[u8], width: usize, height: usize) -> anyhow::Result<()> {
    let size = [u32::try_from(width)?, u32::try_from(height)?];
    write_encoded(path, grey, size, ExtendedColorType::L8)
}

/// Enlarges each pixel of rows of `width` to a square of `zoom` × `zoom`.
pub fn enlarged(grey: &[u8], width: usize, zoom: usize) -> Vec<u8> {
    let rows = grey.chunks_exact(width.max(1));
    let wide = |row: &[u8]| -> Vec<u8> {
        let pixels = row.iter();
        pixels.flat_map(|&pixel| std::iter::repeat_n(pixel, zoom)).collect()
    };
    rows.flat_map(|row| wide(row).repeat(zoom)).collect()
}

/// Writes pixels as PNG, atomically.
pub fn write_encoded(path: &Path, pixels: &[u8], [width, height]: [u32; 2], kind: ExtendedColorType) -> anyhow::Result<()> {
    // The encoder drops errors of its last write, and writing to memory has none.
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(pixels, width, height, kind)?;
    files::write(path, png)
}

/// An element type of NumPy files.
pub trait Number: Copy {
    /// NumPy's name for it.
    const NAME: &str;
    /// Its bytes, little-endian.
    fn bytes(self) -> impl AsRef<[u8]>;
}

impl Number for f32 {
    const NAME: &str = "<f4";
    fn bytes(self) -> impl AsRef<[u8]> {
        self.to_le_bytes()
    }
}

impl Number for f64 {
    const NAME: &str = "<f8";
    fn bytes(self) -> impl AsRef<[u8]> {
        self.to_le_bytes()
    }
}

/// Writes a matrix as a NumPy file of version 1.0, atomically.
pub fn write_npy<T: Number>(path: &Path, values: &[T], width: usize, height: usize) -> anyhow::Result<()> {
    const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
    // NumPy aligns the data to this; the header is never longer.
    const HEADER: usize = 128;
    let about = format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({height}, {width}), }}", T::NAME);
    let padded = HEADER - MAGIC.len() - 2;
    files::write_with(path, |file| {
        file.write_all(MAGIC)?;
        file.write_all(&(padded as u16).to_le_bytes())?;
        writeln!(file, "{about:<0$}", padded - 1)?;
        for value in values {
            file.write_all(value.bytes().as_ref())?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_becomes_a_square() {
        assert_eq!(enlarged(&[1, 2, 3, 4], 2, 1), [1, 2, 3, 4]);
        assert_eq!(enlarged(&[1, 2, 3, 4], 2, 2), [1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 4, 4, 3, 3, 4, 4]);
    }

    #[test]
    fn matrices_are_written_as_numpy_reads_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("matrix.npy");
        write_npy(&path, &[1.5f32, -2.0, 0.0, 4.0, 5.0, 6.0], 3, 2).expect("a file");
        let bytes = std::fs::read(&path).expect("a file");
        let (header, numbers) = bytes.split_at(128);
        assert_eq!(header[..10], *b"\x93NUMPY\x01\x00\x76\x00");
        let about = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
        let text = std::str::from_utf8(&header[10..]).expect("plain text");
        assert_eq!(text.trim_end(), about);
        assert!(text.ends_with('\n'));
        assert_eq!(numbers.len(), 24);
        assert_eq!(numbers[..8], [0, 0, 0xc0, 0x3f, 0, 0, 0, 0xc0]);
    }
}
