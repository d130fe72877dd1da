//! Samples of the light on a panel.

use super::outline::{Outline, Point};
use crate::frame::Frame;
use link::panel::{LEDS, SIDE};

/// One grey level in units of a sample: 256.
pub const GREY: i32 = 1 << 8;
/// Samples on each LED: its centre, and a quarter of a pitch to the left, right, above and below.
const ON_LED: usize = 5;

/// The light on and between LEDs, in 1/256 of a grey level.
pub struct Samples {
    /// The samples on each LED.
    pub leds: [[i32; ON_LED]; LEDS],
    /// Samples at the corners of the cells. The outermost are half a pitch outside the outer LEDs.
    between: [[i32; SIDE + 1]; SIDE + 1],
}

impl Samples {
    /// Samples the panel at `outline`; `None` if part of it is outside the frame.
    pub fn take(frame: &Frame<'_>, outline: &Outline) -> Option<Self> {
        let [column, row] = outline.steps();
        let quarter = [column, row].map(|step| step.over(4));
        let half = column.over(2).plus(row.over(2));
        let mut leds = [[0; ON_LED]; LEDS];
        for (led, samples) in leds.iter_mut().enumerate() {
            let centre = outline.led(led % SIDE, led / SIDE);
            let points = [
                centre,
                centre.minus(quarter[0]),
                centre.plus(quarter[0]),
                centre.minus(quarter[1]),
                centre.plus(quarter[1]),
            ];
            for (sample, point) in samples.iter_mut().zip(points) {
                *sample = light(frame, point)?;
            }
        }
        let mut between = [[0; SIDE + 1]; SIDE + 1];
        for (v, samples) in between.iter_mut().enumerate() {
            for (u, sample) in samples.iter_mut().enumerate() {
                // The corner above and to the left of LED (u, v); beyond the last LED, below and to the right of it.
                let mut point = outline.led(u.min(SIDE - 1), v.min(SIDE - 1)).minus(half);
                if u == SIDE {
                    point = point.plus(column);
                }
                if v == SIDE {
                    point = point.plus(row);
                }
                *sample = light(frame, point)?;
            }
        }
        Some(Self { leds, between })
    }

    /// The difference of an LED and the corners of its cell, in 1/256 of a grey level.
    pub fn feature(&self, led: usize) -> i32 {
        let [centre, around @ ..] = self.leds[led];
        let bright = (2 * centre + around.iter().sum::<i32>()) / 6;
        let (u, v) = (led % SIDE, led / SIDE);
        let [above, below] = [self.between[v], self.between[v + 1]];
        bright - (above[u] + above[u + 1] + below[u] + below[u + 1]) / 4
    }
}

/// The bilinearly interpolated light at a point; `None` outside the frame.
pub fn light(frame: &Frame<'_>, point: Point) -> Option<i32> {
    let [x, y] = [point.x, point.y];
    let column = usize::try_from(x >> 16).ok()?;
    let row = usize::try_from(y >> 16).ok()?;
    let [right, lower] = [x, y].map(|at| (at >> 8) & 0xff);
    let (above, below) = (frame.row(row)?, frame.row(row + 1)?);
    let pair = |pixels: &[u8]| -> Option<i32> {
        let [left_grey, right_grey] = *pixels.get(column..)?.first_chunk()?;
        Some(i32::from(left_grey) * (GREY - right) + i32::from(right_grey) * right)
    };
    Some((pair(above)? * (GREY - lower) + pair(below)? * lower) >> 8)
}
