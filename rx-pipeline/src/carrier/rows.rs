//! Rows of LEDs that have one sign each in all frames: those of a carrier that is in step with the frames, of lines that are exposed one
//! after another.
//!
//! No frame then shows the complement of another, nor any contrast that changes. But the sync panel shows which rows are inverted.

use super::NEAR;
use link::framing::SYNC_SEEN;
use link::panel::{PanelFrame, SIDE, SoftPanel};

/// How well each row has to show the sync panel or its complement (correlation), and how many may not (count).
const SEEN_BY: f32 = 0.85;
/// See there.
const UNSEEN: u32 = 1;
/// Sync panels with the same rows inverted, from which on all frames have (count). Fewer: carriers that are not in step seem to be.
const SIGHTINGS: u8 = 3;

/// The rows that are inverted, but for one sign common to all.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    /// A bit for each row, none for the first.
    inverted: u8,
    /// When a sync panel showed that last (frame periods), and how many have.
    time: f64,
    sightings: u8,
}

impl Rows {
    pub const NONE: Self = Self {
        inverted: 0,
        time: f64::NEG_INFINITY,
        sightings: 0,
    };

    /// Takes in what a frame showed.
    pub fn see(&mut self, time: f64, soft: &SoftPanel) {
        let Some(inverted) = SYNC_SEEN.iter().find_map(|sync| inverted(sync, soft)) else {
            return;
        };
        if time - self.time < NEAR {
            return;
        }
        let differing = (inverted ^ self.inverted).count_ones();
        let is_slow = differing <= 1 && self.sightings >= SIGHTINGS;
        *self = Self {
            inverted,
            time,
            sightings: if differing == 0 || is_slow {
                self.sightings.saturating_add(1)
            } else {
                1
            },
        };
    }

    /// The LEDs that are inverted; none as long as that is not known.
    pub fn leds(&self) -> u64 {
        let is_inverted = |row: usize| self.sightings >= SIGHTINGS && self.inverted >> row & 1 == 1;
        (0..SIDE).fold(0, |leds, row| leds | if is_inverted(row) { 0xff << (SIDE * row) } else { 0 })
    }
}

/// The rows that show the complement of a sync panel, but for one sign common to all, if the others show it.
fn inverted(sync: &PanelFrame, soft: &SoftPanel) -> Option<u8> {
    let (mut inverted, mut unseen) = (0u8, 0);
    for row in 0..SIDE {
        let leds = SIDE * row..SIDE * (row + 1);
        let all: i32 = leds.clone().map(|led| i32::from(soft.0[led]).abs()).sum();
        let agreeing: i32 = leds
            .map(|led| {
                if sync.led(led) {
                    i32::from(soft.0[led])
                } else {
                    -i32::from(soft.0[led])
                }
            })
            .sum();
        unseen += u32::from(agreeing.abs() as f32 <= SEEN_BY * all as f32);
        inverted |= u8::from(agreeing < 0) << row;
    }
    (unseen <= UNSEEN).then_some(if inverted & 1 == 1 { !inverted } else { inverted })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No orientation of the sync panel looks like another whose rows are inverted.
    #[test]
    fn sync_panels_have_no_rows_inverted() {
        for sync in SYNC_SEEN {
            let soft = SoftPanel::certain(sync, 40);
            let seen: std::vec::Vec<u8> = SYNC_SEEN.iter().filter_map(|other| inverted(other, &soft)).collect();
            assert!(seen.iter().all(|&rows| rows == 0) && !seen.is_empty(), "{seen:?}");
        }
    }
}
