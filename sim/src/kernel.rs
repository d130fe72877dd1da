//! What a pixel sees of an edge: the lens blur and the pixel's own square, in one dimension.
//!
//! The Gaussian and the square both separate into x and y, so a disc's image needs only two functions of one variable:
//! the **bell** β(s) = ∫ over the pixel's width of the Gaussian at distance s, and the **step** ς(s) = ∫ β, which rises
//! from 0 to 1. [`Exact`] computes them by the error function, [`Tabulated`] reads them from a table of f32, and
//! [`Square`] is what is left where there is no blur.

use libm::{erf, erfc};

/// Floating-point numbers that images are drawn in.
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

/// The bell and the step.
pub trait Kernel {
    /// The type images are drawn in.
    type Real: Real;
    /// β at `s` px, for light from a strip `width` px wide.
    ///
    /// Where there is a blur the strip counts as a line, for its chord stands where quadrature wants it.
    fn bell(&self, s: f64, width: f64) -> Self::Real;
    /// ς at `s` px.
    fn step(&self, s: f64) -> Self::Real;
}

/// Bell and step of the pixel's square alone, where the lens blur is left out: the part of a strip that the pixel covers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Square<R>(std::marker::PhantomData<R>);

impl<R: Real> Kernel for Square<R> {
    type Real = R;

    fn bell(&self, s: f64, width: f64) -> R {
        let overlap = (s + width / 2.0).min(0.5) - (s - width / 2.0).max(-0.5);
        R::from_f64(overlap.max(0.0) / width)
    }

    fn step(&self, s: f64) -> R {
        R::from_f64((s + 0.5).clamp(0.0, 1.0))
    }
}

/// Bell and step by the error function; error about 1e-16.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    sigma_px: f64,
}

impl Exact {
    /// For a blur of `sigma_px`, over 0; see [`Square`] for none.
    pub fn new(sigma_px: f64) -> Self {
        Self { sigma_px }
    }

    /// ∫ of the Gaussian's distribution function from −∞ to s: ψ(s) = s·Φ(s/σ) + σ·φ(s/σ).
    fn ramp(&self, s: f64) -> f64 {
        let z = s / self.sigma_px;
        let below = 0.5 * erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
        s * below + self.sigma_px * (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt()
    }
}

impl Kernel for Exact {
    type Real = f64;

    fn bell(&self, s: f64, _width: f64) -> f64 {
        let scale = std::f64::consts::FRAC_1_SQRT_2 / self.sigma_px;
        0.5 * (erf((s + 0.5) * scale) - erf((s - 0.5) * scale))
    }

    fn step(&self, s: f64) -> f64 {
        // By symmetry from the side where both ramps are small.
        if s > 0.0 {
            1.0 - (self.ramp(0.5 - s) - self.ramp(-0.5 - s))
        } else {
            self.ramp(s + 0.5) - self.ramp(s - 0.5)
        }
    }
}

/// Twice the steepest slope of a Gaussian's density, 2·φ(1): this over σ² bounds the second derivative of bell and step.
pub const CURVATURE: f64 = 0.484;

/// Bell and step read from a table by linear interpolation, as f32.
///
/// With n entries a pixel the interpolation errs by at most max|f''|/(8·n²), where max|f''| is at most
/// [`CURVATURE`]/σ²: 4.1e-7 for n = 256 at σ = 1.5 px. Rounding to f32 adds about 1e-7.
#[derive(Clone, Debug)]
pub struct Tabulated {
    per_px: f32,
    reach_px: f32,
    entries: Vec<[f32; 2]>,
}

impl Tabulated {
    /// The table for a blur of `sigma_px` up to `reach_px` on either side with `per_px` entries a pixel. Beyond, the
    /// bell is 0 and the step 0 or 1.
    pub fn new(sigma_px: f64, reach_px: f64, per_px: usize) -> Self {
        let exact = Exact::new(sigma_px);
        let last = (2.0 * reach_px * per_px as f64).ceil() as usize + 1;
        let position = |index: usize| index as f64 / per_px as f64 - reach_px;
        let entries = (0..=last)
            .map(|i| {
                [
                    exact.bell(position(i), 0.0) as f32,
                    exact.step(position(i)) as f32,
                ]
            })
            .collect();
        Self {
            per_px: per_px as f32,
            reach_px: reach_px as f32,
            entries,
        }
    }

    fn interpolate(&self, s: f64, which: usize) -> f32 {
        let place =
            ((s as f32 + self.reach_px) * self.per_px).clamp(0.0, (self.entries.len() - 2) as f32);
        let index = place as usize;
        let (left, right) = (self.entries[index][which], self.entries[index + 1][which]);
        left + (right - left) * (place - index as f32)
    }
}

impl Kernel for Tabulated {
    type Real = f32;

    fn bell(&self, s: f64, _width: f64) -> f32 {
        self.interpolate(s, 0)
    }

    fn step(&self, s: f64) -> f32 {
        self.interpolate(s, 1)
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
            assert!(
                (slope - exact.bell(s, 0.0)).abs() < 1e-9,
                "at {s}: {slope} against {}",
                exact.bell(s, 0.0)
            );
        }
        assert!((exact.step(-30.0)).abs() < 1e-15 && (exact.step(30.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_table_keeps_its_bound() {
        for (sigma, per_px) in [(1.5, 256), (0.7, 128)] {
            let (exact, table) = (
                Exact::new(sigma),
                Tabulated::new(sigma, 8.0 * sigma, per_px),
            );
            let curvature = CURVATURE / (sigma * sigma);
            let bound = curvature / (8.0 * (per_px * per_px) as f64) + 3e-7;
            for i in -4000..4000 {
                let s = f64::from(i) * 0.002_3 * sigma;
                assert!(
                    (f64::from(table.bell(s, 0.0)) - exact.bell(s, 0.0)).abs() < bound,
                    "bell at {s}"
                );
                assert!(
                    (f64::from(table.step(s)) - exact.step(s)).abs() < bound,
                    "step at {s}"
                );
            }
        }
    }

    #[test]
    fn without_blur_a_pixel_covers_its_part_of_a_strip() {
        let square = Square::<f64>::default();
        assert_eq!(
            [0.0, 0.3, 0.5, 0.8].map(|s| square.bell(s, 0.4)),
            [1.0, 1.0, 0.5, 0.0]
        );
        assert_eq!(square.step(0.0), 0.5);
    }
}
