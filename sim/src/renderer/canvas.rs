//! A region of the sensor in linear values, and the drawing of LEDs into it.

use glam::DVec2;
use link::panel::{LEDS, SIDE};

use crate::disc::kernel::Real;
use crate::disc::outline::{Blur, Outline};
use crate::renderer::separable::SeparableImage;

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

impl Region {
    /// Whether two regions have a pixel in common.
    pub fn meets(self, other: Self) -> bool {
        let apart = |a: usize, length: usize, b: usize, other: usize| a + length <= b || b + other <= a;
        !apart(self.x, self.width, other.x, other.width) && !apart(self.y, self.height, other.y, other.height)
    }

    /// The region with a margin of `by` pixels, limited to the sensor's start.
    pub(super) fn widened(self, by: usize) -> Self {
        let (x, y) = (self.x.saturating_sub(by), self.y.saturating_sub(by));
        Self {
            x,
            y,
            width: self.x + self.width + by - x,
            height: self.y + self.height + by - y,
        }
    }

    /// The intersection of both regions, which may be empty.
    fn common(self, other: Self) -> Self {
        let end = |a: usize, length: usize, b: usize, other: usize| (a + length).min(b + other);
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        Self {
            x,
            y,
            width: end(self.x, self.width, other.x, other.width).saturating_sub(x),
            height: end(self.y, self.height, other.y, other.height).saturating_sub(y),
        }
    }

    /// Its first pixel, and the one after its last.
    pub(super) fn corners(self) -> [DVec2; 2] {
        let corner = |x: usize, y: usize| DVec2::new(x as f64, y as f64);
        [corner(self.x, self.y), corner(self.x + self.width, self.y + self.height)]
    }
}

/// Linear values of a region, row by row.
#[derive(Clone, Debug)]
pub struct Canvas<R> {
    region: Region,
    values: Vec<R>,
    /// Scratch: one row of LEDs, the values across of its columns, the values down of one row.
    row: Vec<R>,
    across: Vec<R>,
    down: Vec<R>,
    /// The mask of an opaque cover, if there is one.
    mask: Option<Box<Canvas<R>>>,
}

impl<R: Real> Canvas<R> {
    /// A black canvas.
    pub fn new(region: Region) -> Self {
        Self {
            region,
            values: vec![R::default(); region.width * region.height],
            row: Vec::new(),
            across: Vec::new(),
            down: Vec::new(),
            mask: None,
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
    pub(crate) fn values_mut(&mut self) -> &mut [R] {
        &mut self.values
    }

    /// Sets one value everywhere.
    pub fn fill(&mut self, value: R) {
        self.values.fill(value);
    }

    /// Covers the drawn image with the linear value `light`, by the mask that `draw` draws on black; it draws nothing outside `within`.
    pub fn cover(&mut self, light: R, within: Region, draw: impl FnOnce(&mut Self)) {
        let part = self.region.common(within);
        if part.width == 0 || part.height == 0 {
            return;
        }
        let mut mask = self.mask.take().unwrap_or_else(|| Box::new(Self::new(part)));
        mask.region = part;
        mask.values.clear();
        mask.values.resize(part.width * part.height, R::default());
        draw(&mut mask);
        let rows = self.values.chunks_exact_mut(self.region.width);
        let rows = rows.skip(part.y - self.region.y);
        for (row, covered) in rows.zip(mask.values.chunks_exact(part.width)) {
            let row = &mut row[part.x - self.region.x..][..part.width];
            for (value, &covered) in row.iter_mut().zip(covered) {
                *value += covered * (light - *value);
            }
        }
        self.mask = Some(mask);
    }

    /// Adds 64 LEDs of one shape with centres on upright rows and columns (in px of the sensor).
    ///
    /// The values across a column are computed once for its eight LEDs, and a row of eight LEDs is spread over its pixel rows together: an
    /// eighth of the work of [`Canvas::add_led`] 64 times.
    #[inline(always)]
    pub(crate) fn add_lattice<S: SeparableImage<Real = R>>(
        &mut self,
        image: &S,
        columns: &[f64; SIDE],
        rows: &[f64; SIDE],
        light: &[R; LEDS],
    ) {
        let ([width, height], [before_x, before_y]) = (image.size(), image.before());
        let Region { x, y, .. } = self.region;
        let firsts = columns.map(|column| column.floor() as i64 - before_x as i64 - x as i64);
        let end = self.region.width as i64;
        let from = firsts.into_iter().fold(end, i64::min).max(0);
        let to = firsts.into_iter().fold(i64::MIN, i64::max) + width as i64;
        if from >= to.min(end) {
            return;
        }
        let lit_length = (to.min(end) - from) as usize;
        // Room on either side for LEDs that are not wholly in the region.
        let row_length = lit_length + 2 * width;
        self.row.resize(lit_length, R::default());
        self.across.resize(SIDE * row_length, R::default());
        self.down.resize(height, R::default());
        let starts = firsts.map(|first| {
            let first = first - from + width as i64;
            first.clamp(0, (row_length - width) as i64) as usize
        });
        for term in 0..image.terms() {
            // Each column spans the whole row, dark beyond its reach: adding whole rows is faster than adding short overlapping pieces,
            // which depend on each other.
            self.across.fill(R::default());
            let all_columns = self.across.chunks_exact_mut(row_length);
            for ((values, column), &start) in all_columns.zip(columns).zip(&starts) {
                let fraction = column - column.floor();
                image.across(term, fraction, &mut values[start..start + width]);
            }
            for (row, light) in rows.iter().zip(light.chunks_exact(SIDE)) {
                let lit = &mut self.row[..lit_length];
                lit.fill(R::default());
                let columns = self.across.chunks_exact(4 * row_length);
                for (four, light) in columns.zip(light.chunks_exact(4)) {
                    let column = |k: usize| &four[k * row_length + width..][..lit.len()];
                    let four = [0, 1, 2, 3].map(column);
                    add_four_scaled(lit, four, [light[0], light[1], light[2], light[3]]);
                }
                image.down(term, row - row.floor(), &mut self.down);
                let first = row.floor() as i64 - before_y as i64 - y as i64;
                for (j, &down) in (first..).zip(&self.down) {
                    if (0..self.region.height as i64).contains(&j) {
                        let start = j as usize * self.region.width + from as usize;
                        add_scaled(&mut self.values[start..start + lit.len()], lit, down);
                    }
                }
            }
        }
    }

    /// Adds one LED of the given linear `light` with its centre at `centre` (in px of the sensor).
    #[inline(always)]
    pub(crate) fn add_led<S: SeparableImage<Real = R>>(&mut self, image: &S, centre: DVec2, light: R) {
        let ([width, height], [before_x, before_y]) = (image.size(), image.before());
        let Region { x, y, .. } = self.region;
        self.across.resize(width, R::default());
        self.down.resize(height, R::default());
        let (floor, fraction) = (centre.floor(), centre - centre.floor());
        let first_x = floor.x as i64 - before_x as i64 - x as i64;
        let first_y = floor.y as i64 - before_y as i64 - y as i64;
        let end = self.region.width as i64;
        let (from, to) = (first_x.clamp(0, end), (first_x + width as i64).clamp(0, end));
        if from >= to {
            return;
        }
        for term in 0..image.terms() {
            image.across(term, fraction.x, &mut self.across);
            image.down(term, fraction.y, &mut self.down);
            let across = &self.across[(from - first_x) as usize..(to - first_x) as usize];
            for (j, &down) in (first_y..).zip(&self.down) {
                if (0..self.region.height as i64).contains(&j) {
                    let start = j as usize * self.region.width + from as usize;
                    add_scaled(&mut self.values[start..start + across.len()], across, down * light);
                }
            }
        }
    }

    /// Adds the values of another canvas times `light`, in common pixels.
    pub fn add(&mut self, other: &Canvas<f32>, light: R) {
        let (own, others) = (self.region, other.region);
        let (from, to) = (own.x.max(others.x), (own.x + own.width).min(others.x + others.width));
        if from >= to {
            return;
        }
        for y in own.y.max(others.y)..(own.y + own.height).min(others.y + others.height) {
            let row = |region: Region| {
                let start = (y - region.y) * region.width;
                start + from - region.x..start + to - region.x
            };
            let values = &mut self.values[row(own)];
            for (value, &other) in values.iter_mut().zip(&other.values[row(others)]) {
                *value += light * R::from_f64(f64::from(other));
            }
        }
    }

    /// Adds an outline of the given linear `light` with its centre at `centre` (in px of the sensor), pixel by pixel.
    pub(crate) fn add_outline(&mut self, outline: &Outline, blur: &Blur, centre: DVec2, light: R) {
        let (reach_x, reach_y) = (outline.reach() + blur.margin_px()).into();
        let centre = centre - DVec2::new(self.region.x as f64, self.region.y as f64);
        let (from_x, to_x) = self.span(centre.x, reach_x, self.region.width);
        let (from_y, to_y) = self.span(centre.y, reach_y, self.region.height);
        for j in from_y..to_y {
            let row = &mut self.values[j * self.region.width..][from_x..to_x];
            for (i, value) in (from_x..to_x).zip(row) {
                let at = DVec2::new(i as f64, j as f64) - centre;
                *value += light * R::from_f64(outline.light_by(blur, at));
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

/// target += Σ source·scale, element by element.
#[inline(always)]
fn add_four_scaled<R: Real>(target: &mut [R], [a, b, c, d]: [&[R]; 4], scale: [R; 4]) {
    for ((((target, &a), &b), &c), &d) in target.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *target += (a * scale[0] + b * scale[1]) + (c * scale[2] + d * scale[3]);
    }
}

/// target += source·scale, element by element.
#[inline(always)]
fn add_scaled<R: Real>(target: &mut [R], source: &[R], scale: R) {
    for (target, &source) in target.iter_mut().zip(source) {
        *target += source * scale;
    }
}
