//! JPEG files of every kind: each is decoded correctly, or rejected with the reason.
//!
//! They show [`shown`] and were made by libjpeg-turbo's cjpeg at quality 95. `extended`, `refused-12-bit` and `refused-lossless` are
//! `444.jpg` with another frame header; `cmyk` is Pillow's. The tests themselves add and remove the parts that cameras add and omit.

use std::path::{Path, PathBuf};

use image::{DynamicImage, Rgb, RgbImage};
use sim::input::{self, PictureError};

/// Maximum error of a grey level, from the compression of a smooth picture and from colours that up to 4 × 2 pixels share.
const OFF_GREY: u8 = 8;

/// A picture that is smooth in all colours and does not consist of whole blocks.
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
        let read = input::picture(&path).expect("a picture").image.into_luma8();
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

/// The names of the files that are decoded.
fn whole() -> Vec<(String, Vec<u8>)> {
    let read = |path: PathBuf| (path.display().to_string(), std::fs::read(&path).expect("a file"));
    files(false).into_iter().map(read).collect()
}

/// The bytes of a film as telephones append it: it contains nearly any pair of bytes, including the start of a scan.
fn film() -> Vec<u8> {
    let mut film = b"\0\0\0\x18ftypmp42\0\0\0\0isommp42".to_vec();
    for k in 0..20_000u32 {
        film.extend((k.wrapping_mul(2_654_435_761) >> 8).to_be_bytes());
    }
    film.extend(b"\xff\xda\x00\x03");
    film
}

#[test]
fn a_film_behind_a_picture_is_passed_over() {
    for (name, jpeg) in whole() {
        let read = input::picture_of(&[&jpeg[..], &film()].concat()).unwrap_or_else(|fault| panic!("{name}: {fault}"));
        assert_eq!(read.image, input::picture_of(&jpeg).expect("a picture").image, "{name}");
        assert!(!read.lacks_end, "{name}");
    }
}

#[test]
fn a_picture_that_lacks_only_its_end_marker_is_read_and_named() {
    for (name, jpeg) in whole() {
        let data = jpeg.strip_suffix(b"\xff\xd9").expect("its end");
        for padding in [&b""[..], b"\xff", b"\0\0\0\0"] {
            let read = input::picture_of(&[data, padding].concat()).unwrap_or_else(|fault| panic!("{name}: {fault}"));
            assert_eq!(read.image, input::picture_of(&jpeg).expect("a picture").image, "{name}");
            assert!(read.lacks_end, "{name}");
        }
    }
}

#[test]
fn a_picture_that_lacks_data_is_refused() {
    for (name, jpeg) in whole() {
        let scan = jpeg.windows(2).rposition(|marker| marker == [0xff, 0xda]).expect("a scan");
        for kept in [0.1, 0.5, 0.9] {
            let length = scan + 12 + ((jpeg.len() - scan - 14) as f64 * kept) as usize;
            let reserved = [&jpeg[..length], &[0; 1 << 16]].concat();
            for cut in [&jpeg[..length], &reserved] {
                let fault = input::picture_of(cut);
                assert!(matches!(fault, Err(PictureError::Cut)), "{name}, {kept}: {fault:?}");
            }
        }
    }
}

#[test]
fn tables_that_every_webcam_shares_may_be_left_out() {
    let mut jpeg = Vec::new();
    // Its encoder has no other tables.
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 90);
    shown().write_with_encoder(encoder).expect("encoded");
    let mut bare = jpeg.clone();
    while let Some(at) = bare.windows(2).position(|marker| marker == [0xff, 0xc4]) {
        let length = usize::from(u16::from_be_bytes([bare[at + 2], bare[at + 3]]));
        bare.drain(at..at + 2 + length);
    }
    assert!(bare.len() + 400 < jpeg.len());
    let read = input::picture_of(&bare).expect("a picture");
    assert_eq!(read.image, input::picture_of(&jpeg).expect("a picture").image);
}
