//! Writes grey images.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_becomes_a_square() {
        assert_eq!(enlarged(&[1, 2, 3, 4], 2, 1), [1, 2, 3, 4]);
        assert_eq!(enlarged(&[1, 2, 3, 4], 2, 2), [1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 4, 4, 3, 3, 4, 4]);
    }
}
