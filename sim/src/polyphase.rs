//! A stamp read from a table of sub-pixel phases.
//!
//! What an LED's image looks like depends on where in its pixel the centre lies. The table holds the values across and down of
//! each term at equally spaced phases, as contiguous vectors; between two phases it interpolates linearly, so that one LED's
//! values are one multiply-add of two vectors.

use crate::chords::Chords;
use crate::kernel::Exact;
use crate::stamp::{Chorded, Stamp};

/// Values across come in whole vectors of so many.
const LANES: usize = 8;

/// Both kinds of values of an LED's terms at `phases` phases a pixel, as f32.
///
/// With n phases the interpolation errs by at most max|f''|/(8·n²) of a value f, and the table holds f rounded to f32:
/// see [`crate::kernel::CURVATURE`].
#[derive(Clone, Debug)]
pub struct Polyphase {
    terms: usize,
    before: [usize; 2],
    across: Phases,
    down: Phases,
}

impl Polyphase {
    /// The table for the shape that `chords` make, under the blur of `kernel`, drawn up to `margin_px` beyond its edge.
    pub fn new(kernel: &Exact, chords: &Chords, margin_px: f64, phases: usize) -> Self {
        let stamp = Chorded::new(kernel, chords, margin_px);
        let ([width, height], terms) = (stamp.size(), stamp.terms());
        let width = width.next_multiple_of(LANES);
        Self {
            terms,
            before: stamp.before(),
            across: Phases::tabulate(terms, phases, width, |term, phase, values| {
                stamp.across(term, phase, values);
            }),
            down: Phases::tabulate(terms, phases, height, |term, phase, values| {
                stamp.down(term, phase, values);
            }),
        }
    }

    /// The bytes that its values take.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.across.values) + size_of_val(&*self.down.values)
    }
}

impl Stamp for Polyphase {
    type Real = f32;

    fn terms(&self) -> usize {
        self.terms
    }

    fn before(&self) -> [usize; 2] {
        self.before
    }

    fn size(&self) -> [usize; 2] {
        [self.across.length, self.down.length]
    }

    #[inline(always)]
    fn across(&self, term: usize, fraction: f64, values: &mut [f32]) {
        self.across.interpolate(term, fraction, values);
    }

    #[inline(always)]
    fn down(&self, term: usize, fraction: f64, values: &mut [f32]) {
        self.down.interpolate(term, fraction, values);
    }
}

/// Vectors of `length` values at `phases` + 1 phases from 0 to 1, for each term.
#[derive(Clone, Debug)]
struct Phases {
    phases: usize,
    length: usize,
    values: Vec<f32>,
}

impl Phases {
    fn tabulate(
        terms: usize,
        phases: usize,
        length: usize,
        fill: impl Fn(usize, f64, &mut [f64]),
    ) -> Self {
        let mut exact = vec![0.0; length];
        let mut values = Vec::with_capacity(terms * (phases + 1) * length);
        for term in 0..terms {
            for phase in 0..=phases {
                fill(term, phase as f64 / phases as f64, &mut exact);
                values.extend(exact.iter().map(|&value| value as f32));
            }
        }
        Self {
            phases,
            length,
            values,
        }
    }

    #[inline(always)]
    fn interpolate(&self, term: usize, fraction: f64, values: &mut [f32]) {
        let place = fraction.clamp(0.0, 1.0) * self.phases as f64;
        let phase = (place as usize).min(self.phases - 1);
        let part = (place - phase as f64) as f32;
        let start = (term * (self.phases + 1) + phase) * self.length;
        let (left, right) = self.values[start..start + 2 * self.length].split_at(self.length);
        for ((value, &left), &right) in values.iter_mut().zip(left).zip(right) {
            *value = left + (right - left) * part;
        }
    }
}
