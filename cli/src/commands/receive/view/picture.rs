//! Pictures small enough to be encoded and sent while frames arrive.

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use serde_json::{Value, json};

const QUALITY: u8 = 85;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

impl Region {
    /// A whole frame.
    pub fn of([width, height]: [usize; 2]) -> Self {
        Self {
            left: 0,
            top: 0,
            width,
            height,
        }
    }

    /// The part of a frame around a panel; `None` if the panel is outside the frame.
    pub fn around(corners: &[[f32; 2]; 4], size: [usize; 2]) -> Option<Self> {
        let low = [0, 1].map(|axis| corners.iter().fold(f32::INFINITY, |low, corner| low.min(corner[axis])));
        let high = [0, 1].map(|axis| corners.iter().fold(f32::NEG_INFINITY, |high, corner| high.max(corner[axis])));
        let margin = (0.2 * (high[0] - low[0]).max(high[1] - low[1])).max(3.0);
        let ends = [0, 1].map(|axis| {
            let last = size[axis].saturating_sub(1) as f32;
            let [from, to] = [low[axis] - margin, high[axis] + margin];
            (from <= last && to >= 0.0).then(|| (from.max(0.0) as usize, to.min(last) as usize))
        });
        let [Some((left, right)), Some((top, bottom))] = ends else {
            return None;
        };
        Some(Self {
            left,
            top,
            width: right - left + 1,
            height: bottom - top + 1,
        })
    }
}

/// A region of a frame as JPEG, in squares of `step` pixels so that its longer side has at most `side_max` of them.
///
/// The middle of pixel (x, y) of the frame is at ((x − left + 0.5)/step − 0.5, …) in the picture.
pub fn as_json(grey: &[u8], size: [usize; 2], region: Region, side_max: usize) -> Option<Value> {
    let step = region.width.max(region.height).div_ceil(side_max).max(1);
    let [width, height] = [region.width, region.height].map(|side| side.div_ceil(step));
    let mut squares = Vec::with_capacity(width * height);
    let mut sums = vec![(0u32, 0u32); width];
    for row in 0..height {
        sums.fill((0, 0));
        for y in (row * step..(row + 1) * step).take_while(|&y| y < region.height) {
            let start = (region.top + y) * size[0] + region.left;
            let pixels = grey.get(start..start + region.width)?;
            for (sum, square) in sums.iter_mut().zip(pixels.chunks(step)) {
                sum.0 += square.iter().copied().map(u32::from).sum::<u32>();
                sum.1 += square.len() as u32;
            }
        }
        squares.extend(sums.iter().map(|&(sum, count)| ((sum + count / 2) / count.max(1)) as u8));
    }
    let mut jpeg = Vec::new();
    let sides = [width, height].map(|side| side as u32);
    let mut encoder = JpegEncoder::new_with_quality(&mut jpeg, QUALITY);
    encoder.encode(&squares, sides[0], sides[1], ExtendedColorType::L8).ok()?;
    Some(json!({ "left": region.left, "top": region.top, "step": step, "jpeg": base64(&jpeg) }))
}

/// Bytes as base64 (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0u32, |bits, at| bits << 8 | u32::from(three.get(at).copied().unwrap_or_default()));
        for digit in 0..4 {
            match digit <= three.len() {
                true => text.push(DIGITS[(bits >> (18 - 6 * digit) & 63) as usize].into()),
                false => text.push('='),
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_has_the_vectors_of_rfc_4648() {
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xff, 0xef, 0xfe]), "/+/+");
    }

    /// A picture's pixels.
    fn decoded(picture: &Value) -> image::GrayImage {
        let text = picture["jpeg"].as_str().expect("text").trim_end_matches('=');
        let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let bits = text
            .bytes()
            .flat_map(|digit| {
                let value = digits.iter().position(|&other| other == digit).expect("a digit");
                (0..6).rev().map(move |bit| (value >> bit & 1) as u8)
            })
            .collect::<Vec<_>>();
        let bytes: Vec<u8> = bits
            .chunks_exact(8)
            .map(|byte| byte.iter().fold(0, |all, bit| all << 1 | bit))
            .collect();
        image::load_from_memory(&bytes).expect("a picture").into_luma8()
    }

    #[test]
    fn a_picture_has_the_means_of_squares() {
        // Columns of a square each; the last square is half as wide.
        let size = [50, 33];
        let grey: Vec<u8> = (0..size[0] * size[1]).map(|at| 60 + 10 * (at % size[0] / 4) as u8).collect();
        let picture = as_json(&grey, size, Region::of(size), 13).expect("a picture");
        assert_eq!(picture["step"], 4);
        let shown = decoded(&picture);
        assert_eq!(shown.dimensions(), (13, 9));
        for (x, _, pixel) in shown.enumerate_pixels() {
            assert!(pixel.0[0].abs_diff(60 + 10 * x as u8) <= 6, "{x}: {pixel:?}");
        }
        let close = Region {
            left: 8,
            top: 2,
            width: 12,
            height: 20,
        };
        let close = as_json(&grey, size, close, 100).expect("a picture");
        assert_eq!((&close["left"], &close["top"], &close["step"]), (&8.into(), &2.into(), &1.into()));
        assert!(decoded(&close).get_pixel(11, 0).0[0].abs_diff(100) <= 6);
        assert_eq!(as_json(&grey[..70], size, Region::of(size), 13), None);
    }

    #[test]
    fn the_region_around_a_panel_is_inside_the_frame() {
        let panel = |x: f32, y: f32| [[x, y], [x + 70.0, y], [x + 70.0, y + 70.0], [x, y + 70.0]];
        let around = |x, y| Region::around(&panel(x, y), [640, 480]);
        let whole = Region {
            left: 86,
            top: 186,
            width: 99,
            height: 99,
        };
        assert_eq!(around(100.0, 200.0), Some(whole));
        let cut = around(-20.0, 440.0).expect("partly in the frame");
        assert_eq!((cut.left, cut.top, cut.width, cut.height), (0, 426, 65, 54));
        assert_eq!(around(700.0, 0.0), None);
        assert_eq!(around(0.0, -1e9), None);
    }
}
