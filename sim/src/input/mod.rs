//! Files that are read: ordinary ones, no larger than what they hold can be, so that neither memory nor patience ends first.
//!
//! Without the feature `files` there are none: whoever asks for one is told so.

#[cfg_attr(feature = "files", path = "files.rs")]
#[cfg_attr(not(feature = "files"), path = "no_files.rs")]
mod files;

use std::io::{Cursor, Error, ErrorKind};
use std::path::Path;

pub use files::{is_there, list, read};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

/// The largest scene, camera or calibration, in bytes of text.
pub const SCENE_MAX: u64 = 1 << 20;
/// The largest plan or table, in bytes of text.
pub const TABLE_MAX: u64 = 1 << 24;
/// The largest file of results that are kept, in bytes of text.
pub const RESULTS_MAX: u64 = 1 << 30;
/// The most columns or rows of a picture: as many as a camera may have.
pub const SIDE_MAX: u32 = rx_pipeline::frame::SIDE_MAX as u32;
/// The largest picture, in bytes: four channels of 16 bits.
const PICTURE_MAX: u64 = 8 * (SIDE_MAX as u64).pow(2);

/// Why a picture cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// Its file cannot be read.
    #[error("cannot read it: {0}")]
    Read(#[from] Error),
    /// It is no picture, or a damaged one.
    #[error("it is no whole PNG, JPEG or PGM image of a kind that is read: {0}; if another program can show it, save it as PNG there")]
    Damaged(#[from] ImageError),
    /// A JPEG without an end.
    #[error("it is no whole PNG, JPEG or PGM image: it ends too soon")]
    Cut,
    /// More than a picture can have.
    #[error("it has {bytes} bytes, and the largest picture that is read has {PICTURE_MAX}: is it the file you meant?")]
    TooLong {
        /// Its bytes.
        bytes: usize,
    },
    /// No pixels, or too many.
    #[error("it has {width} × {height} pixels: 1 × 1 to {SIDE_MAX} × {SIDE_MAX} are read; scale or cut it")]
    Size {
        /// Its columns.
        width: u32,
        /// Its rows.
        height: u32,
    },
}

/// The text of an ordinary file that has at most `most` bytes.
///
/// # Errors
/// As [`read`], and when it is no UTF-8.
pub fn read_text(path: &Path, most: u64) -> Result<String, Error> {
    String::from_utf8(read(path, most)?).map_err(|_| {
        let why = "it is no text in UTF-8";
        Error::new(ErrorKind::InvalidData, why)
    })
}

/// A picture of 1 × 1 to [`SIDE_MAX`] × [`SIDE_MAX`] pixels from a PNG, JPEG or PGM file, turned as its camera was held.
///
/// # Errors
/// See [`PictureError`].
pub fn picture(path: &Path) -> Result<DynamicImage, PictureError> {
    picture_of(&read(path, PICTURE_MAX)?)
}

/// The same from the bytes of such a file.
///
/// # Errors
/// See [`PictureError`].
pub fn picture_of(bytes: &[u8]) -> Result<DynamicImage, PictureError> {
    if bytes.len() as u64 > PICTURE_MAX {
        return Err(PictureError::TooLong { bytes: bytes.len() });
    }
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    // The decoder fills what is missing of a JPEG with grey, which would pass for a picture.
    if reader.format() == Some(ImageFormat::Jpeg) && !ends(bytes) {
        return Err(PictureError::Cut);
    }
    let mut decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let allowed = 1..=SIDE_MAX;
    if !allowed.contains(&width) || !allowed.contains(&height) {
        return Err(PictureError::Size { width, height });
    }
    // Telephones write what the sensor has, and how it was held.
    let orientation = decoder.orientation()?;
    let mut picture = DynamicImage::from_decoder(decoder)?;
    picture.apply_orientation(orientation);
    Ok(picture)
}

/// Whether a JPEG has its end-of-image marker after the last scan.
fn ends(jpeg: &[u8]) -> bool {
    let scan = jpeg.windows(2).rposition(|marker| marker == [0xff, 0xda]).unwrap_or(0);
    jpeg[scan..].windows(2).any(|marker| marker == [0xff, 0xd9])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_long_is_refused() {
        let path = std::env::temp_dir().join(format!("vocc-input-{}", std::process::id()));
        std::fs::write(&path, "abcd").unwrap();
        assert_eq!(read_text(&path, 4).unwrap(), "abcd");
        let fault = read_text(&path, 3).unwrap_err().to_string();
        assert!(fault.contains("more than 3 bytes"), "{fault}");
        std::fs::write(&path, [0xff]).unwrap();
        let fault = read_text(&path, 3).unwrap_err().to_string();
        assert!(fault.contains("UTF-8"), "{fault}");
        std::fs::remove_file(&path).unwrap();
        assert_eq!(read(&path, 3).unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[test]
    fn a_photograph_is_turned_as_its_camera_was_held() {
        let path = std::env::temp_dir().join(format!("vocc-turned-{}.jpg", std::process::id()));
        image::GrayImage::new(4, 2).save(&path).unwrap();
        let plain = std::fs::read(&path).unwrap();
        // An EXIF segment of one entry: the orientation (0x112), 6.
        let exif = b"\xff\xe1\x00\x22Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        std::fs::write(&path, [&plain[..2], exif, &plain[2..]].concat()).unwrap();
        let turned = picture(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!((turned.width(), turned.height()), (2, 4));
    }

    #[cfg(unix)]
    #[test]
    fn what_may_have_no_end_is_refused() {
        for path in ["/dev/zero", "/"] {
            let fault = read(Path::new(path), 3).unwrap_err().to_string();
            assert!(fault.contains("no ordinary file"), "{path}: {fault}");
        }
    }
}
