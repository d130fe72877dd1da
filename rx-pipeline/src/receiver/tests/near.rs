//! Panels of any size, up to those that fill the picture: sharp discs, many pixels wide.

use super::*;
use crate::cells::CellsError;
use link::scramble::split_mix64;

pub(super) type Whole = Receiver<25_600, Box<ReceiverMemory<25_600>>, FrameSearch<Box<SearchMemory>, Vec<u8>>>;

pub(super) fn receiver_of(width: usize, height: usize) -> Whole {
    let room = FrameSearch::<Box<SearchMemory>>::bytes(width, height);
    let search = FrameSearch::with_history(Box::default(), std::vec![0; room]);
    Receiver::new(ReceiverSettings::default(), Box::default(), search).unwrap()
}

/// A frame of `size` with a panel at four corner LEDs; the frame cuts off any part beyond it.
fn draw([width, height]: [usize; 2], corners: &Corners, bits: u64) -> Vec<u8> {
    let mut light = std::vec![1.0f32; width * height];
    let homography = corners.homography();
    let at = |column: f64, row: f64| homography.to_image([column, row]).map(|c| c as f32);
    for led in 0..64 {
        let (column, row) = ((led % 8) as f64, (led / 8) as f64);
        let [x, y] = at(column, row);
        let [right, _] = at(column + 0.25, row);
        let [_, lower] = at(column, row + 0.25);
        let radius = [right - x, lower - y];
        let surface = if bits >> led & 1 == 1 { 9.0 } else { 2.2 };
        let reach = radius.map(|r| r + 4.0);
        let range = |c: f32, reach: f32, end: usize| (c - reach).max(0.0) as usize..((c + reach).max(0.0) as usize + 1).min(end);
        for v in range(y, reach[1], height) {
            for u in range(x, reach[0], width) {
                let away = ((u as f32 - x) / radius[0]).hypot((v as f32 - y) / radius[1]);
                let beyond = (away - 1.0) * radius[0].min(radius[1]);
                let share = 1.0 / (1.0 + (1.2 * beyond).exp());
                light[v * width + u] += (surface - 1.0) * share;
            }
        }
    }
    light.iter().map(|light| (118.0 * light.powf(1.0 / 2.2)).round() as u8).collect()
}

/// A square panel around a place.
pub(super) fn square([x, y]: [f32; 2], pitch: f32) -> Corners {
    let half = 3.5 * pitch;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    Corners::new(corners.map(|[dx, dy]| [x + dx, y + dy])).unwrap()
}

pub(super) fn off(seen: &Corners, truth: &Corners) -> f32 {
    let pairs = seen.points().into_iter().zip(truth.points());
    pairs.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f32::max)
}

/// A panel rotated so that each LED is farther away than its left neighbour by the share `tilt`.
fn aside([x, y]: [f32; 2], pitch: f32, tilt: f32) -> Corners {
    let corners = [[-3.5, -3.5], [3.5, -3.5], [3.5, 3.5], [-3.5, 3.5f32]];
    Corners::new(corners.map(|[column, row]| {
        let nearness = pitch / (1.0 + tilt * column);
        [x + 0.9 * column * nearness, y + row * nearness]
    }))
    .unwrap()
}

/// The first reading of a panel that always shows the same bits, and the number of its frame.
fn first_reading(size: [usize; 2], truth: &Corners, bits: u64) -> (u64, FrameReading) {
    let pixels = draw(size, truth, bits);
    let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
    let mut receiver = receiver_of(size[0], size[1]);
    (0..4)
        .find_map(|number| Some((number, receiver.frame(number, &frame).reading.ok()?)))
        .unwrap_or_else(|| panic!("a pitch of {} px is not found", truth.pitch_px()))
}

#[test]
fn panels_of_any_size_are_found_at_once() {
    let pitches = [5.0, 8.5, 12.0, 17.0, 31.0, 56.0, 80.0, 117.0];
    for (panel, pitch) in panels(8).into_iter().zip(pitches) {
        let truth = square([491.0, 482.3], pitch);
        let (number, reading) = first_reading([1000, 960], &truth, panel.bits());
        assert_eq!(reading.detection.bits, panel, "{pitch}");
        assert!(number < 2 && off(&reading.corners, &truth) < 0.1 * pitch, "{pitch}");
    }
}

/// A frame of a square panel with a board of 8.8 pitches before blocks that stand out more than its LEDs, on every level.
pub(super) fn before_blocks(size: [usize; 2], centre: [f32; 2], pitch: f32, bits: u64, number: u64) -> Vec<u8> {
    let noise = |pixel: usize| (split_mix64(number << 32 | pixel as u64) % 7) as i16 - 3;
    let block = |pixel: usize, side: usize| {
        let [x, y] = [pixel % size[0] / side, pixel / size[0] / side];
        (split_mix64((x + 1000 * y + side) as u64) % 120) as i16 - 60
    };
    let mut pixels = draw(size, &square(centre, pitch), bits);
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let away = [i % size[0], i / size[0]].map(|c| c as f32);
        let away = (away[0] - centre[0]).abs().max((away[1] - centre[1]).abs());
        let texture = if away > 4.4 * pitch { block(i, 7) + block(i, 28) } else { 0 };
        *pixel = (i16::from(*pixel) + noise(i) + texture).clamp(0, 255) as u8;
    }
    pixels
}

/// A new symbol in every second frame, or less often, always shows in the frames in which the same level has its turn.
#[test]
fn a_near_panel_of_slow_symbols_is_found_at_any_phase() {
    let (size, centre) = ([480, 360], [241.0, 178.5]);
    for pitch in [20.0, 34.0] {
        for frames_per_symbol in 1..=4 {
            for phase in 0..frames_per_symbol {
                let truth = square(centre, pitch);
                let mut receiver = receiver_of(size[0], size[1]);
                let panels = panels(30);
                let right = (0..24).find(|&number| {
                    let bits = panels[((number + phase) / frames_per_symbol) as usize].bits();
                    let pixels = before_blocks(size, centre, pitch, bits, number);
                    let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
                    let reading = receiver.frame(number, &frame).reading;
                    reading.is_ok_and(|reading| off(&reading.corners, &truth) < 0.2 * pitch)
                });
                assert!(
                    right.is_some_and(|number| number <= 2 * frames_per_symbol + 1),
                    "{pitch} px, a symbol of {frames_per_symbol} frames from phase {phase}: found in frame {right:?}"
                );
            }
        }
    }
}

#[test]
fn near_panels_are_seen_in_perspective() {
    let size = [1000, 960];
    for (tilt, pitch) in [(0.0, 100.0), (0.015, 100.0), (-0.02, 72.0), (0.02, 40.0), (0.008, 20.0)] {
        let truth = aside([500.0, 480.0], pitch, tilt);
        let mut receiver = receiver_of(size[0], size[1]);
        let mut last = None;
        for (number, panel) in panels(12).into_iter().enumerate() {
            let pixels = draw(size, &truth, panel.bits());
            let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
            last = receiver.frame(number as u64, &frame).reading.ok();
            if let Some(reading) = &last {
                assert_eq!(reading.detection.bits, panel, "{tilt}, {pitch} px, frame {number}");
            }
        }
        let off_px = off(&last.unwrap().corners, &truth);
        // An affine lattice is off by (3.5² − 5.25) times the tilt at the corners: 0.14 pitches for 0.02.
        assert!(off_px < 0.05 * pitch, "{tilt}, {pitch} px: off by {off_px} px");
    }
}

#[test]
fn a_panel_that_comes_nearer_is_read_in_every_frame() {
    let size = [1000, 960];
    let mut receiver = receiver_of(size[0], size[1]);
    let mut pitch = 5.0;
    for (number, panel) in panels(64).into_iter().enumerate() {
        let truth = square([498.0 - 0.2 * pitch, 480.0], pitch);
        let pixels = draw(size, &truth, panel.bits());
        let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
        let reading = receiver.frame(number as u64, &frame).reading;
        let reading = reading.unwrap_or_else(|why| panic!("frame {number}, {pitch} px: {why}"));
        assert_eq!(reading.detection.bits, panel, "frame {number}, {pitch} px");
        assert!(off(&reading.corners, &truth) < 0.3 * pitch, "frame {number}, {pitch} px");
        pitch *= 1.05;
    }
    assert!(8.0 * pitch > 900.0);
}

#[test]
fn a_panel_partly_out_of_the_picture_says_so_and_is_read_once_it_is_in() {
    let size = [800, 600];
    let mut receiver = receiver_of(size[0], size[1]);
    for (number, panel) in panels(30).into_iter().enumerate() {
        // To the right and back: its outline leaves the picture from frame 10 to frame 19.
        let turn = (number as f32 - 14.5).abs();
        let x = 800.0 - 4.0 * 40.0 + 4.0 * (4.9 - turn);
        let pixels = draw(size, &square([x, 300.0], 40.0), panel.bits());
        let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
        let out = (10..=19).contains(&number);
        match receiver.frame(number as u64, &frame).reading {
            Ok(reading) => {
                assert!(!out, "frame {number}");
                assert_eq!(reading.detection.bits, panel, "frame {number}");
            }
            Err(Loss::Cells(why)) => {
                // It has turned round unseen and is expected farther outside until it is given up there.
                assert!(out || (20..=10 + PATIENCE_FRAMES as usize).contains(&number));
                assert!(matches!(why, CellsError::OutsideFrame { width: 800, .. }), "{why}");
            }
            Err(why) => panic!("frame {number}: {why}"),
        }
    }
}
