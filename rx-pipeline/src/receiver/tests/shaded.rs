//! Shadows that cross a panel from frame to frame, as those of a bridge or of branches.

use super::near::{off, receiver_of, square};
use super::*;
use link::scramble::split_mix64;

const SIZE: [usize; 2] = [320, 240];
const CENTRE: [f32; 2] = [163.4, 118.8];
const PITCH: f32 = 9.0;
/// The board's half width (pitches).
const BOARD: f32 = 4.4;

/// Sunlight right of an edge, up to the next edge, and a seventh of it elsewhere.
fn sunlight(x: f32, edge: f32) -> f32 {
    let beyond = |edge: f32| 1.0 / (1.0 + libm::expf((edge - x) / 0.9));
    0.15 + 0.85 * (beyond(edge) - beyond(edge + 60.0)).abs()
}

/// A panel before blocks, the edges of its shadows at `edge_px` and 60 px to the right.
fn in_shade(bits: u64, number: u64, edge_px: f32) -> Vec<u8> {
    let random = |value: u64, below: u64| (split_mix64(value) % below) as f32;
    let grey = |i: usize| {
        let at = [i % SIZE[0], i / SIZE[0]];
        let [column, row] = [0, 1].map(|axis| (at[axis] as f32 - CENTRE[axis]) / PITCH);
        let light = if column.abs().max(row.abs()) > BOARD {
            0.2 + 0.01 * random((at[0] / 9 + 100 * (at[1] / 9)) as u64, 90)
        } else {
            0.7
        };
        let [near_column, near_row] = [column, row].map(|c| (libm::roundf(c + 3.5)).clamp(0.0, 7.0));
        let (u, v) = (column + 3.5 - near_column, row + 3.5 - near_row);
        let led = 8 * near_row as u32 + near_column as u32;
        let height = if bits >> led & 1 == 1 { 2.4 } else { 0.0 };
        let light = light * sunlight(at[0] as f32, edge_px) + height * libm::expf(-(u * u + v * v) / 0.08);
        let noise = random(number << 32 | i as u64, 5) - 2.0;
        (118.0 * libm::powf(light, 1.0 / 2.2) + noise).clamp(0.0, 255.0) as u8
    };
    (0..SIZE[0] * SIZE[1]).map(grey).collect()
}

#[test]
fn panels_that_shadows_cross_are_read() {
    const FRAMES: u64 = 40;
    let panels = panels(FRAMES as usize);
    let mut receiver = receiver_of(SIZE[0], SIZE[1]);
    let mut wrong_bits = |number: u64| {
        let bits = panels[number as usize].bits();
        let pixels = in_shade(bits, number, 104.0 + 0.7 * number as f32);
        let frame = Frame::new(&pixels, SIZE[0], SIZE[1]).unwrap();
        let reading = receiver.frame(number, &frame).reading.ok()?;
        let is_in_place = off(&reading.corners, &square(CENTRE, PITCH)) < 0.3 * PITCH;
        is_in_place.then(|| (reading.detection.bits.bits() ^ bits).count_ones())
    };
    let read: Vec<u32> = (0..FRAMES).filter_map(&mut wrong_bits).collect();
    assert!(read.len() >= 38, "{} of {FRAMES} read in place", read.len());
    // With the shadows, 27 are wrong.
    assert!(read.iter().sum::<u32>() <= 12, "wrong bits {read:?}");
}
