//! Rows of LEDs that have the same sign in all frames: a rolling shutter sees a carrier in step with the frames.
//!
//! In this case, no frame shows the complement of another, and the contrast is constant. Only the sync panel shows which rows are inverted.

use super::NEAR;
use link::framing::SYNC_SEEN;
use link::panel::{PanelFrame, SIDE, SoftPanel};

/// Minimum correlation of each row with the sync panel or its complement.
const SEEN_BY: f32 = 0.85;
/// Maximum number of rows that show neither (count).
const UNSEEN: u32 = 1;
/// Number of sync panels with the same inverted rows after which the rows count as inverted in all frames (count). Fewer: carriers that are
/// not in step are accepted.
const SIGHTINGS: u8 = 3;

/// The inverted rows, up to one common sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    /// A bit for each row.
    inverted: u8,
    /// The time of the last sync panel that showed them (frame periods).
    time: f64,
    /// The number of these panels.
    sightings: u8,
    /// Whether a later frame showed no sync panel.
    is_over: bool,
}

impl Rows {
    pub const NONE: Self = Self {
        inverted: 0,
        time: f64::NEG_INFINITY,
        sightings: 0,
        is_over: true,
    };

    /// Processes a frame.
    pub fn see(&mut self, time: f64, soft: &SoftPanel) {
        let Some((inverted, seen)) = SYNC_SEEN.iter().find_map(|sync| inverted(sync, soft)) else {
            self.is_over = true;
            return;
        };
        if time - self.time < NEAR {
            return;
        }
        // A row that is not seen keeps its sign, and all signs are relative to a common one.
        let differing = (inverted ^ self.inverted) & seen;
        let is_complement = 2 * differing.count_ones() > seen.count_ones();
        let differing = if is_complement { !differing & seen } else { differing };
        let is_slow = differing.count_ones() <= 1 && self.sightings >= SIGHTINGS;
        *self = Self {
            inverted: self.inverted ^ differing,
            time,
            sightings: if differing == 0 || is_slow {
                // The same sync panel in another frame adds no evidence.
                self.sightings.saturating_add(u8::from(self.is_over))
            } else {
                1
            },
            is_over: false,
        };
    }

    /// The inverted LEDs; 0 until they are known.
    pub fn leds(&self) -> u64 {
        if self.sightings >= SIGHTINGS { leds_of(self.inverted) } else { 0 }
    }
}

/// The LEDs of the rows in a mask.
fn leds_of(rows: u8) -> u64 {
    (0..SIDE).fold(0, |leds, row| leds | (u64::from(rows >> row & 1) * 0xff) << (SIDE * row))
}

/// The rows that show the complement of a sync panel, and the rows that show either sign, if nearly all do.
fn inverted(sync: &PanelFrame, soft: &SoftPanel) -> Option<(u8, u8)> {
    let (mut inverted, mut seen) = (0u8, 0u8);
    // Positive for agreement.
    let agreement = soft.flipped(!sync.bits()).0.map(i32::from);
    for (row, leds) in agreement.chunks_exact(SIDE).enumerate() {
        let (agreeing, all) = leds.iter().fold((0, 0), |(agreeing, all), led| (agreeing + led, all + led.abs()));
        seen |= u8::from(agreeing.abs() as f32 > SEEN_BY * all as f32) << row;
        inverted |= u8::from(agreeing < 0) << row;
    }
    (seen.count_zeros() <= UNSEEN).then_some((inverted, seen))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No orientation of the sync panel looks like another one with inverted rows.
    #[test]
    fn sync_panels_have_no_rows_inverted() {
        for sync in SYNC_SEEN {
            let soft = SoftPanel::certain(sync, 40);
            let seen: std::vec::Vec<_> = SYNC_SEEN.iter().filter_map(|other| inverted(other, &soft)).collect();
            assert!(
                seen.iter().all(|&(rows, _)| [0, 0xff].contains(&rows)) && !seen.is_empty(),
                "{seen:?}"
            );
        }
    }

    /// A sync panel with some inverted rows; `other` alters LEDs of its last row.
    fn sync_panel(inverted: u8, other: u64) -> SoftPanel {
        let bits = SYNC_SEEN[0].bits() ^ leds_of(inverted) ^ other << (SIDE * (SIDE - 1));
        SoftPanel::certain(PanelFrame::from_bits(bits), 40)
    }

    const ANOTHER: SoftPanel = SoftPanel::ERASED;

    #[test]
    fn a_row_that_already_shows_the_next_symbol_keeps_its_sign() {
        let mut rows = Rows::NONE;
        for number in 0..5 {
            let other = if number == 3 { 0x3f } else { 0 };
            rows.see(f64::from(20 * number), &sync_panel(0, other));
            assert_eq!(rows.leds(), 0, "sync panel {number}");
            rows.see(f64::from(20 * number + 10), &ANOTHER);
        }
    }

    #[test]
    fn rows_are_told_by_sync_panels_and_not_by_frames_of_one() {
        let mut rows = Rows::NONE;
        for frame in (0..50).step_by(4) {
            rows.see(f64::from(frame), &sync_panel(0b110, 0));
        }
        assert_eq!(rows.leds(), 0);
        for number in 1..3 {
            rows.see(f64::from(100 * number), &ANOTHER);
            rows.see(f64::from(100 * number + 10), &sync_panel(0b110, 0));
        }
        assert_eq!(rows.leds(), 0x00ff_ff00);
    }
}
