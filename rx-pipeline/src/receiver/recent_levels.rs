//! The places of a lattice that have recently been lit.

use crate::lattice::Lattice;
use link::panel::{LEDS, PanelFrame, SIDE};

/// Number of frames over which the share of lit frames is averaged (count). Lower: known sooner, and from fewer symbols.
const MEMORY: u8 = 8;
/// Increase of a place's level in a frame in which it is lit; the maximum level is then 248.
const GAIN: u8 = 31;
/// A place with a higher level has an LED. A place between LEDs is at 0, an LED that is lit in half of the frames at 124.
const LIT: u8 = 25;
/// Minimum number of frames before levels are used (count). Fewer: LEDs that happen to be Off look like gaps.
const FRAMES: u8 = 12;

/// Minimum number of lit LEDs outside a new place that prove that a panel at rest has not moved there (count).
const LEFT: usize = 4;
/// The range of places on a panel (pitches from its first LED).
const ON_PANEL: core::ops::Range<f32> = -0.5..SIDE as f32 - 0.5;

/// The recent level of each place.
#[derive(Clone, Debug)]
pub(super) struct RecentLevels {
    level: [u8; LEDS],
    frames: u8,
}

impl RecentLevels {
    pub const NONE: Self = Self {
        level: [0; LEDS],
        frames: 0,
    };

    /// Processes the bits of a frame.
    pub fn see(&mut self, bits: PanelFrame) {
        for (led, level) in self.level.iter_mut().enumerate() {
            *level -= *level / MEMORY;
            *level += if bits.led(led) { GAIN } else { 0 };
        }
        self.frames = self.frames.saturating_add(1);
    }

    /// Whether `there` excludes LEDs of the panel that has been on `lattice`.
    pub fn leaves_leds(&self, lattice: &Lattice, there: &Lattice) -> bool {
        let Some(places) = self.places() else { return false };
        let is_left = |led: &usize| {
            let [column, row] = [led % SIDE, led / SIDE].map(|place| place as f32);
            let at = there.coordinates(lattice.position(column, row));
            at.is_none_or(|at| !at.iter().all(|along| ON_PANEL.contains(along)))
        };
        (0..LEDS).filter(|led| places >> led & 1 == 1).filter(is_left).count() >= LEFT
    }

    /// The places that have been lit, as bits; none after too few frames.
    pub fn places(&self) -> Option<u64> {
        let lit = |places: u64, led: usize| places | u64::from(self.level[led] > LIT) << led;
        (self.frames >= FRAMES).then(|| (0..LEDS).fold(0, lit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A panel at rest stays where its LEDs have been lit; a panel that is followed one line off may return to its place.
    #[test]
    fn a_panel_leaves_no_line_that_was_lit() {
        let lattice = Lattice {
            centre: [40.0, 40.0],
            column: [5.0, 0.5],
            row: [-0.5, 5.0],
            tilt: [0.0; 2],
        };
        let beside = |columns: f32, rows: f32| Lattice {
            centre: core::array::from_fn(|i| lattice.centre[i] + columns * lattice.column[i] + rows * lattice.row[i]),
            ..lattice
        };
        let after = |bits: u64| {
            let mut lit = RecentLevels::NONE;
            (0..FRAMES).for_each(|_| lit.see(PanelFrame::from_bits(bits)));
            lit
        };
        let whole = after(u64::MAX);
        assert!(!whole.leaves_leds(&lattice, &beside(0.3, -0.3)));
        for (columns, rows) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -2.0)] {
            assert!(whole.leaves_leds(&lattice, &beside(columns, rows)));
        }
        // The last row has never been lit.
        let without_last = after(u64::MAX >> SIDE);
        assert!(!without_last.leaves_leds(&lattice, &beside(0.0, -1.0)));
        assert!(without_last.leaves_leds(&lattice, &beside(0.0, 1.0)));
        assert!(!RecentLevels::NONE.leaves_leds(&lattice, &beside(1.0, 0.0)));
    }

    /// A panel whose LEDs are every second place of the lattice: no frame shows all of them.
    #[test]
    fn places_that_are_never_lit_are_between_leds() {
        const LEDS_OF_PANEL: u64 = 0xaa55_aa55_aa55_aa55;
        let mut lit = RecentLevels::NONE;
        let mut random = 0x9e37_79b9_7f4a_7c15u64;
        for frame in 0..20 {
            assert_eq!(lit.places().is_some(), frame >= FRAMES, "frame {frame}");
            random = random.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            lit.see(PanelFrame::from_bits((random ^ random >> 29) & LEDS_OF_PANEL));
        }
        let places = lit.places().expect("enough frames");
        assert_eq!(places & !LEDS_OF_PANEL, 0);
        assert!((places ^ LEDS_OF_PANEL).count_ones() <= 2, "{places:016x}");
    }
}
