//! Lines read out one after another: by how much of an exposure each is later than the one above it.
//!
//! An exposure that catches two symbols then catches more of the next one, the later its line: with Δ exposures a line, α of the LEDs
//! grows by Δ from line to line, from 0 where the last symbol was shown throughout to 1 where the next one was. What such a frame tells is
//! Δ, the time of a line over that of an exposure, and the moment of the change; neither time alone.
//!
//! Where Δ is so great that hardly a row of LEDs is caught by the change, every LED is as good as On or Off, and the frame looks like a
//! symbol of its own: `lines/split.rs` tells it by its LEDs above some line, which are those of the symbol before, while those below are
//! not.

mod reading;
mod share;
mod split;

use link::panel::{LEDS, SIDE};

/// The greatest time between two lines that is reckoned with (exposures).
pub const LINE_DELAY_MAX: f32 = 2.0;
/// By how much α may differ between a panel's middle and its ends, to begin with where nothing is known. More of them: slower.
const SPREADS: [f32; 5] = [0.15, 0.35, 0.8, 1.8, 4.0];
/// As many, read from above and from below.
const SLOPES: usize = 2 * SPREADS.len();
/// How far what a person tells may be off (share of it, one standard deviation).
const TOLD_UNSURE: f32 = 0.3;
/// How far what a frame shows may be off beyond what noise explains (share of it, one standard deviation).
const SEEN_UNSURE: f32 = 0.1;
/// What earlier frames say of the slope is kept from one to the next (share): exposures change with the light. Higher: surer.
const KEEP: f32 = 0.9;
/// After so many changes that all lines saw at once, all lines are exposed at once (frames).
const AT_ONCE_FRAMES: u32 = 8;
/// As far as panels up to this height can show (multiple of that of the highest that showed one).
const HIGHER: f32 = 1.5;
/// A change crosses a panel within a row or two of LEDs where α would differ by so much between its middle and its ends.
const STEEP: f32 = 1.5;
/// What it takes to see two symbols in a clean reading (nats): where nothing is known of the lines, and where they are known to be
/// that slow. Lower: chance is taken for a part of the symbol before.
const SPLIT: f32 = 15.0;
/// How far the steepness of a clean edge may be off (share of it, one standard deviation).
const EDGE_UNSURE: f32 = 0.7;
/// See [`SPLIT`].
const SPLIT_KNOWN: f32 = 4.0;

/// What frames have told of the time between lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineDelay {
    /// Δ, in exposures a line of the camera; positive if it reads from above.
    mean: f32,
    /// 1 over the variance of that; 0 where nothing is known.
    precision: f32,
    /// Changes that all lines saw at once, while nothing else was known, and the highest panel that showed one, in lines.
    at_once: u32,
    highest_px: f32,
    /// What the last frame's LEDs would say of an edge, read from above and from below, where it was taken for one symbol (nats).
    hints: [f32; 2],
    /// What was left of that frame; infinite where it was read as two symbols.
    noise: f32,
    /// Whether something was known of the symbol before it.
    is_second: bool,
}

/// A panel's LEDs as the lines see them.
#[derive(Clone, Copy)]
struct Rows {
    /// By how many image pixels each LED is below the panel's middle.
    below: [f32; LEDS],
    /// Half of the way from the highest to the lowest LED, in image pixels.
    half: f32,
    /// Lines of the camera in an image pixel.
    lines: f32,
}

impl Rows {
    /// The LEDs at those places of an image of which a pixel is so many `lines` high.
    fn of(centre: &[[f32; 2]; LEDS], lines: f32) -> Self {
        let middle = centre.iter().map(|[_, y]| y).sum::<f32>() / LEDS as f32;
        let below = centre.map(|[_, y]| y - middle);
        let half = below.iter().fold(1.0f32, |half, y| half.max(y.abs()));
        Self { below, half, lines }
    }

    /// By how much α grows from one column of LEDs to the next, and from one row to the next, if it grows by `slope` from one image pixel
    /// to the one below it.
    fn growth(&self, slope: f32) -> [f32; 2] {
        let last = SIDE - 1;
        let along = |end: usize| slope * (self.below[end] - self.below[0]) / last as f32;
        [along(last), along(SIDE * last)]
    }
}

impl LineDelay {
    /// Nothing is known; all zeros.
    pub const UNKNOWN: Self = Self {
        mean: 0.0,
        precision: 0.0,
        at_once: 0,
        highest_px: 0.0,
        hints: [0.0; 2],
        noise: 0.0,
        is_second: false,
    };

    /// Goes on from what was told; 0 for a camera that exposes all lines at once.
    pub fn told(delay: f32) -> Self {
        let unsure = TOLD_UNSURE * delay;
        let (at_once, precision) = if delay == 0.0 {
            (AT_ONCE_FRAMES, 0.0)
        } else {
            (0, 1.0 / (unsure * unsure))
        };
        Self {
            mean: delay,
            precision,
            at_once,
            highest_px: f32::MAX,
            ..Self::UNKNOWN
        }
    }

    /// Δ, if it is known: 0 where all lines were seen to be exposed at once.
    pub fn known(&self) -> Option<f32> {
        (self.precision > 0.0 || self.at_once >= AT_ONCE_FRAMES).then_some(self.mean)
    }

    /// The slopes of α to begin with in an image, in shares an image pixel: the one that is known, or all that may be.
    fn slopes(&self, rows: &Rows) -> heapless::Vec<f32, SLOPES> {
        let mut slopes = heapless::Vec::new();
        if self.precision > 0.0 {
            // Whatever cannot be pushed is beyond all that is tried.
            let _ = slopes.push(self.mean * rows.lines);
        } else if !self.is_at_once(rows) {
            for spread in SPREADS {
                for sign in [1.0, -1.0] {
                    let _ = slopes.push(sign * spread / rows.half);
                }
            }
        }
        slopes
    }

    /// Whether all lines are known to be exposed at once, as far as a panel of that height can show.
    fn is_at_once(&self, rows: &Rows) -> bool {
        let height_px = rows.half * rows.lines;
        self.precision == 0.0 && self.at_once >= AT_ONCE_FRAMES && height_px <= HIGHER * self.highest_px
    }

    /// What it costs that the slope is another than that which is known, in nats.
    fn loss(&self, slope: f32, rows: &Rows) -> f32 {
        let off = slope / rows.lines - self.mean;
        0.5 * self.precision * off * off
    }

    /// Takes in a change that all lines saw at once.
    fn saw_at_once(&mut self, rows: &Rows) {
        if self.precision == 0.0 {
            self.at_once = self.at_once.saturating_add(1);
            self.highest_px = self.highest_px.max(rows.half * rows.lines);
        }
    }

    /// Takes in the slope that a frame showed, and its precision.
    fn saw(&mut self, slope: f32, precision: f32, rows: &Rows) {
        let delay = slope / rows.lines;
        // What the model leaves out is more than noise.
        let unsure = SEEN_UNSURE * delay;
        let precision = 1.0 / (1.0 / (precision * rows.lines * rows.lines) + unsure * unsure);
        if delay == 0.0 || !precision.is_normal() {
            return;
        }
        self.precision = KEEP * self.precision + precision;
        self.mean += precision / self.precision * (delay - self.mean);
        self.at_once = 0;
    }

    /// Takes in a clean edge, which is all the steeper the sharper it is.
    fn saw_edge(&mut self, slope: f32, rows: &Rows) {
        if self.precision == 0.0 {
            self.mean = slope / rows.lines;
            let unsure = EDGE_UNSURE * self.mean;
            self.precision = 1.0 / (unsure * unsure);
            self.at_once = 0;
        }
    }

    /// Notes that the last frame was read as two symbols: of the second less is known than a frame alone would tell, so that it tells
    /// nothing of edges.
    fn read_two(&mut self) {
        (self.hints, self.noise) = ([0.0; 2], f32::INFINITY);
    }

    /// What has to speak for the symbol before, in nats, so that a frame is taken for the end of it.
    fn evidence_needed(&self) -> f32 {
        if self.precision > 0.0 { SPLIT_KNOWN } else { SPLIT }
    }

    /// Whether α may go from 0 to 1 within a row or two of LEDs.
    fn is_steep(&self, rows: &Rows) -> bool {
        self.mean.abs() * rows.lines * rows.half > STEEP
    }
}

#[cfg(test)]
mod tests;
