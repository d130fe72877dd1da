//! Two symbols in a frame in which every LED is close to On or Off: one above a line, the other below.

use super::super::level_prior::NOISIER;
use super::{LineDelay, Rows};
use super::{SPLIT, SPLIT_KNOWN};
use link::panel::{LEDS, PanelFrame, SoftPanel};

/// The difference of α between a panel's middle and its ends, for a clean edge alone.
const STEP_ROWS: f32 = 7.0;
/// A change with a nearly clean edge may have caught LEDs this close to it (share of half the panel): a row.
const BESIDE: f32 = 0.25;
/// Intervals between tried places of an edge (count).
const EDGES: usize = 16;
/// Log-likelihood ratio of an LED that agrees, same symbol against chance (nats): wrong in one of 50.
const SAME_NATS: f32 = 0.67;
/// The same, with opposite sign, of an LED that does not agree (nats).
const OTHER_NATS: f32 = 3.2;
/// LEDs beyond the edge that differ from the symbol before, at least (count).
const DIFFER: u32 = 2;

/// Read from above, and from below.
const SIGNS: [f32; 2] = [1.0, -1.0];

/// A panel that is one symbol's above a line and another's below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    /// LEDs of the symbol that ended.
    pub ended: PanelFrame,
    /// The distance of the edge below the panel's middle, in image pixels.
    edge: f32,
    /// The least slope of α at the edge, in shares an image pixel.
    slope: f32,
}

impl Split {
    /// α in the panel's middle.
    pub fn middle(&self) -> f32 {
        0.5 - self.slope * self.edge
    }

    /// The growth of α from one column of LEDs to the next, and from one row to the next.
    pub fn growth(&self, rows: &Rows) -> [f32; 2] {
        rows.growth(self.slope)
    }

    /// Whether an LED is in a row next to the edge.
    pub fn is_beside(&self, led: usize, rows: &Rows) -> bool {
        (rows.below[led] - self.edge).abs() < BESIDE * rows.half
    }
}

/// Finds the line that splits a reading: its `bits` above the line, or below it if the camera reads upwards, are those of the symbol
/// `before`, and the others of another symbol.
///
/// Until the direction of reading is known, one mistake leads to the next. If a few rows of the last frame were the end of a symbol, and
/// this went unnoticed, these rows differ in the next frame, as if that frame began another symbol. The evidence in the last frame decides
/// between the two directions, unless the change itself caught a row: then that frame has more `noise` than this one. A film's first frame
/// gives no evidence, and the camera counts as reading from above, as nearly all do. If a camera reads from below and every second frame
/// shows a change, the delay must be configured.
pub(super) fn split(bits: PanelFrame, before: &SoftPanel, noise: f32, delay: &mut LineDelay, rows: &Rows) -> Option<Split> {
    let is_second = *before != SoftPanel::ERASED;
    let was_second = core::mem::replace(&mut delay.is_second, is_second);
    let was_clear = core::mem::replace(&mut delay.noise, noise) <= NOISIER * noise;
    let known = delay.precision > 0.0;
    if !is_second || delay.is_at_once(rows) || known && !delay.is_steep(rows) {
        delay.hints = [0.0; 2];
        return None;
    }
    let agreement = (bits.bits() ^ !before.hard().bits(), before.seen());
    let edges = SIGNS.map(|sign| edge(agreement, sign, rows));
    let gains = edges.map(|edge| edge.map_or(0.0, |(gain, _)| gain));
    let hints = core::mem::replace(&mut delay.hints, gains);
    for (way, sign) in SIGNS.into_iter().enumerate() {
        if known && sign * delay.mean > 0.0 && gains[way] >= SPLIT_KNOWN {
            delay.read_two();
            return edges[way].map(|(_, split)| split);
        }
    }
    let way = usize::from(gains[1] > gains[0]);
    let (gain, split) = edges[way]?;
    if gain < SPLIT || !was_clear {
        return None;
    }
    if !was_second && SIGNS[way] < 0.0 {
        delay.hints = [0.0; 2];
        return None;
    }
    // The delay known so far has the wrong direction.
    *delay = LineDelay {
        noise,
        is_second,
        ..LineDelay::UNKNOWN
    };
    if hints[1 - way] >= SPLIT_KNOWN {
        delay.add_edge(-split.slope, rows);
        return None;
    }
    delay.add_edge(split.slope, rows);
    delay.read_two();
    Some(split)
}

/// The likeliest edge of a camera that reads from above (`sign` 1) or from below (-1), and its evidence in nats; `None` if fewer than
/// [`DIFFER`] LEDs beyond it differ from the symbol before.
fn edge(agreement: (u64, u64), sign: f32, rows: &Rows) -> Option<(f32, Split)> {
    let mut found: Option<(f32, Split)> = None;
    let slope = sign * STEP_ROWS / rows.half;
    for step in 1..EDGES {
        let at = sign * rows.half * (2.0 * step as f32 / EDGES as f32 - 1.0);
        let is_ended = |led: usize| sign * rows.below[led] < sign * at;
        let (gain, ended, differ) = evidence(agreement, is_ended);
        if gain <= 0.0 || differ < DIFFER || found.is_some_and(|(best, _)| gain <= best) {
            continue;
        }
        let split = Split { ended, edge: at, slope };
        found = Some((gain, split));
    }
    found
}

/// The evidence, in nats, that one part of the panel shows the symbol before rather than agreeing by chance; the LEDs of that part; and the
/// number of the others that differ from it.
fn evidence((agree, seen): (u64, u64), is_ended: impl Fn(usize) -> bool) -> (f32, PanelFrame, u32) {
    let ended = (0..LEDS).fold(0u64, |ended, led| ended | u64::from(is_ended(led)) << led);
    let differ = (!agree & seen & !ended).count_ones();
    (agreement_nats(agree, seen & ended), PanelFrame::from_bits(ended), differ)
}

/// The log-likelihood ratio of same symbol against chance if the `known` LEDs agree by the mask `agree`, in nats.
pub(super) fn agreement_nats(agree: u64, known: u64) -> f32 {
    let [same, other] = [agree, !agree].map(|leds| (leds & known).count_ones() as f32);
    SAME_NATS * same - OTHER_NATS * other
}
