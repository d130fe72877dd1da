//! An LED's image from a table of sub-pixel phases.
//!
//! An LED's image depends on the position of its centre within a pixel. [`PhaseTable`]s hold the values across and down of each term, so
//! that one LED's values are one interpolation between two rows.

use crate::disc::chords::Chords;
use crate::disc::kernel::Exact;
use crate::disc::phase_table::PhaseTable;
use crate::disc::spread::Spread;
use crate::renderer::separable::{ChordImage, SeparableImage};

/// The vector length of values across.
pub const LANES: usize = 8;
/// The most rows of a table: a larger table costs more time than it saves.
const MOST_ROWS: usize = 4096;

/// The values across and down of an LED's terms, as f32; the error is that of [`crate::disc::kernel::KernelTables`].
#[derive(Clone, Debug)]
pub struct Polyphase {
    before: [usize; 2],
    size: [usize; 2],
    /// Across and down, for each term.
    terms: Vec<[PhaseTable; 2]>,
}

impl Polyphase {
    /// The table for the shape of `chords`, under the blur of `kernel` and the spread, drawn up to `margin_px` beyond its edge. `None` if
    /// it would be too large.
    pub fn new(kernel: &Exact, chords: &Chords, spread: &Spread, margin_px: f64, phases: usize) -> Option<Self> {
        let image = ChordImage::new(kernel, chords, spread, margin_px);
        if image.terms() * phases > MOST_ROWS {
            return None;
        }
        let [width, height] = image.size();
        let width = width.next_multiple_of(LANES);
        let term = |term: usize| {
            [
                PhaseTable::new(phases, width, |phase, values| image.across(term, phase, values)),
                PhaseTable::new(phases, height, |phase, values| image.down(term, phase, values)),
            ]
        };
        Some(Self {
            before: image.before(),
            size: [width, height],
            terms: (0..image.terms()).map(term).collect(),
        })
    }
}

impl SeparableImage for Polyphase {
    type Real = f32;

    fn terms(&self) -> usize {
        self.terms.len()
    }

    fn before(&self) -> [usize; 2] {
        self.before
    }

    fn size(&self) -> [usize; 2] {
        self.size
    }

    #[inline(always)]
    fn across(&self, term: usize, fraction: f64, values: &mut [f32]) {
        interpolate(&self.terms[term][0], fraction, values);
    }

    #[inline(always)]
    fn down(&self, term: usize, fraction: f64, values: &mut [f32]) {
        interpolate(&self.terms[term][1], fraction, values);
    }
}

#[inline(always)]
fn interpolate(phases: &PhaseTable, fraction: f64, values: &mut [f32]) {
    let (left, right, part) = phases.around(fraction);
    for ((value, &left), &right) in values.iter_mut().zip(left).zip(right) {
        *value = left + (right - left) * part;
    }
}
