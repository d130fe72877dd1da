//! Single pictures from files.

use std::path::Path;

use anyhow::{Context, bail};
use image::{DynamicImage, GrayImage};
use link::camera::Encoding;
use reception::deep::{Compander, SampleKind};
use reception::picture;
use sim::input::{self, Picture};
use studies::stop::Stop;

use super::{PixelArguments, secrets};

/// Number of pictures read to find a film's white level.
const LOOKED_AT: usize = 8;

/// Reads the pictures of one camera.
pub struct PictureReader {
    pixels: PixelArguments,
    deep: Compander,
    /// Whether the white level is fixed for a whole film.
    is_settled: bool,
}

/// A picture in 8-bit grey.
pub struct GreyPicture {
    pub image: GrayImage,
    /// The kind of its own samples.
    pub samples: SampleKind,
    /// A warning about its file, which was read nevertheless.
    pub remark: Option<String>,
}

impl PictureReader {
    /// A reader with these settings. Deep pixels are linear in light unless an encoding is set.
    pub fn new(pixels: PixelArguments, encoding: Option<Encoding>) -> Self {
        Self {
            pixels,
            deep: Compander::new(pixels.depth, encoding.unwrap_or(Encoding::LINEAR)),
            is_settled: false,
        }
    }

    /// Fixes the white level from some pictures of a film, including the first, if no depth is set and they have more than 8 bits. A
    /// brighter picture then cannot halve the levels of those that follow.
    pub fn settle_white<'a>(&mut self, film: impl ExactSizeIterator<Item = &'a Path>, stop: Stop) {
        if self.pixels.depth.is_some() {
            return;
        }
        let step = film.len().div_ceil(LOOKED_AT).max(1);
        for path in film.step_by(step) {
            // An unreadable picture is reported in its turn.
            if stop.is_asked() || self.read(path).is_ok_and(|picture| picture.samples == SampleKind::Plain) {
                return;
            }
        }
        self.deep.fix();
        self.is_settled = true;
    }

    /// Reads a PNG, JPEG or PGM file as 8-bit grey.
    pub fn read(&mut self, path: &Path) -> anyhow::Result<GreyPicture> {
        let unusable = || format!("cannot use {} as a frame", secrets::masked(&path.display().to_string()));
        let mut picture = input::picture(path).with_context(unusable)?;
        self.unstretch(&mut picture);
        let lacks_end = picture.lacks_end;
        let mut image = picture.image;
        let samples = match samples_mut(&mut image) {
            Some(_) => SampleKind::Deep,
            None => SampleKind::Plain,
        };
        let (width, height) = (image.width(), image.height());
        let grey = self.grey(image).with_context(unusable)?;
        let remark = match lacks_end {
            true => Some(format!("{} has no end marker, and is read nevertheless", path.display())),
            false => self.clipped(path),
        };
        let image = GrayImage::from_raw(width, height, grey);
        Ok(GreyPicture {
            image: image.with_context(|| format!("the pixels of {} do not match its size", path.display()))?,
            samples,
            remark,
        })
    }

    /// Scales samples to the set depth if the decoder has stretched them to the full range.
    fn unstretch(&self, picture: &mut Picture) {
        let (Some(sample_max), Some(_)) = (picture.sample_max, self.pixels.depth) else {
            return;
        };
        // A set depth above the file's puts its white at the file's white.
        let largest = u64::from(sample_max.max(self.deep.white()));
        let stretched = u64::from(u16::MAX);
        for sample in samples_mut(&mut picture.image).unwrap_or_default() {
            *sample = ((u64::from(*sample) * largest + stretched / 2) / stretched) as u16;
        }
    }

    /// Warns once that a picture is brighter than those that fixed the film's white level.
    fn clipped(&mut self, path: &Path) -> Option<String> {
        let (most, white) = (self.deep.clipped().filter(|_| self.is_settled)?, self.deep.white());
        self.is_settled = false;
        Some(format!(
            "{} has samples up to {most}, and white was taken from pictures of at most {white}: what is brighter is white; --depth tells \
             the bits of a sample",
            path.display()
        ))
    }

    fn grey(&mut self, image: DynamicImage) -> anyhow::Result<Vec<u8>> {
        let size = (image.width() as usize, image.height() as usize);
        let channel = self.pixels.channel.unwrap_or_default();
        if let Some(mosaic) = self.pixels.bayer {
            return match image {
                DynamicImage::ImageLuma8(grey) => mosaic.channel(grey.as_raw(), size, channel),
                DynamicImage::ImageLuma16(deep) => {
                    let deep = mosaic.channel(deep.as_raw(), size, channel)?;
                    Ok(self.deep.grey(&deep))
                }
                other => bail!(
                    "it is {:?}, and a mosaic is grey: omit --bayer for pictures in colour",
                    other.color()
                ),
            };
        }
        Ok(picture::grey(image, channel, &mut self.deep)?)
    }
}

/// The samples of a picture with more than 8 bits.
fn samples_mut(image: &mut DynamicImage) -> Option<&mut [u16]> {
    match image {
        DynamicImage::ImageLuma16(deep) => Some(deep),
        DynamicImage::ImageLumaA16(deep) => Some(deep),
        DynamicImage::ImageRgb16(deep) => Some(deep),
        DynamicImage::ImageRgba16(deep) => Some(deep),
        _ => None,
    }
}
