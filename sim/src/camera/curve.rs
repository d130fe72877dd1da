//! A camera's curve from linear values to grey levels.
//!
//! The equations of the standards are those of [`link::camera::Encoding`], and those of the gamma curve are in [`grey`]. This module adds a
//! shoulder, with which some cameras keep bright skies from clipping, and a black level. Linear value 1 is grey 118 of a curve whose black
//! is 0.

use link::camera::Encoding as Standard;

use super::grey;
use crate::scene::{Camera, Encoding};

/// The grey level from which on the shoulder bends the gamma curve.
const KNEE_GREY: f64 = 150.0;
/// The grey level of white.
const WHITE_GREY: f64 = 255.0;

/// A camera's curve. It rises from black to white with a falling slope, and is white beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    shape: Shape,
    black_grey: f64,
}

/// The curve of a camera whose black is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Gamma(f64),
    Standard(Standard),
    /// A gamma curve with a shoulder; the value is γ.
    Shoulder(f64),
}

impl Curve {
    /// The curve of a scene's camera.
    pub fn of(camera: &Camera) -> Self {
        let shape = match camera.encoding {
            Encoding::Gamma => Shape::Gamma(camera.gamma),
            Encoding::Linear => Shape::Gamma(1.0),
            Encoding::Srgb => Shape::Standard(Standard::Srgb),
            Encoding::Rec709 => Shape::Standard(Standard::Rec709),
            Encoding::Shoulder => Shape::Shoulder(camera.gamma),
        };
        Self {
            shape,
            black_grey: camera.black_grey,
        }
    }

    /// The gamma curve 118·x^(1/γ), γ from 1 to 4.
    pub fn gamma(gamma: f64) -> Self {
        Self {
            shape: Shape::Gamma(gamma),
            black_grey: 0.0,
        }
    }

    /// Its γ, if it is a gamma curve without a black level.
    pub(crate) fn as_gamma(&self) -> Option<f64> {
        match self.shape {
            Shape::Gamma(gamma) if self.black_grey == 0.0 => Some(gamma),
            _ => None,
        }
    }

    /// The nearest standard curve, for the settings of a receiver.
    pub fn standard(&self) -> Standard {
        match self.shape {
            Shape::Standard(standard) => standard,
            Shape::Gamma(gamma) | Shape::Shoulder(gamma) => Standard::Gamma(gamma as f32),
        }
    }

    /// The level of black.
    pub fn black_grey(&self) -> f64 {
        self.black_grey
    }

    /// The unrounded grey level of a linear value, black to 255; black for negative values and NaN.
    ///
    /// ```
    /// use sim::camera::curve::Curve;
    /// use sim::scene::Scene;
    /// let curve = |encoding| {
    ///     let set = format!("camera.encoding={encoding}");
    ///     Ok::<_, sim::scene::SceneError>(Curve::of(&Scene::load("paper", &[set])?.camera))
    /// };
    /// assert_eq!(curve("gamma")?.unrounded(1.0), 118.0);
    /// assert_eq!(curve("linear")?.unrounded(1.5), 177.0);
    /// // The shoulder still separates levels that the gamma curve clips.
    /// assert_eq!(curve("gamma")?.unrounded(7.0), 255.0);
    /// assert!(curve("shoulder")?.unrounded(7.0) < 250.0);
    /// # Ok::<(), sim::scene::SceneError>(())
    /// ```
    pub fn unrounded(&self, linear: f64) -> f64 {
        self.unclipped(linear).min(WHITE_GREY)
    }

    /// The same without clipping at white.
    pub(super) fn unclipped(&self, linear: f64) -> f64 {
        let level = match self.shape {
            Shape::Gamma(gamma) => grey::unclipped(linear, gamma),
            Shape::Standard(curve) => curve.grey_f64(linear.max(0.0)),
            Shape::Shoulder(gamma) => shoulder(grey::unclipped(linear, gamma)),
        };
        self.black_grey + level * self.span()
    }

    /// The linear value of a grey level: the inverse of [`Curve::unrounded`] below 255; 0 for levels below black and NaN.
    pub fn linear(&self, grey: f64) -> f64 {
        let level = (grey - self.black_grey) / self.span();
        match self.shape {
            Shape::Gamma(gamma) => grey::linear(level, gamma),
            Shape::Standard(curve) => curve.light_f64(level),
            Shape::Shoulder(gamma) => grey::linear(before_shoulder(level), gamma),
        }
    }

    /// The greatest change of the unrounded grey of a pixel not darker than `floor`, by a change of `linear_change`.
    ///
    /// The curve is concave, so the change is greatest at the floor.
    pub(crate) fn greatest_change(&self, floor: f64, linear_change: f64) -> f64 {
        self.unrounded(floor + linear_change.abs()) - self.unrounded(floor)
    }

    /// The greatest change of an unrounded grey level if linear values of at most `peak` are scaled by a `factor` of at most 1.
    pub(crate) fn greatest_loss(&self, peak: f64, factor: f64) -> f64 {
        let factor = factor.max(0.0);
        if let Some(gamma) = self.as_gamma() {
            return grey::unrounded(peak, gamma) * (1.0 - factor.powf(1.0 / gamma));
        }
        // Between two of these levels the curve lies between their values.
        const STEPS: u32 = 512;
        let top = self.unrounded(peak);
        let level = |k: u32| self.black_grey + (top - self.black_grey) * f64::from(k) / f64::from(STEPS);
        let loss = |k: u32| level(k + 1) - self.unrounded(self.linear(level(k)) * factor);
        (0..STEPS).map(loss).fold(0.0, f64::max)
    }

    /// The greatest difference of two curves at any linear value.
    pub fn greatest_difference(&self, other: &Self) -> f64 {
        if self == other {
            return 0.0;
        }
        // Both rise, so between two levels of one the other lies between its values there; beyond the last both are white.
        const STEPS: u32 = 2048;
        let white = self.linear(WHITE_GREY).max(other.linear(WHITE_GREY));
        let light = |k: u32| white * (f64::from(k) / f64::from(STEPS)).powi(3);
        let apart = |k: u32| {
            let [low, high] = [k, k + 1].map(light);
            let up = self.unrounded(high) - other.unrounded(low);
            let down = other.unrounded(high) - self.unrounded(low);
            up.max(down)
        };
        (0..STEPS).map(apart).fold(0.0, f64::max)
    }

    /// Grey levels per step of a curve whose black is 0.
    fn span(&self) -> f64 {
        (WHITE_GREY - self.black_grey) / WHITE_GREY
    }
}

/// Applies the shoulder to a level of the gamma curve: above the knee a parabola with continuous slope, which is flat at white. It
/// compresses twice the range between knee and white.
fn shoulder(level: f64) -> f64 {
    let room = WHITE_GREY - KNEE_GREY;
    let part = ((level - KNEE_GREY) / (2.0 * room)).clamp(0.0, 1.0);
    if part > 0.0 {
        WHITE_GREY - room * (1.0 - part).powi(2)
    } else {
        level
    }
}

/// The inverse of [`shoulder`]: the level of the gamma curve.
fn before_shoulder(level: f64) -> f64 {
    let room = WHITE_GREY - KNEE_GREY;
    if level > KNEE_GREY {
        KNEE_GREY + 2.0 * room * (1.0 - ((WHITE_GREY - level) / room).max(0.0).sqrt())
    } else {
        level
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn curves() -> Vec<Curve> {
        let of = |encoding: &str, black: u32| {
            let settings = [format!("camera.encoding={encoding}"), format!("camera.black_grey={black}")];
            Curve::of(&Scene::load("paper", &settings).unwrap().camera)
        };
        let all = Encoding::NAMES.map(|encoding| [of(encoding, 0), of(encoding, 16)]);
        all.into_iter().flatten().collect()
    }

    #[test]
    fn levels_come_back_and_the_curve_is_concave() {
        for curve in curves() {
            let black = curve.black_grey() as i32;
            assert_eq!(curve.unrounded(-1.0), f64::from(black));
            assert_eq!(curve.unrounded(f64::NAN), f64::from(black));
            assert_eq!(curve.unrounded(1e9), 255.0);
            for level in (black..=255).map(f64::from) {
                let back = curve.unrounded(curve.linear(level));
                assert!((back - level).abs() < 1e-3, "{curve:?}: {level} is {back}");
            }
            let mut slope = f64::INFINITY;
            for k in 0..2000 {
                let [a, b] = [k, k + 1].map(|k| f64::from(k) * 0.01);
                let next = (curve.unrounded(b) - curve.unrounded(a)) / 0.01;
                assert!((0.0..=slope + 1e-6).contains(&next), "{curve:?} at {a}");
                slope = next;
            }
        }
    }

    #[test]
    fn losses_and_differences_are_bounded() {
        let all = curves();
        let lights = || (0..3000).map(|k| (f64::from(k) / 1000.0).powi(3));
        for curve in &all {
            for factor in [0.0, 0.3, 0.9, 0.999, 1.0] {
                let bound = curve.greatest_loss(9.0, factor);
                for light in lights().filter(|&light| light <= 9.0) {
                    let loss = curve.unrounded(light) - curve.unrounded(light * factor);
                    assert!(loss <= bound + 1e-4, "{curve:?} × {factor}: {loss} > {bound}");
                }
            }
            for other in &all {
                let bound = curve.greatest_difference(other);
                let most = lights().map(|x| (curve.unrounded(x) - other.unrounded(x)).abs());
                let most = most.fold(0.0, f64::max);
                assert!(most <= bound && bound <= most + 2.0, "{most} of {bound}");
            }
        }
    }
}
