//! Converts pictures of any kind to the 8-bit grey that the receiver reads.

use image::{ColorType, DynamicImage};

use crate::colour::Channel;
use crate::deep::Compander;

/// The picture has a kind of pixel that no camera's frame has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its pixels are {kind:?}: give grey or colour of 8 to 16 bits")]
pub struct PixelKindError {
    /// The kind of pixel.
    pub kind: ColorType,
}

/// The grey levels of a picture, row by row. Colours give one channel, and `deep` converts samples of more than 8 bits.
///
/// ```
/// use image::{DynamicImage, RgbImage};
/// use link::camera::Encoding;
/// use reception::{colour::Channel, deep::Compander, picture};
///
/// let lamp = DynamicImage::ImageRgb8(RgbImage::from_raw(1, 1, vec![250, 20, 10]).unwrap());
/// let grey = picture::grey(lamp, Channel::Brightest, &mut Compander::new(None, Encoding::LINEAR))?;
/// assert_eq!(grey, [250]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If the pixels are floating-point numbers.
pub fn grey(image: DynamicImage, channel: Channel, deep: &mut Compander) -> Result<Vec<u8>, PixelKindError> {
    Ok(match image {
        DynamicImage::ImageLuma8(grey) => grey.into_raw(),
        DynamicImage::ImageLumaA8(_) => image.into_luma8().into_raw(),
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => channel.of_rgb(image.into_rgb8().as_raw()),
        DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => deep.grey(image.into_luma16().as_raw()),
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => deep.grey(&channel.of_rgb(image.into_rgb16().as_raw())),
        other => {
            return Err(PixelKindError { kind: other.color() });
        }
    })
}
