//! Single pictures from files.

use std::path::Path;

use anyhow::{Context, bail};
use image::{DynamicImage, GrayImage};
use link::camera::Encoding;
use reception::deep::Compander;
use reception::picture;
use sim::input;

use super::PixelArguments;

/// Reads the pictures of one camera.
pub struct PictureReader {
    pixels: PixelArguments,
    deep: Compander,
}

impl PictureReader {
    /// For pixels as they are told to be. Deep ones are in proportion to light, unless another encoding is told.
    pub fn new(pixels: PixelArguments, encoding: Option<Encoding>) -> Self {
        Self {
            pixels,
            deep: Compander::new(pixels.depth, encoding.unwrap_or(Encoding::LINEAR)),
        }
    }

    /// White in the deep pictures so far; 0 where there were none.
    pub fn deep_white(&self) -> u16 {
        self.deep.white()
    }

    /// An 8-bit grey image from a PNG, JPEG or PGM file.
    pub fn read(&mut self, path: &Path) -> anyhow::Result<GrayImage> {
        let unusable = || format!("cannot take {} for a frame", path.display());
        let image = input::picture(path).with_context(unusable)?;
        let (width, height) = (image.width(), image.height());
        let grey = self.grey(image).with_context(unusable)?;
        GrayImage::from_raw(width, height, grey).with_context(|| format!("{} has other pixels than its size says", path.display()))
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
                    "it is {:?}, and a mosaic is grey: leave --bayer out where a picture has its colours",
                    other.color()
                ),
            };
        }
        Ok(picture::grey(image, channel, &mut self.deep)?)
    }
}
