//! JPEG files of every kind: each is read as what it shows, or refused with what is wrong.
//!
//! They show [`shown`] and are made by libjpeg-turbo's cjpeg at quality 95; `extended`, `refused-12-bit` and `refused-lossless` are
//! `444.jpg` with another frame header, `cmyk` is Pillow's.

use std::path::{Path, PathBuf};

use image::{DynamicImage, Rgb, RgbImage};
use sim::input::{self, PictureError};

/// How far a grey level may be off: what the compression of a smooth picture does, and that its colours are those of up to 4 × 2 pixels.
const OFF_GREY: u8 = 8;

/// A picture that is smooth in all colours and has no whole number of blocks.
fn shown() -> DynamicImage {
    let colour = |x: u32, y: u32| [40 + 3 * x, 60 + 4 * y, 200 - 2 * x - 2 * y].map(|part| part as u8);
    RgbImage::from_fn(50, 35, |x, y| Rgb(colour(x, y))).into()
}

fn files(are_refused: bool) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/jpeg");
    let files = std::fs::read_dir(folder).expect("a folder");
    let files = files.map(|file| file.expect("a file").path());
    let is_refused = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("refused"));
    files.filter(|path| is_refused(path) == are_refused).collect()
}

#[test]
fn what_is_read_is_what_it_shows() {
    let shown = shown().into_luma8();
    let files = files(false);
    assert_eq!(files.len(), 16);
    for path in files {
        let read = input::picture(&path).expect("a picture").into_luma8();
        assert_eq!(read.dimensions(), shown.dimensions(), "{}", path.display());
        let pixels = read.as_raw().iter().zip(shown.as_raw());
        let off = pixels.map(|(read, shown)| read.abs_diff(*shown)).max();
        assert!(off.is_some_and(|off| off <= OFF_GREY), "{}: {off:?}", path.display());
    }
}

#[test]
fn what_is_not_read_is_refused_with_a_way_out() {
    let files = files(true);
    assert_eq!(files.len(), 6);
    for path in files {
        let fault = input::picture(&path).expect_err("it cannot be read");
        assert!(matches!(fault, PictureError::Damaged(_)), "{}: {fault}", path.display());
        assert!(fault.to_string().contains("save it as PNG"), "{fault}");
    }
}
