//! Reading and writing grey images.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, bail, ensure};
use image::{DynamicImage, GrayImage, ImageReader};
use npyz::WriterBuilder;

use crate::files::write_aside;

/// An 8-bit grey image from a PNG, JPEG or PGM file.
pub fn read_grey(path: &Path) -> anyhow::Result<GrayImage> {
    let decoded = ImageReader::open(path)
        .and_then(ImageReader::with_guessed_format)
        .with_context(|| format!("cannot read {}", path.display()))?;
    let image = decoded
        .decode()
        .with_context(|| format!("{} is no whole PNG, JPEG or PGM image", path.display()))?;
    ensure!(
        image.width() > 0 && image.height() > 0,
        "{} has no pixels ({} × {}): give a frame of the camera",
        path.display(),
        image.width(),
        image.height()
    );
    match image {
        DynamicImage::ImageLuma8(grey) => Ok(grey),
        other => bail!(
            "{} is {:?}: frames are 8-bit grey; convert it, such as by `ffmpeg -i IN -pix_fmt gray OUT.png`",
            path.display(),
            other.color()
        ),
    }
}

/// Writes a grey image as PNG: whole or not at all.
pub fn write_png(path: &Path, grey: &[u8], width: usize, height: usize) -> anyhow::Result<()> {
    write_aside(path, |aside| {
        let size = [u32::try_from(width)?, u32::try_from(height)?];
        image::save_buffer_with_format(
            aside,
            grey,
            size[0],
            size[1],
            image::ExtendedColorType::L8,
            image::ImageFormat::Png,
        )?;
        Ok(())
    })
}

/// Writes a matrix as a NumPy file: whole or not at all.
pub fn write_npy<T: npyz::AutoSerialize + Copy>(
    path: &Path,
    values: &[T],
    width: usize,
    height: usize,
) -> anyhow::Result<()> {
    write_aside(path, |aside| {
        let mut file = BufWriter::new(File::create(aside)?);
        let mut npy = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&[height as u64, width as u64])
            .writer(&mut file)
            .begin_nd()?;
        npy.extend(values.iter().copied())?;
        npy.finish()?;
        Ok(file.flush()?)
    })
}
