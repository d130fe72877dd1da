//! Rolling shutter: the delay of each line relative to the one above, in exposures.
//!
//! In an exposure that catches two symbols, the share of the next one is greater in later lines. With a delay of Δ exposures a line, α of
//! the LEDs grows by Δ from line to line, from 0 (last symbol throughout) to 1 (next symbol throughout). Such a frame determines Δ, the
//! time of a line relative to that of an exposure, and the moment of the change, but neither time alone.
//!
//! If Δ is so great that the change catches hardly a row of LEDs, every LED is close to On or Off, and the frame looks like a symbol of its
//! own. `lines/split.rs` recognises it because its LEDs on one side of some line are those of the symbol before, and the others are not.

mod reading;
mod share;
mod split;

use link::panel::{LEDS, SIDE};

/// The greatest supported delay between two lines (exposures).
pub const LINE_DELAY_MAX: f32 = 2.0;
/// Initial differences of α between a panel's middle and its ends, if nothing is known. More: slower.
const SPREADS: [f32; 5] = [0.15, 0.35, 0.8, 1.8, 4.0];
/// The number of these slopes, read from above and from below.
const SLOPES: usize = 2 * SPREADS.len();
/// The standard deviation of a configured delay (share of it).
const CONFIGURED_DEVIATION: f32 = 0.3;
/// The standard deviation of a frame's delay beyond noise (share of it).
const SEEN_UNSURE: f32 = 0.1;
/// The weight that earlier frames keep from one frame to the next (share), because exposures change with the light. Higher: surer.
const KEEP: f32 = 0.9;
/// Changes that all lines saw at once, until the camera counts as one that exposes all lines at once (frames).
const AT_ONCE_FRAMES: u32 = 8;
/// That verdict holds for panels up to this height (multiple of the height of the highest panel that showed such a change).
const HIGHER: f32 = 1.5;
/// Minimum difference of α between a panel's middle and its ends if a change crosses the panel within a row or two of LEDs.
const STEEP: f32 = 1.5;
/// Minimum evidence for two symbols in a clean reading, if the delay of lines is unknown (nats). Lower: chance agreement looks like a part
/// of the symbol before.
const SPLIT: f32 = 15.0;
/// The standard deviation of the slope of a clean edge (share of it).
const EDGE_UNSURE: f32 = 0.7;
/// The same if lines are known to be that slow (nats).
const SPLIT_KNOWN: f32 = 4.0;

/// The estimated delay between lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LineDelay {
    /// Δ, in exposures a line of the camera; positive if it reads from above.
    mean: f32,
    /// 1 over the variance of that; 0 if unknown.
    precision: f32,
    /// Changes that all lines saw at once, while nothing else was known.
    at_once: u32,
    /// The height of the highest panel that showed one, in lines.
    highest_px: f32,
    /// The evidence of the last frame for an edge, read from above and from below, if it was read as one symbol (nats).
    hints: [f32; 2],
    /// The residual noise of that frame; infinite if it was read as two symbols.
    noise: f32,
    /// Whether the symbol before that frame was known.
    is_second: bool,
}

/// A panel's LEDs in relation to the camera's lines.
#[derive(Clone, Copy)]
struct Rows {
    /// The distance of each LED below the panel's middle, in image pixels.
    below: [f32; LEDS],
    /// Half of the height from the highest to the lowest LED, in image pixels.
    half: f32,
    /// Lines of the camera in an image pixel.
    lines: f32,
}

impl Rows {
    /// The LEDs at these centres in an image whose pixels are `lines` high.
    fn of(centre: &[[f32; 2]; LEDS], lines: f32) -> Self {
        let middle = centre.iter().map(|[_, y]| y).sum::<f32>() / LEDS as f32;
        let below = centre.map(|[_, y]| y - middle);
        let half = below.iter().fold(1.0f32, |half, y| half.max(y.abs()));
        Self { below, half, lines }
    }

    /// The growth of α from one column of LEDs to the next, and from one row to the next, given its `slope` from one image pixel to the one
    /// below.
    fn growth(&self, slope: f32) -> [f32; 2] {
        let last = SIDE - 1;
        let along = |end: usize| slope * (self.below[end] - self.below[0]) / last as f32;
        [along(last), along(SIDE * last)]
    }
}

impl LineDelay {
    /// An unknown delay; all zeros.
    pub const UNKNOWN: Self = Self {
        mean: 0.0,
        precision: 0.0,
        at_once: 0,
        highest_px: 0.0,
        hints: [0.0; 2],
        noise: 0.0,
        is_second: false,
    };

    /// A configured delay; 0 for a camera that exposes all lines at once.
    pub fn configured(delay: f32) -> Self {
        let unsure = CONFIGURED_DEVIATION * delay;
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

    /// Δ, if it is known: 0 if all lines were seen to be exposed at once.
    pub fn known(&self) -> Option<f32> {
        (self.precision > 0.0 || self.at_once >= AT_ONCE_FRAMES).then_some(self.mean)
    }

    /// The initial slopes of α in an image, in shares an image pixel: the known one, or all candidates.
    fn slopes(&self, rows: &Rows) -> heapless::Vec<f32, SLOPES> {
        let mut slopes = heapless::Vec::new();
        if self.precision > 0.0 {
            // The capacity holds all candidates.
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

    /// Whether all lines are known to be exposed at once, for a panel of that height.
    fn is_at_once(&self, rows: &Rows) -> bool {
        let height_px = rows.half * rows.lines;
        self.precision == 0.0 && self.at_once >= AT_ONCE_FRAMES && height_px <= HIGHER * self.highest_px
    }

    /// The loss of a slope that differs from the known one, in nats.
    fn loss(&self, slope: f32, rows: &Rows) -> f32 {
        let off = slope / rows.lines - self.mean;
        0.5 * self.precision * off * off
    }

    /// Adds a change that all lines saw at once.
    fn saw_at_once(&mut self, rows: &Rows) {
        if self.precision == 0.0 {
            self.at_once = self.at_once.saturating_add(1);
            self.highest_px = self.highest_px.max(rows.half * rows.lines);
        }
    }

    /// Adds the slope of a frame, and its precision.
    fn add_slope(&mut self, slope: f32, precision: f32, rows: &Rows) {
        let delay = slope / rows.lines;
        // The errors of the model add to the noise.
        let unsure = SEEN_UNSURE * delay;
        let precision = 1.0 / (1.0 / (precision * rows.lines * rows.lines) + unsure * unsure);
        if delay == 0.0 || !precision.is_normal() {
            return;
        }
        self.precision = KEEP * self.precision + precision;
        self.mean += precision / self.precision * (delay - self.mean);
        self.at_once = 0;
    }

    /// Adds a clean edge, whose slope is a lower bound.
    fn add_edge(&mut self, slope: f32, rows: &Rows) {
        if self.precision == 0.0 {
            self.mean = slope / rows.lines;
            let unsure = EDGE_UNSURE * self.mean;
            self.precision = 1.0 / (unsure * unsure);
            self.at_once = 0;
        }
    }

    /// Notes that the last frame was read as two symbols. Less is known of the second than of a frame of its own, so that it gives no
    /// evidence for edges.
    fn read_two(&mut self) {
        (self.hints, self.noise) = ([0.0; 2], f32::INFINITY);
    }

    /// The minimum evidence, in nats, for a frame that shows the end of the symbol before.
    fn evidence_needed(&self) -> f32 {
        if self.precision > 0.0 { SPLIT_KNOWN } else { SPLIT }
    }

    /// Whether α may rise from 0 to 1 within a row or two of LEDs.
    fn is_steep(&self, rows: &Rows) -> bool {
        self.mean.abs() * rows.lines * rows.half > STEEP
    }
}

#[cfg(test)]
mod tests;
