//! Two symbols in a frame in which every LED is as good as On or Off: the one above a line, the other below.

use super::super::level_prior::NOISIER;
use super::{LineDelay, Rows};
use super::{SPLIT, SPLIT_KNOWN};
use link::panel::{LEDS, PanelFrame, SoftPanel};

/// By how much α differs so where nothing but a clean edge was seen.
const STEP_ROWS: f32 = 7.0;
/// A change that nearly has a clean edge may have caught LEDs that are so near to it (share of half the panel): a row.
const BESIDE: f32 = 0.25;
/// Places of an edge that are looked at, one less (count).
const EDGES: usize = 16;
/// How much likelier an LED that agrees is its symbol's than one by chance (nats): wrong in one of 50.
const SAME_NATS: f32 = 0.67;
/// How much less likely one that does not (nats).
const OTHER_NATS: f32 = 3.2;
/// LEDs that differ from the symbol before in the rest of the reading, at least (count).
const DIFFER: u32 = 2;

/// Read from above, and from below.
const SIGNS: [f32; 2] = [1.0, -1.0];

/// A panel that is one symbol's above a line and another's below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    /// LEDs of the symbol that ended.
    pub ended: PanelFrame,
    /// How far below the panel's middle the one begins and the other ends, in image pixels.
    edge: f32,
    /// How steeply α goes from one to the other, at least, in shares an image pixel.
    slope: f32,
}

impl Split {
    /// α in the panel's middle.
    pub fn middle(&self) -> f32 {
        0.5 - self.slope * self.edge
    }

    /// By how much it grows from one column of LEDs to the next, and from one row to the next.
    pub fn growth(&self, rows: &Rows) -> [f32; 2] {
        rows.growth(self.slope)
    }

    /// Whether an LED is in a row next to the edge.
    pub fn is_beside(&self, led: usize, rows: &Rows) -> bool {
        (rows.below[led] - self.edge).abs() < BESIDE * rows.half
    }
}

/// Tells whether a reading's `bits` are those of the symbol `before` above a line, or below it where the camera reads upwards, and of
/// another symbol elsewhere.
///
/// As long as it is not known from where the camera reads, one mistake begets another: were few rows of the last frame the end of a symbol,
/// and nobody saw that, then these few differ in the next frame, as if that began another symbol. What the last frame's rows had in common
/// with the symbol before it tells which it is, unless the change itself has caught a row: then more `noise` is left of that frame than of
/// this one. Where a film begins nothing tells, and a camera is taken to read from above, as nearly all do: one that reads from below and
/// whose every second frame shows a change has to be told.
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
    // What was known of the other way was wrong.
    *delay = LineDelay {
        noise,
        is_second,
        ..LineDelay::UNKNOWN
    };
    if hints[1 - way] >= SPLIT_KNOWN {
        delay.saw_edge(-split.slope, rows);
        return None;
    }
    delay.saw_edge(split.slope, rows);
    delay.read_two();
    Some(split)
}

/// The likeliest edge of a camera that reads from above (`sign` 1) or from below (-1), and what speaks for it, in nats; none where hardly
/// an LED beyond it differs from the symbol before.
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

/// By how much likelier LEDs are the symbol's before if they are those of a part of the panel, than if they are by chance; these LEDs; and
/// how many of the rest differ from it.
fn evidence((agree, seen): (u64, u64), is_ended: impl Fn(usize) -> bool) -> (f32, PanelFrame, u32) {
    let ended = (0..LEDS).fold(0u64, |ended, led| ended | u64::from(is_ended(led)) << led);
    let differ = (!agree & seen & !ended).count_ones();
    (agreement_nats(agree, seen & ended), PanelFrame::from_bits(ended), differ)
}

/// By how much likelier it is that LEDs of a mask `agree` as they do if they show the same symbol than if they do not, in nats.
pub(super) fn agreement_nats(agree: u64, known: u64) -> f32 {
    let [same, other] = [agree, !agree].map(|leds| (leds & known).count_ones() as f32);
    SAME_NATS * same - OTHER_NATS * other
}
