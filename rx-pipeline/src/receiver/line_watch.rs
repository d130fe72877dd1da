//! Detects that a panel is followed one line off: the places beside one of its sides change with each symbol, while its own line on the
//! other side does not.
//!
//! A fit to a single frame cannot show this if the other seven lines fit. Successive symbols can: each changes the outer lines of a panel,
//! and nothing else next to it changes with each of them.

use crate::frame::Frame;
use crate::lattice::{Lattice, MIDDLE};
use link::panel::{LEDS, PanelFrame, SIDE};

/// The steps in columns and rows to the places beside each side of a panel.
const STEPS: [[i32; 2]; 4] = [[0, -1], [1, 0], [0, 1], [-1, 0]];
/// Bits of the four outer lines that differ from one symbol to the next, at least (count): half of them do in a message, 16, or 12 if one
/// line is not the panel's.
const SYMBOL: u32 = 6;
/// Minimum number of successive symbols that change the places beside a panel to prove that its LEDs are there (count). Lower: moved
/// sooner, and sometimes by a lamp.
const CHANGES: u8 = 3;
/// Minimum number of places that they change (count).
const CHANGED: u32 = 5;
/// Minimum number of places that have changed, or are lit beside a panel whose other line is Off, for a doubt (count).
const DOUBTED: u32 = 2;
/// LEDs of either state that show the levels of On and Off, at least (count).
const LEAST_LEDS: u32 = 4;

/// The sides of a followed panel.
#[derive(Clone, Debug)]
pub(super) struct LineWatch([Side; 4]);

/// The places beside a side, since the panel's line on the other side has changed.
#[derive(Clone, Copy, Debug)]
struct Side {
    last: Lines,
    /// The places that have changed with each symbol.
    changed: u8,
    /// Number of these symbols.
    changes: u8,
    /// Whether a symbol has changed neither line: the panel's own may be broken.
    is_still: bool,
}

/// Two lines in a frame.
#[derive(Clone, Copy, Debug)]
struct Lines {
    /// The bits of the panel's line on the other side.
    own: u8,
    /// The places beside the panel that are lit.
    beside: u8,
}

impl LineWatch {
    pub const NEW: Self = Self(
        [Side {
            last: Lines { own: 0, beside: 0 },
            changed: 0,
            changes: 0,
            is_still: false,
        }; 4],
    );

    /// Processes a frame of a single symbol, in which the panel on `lattice` was read as `bits`.
    pub fn see(&mut self, frame: &Frame<'_>, lattice: &Lattice, bits: PanelFrame) {
        let bits = bits.bits();
        let own = STEPS.map(|step| line(bits, step.map(|c| -c)));
        // Within a symbol, changes beside the panel are other light.
        let differing = self.0.iter().zip(own).map(|(side, own)| (side.last.own ^ own).count_ones());
        if differing.sum::<u32>() < SYMBOL {
            return;
        }
        let Some(threshold) = threshold(frame, lattice, bits) else { return };
        for ((side, step), own) in self.0.iter_mut().zip(STEPS).zip(own) {
            let beside = lit_beside(frame, lattice, step, threshold);
            side.see(Lines { own, beside });
        }
    }

    /// Whether the panel may be one line off.
    pub fn is_doubtful(&self) -> bool {
        self.0.iter().any(Side::is_doubtful)
    }

    /// The lattice of the panel and its bits in the last frame, if it is a line beside `lattice`, where these were `bits`.
    pub fn moved(&self, lattice: &Lattice, bits: PanelFrame) -> Option<(Lattice, PanelFrame)> {
        let (side, step) = self.0.iter().zip(STEPS).find(|(side, _)| side.is_of_panel())?;
        let [column, row] = step.map(|step| MIDDLE + step as f32);
        let centre = lattice.position(column, row);
        let beside = along(step).zip(0..SIDE).map(|(led, i)| u64::from(side.last.beside >> i & 1) << led);
        let bits = moved_by(bits.bits(), step) | beside.sum::<u64>();
        Some((Lattice { centre, ..*lattice }, PanelFrame::from_bits(bits)))
    }
}

impl Side {
    fn see(&mut self, now: Lines) {
        let changed = now.beside ^ self.last.beside;
        if now.own != self.last.own {
            (self.changed, self.changes, self.is_still) = (0, 0, false);
        } else if changed == 0 {
            (self.changed, self.changes, self.is_still) = (0, 0, true);
        } else {
            self.changed |= changed;
            self.changes = self.changes.saturating_add(1);
        }
        self.last = now;
    }

    /// Whether these may be the panel's LEDs. If all are lit, they are background.
    fn is_doubtful(&self) -> bool {
        let Lines { own, beside } = self.last;
        let is_lit = own == 0 && (DOUBTED..SIDE as u32).contains(&beside.count_ones());
        is_lit && !self.is_still || self.changed.count_ones() >= DOUBTED
    }

    /// Whether these are the panel's LEDs.
    fn is_of_panel(&self) -> bool {
        self.changes >= CHANGES && self.changed.count_ones() >= CHANGED
    }
}

/// The bits at the places that lie that many columns and rows on.
fn moved_by(bits: u64, [columns, rows]: [i32; 2]) -> u64 {
    (0..LEDS).fold(0, |moved, led| {
        let [column, row] = [led % SIDE, led / SIDE].map(|place| place as i32);
        let at = [column + columns, row + rows];
        let is_on = at.iter().all(|at| (0..SIDE as i32).contains(at)) && bits >> (at[1] * SIDE as i32 + at[0]) & 1 == 1;
        moved | u64::from(is_on) << led
    })
}

/// The LEDs of the outer line in a direction.
fn along(step: [i32; 2]) -> impl Iterator<Item = usize> {
    (0..LEDS).filter(move |led| {
        let place = [led % SIDE, led / SIDE];
        (0..2).all(|axis| match step[axis] {
            -1 => place[axis] == 0,
            1 => place[axis] == SIDE - 1,
            _ => true,
        })
    })
}

/// The bits of these LEDs.
fn line(bits: u64, step: [i32; 2]) -> u8 {
    along(step)
        .zip(0..SIDE)
        .fold(0, |line, (led, i)| line | ((bits >> led & 1) as u8) << i)
}

/// The places beside a side that are lit, as bits. Places outside the frame are not.
fn lit_beside(frame: &Frame<'_>, lattice: &Lattice, step: [i32; 2], threshold: f32) -> u8 {
    let mut lit = 0;
    for i in 0..SIDE {
        let [column, row] = step.map(|step| match step {
            -1 => -1.0,
            1 => SIDE as f32,
            _ => i as f32,
        });
        let is_lit = frame
            .nearest(lattice.position(column, row))
            .is_some_and(|grey| f32::from(grey) > threshold);
        lit |= u8::from(is_lit) << i;
    }
    lit
}

/// The grey level halfway between Off and On LEDs; none if either are too few, or if Off LEDs are not darker.
fn threshold(frame: &Frame<'_>, lattice: &Lattice, bits: u64) -> Option<f32> {
    if !(LEAST_LEDS..=LEDS as u32 - LEAST_LEDS).contains(&bits.count_ones()) {
        return None;
    }
    let mean = |of: u64| {
        let leds = (0..LEDS).filter(|led| of >> led & 1 == 1);
        let greys = leds.filter_map(|led| frame.nearest(lattice.position((led % SIDE) as f32, (led / SIDE) as f32)));
        greys.map(f32::from).sum::<f32>() / of.count_ones() as f32
    };
    let [off, on] = [!bits, bits].map(mean);
    (on > off).then_some(0.5 * (off + on))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Scene;

    /// Symbols as random as a message's.
    fn symbol(i: u64) -> u64 {
        let mixed = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (mixed ^ mixed >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9)
    }

    /// Follows a panel some columns and rows off for `frames` symbols. Returns the panel's place and bits as found, the watch, and the
    /// followed and true lattices.
    fn watched(frames: u64, off: [i32; 2], symbol: impl Fn(u64) -> u64) -> (Option<(Lattice, PanelFrame)>, LineWatch, [Lattice; 2]) {
        let mut watch = LineWatch::NEW;
        let panel = Lattice::through(&Scene::PLAIN.corners());
        let [column, row] = off.map(|off| MIDDLE + off as f32);
        let centre = panel.position(column, row);
        let lattice = Lattice { centre, ..panel };
        let mut seen = PanelFrame::from_bits(0);
        for bits in (0..frames).map(symbol) {
            let scene = Scene { bits, ..Scene::PLAIN }.render();
            seen = PanelFrame::from_bits(moved_by(bits, off));
            watch.see(&scene.frame(), &lattice, seen);
        }
        (watch.moved(&lattice, seen), watch, [lattice, panel])
    }

    #[test]
    fn a_panel_one_line_off_is_moved_to_its_lines() {
        for off in [[0, 1], [0, -1], [1, 0], [-1, 0]] {
            let (moved, watch, [_, panel]) = watched(6, off, symbol);
            assert!(watch.is_doubtful());
            let (lattice, bits) = moved.unwrap_or_else(|| panic!("{off:?}: {watch:?}"));
            assert!(lattice.is_close_to(&panel), "{off:?}: {lattice:?}");
            assert_eq!(bits.bits(), symbol(5), "{off:?}");
        }
    }

    /// A column and a row off, or two lines: closer with each move.
    #[test]
    fn a_panel_farther_off_is_moved_closer() {
        for off in [[1, 1], [-1, 1], [2, 0], [0, -2]] {
            let (moved, watch, [followed, panel]) = watched(8, off, symbol);
            let (lattice, _) = moved.unwrap_or_else(|| panic!("{off:?}: {watch:?}"));
            let off = |lattice: &Lattice| {
                let [dx, dy] = core::array::from_fn(|i| lattice.centre[i] - panel.centre[i]);
                libm::hypotf(dx, dy)
            };
            assert!(off(&lattice) < 0.8 * off(&followed));
        }
    }

    /// Neither symbols without a line, nor a panel at rest, nor one LED lit after another move a panel, nor light that changes beside a
    /// line within a symbol.
    #[test]
    fn a_panel_in_its_place_stays() {
        let without_line = |i: u64| symbol(i) >> SIDE << SIDE;
        let same = |_| moved_by(symbol(3), [0, 1]);
        let walking = |i: u64| 1 << (i % LEDS as u64);
        let symbols: [&dyn Fn(u64) -> u64; 4] = [&symbol, &without_line, &same, &walking];
        for symbol in symbols {
            let (moved, watch, _) = watched(40, [0, 0], symbol);
            assert!(!watch.is_doubtful());
            assert_eq!(moved, None);
        }
        let mut watch = LineWatch::NEW;
        for i in 0..40 {
            let seen = Scene {
                bits: symbol(i),
                ..Scene::PLAIN
            }
            .render();
            let lattice = Lattice::through(
                &Scene {
                    centre: [47.3, 53.0],
                    ..Scene::PLAIN
                }
                .corners(),
            );
            watch.see(&seen.frame(), &lattice, PanelFrame::from_bits(moved_by(symbol(0), [0, 1])));
            assert_eq!(watch.moved(&lattice, PanelFrame::default()), None, "{watch:?}");
        }
    }

    /// The light beside a panel with a broken line does not change.
    #[test]
    fn a_broken_line_beside_steady_light_is_doubted_for_two_symbols() {
        let background = |[x, y]: [f32; 2]| if x < 50.0 && y > 66.0 { 12.0 } else { 1.0 };
        let mut watch = LineWatch::NEW;
        let lattice = Lattice::through(&Scene::PLAIN.corners());
        for i in 0..10 {
            let bits = symbol(i) >> SIDE << SIDE;
            let scene = Scene {
                bits,
                background,
                ..Scene::PLAIN
            }
            .render();
            watch.see(&scene.frame(), &lattice, PanelFrame::from_bits(bits));
            assert_eq!(watch.moved(&lattice, PanelFrame::from_bits(bits)), None);
            assert!(i < 2 || !watch.is_doubtful(), "symbol {i}: {watch:?}");
        }
    }
}
