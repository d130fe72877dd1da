//! Compares integer arithmetic with floating point.

use super::decision::FEATURE_ERROR_GREY;
use super::outline::Outline;
use super::samples::Samples;
use super::*;
use crate::cells::CellMap;
use crate::detect::Detector;
use crate::features::Features;
use link::fec::Code;
use link::framing::Framer;
use link::panel::PanelFrame;
use properties::prelude::*;
use std::boxed::Box;
use std::vec::Vec;

mod others;

const SIDE_PX: usize = 80;

/// Spots of a linear camera at `corners`.
fn panel(bits: u64, corners: &Corners, light: f64, noise_grey: f64, sigma_px: f64) -> Vec<u8> {
    let mut pixels = std::vec![12.0; SIDE_PX * SIDE_PX];
    let place = corners.homography();
    for led in (0..64).filter(|led| bits >> led & 1 == 1) {
        let [x, y] = place.to_image([f64::from(led % 8), f64::from(led / 8)]);
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let square = ((i % SIDE_PX) as f64 - x).powi(2) + ((i / SIDE_PX) as f64 - y).powi(2);
            *pixel += light * (-0.5 * square / (sigma_px * sigma_px)).exp();
        }
    }
    let mut seed = bits as u32 | 1;
    pixels
        .into_iter()
        .map(|grey: f64| {
            let mut uniform = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(seed >> 8) / f64::from(1 << 24) - 0.5
            };
            let noise = (0..12).map(|_| uniform()).sum::<f64>() * noise_grey;
            (grey + noise).round().clamp(0.0, 255.0) as u8
        })
        .collect()
}

fn corners(x: f32, y: f32, pitch: f32, roll: f32) -> Corners {
    let [dx, dy] = [7.0 * pitch * roll.cos(), 7.0 * pitch * roll.sin()];
    Corners::new([[x, y], [x + dx, y + dy], [x + dx - dy, y + dx + dy], [x - dy, y + dx]]).unwrap()
}

/// Corners around the middle of the frame, with any rotation.
fn turned(pitch: f32, roll: f32) -> Corners {
    let (sin, cos) = roll.sin_cos();
    let half = 3.5 * pitch;
    let ends = [[-half, -half], [half, -half], [half, half], [-half, half]];
    Corners::new(ends.map(|[x, y]| [39.7 + cos * x - sin * y, 40.2 + sin * x + cos * y])).unwrap()
}

/// The same feature in floating point: places from the homography, and bilinear interpolation of the light.
fn feature(frame: &Frame<'_>, corners: &Corners, led: usize) -> f64 {
    let place = corners.homography();
    let light = |column: f64, row: f64| {
        let [x, y] = place.to_image([column, row]);
        let grey = |dx: f64, dy: f64| f64::from(frame.pixel((x.floor() + dx) as usize, (y.floor() + dy) as usize).unwrap());
        let [fx, fy] = [x - x.floor(), y - y.floor()];
        (grey(0.0, 0.0) * (1.0 - fx) + grey(1.0, 0.0) * fx) * (1.0 - fy) + (grey(0.0, 1.0) * (1.0 - fx) + grey(1.0, 1.0) * fx) * fy
    };
    let (column, row) = ((led % 8) as f64, (led / 8) as f64);
    let around: f64 = [(-0.25, 0.0), (0.25, 0.0), (0.0, -0.25), (0.0, 0.25)]
        .iter()
        .map(|(u, v)| light(column + u, row + v))
        .sum();
    let between: f64 = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)]
        .iter()
        .map(|(u, v)| light(column + u, row + v))
        .sum();
    (2.0 * light(column, row) + around) / 6.0 - between / 4.0
}

properties! {
    /// The stated error bound, over poses, light and noise.
    #[test]
    fn features_are_those_of_real_numbers(
        bits: u64, x in 15.0f32..25.0, y in 15.0f32..25.0, pitch in 2.2f32..5.5, roll in -0.3f32..0.3, noise in 0.0..4.0f64,
    ) {
        let corners = corners(x, y, pitch, roll);
        let pixels = panel(bits, &corners, 120.0, noise, 0.9);
        let frame = Frame::new(&pixels, SIDE_PX, SIDE_PX).unwrap();
        let samples = Samples::take(&frame, &Outline::of(&corners)).unwrap();
        for led in 0..64 {
            let (whole, real) = (f64::from(samples.feature(led)) / 256.0, feature(&frame, &corners, led));
            prop_assert!((whole - real).abs() <= FEATURE_ERROR_GREY, "{led}: {whole} instead of {real}");
        }
    }

    /// Nothing panics, whatever the frame and the outline.
    #[test]
    fn any_outline_is_survived(pixels in prop::collection::vec(any::<u8>(), 400), points in prop::array::uniform8(-1e6f32..1e6)) {
        let [a, b, c, d, e, f, g, h] = points;
        let frame = Frame::new(&pixels, 20, 20).unwrap();
        if let Ok(corners) = Corners::new([[a, b], [c, d], [e, f], [g, h]]) {
            let mut outline = Outline::of(&corners);
            if let Some(samples) = Samples::take(&frame, &outline) {
                let bits = Decision::of(&samples).map_or(u64::MAX, |decision| decision.bits);
                outline.correct(&samples, bits);
            }
        }
    }
}

properties! {
    #![cases(properties::cases(12, 256))]

    /// From corners with an error of a tenth of a pitch, a few frames reduce the error to a twentieth, and the bits are right.
    #[test]
    fn following_comes_to_the_panel(
        x in 15.0f32..25.0, y in 15.0f32..25.0, pitch in 3.0f32..5.5, roll in -0.3f32..0.3, off in prop::array::uniform8(-0.1f32..0.1),
    ) {
        let truth = corners(x, y, pitch, roll);
        let mut near = truth.points();
        near.iter_mut().flatten().zip(off).for_each(|(at, off)| *at += off * pitch);
        let mut outline = Outline::of(&Corners::new(near).unwrap());
        let mut bits = 0x9a3c_5e71_0f96_c3a5u64;
        for _ in 0..12 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let pixels = panel(bits, &truth, 150.0, 1.0, 0.9);
            let frame = Frame::new(&pixels, SIDE_PX, SIDE_PX).unwrap();
            let samples = Samples::take(&frame, &outline).unwrap();
            let decision = Decision::of(&samples).unwrap();
            prop_assert_eq!(decision.bits, bits);
            outline.correct(&samples, decision.bits);
        }
        let found = outline.corners().unwrap().points();
        for (found, truth) in found.iter().flatten().zip(truth.points().iter().flatten()) {
            prop_assert!((found - truth).abs() < 0.12 * pitch, "{found} instead of {truth}");
        }
    }

    #[test]
    fn a_panel_is_found_and_its_message_read_however_it_is_turned(pitch in 3.2f32..4.6, roll in -3.2f32..3.2, fresh: bool) {
        let mut framer = Framer::new(b"ice", Code::for_length(3), fresh).unwrap();
        let room = std::vec![0; BlinkSearch::bytes(SIDE_PX, SIDE_PX)];
        let mut receiver = Box::new(IntegerReceiver::new(1.0, room).unwrap());
        let truth = turned(pitch, roll);
        let (mut messages, mut sure) = (0, 0);
        for number in 0..40 {
            let shown = framer.next_panel();
            let pixels = panel(shown.bits(), &truth, 150.0, 1.0, 0.9);
            let outcome = receiver.frame(number, &Frame::new(&pixels, SIDE_PX, SIDE_PX).unwrap(), &mut ());
            if let (Some(reading), Some(orientation)) = (outcome.reading, outcome.orientation) {
                prop_assert_eq!(PanelFrame::from_bits(reading.bits).upright(orientation), shown);
                let own = reading.corners.upright(orientation.quarter_turns()).points();
                for (found, truth) in own.iter().flatten().zip(truth.points().iter().flatten()) {
                    prop_assert!((found - truth).abs() < 0.12 * pitch, "{found} instead of {truth}");
                }
                sure += 1;
            }
            if let Event::Delivered(delivery) = outcome.event {
                prop_assert_eq!(delivery.message, b"ice");
                messages += 1;
            }
        }
        prop_assert!(messages == 1 && sure > 10, "{} messages, {} readings", messages, sure);
    }
}

/// Wrong bits under noise, compared with floating-point k-means on the same frames, which uses all pixels: 22 of 9600 against 4. The light
/// is a fifth of the exposure control's target.
#[test]
fn noise_costs_few_bits_more_than_with_real_numbers() {
    let mut wrong = [0u32; 2];
    let mut map = Box::new(CellMap::<4096>::empty());
    let mut bits = 7u64;
    for i in 0..150 {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let truth = corners(18.3 + 0.01 * i as f32, 20.6, 3.6, 0.05);
        let pixels = panel(bits, &truth, 30.0, 6.0, 0.9);
        let frame = Frame::new(&pixels, SIDE_PX, SIDE_PX).unwrap();
        let samples = Samples::take(&frame, &Outline::of(&truth)).unwrap();
        let in_integers = Decision::of(&samples).unwrap().bits;
        map.build(&truth, SIDE_PX, SIDE_PX).unwrap();
        let features = Features::measure(&frame, &map).unwrap();
        let in_reals = Detector::KMeans.detect(&features).unwrap().bits.bits();
        wrong[0] += (in_integers ^ bits).count_ones();
        wrong[1] += (in_reals ^ bits).count_ones();
    }
    std::println!("wrong of 9600: {} in integers, {} in real numbers", wrong[0], wrong[1]);
    assert!(wrong[0] <= 40 && wrong[1] > 0, "{wrong:?}");
}

/// The table of the confidence is 1/(1 + exp(x)).
#[test]
fn confidence_is_that_of_the_soft_values() {
    for soft in 0..=127i8 {
        let mut panel = link::panel::SoftPanel::ERASED;
        panel.0.fill(-soft);
        let decision = Decision {
            bits: 0,
            soft: panel,
            distance: 0,
        };
        let expected = 1.0 - 1.0 / (1.0 + (0.25 * f64::from(soft)).exp());
        assert!((f64::from(decision.confidence()) - expected).abs() < 2e-5, "{soft}");
    }
}

/// A frame that is too large, or whose search lacks memory, is rejected with a reason, and the next frame is still searched.
#[test]
fn frames_that_cannot_be_searched_are_refused() {
    let mut search = BlinkSearch::new(std::vec![0; 2 * 4096 + 1]);
    let pixels = std::vec![0; 4096];
    for (width, height, refused) in [
        (2048, 2, None),
        (2, 2048, None),
        (2049, 1, Some(BlinkSearchError::Size { width: 2049, height: 1 })),
        (1, 4096, Some(BlinkSearchError::Size { width: 1, height: 4096 })),
        (1, 1, None),
    ] {
        let frame = Frame::new(&pixels, width, height).unwrap();
        for _ in 0..40 {
            assert_eq!(search.find(&frame).err(), refused);
        }
    }
    let pixels = std::vec![0; 4097];
    let frame = Frame::new(&pixels, 241, 17).unwrap();
    let refused = BlinkSearchError::Room { needed: 8194, has: 8193 };
    assert_eq!(search.find(&frame), Err(refused));
    let mut receiver = IntegerReceiver::new(1.0, [0; 7]).unwrap();
    assert_eq!(
        receiver.frame(0, &frame, &mut ()).search,
        Err(BlinkSearchError::Room { needed: 8194, has: 7 })
    );
}

/// The largest frame, in which all pixels change by the maximum: no sum overflows.
#[test]
fn the_largest_frames_are_searched() {
    let mut search = BlinkSearch::new(std::vec![0; BlinkSearch::bytes(2048, 2048)]);
    for grey in [0, 255, 0, 255, 0, 255, 0] {
        let pixels = std::vec![grey; 2048 * 2048];
        let frame = Frame::new(&pixels, 2048, 2048).unwrap();
        assert_eq!(search.find(&frame), Ok(None));
    }
}

/// Two groups that are as far apart as those of noise or evenly spread light are rejected.
#[test]
fn noise_is_not_parted() {
    for (distance, is_parted) in [(7, false), (12, false), (40, true)] {
        let decision = Decision {
            bits: 1,
            soft: SoftPanel::ERASED,
            distance,
        };
        assert_eq!(decision.is_parted(), is_parted, "{distance}");
    }
}

/// Its samples may still separate On from Off.
#[test]
fn an_outline_that_is_none_any_more_counts_as_missed() {
    let shown = turned(7.0, 0.0);
    let pixels = panel(0x5a3c_c3a5_0ff0_9669, &shown, 150.0, 0.5, 1.5);
    let frame = Frame::new(&pixels, SIDE_PX, SIDE_PX).unwrap();
    let [top_left, top_right, bottom_right, bottom_left] = Outline::of(&shown).0;
    let mut track = Track {
        outline: Outline([top_right, top_left, bottom_left, bottom_right]),
        usual: 0,
        missed: 0,
    };
    for missed in 1..=PATIENCE_FRAMES {
        assert!(track.read(&frame, &mut ()).is_none());
        assert_eq!(track.missed, missed);
    }
}
