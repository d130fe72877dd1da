//! A region of the sensor in linear values, and how LEDs are drawn into it.

use glam::DVec2;
use link::panel::{LEDS, SIDE};

use crate::chords::Chords;
use crate::kernel::{Kernel, Real};

/// A rectangle of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Linear values of a region, row by row.
#[derive(Clone, Debug)]
pub struct Canvas<R> {
    region: Region,
    values: Vec<R>,
    /// Scratch of one row's bell values, and of one LED's bells and steps.
    row: Vec<R>,
    bells: Vec<R>,
    steps: Vec<R>,
}

impl<R: Real> Canvas<R> {
    /// A black canvas.
    pub fn new(region: Region) -> Self {
        Self {
            region,
            values: vec![R::default(); region.width * region.height],
            row: vec![R::default(); region.width],
            bells: Vec::new(),
            steps: Vec::new(),
        }
    }

    /// The rectangle it covers.
    pub fn region(&self) -> Region {
        self.region
    }

    /// The values, row by row.
    pub fn values(&self) -> &[R] {
        &self.values
    }

    /// The values, row by row, to be changed.
    pub fn values_mut(&mut self) -> &mut [R] {
        &mut self.values
    }

    /// One value everywhere.
    pub fn fill(&mut self, value: R) {
        self.values.fill(value);
    }

    /// Adds 64 equal LEDs whose centres lie on upright rows and columns (in px of the sensor).
    ///
    /// What a column's bells are is worked out once for its eight LEDs, and a row of eight LEDs is spread over its
    /// pixel rows together: an eighth of the work of [`Canvas::add_led`] 64 times.
    pub fn add_lattice<K: Kernel<Real = R>>(
        &mut self,
        kernel: &K,
        chords: &Chords,
        margin_px: f64,
        columns: &[f64; SIDE],
        rows: &[f64; SIDE],
        light: &[R; LEDS],
    ) {
        let (reach_x, reach_y) = (chords.reach() + margin_px).into();
        let half = chords.0.len().div_ceil(2);
        // Chords come in pairs ±u of equal ends; an odd one out stands in the middle and counts once.
        for (k, chord) in chords.0.iter().take(half).enumerate() {
            let alone = 2 * k + 1 == chords.0.len();
            let spans_x =
                columns.map(|c| self.span(c - self.region.x as f64, reach_x, self.region.width));
            let spans_y =
                rows.map(|r| self.span(r - self.region.y as f64, reach_y, self.region.height));
            self.bells.clear();
            for (&(from, to), column) in spans_x.iter().zip(columns) {
                let centre = column - self.region.x as f64;
                let bell = |i: usize| {
                    let s = i as f64 - centre;
                    let right = kernel.bell(s - chord.u, chord.weight);
                    R::from_f64(chord.weight)
                        * if alone {
                            right
                        } else {
                            right + kernel.bell(s + chord.u, chord.weight)
                        }
                };
                self.bells.extend((from..to).map(bell));
            }
            for (r, (&(from_y, to_y), row)) in spans_y.iter().zip(rows).enumerate() {
                self.row.fill(R::default());
                let mut bells = self.bells.as_slice();
                for (c, &(from, to)) in spans_x.iter().enumerate() {
                    let (mine, rest) = bells.split_at(to - from);
                    add_scaled(&mut self.row[from..to], mine, light[SIDE * r + c]);
                    bells = rest;
                }
                let (first, last) = (spans_x[0].0, spans_x[SIDE - 1].1);
                let centre = row - self.region.y as f64;
                for j in from_y..to_y {
                    let s = j as f64 - centre;
                    let step = kernel.step(s - chord.top) - kernel.step(s - chord.bottom);
                    let start = j * self.region.width;
                    add_scaled(
                        &mut self.values[start + first..start + last],
                        &self.row[first..last],
                        step,
                    );
                }
            }
        }
    }

    /// Adds one LED of the given linear `light` with its centre at `centre` (in px of the sensor).
    pub fn add_led<K: Kernel<Real = R>>(
        &mut self,
        kernel: &K,
        chords: &Chords,
        margin_px: f64,
        centre: DVec2,
        light: R,
    ) {
        let (reach_x, reach_y) = (chords.reach() + margin_px).into();
        let centre = centre - DVec2::new(self.region.x as f64, self.region.y as f64);
        let (from_x, to_x) = self.span(centre.x, reach_x, self.region.width);
        let (from_y, to_y) = self.span(centre.y, reach_y, self.region.height);
        for chord in &chords.0 {
            let scale = light * R::from_f64(chord.weight);
            self.bells.clear();
            self.bells.extend(
                (from_x..to_x)
                    .map(|i| kernel.bell(i as f64 - centre.x - chord.u, chord.weight) * scale),
            );
            self.steps.clear();
            let step = |s: f64| kernel.step(s - chord.top) - kernel.step(s - chord.bottom);
            self.steps
                .extend((from_y..to_y).map(|j| step(j as f64 - centre.y)));
            for (j, &step) in (from_y..to_y).zip(&self.steps) {
                let start = j * self.region.width;
                add_scaled(
                    &mut self.values[start + from_x..start + to_x],
                    &self.bells,
                    step,
                );
            }
        }
    }

    /// The pixels within `reach` of `centre`, as a half-open span inside `0..end`.
    fn span(&self, centre: f64, reach: f64, end: usize) -> (usize, usize) {
        let from = (centre - reach).ceil().clamp(0.0, end as f64) as usize;
        let to = ((centre + reach).floor() + 1.0).clamp(from as f64, end as f64) as usize;
        (from, to)
    }
}

/// target += source·scale, element by element.
#[inline]
fn add_scaled<R: Real>(target: &mut [R], source: &[R], scale: R) {
    for (target, &source) in target.iter_mut().zip(source) {
        *target += source * scale;
    }
}
