//! An edge as a pixel sees it: the lens blur and the pixel's own square, in one dimension.
//!
//! The Gaussian and the square both separate into x and y, so a disc's image needs only two functions of one variable:
//! the **bell** β(s) = ∫ over the pixel's width of the Gaussian at distance s, and the **step** ς(s) = ∫ β, which rises
//! from 0 to 1. [`Exact`] computes them by the error function, [`KernelTables`] reads them from a table of f32.
//! Without a blur there is nothing to approximate: see [`crate::disc::overlap`].

use libm::{erf, erfc};

use crate::disc::gauss;
use crate::disc::phase_table::PhaseTable;

/// The floating-point type of images.
pub trait Real:
    Copy
    + Default
    + Send
    + Sync
    + std::ops::AddAssign
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + 'static
{
    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;
    /// The number in double precision.
    fn to_f64(self) -> f64;
}

impl Real for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}

impl Real for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    fn to_f64(self) -> f64 {
        self.into()
    }
}

/// The bell and the step, for rows of pixels.
pub trait Kernel {
    /// The type of the image.
    type Real: Real;
    /// Adds scale·β at `first`, `first` + 1, … px.
    fn add_bells(&self, first: f64, scale: Self::Real, values: &mut [Self::Real]);
    /// Adds scale·ς at `first`, `first` + 1, … px.
    fn add_steps(&self, first: f64, scale: Self::Real, values: &mut [Self::Real]);
    /// Adds scale times the mean of ς over `half` px (above 0) to either side of `first`, `first` + 1, … px.
    fn add_slopes(&self, first: f64, half: f64, scale: Self::Real, values: &mut [Self::Real]);
}

/// Bell and step by the error function: absolute error about 1e-15, without cancellation in the far tails.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    sigma_px: f64,
}

/// Steps closer than this part of the blur's σ are not subtracted: the bell is integrated between them.
const CLOSE: f64 = 1.0 / 16.0;

impl Exact {
    /// For a blur of `sigma_px` above 0; see [`crate::disc::overlap`] for none.
    pub fn new(sigma_px: f64) -> Self {
        Self { sigma_px }
    }

    /// β at `s` px.
    pub fn bell(&self, s: f64) -> f64 {
        let scale = std::f64::consts::FRAC_1_SQRT_2 / self.sigma_px;
        let (near, far) = (s.abs() - 0.5, s.abs() + 0.5);
        // Outside the pixel both error functions are almost 1, so their complements are subtracted instead.
        if near > 0.0 {
            0.5 * (erfc(near * scale) - erfc(far * scale))
        } else {
            0.5 * (erf(far * scale) - erf(near * scale))
        }
    }

    /// ς at `s` px.
    pub fn step(&self, s: f64) -> f64 {
        if s > 0.0 { 1.0 - self.rising(-s) } else { self.rising(s) }
    }

    /// ∫ β from `lower` over a `length` of at least 0: the light of a pixel between two edges, ς(lower + length) − ς(lower).
    ///
    /// ```
    /// use sim::disc::kernel::Exact;
    /// let exact = Exact::new(1.0);
    /// // Both steps are 1 to the last bit, and yet there is light between them.
    /// assert_eq!(exact.step(11.0) - exact.step(10.0), 0.0);
    /// assert!((exact.between(10.0, 1.0) / 1.0814e-22 - 1.0).abs() < 1e-3);
    /// ```
    pub fn between(&self, lower: f64, length: f64) -> f64 {
        let upper = lower + length;
        if length < CLOSE * self.sigma_px {
            let bells = gauss::nodes(0.0, length).map(|(s, weight)| weight * self.bell(lower + s));
            bells.sum()
        } else if lower > 0.0 {
            self.rising(-lower) - self.rising(-upper)
        } else if upper > 0.0 {
            1.0 - self.rising(-upper) - self.rising(lower)
        } else {
            self.rising(upper) - self.rising(lower)
        }
    }

    /// The excess of ∫ς up to `s` px over that of a sharp step, max(s, 0): the same on either side of the edge.
    pub fn lag(&self, s: f64) -> f64 {
        let s = -s.abs();
        self.bowl(s + 0.5) - self.bowl(s - 0.5)
    }

    fn bowl(&self, s: f64) -> f64 {
        let (z, variance) = (s / self.sigma_px, self.sigma_px * self.sigma_px);
        let below = 0.5 * erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
        let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
        0.5 * ((s * s + variance) * below + s * self.sigma_px * density)
    }

    /// ς at `s` of at most 0, as a difference of two small ramps.
    fn rising(&self, s: f64) -> f64 {
        self.ramp(s + 0.5) - self.ramp(s - 0.5)
    }

    /// ∫ of the Gaussian's distribution function from −∞ to s: ψ(s) = s·Φ(s/σ) + σ·φ(s/σ).
    fn ramp(&self, s: f64) -> f64 {
        let z = s / self.sigma_px;
        let below = 0.5 * erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
        s * below + self.sigma_px * (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt()
    }
}

impl Exact {
    fn add_lags(&self, first: f64, scale: f64, values: &mut [f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            *value += scale * self.lag(first + i as f64);
        }
    }
}

impl Kernel for Exact {
    type Real = f64;

    fn add_bells(&self, first: f64, scale: f64, values: &mut [f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            *value += scale * self.bell(first + i as f64);
        }
    }

    fn add_steps(&self, first: f64, scale: f64, values: &mut [f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            *value += scale * self.step(first + i as f64);
        }
    }

    fn add_slopes(&self, first: f64, half: f64, scale: f64, values: &mut [f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            let s = first + i as f64;
            let lag = (self.lag(s + half) - self.lag(s - half)) / (2.0 * half);
            *value += scale * (sharp_slope(s, half) + lag);
        }
    }
}

/// The mean of a sharp step over `half` px to either side of `s`.
fn sharp_slope(s: f64, half: f64) -> f64 {
    ((s + half) / (2.0 * half)).clamp(0.0, 1.0)
}

/// Twice the steepest slope of a Gaussian's density, 2·φ(1): this over σ² bounds the second derivative of bell and step.
pub const CURVATURE: f64 = 0.484;

/// Bell and step read from a table, as f32.
///
/// With n phases a pixel the interpolation errs by at most max|f''|/(8·n²), where max|f''| is at most
/// [`CURVATURE`]/σ²: 4.1e-7 for n = 256 at σ = 1.5 px. Rounding to f32 adds about 1e-7.
#[derive(Clone, Debug)]
pub struct KernelTables {
    /// Pixels of a row of the tables before the middle.
    before: i64,
    bells: PhaseTable,
    steps: PhaseTable,
    lags: PhaseTable,
}

impl KernelTables {
    /// The table for a blur of `sigma_px` up to `reach_px` on either side with `per_px` phases a pixel. Beyond, the
    /// bell is 0 and the step 0 or 1.
    pub fn new(sigma_px: f64, reach_px: f64, per_px: usize) -> Self {
        let exact = Exact::new(sigma_px);
        let before = reach_px.ceil();
        let length = 2 * before as usize + 1;
        let table = |add: fn(&Exact, f64, f64, &mut [f64])| {
            PhaseTable::new(per_px, length, |phase, values| {
                values.fill(0.0);
                add(&exact, phase - before, 1.0, values);
            })
        };
        Self {
            before: before as i64,
            bells: table(Exact::add_bells),
            steps: table(Exact::add_steps),
            lags: table(Exact::add_lags),
        }
    }

    /// Adds scale·f at `first`, `first` + 1, … px within the table, and returns the range of these values.
    #[inline(always)]
    fn add(&self, table: &PhaseTable, first: f64, scale: f32, values: &mut [f32]) -> std::ops::Range<usize> {
        let floor = first.floor();
        let (left, right, part) = table.around(first - floor);
        // The position of the first value in the table's row.
        let offset = (floor as i64).saturating_add(self.before);
        let place = |i: i64| i.clamp(0, values.len() as i64) as usize;
        let within =
            place(offset.saturating_neg())..place((table.length() as i64).saturating_sub(offset)).max(place(offset.saturating_neg()));
        let start = offset.max(0).min(table.length() as i64) as usize;
        let rows = left[start..].iter().zip(&right[start..]);
        for (value, (&left, &right)) in values[within.clone()].iter_mut().zip(rows) {
            *value += scale * (left + (right - left) * part);
        }
        within
    }
}

impl Kernel for KernelTables {
    type Real = f32;

    #[inline(always)]
    fn add_bells(&self, first: f64, scale: f32, values: &mut [f32]) {
        self.add(&self.bells, first, scale, values);
    }

    #[inline(always)]
    fn add_steps(&self, first: f64, scale: f32, values: &mut [f32]) {
        let within = self.add(&self.steps, first, scale, values);
        values[within.end..].iter_mut().for_each(|value| *value += scale);
    }

    #[inline(always)]
    fn add_slopes(&self, first: f64, half: f64, scale: f32, values: &mut [f32]) {
        for (i, value) in values.iter_mut().enumerate() {
            *value += scale * sharp_slope(first + i as f64, half) as f32;
        }
        let lag = scale * (0.5 / half) as f32;
        self.add(&self.lags, first + half, lag, values);
        self.add(&self.lags, first - half, -lag, values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bell_is_the_slope_of_the_step() {
        let exact = Exact::new(1.5);
        for i in -80..=80 {
            let s = f64::from(i) * 0.1;
            let slope = (exact.step(s + 1e-5) - exact.step(s - 1e-5)) / 2e-5;
            assert!((slope - exact.bell(s)).abs() < 1e-9, "at {s}: {slope} against {}", exact.bell(s));
        }
        assert!((exact.step(-30.0)).abs() < 1e-15 && (exact.step(30.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_table_keeps_its_bound() {
        for (sigma, per_px) in [(1.5, 256), (0.7, 128)] {
            let exact = Exact::new(sigma);
            let table = KernelTables::new(sigma, 8.0 * sigma, per_px);
            let curvature = CURVATURE / (sigma * sigma);
            let bound = curvature / (8.0 * (per_px * per_px) as f64) + 3e-7;
            for i in -400..400 {
                let first = f64::from(i) * 0.023 * sigma;
                let (mut bells, mut steps) = ([0.0; 60], [0.0; 60]);
                table.add_bells(first, 1.0, &mut bells);
                table.add_steps(first, 1.0, &mut steps);
                for (k, (bell, step)) in bells.into_iter().zip(steps).enumerate() {
                    let s = first + k as f64;
                    assert!((f64::from(bell) - exact.bell(s)).abs() < bound, "bell at {s}");
                    assert!((f64::from(step) - exact.step(s)).abs() < bound, "step at {s}");
                }
            }
        }
    }
}
