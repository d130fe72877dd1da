//! Loss of a frame by JPEG, with a real encoder and decoder.

use std::f64::consts::PI;
use std::io::Cursor;

use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::{DynamicImage, ExtendedColorType};

use super::{About, Effect};
use crate::formation::{Formation, GreyStage};
use crate::view::{LinearRange, View};

/// The side of a separately encoded block, in px.
const BLOCK: usize = 8;
/// Addition to the bound for the integer arithmetic of encoder and decoder, in grey levels.
const ROUNDING_GREY: f64 = 4.0;

/// See the [module](self).
pub(super) struct Codec;

impl Effect for Codec {
    fn about(&self) -> About {
        About {
            name: "codec",
            model: "JPEG (ITU-T T.81) of each frame by itself, quantised by the tables of its Annex K scaled as libjpeg does",
            keys: &["camera.jpeg_quality"],
            cost: "each frame is encoded and decoded",
        }
    }

    fn bound_grey(&self, view: &View, _range: &LinearRange) -> f64 {
        view.scene.camera.jpeg_quality.map_or(0.0, greatest_error)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        if let Some(quality) = view.scene.camera.jpeg_quality {
            formation.grey_stages.push(Box::new(Jpeg { quality }));
        }
    }
}

/// The steps of luminance at quality 50: ITU-T T.81, table K.1.
#[rustfmt::skip]
const STEPS: [u32; BLOCK * BLOCK] = [
    16, 11, 10, 16,  24,  40,  51,  61,
    12, 12, 14, 19,  26,  58,  60,  55,
    14, 13, 16, 24,  40,  57,  69,  56,
    14, 17, 22, 29,  51,  87,  80,  62,
    18, 22, 37, 56,  68, 109, 103,  77,
    24, 35, 55, 64,  81, 104, 113,  92,
    49, 64, 78, 87, 103, 121, 120, 101,
    72, 92, 95, 98, 112, 100, 103,  99,
];

/// The greatest error of a pixel: half a step for each of the 64 coefficients of its block, all with the worst sign.
fn greatest_error(quality: u8) -> f64 {
    let scale = match u32::from(quality.clamp(1, 100)) {
        coarse @ ..50 => 5000 / coarse,
        fine => 200 - 2 * fine,
    };
    let step = |k: usize| f64::from(((STEPS[k] * scale + 50) / 100).clamp(1, 255));
    let cosine = |frequency: usize, place: usize| {
        let norm = if frequency == 0 { (0.5f64).sqrt() } else { 1.0 };
        norm / 2.0 * ((2 * place + 1) as f64 * frequency as f64 * PI / 16.0).cos()
    };
    let at = |x: usize, y: usize| -> f64 {
        let coefficient = |k: usize| step(k) / 2.0 * (cosine(k % BLOCK, x) * cosine(k / BLOCK, y)).abs();
        (0..BLOCK * BLOCK).map(coefficient).sum()
    };
    let places = (0..BLOCK * BLOCK).map(|k| at(k % BLOCK, k / BLOCK));
    (places.fold(0.0, f64::max) + ROUNDING_GREY).min(255.0)
}

struct Jpeg {
    quality: u8,
}

impl Jpeg {
    fn decoded(&self, width: usize, grey: &[u8]) -> image::ImageResult<Vec<u8>> {
        let mut file = Vec::new();
        let height = grey.len() / width;
        JpegEncoder::new_with_quality(&mut file, self.quality).encode(grey, width as u32, height as u32, ExtendedColorType::L8)?;
        let decoder = JpegDecoder::new(Cursor::new(file))?;
        Ok(DynamicImage::from_decoder(decoder)?.into_luma8().into_raw())
    }
}

impl GreyStage for Jpeg {
    fn reach_px(&self) -> usize {
        BLOCK - 1
    }

    fn block_px(&self) -> usize {
        BLOCK
    }

    fn apply(&self, width: usize, grey: &mut [u8]) {
        // A frame that was just encoded can be decoded; if not, it stays unchanged.
        if let Ok(decoded) = self.decoded(width, grey) {
            for (grey, decoded) in grey.iter_mut().zip(decoded) {
                *grey = decoded;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Fixed, Purpose};

    #[test]
    fn a_frame_comes_back_within_the_bound() {
        let fixed = Fixed::new(1, Purpose::Noise);
        let (width, height) = (43, 29);
        for quality in [1, 30, 50, 75, 90, 100] {
            for (low, bits) in [(0u64, 8), (100, 5), (118, 0)] {
                let level = |i: usize| low + (fixed.at(i % width, i / width) >> 32) % (1 << bits);
                let frame: Vec<u8> = (0..width * height).map(|i| level(i) as u8).collect();
                let mut decoded = frame.clone();
                Jpeg { quality }.apply(width, &mut decoded);
                let apart = frame.iter().zip(&decoded).map(|(a, b)| a.abs_diff(*b));
                let most = f64::from(apart.max().unwrap());
                assert!(most <= greatest_error(quality), "{quality}: {most}");
                assert!(most > 0.0 || bits == 0 || quality == 100, "{quality}");
            }
        }
        assert!(greatest_error(100) < 40.0, "{}", greatest_error(100));
    }

    #[test]
    fn blocks_are_encoded_each_by_itself() {
        let fixed = Fixed::new(2, Purpose::Noise);
        let level = |x: usize, y: usize| (fixed.at(x, y) >> 57) as u8 + 60;
        let frame = |from: usize, to: usize| -> Vec<u8> { (0..16).flat_map(|y| (from..to).map(move |x| level(x, y))).collect() };
        let (mut whole, mut part) = (frame(0, 48), frame(16, 40));
        let jpeg = Jpeg { quality: 60 };
        jpeg.apply(48, &mut whole);
        jpeg.apply(24, &mut part);
        for (whole, part) in whole.chunks(48).zip(part.chunks(24)) {
            assert_eq!(&whole[16..40], part);
        }
    }
}
