//! Input files: only ordinary ones, with a size limit, so that memory and time stay bounded.
//!
//! Without the feature `files`, reading a file is an error.

#[cfg_attr(feature = "files", path = "files.rs")]
#[cfg_attr(not(feature = "files"), path = "no_files.rs")]
mod files;
mod jpeg;
mod png;

use std::borrow::Cow;
use std::io::{Cursor, Error, ErrorKind};
use std::path::Path;

pub use files::{is_there, list, read};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

/// The largest scene, camera or calibration, in bytes of text.
pub const SCENE_MAX: u64 = 1 << 20;
/// The largest plan or table, in bytes of text.
pub const TABLE_MAX: u64 = 1 << 24;
/// The largest file of stored results, in bytes of text.
pub const RESULTS_MAX: u64 = 1 << 30;
/// The most columns or rows of a picture: those of the largest camera.
pub const SIDE_MAX: u32 = rx_pipeline::frame::SIDE_MAX as u32;
/// The largest picture, in bytes: four channels of 16 bits.
const PICTURE_MAX: u64 = 8 * (SIDE_MAX as u64).pow(2);

/// Why a picture cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// Its file cannot be read.
    #[error("cannot read it: {0}")]
    Read(#[from] Error),
    /// It is not a picture, or damaged.
    #[error("it is not a whole PNG, JPEG or PGM image of a kind that is read: {0}; if another program can show it, save it as PNG there")]
    Damaged(#[from] ImageError),
    /// A JPEG that ends early.
    #[error("it is not a whole PNG, JPEG or PGM image: it ends too soon")]
    Cut,
    /// More bytes than any picture.
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

/// The text of an ordinary file of at most `most` bytes.
///
/// # Errors
/// As [`read`], and if it is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> Result<String, Error> {
    String::from_utf8(read(path, most)?).map_err(|_| {
        let why = "it is not text in UTF-8";
        Error::new(ErrorKind::InvalidData, why)
    })
}

/// The content of a picture file.
#[derive(Debug)]
pub struct Picture {
    /// Its pixels, in the orientation of its camera.
    pub image: DynamicImage,
    /// The largest sample of a PGM or PPM file, by its header; its samples are scaled to all bits of a pixel.
    pub sample_max: Option<u16>,
    /// Whether a JPEG lacks its end marker, and nothing else.
    pub lacks_end: bool,
}

/// A picture of 1 × 1 to [`SIDE_MAX`] × [`SIDE_MAX`] pixels from a PNG, JPEG or PGM file.
///
/// # Errors
/// See [`PictureError`].
pub fn picture(path: &Path) -> Result<Picture, PictureError> {
    picture_of(&read(path, PICTURE_MAX)?)
}

/// As [`picture`], from the bytes of such a file.
///
/// # Errors
/// See [`PictureError`].
pub fn picture_of(bytes: &[u8]) -> Result<Picture, PictureError> {
    if bytes.len() as u64 > PICTURE_MAX {
        return Err(PictureError::TooLong { bytes: bytes.len() });
    }
    let format = image::guess_format(bytes).ok();
    let mut sample_max = None;
    let readable: Cow<[u8]> = match format {
        Some(ImageFormat::Jpeg) => {
            let layout = jpeg::Layout::of(bytes).ok_or(PictureError::Cut)?;
            match layout.picture(bytes) {
                Some(picture) => picture,
                None => return without_end(&layout, bytes),
            }
        }
        Some(ImageFormat::Png) => png::without_ancillary(bytes),
        Some(ImageFormat::Pnm) => {
            sample_max = largest_sample(bytes);
            bytes.into()
        }
        _ => bytes.into(),
    };
    Ok(Picture {
        image: decoded(&readable)?,
        sample_max,
        lacks_end: false,
    })
}

/// A JPEG without an end marker. The decoder fills missing data with grey, which would look like a picture, so bytes after the data must
/// not change it.
fn without_end(layout: &jpeg::Layout, bytes: &[u8]) -> Result<Picture, PictureError> {
    if jpeg::Layout::ends_in_filler(bytes) {
        return Err(PictureError::Cut);
    }
    match layout.ended(bytes).map(|ended| decoded(&ended)) {
        [Ok(image), Ok(other)] if image == other => Ok(Picture {
            image,
            sample_max: None,
            lacks_end: true,
        }),
        [Err(fault @ PictureError::Size { .. }), _] => Err(fault),
        _ => Err(PictureError::Cut),
    }
}

/// The pixels of a whole file.
fn decoded(bytes: &[u8]) -> Result<DynamicImage, PictureError> {
    let mut decoder = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let allowed = 1..=SIDE_MAX;
    if !allowed.contains(&width) || !allowed.contains(&height) {
        return Err(PictureError::Size { width, height });
    }
    // Telephones store the sensor's picture, and the orientation.
    let orientation = decoder.orientation()?;
    let mut image = DynamicImage::from_decoder(decoder)?;
    image.apply_orientation(orientation);
    Ok(image)
}

/// The largest sample that the header of a PGM, PPM or PAM file allows.
fn largest_sample(bytes: &[u8]) -> Option<u16> {
    let lines = bytes.split(|&byte| byte == b'\n');
    let told = lines.filter_map(|line| line.split(|&byte| byte == b'#').next());
    let mut words = told
        .flat_map(|line| line.split(u8::is_ascii_whitespace))
        .filter(|word| !word.is_empty());
    let word = match words.next()? {
        b"P7" => words.skip_while(|&word| word != b"MAXVAL").nth(1),
        _ => words.nth(2),
    };
    std::str::from_utf8(word?).ok()?.parse().ok()
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
        let turned = picture(&path).unwrap().image;
        std::fs::remove_file(&path).unwrap();
        assert_eq!((turned.width(), turned.height()), (2, 4));
    }

    #[test]
    fn the_header_of_a_pgm_file_tells_its_largest_sample() {
        for (file, largest) in [
            (&b"P5\n# 12 bits\n2 1\n4095\n\x0f\xff\x00\x00"[..], 4095),
            (b"P2 2 1 1023 7 1023", 1023),
            (
                b"P7\nWIDTH 2\nHEIGHT 1\nDEPTH 1\nMAXVAL 4095\nTUPLTYPE GRAYSCALE\nENDHDR\n\x0f\xff\x00\x00",
                4095,
            ),
        ] {
            let read = picture_of(file).unwrap();
            assert_eq!(read.sample_max, Some(largest));
            assert_eq!(read.image.into_luma16().into_raw().iter().max(), Some(&65535));
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_may_have_no_end_is_refused() {
        for path in ["/dev/zero", "/"] {
            let fault = read(Path::new(path), 3).unwrap_err().to_string();
            assert!(fault.contains("not an ordinary file"), "{path}: {fault}");
        }
    }
}
