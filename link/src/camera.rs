//! The description of a camera, for receivers and simulator.
//!
//! A receiver needs little of it, and learns the rest from the frames: blur, noise, and the panel's position.

mod encoding;

use core::ops::RangeInclusive;

pub use encoding::Encoding;
use serde::{Deserialize, Serialize};

/// The grey level of linear light 1: that of a grey card metered for the exposure (Do & Yoo 2020, Eq. 11).
pub const MIDDLE_GREY: f32 = 118.0;

/// The properties of a camera that a receiver uses. Each value is a starting point, with a [default](Camera::default); the receiver refines
/// it from the frames.
///
/// ```
/// use link::camera::{Camera, CameraError, Encoding};
///
/// let sharp = Camera { blur_sigma_px: 0.8, ..Camera::default() };
/// assert_eq!(sharp.checked(), Ok(sharp));
///
/// let dark = Camera { encoding: Encoding::Gamma(0.0), ..Camera::default() };
/// assert_eq!(dark.checked(), Err(CameraError::Gamma { gamma: 0.0 }));
/// assert_eq!(dark.clamped().encoding, Encoding::LINEAR);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    /// The curve from light to grey levels.
    pub encoding: Encoding,
    /// The grey level of no light at all, 0 to 64.
    pub black_grey: f32,
    /// Standard deviation of the lens blur, 0.3 to 4 px: the geometric mean of that along x and that along y.
    pub blur_sigma_px: f32,
    /// The blur along x over that along y, 0.5 to 2.
    pub blur_aspect: f32,
    /// Read noise, 0 to 10⁶ electrons. It weighs dark pixels against bright ones; a guess does little harm.
    pub read_noise_e: f32,
}

impl Default for Camera {
    /// γ = 2.2 and 1.5 px of blur (Do & Yoo 2020), 3 electrons of read noise.
    fn default() -> Self {
        Self {
            encoding: Encoding::default(),
            black_grey: 0.0,
            blur_sigma_px: Self::USUAL_BLUR_SIGMA_PX as f32,
            blur_aspect: 1.0,
            read_noise_e: Self::USUAL_READ_NOISE_E as f32,
        }
    }
}

impl Camera {
    /// The default of `blur_sigma_px`.
    pub const USUAL_BLUR_SIGMA_PX: f64 = 1.5;
    /// The default of `read_noise_e`.
    pub const USUAL_READ_NOISE_E: f64 = 3.0;
    /// The range of `black_grey`.
    pub const BLACK_GREY: RangeInclusive<f32> = 0.0..=64.0;
    /// The range of `blur_sigma_px`: a sharper image falls between the pixels, and a softer one merges the LEDs of any readable panel.
    pub const BLUR_SIGMA_PX: RangeInclusive<f32> = 0.3..=4.0;
    /// The range of `blur_aspect`.
    pub const BLUR_ASPECT: RangeInclusive<f32> = 0.5..=2.0;
    /// The range of `read_noise_e`: the square of its end is still finite.
    pub const READ_NOISE_E: RangeInclusive<f32> = 0.0..=1e6;

    /// The camera, if all its values are in range.
    ///
    /// # Errors
    /// [`CameraError`] for the first value out of its range.
    pub fn checked(self) -> Result<Self, CameraError> {
        let Self {
            encoding,
            black_grey,
            blur_sigma_px,
            blur_aspect,
            read_noise_e,
        } = self;
        if let Encoding::Gamma(gamma) = encoding
            && !Encoding::GAMMA.contains(&gamma)
        {
            return Err(CameraError::Gamma { gamma });
        }
        if !Self::BLACK_GREY.contains(&black_grey) {
            return Err(CameraError::Black { black_grey });
        }
        if !Self::BLUR_SIGMA_PX.contains(&blur_sigma_px) {
            return Err(CameraError::Blur { blur_sigma_px });
        }
        if !Self::BLUR_ASPECT.contains(&blur_aspect) {
            return Err(CameraError::BlurAspect { blur_aspect });
        }
        if !Self::READ_NOISE_E.contains(&read_noise_e) {
            return Err(CameraError::ReadNoise { read_noise_e });
        }
        Ok(self)
    }

    /// The light of a grey level, 1 at grey 118 of a camera whose black is 0; 0 below black.
    pub fn light(&self, grey: f32) -> f32 {
        let white = f32::from(u8::MAX);
        self.encoding.light((grey - self.black_grey) * white / (white - self.black_grey))
    }

    /// The grey level of light, neither rounded nor clipped at white; black for none.
    pub fn grey(&self, light: f32) -> f32 {
        let white = f32::from(u8::MAX);
        self.black_grey + self.encoding.grey(light) * (white - self.black_grey) / white
    }

    /// The nearest camera in range; NaN becomes the minimum.
    pub fn clamped(self) -> Self {
        let clamped = |value: f32, range: RangeInclusive<f32>| value.max(*range.start()).min(*range.end());
        Self {
            encoding: self.encoding.clamped(),
            black_grey: clamped(self.black_grey, Self::BLACK_GREY),
            blur_sigma_px: clamped(self.blur_sigma_px, Self::BLUR_SIGMA_PX),
            blur_aspect: clamped(self.blur_aspect, Self::BLUR_ASPECT),
            read_noise_e: clamped(self.read_noise_e, Self::READ_NOISE_E),
        }
    }
}

/// A value that no readable camera has.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The encoding's exponent.
    #[error(
        "a gamma of {gamma} is not {} to {}: give the camera's value, 1 if it is linear; if it is unknown, start with 2.2",
        Encoding::GAMMA.start(),
        Encoding::GAMMA.end()
    )]
    Gamma {
        /// The requested exponent.
        gamma: f32,
    },
    /// The level of no light.
    #[error(
        "a black level of {black_grey} is not {} to {} of 255: give the grey level of a frame with the lens covered",
        Camera::BLACK_GREY.start(),
        Camera::BLACK_GREY.end()
    )]
    Black {
        /// The requested level.
        black_grey: f32,
    },
    /// The blur along x over that along y.
    #[error(
        "a blur {blur_aspect} times as wide as high is not {} to {}: if it is unknown, start with 1",
        Camera::BLUR_ASPECT.start(),
        Camera::BLUR_ASPECT.end()
    )]
    BlurAspect {
        /// The requested ratio.
        blur_aspect: f32,
    },
    /// The lens blur.
    #[error(
        "a blur of {blur_sigma_px} px is not {} to {} px: focus, or shrink the frames; if it is unknown, start with 1.5",
        Camera::BLUR_SIGMA_PX.start(),
        Camera::BLUR_SIGMA_PX.end()
    )]
    Blur {
        /// The requested standard deviation, in pixels.
        blur_sigma_px: f32,
    },
    /// The read noise.
    #[error(
        "a read noise of {read_noise_e} electrons is not {} to {:e}: take it from a data sheet; if it is unknown, start with 3",
        Camera::READ_NOISE_E.start(),
        Camera::READ_NOISE_E.end()
    )]
    ReadNoise {
        /// The requested read noise, in electrons.
        read_noise_e: f32,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_out_of_range_is_refused() {
        let usual = Camera::default();
        assert_eq!((usual.checked(), usual.clamped()), (Ok(usual), usual));
        let gamma = |gamma| Camera {
            encoding: Encoding::Gamma(gamma),
            ..usual
        };
        let blur = |blur_sigma_px| Camera { blur_sigma_px, ..usual };
        let black = |black_grey| Camera { black_grey, ..usual };
        let aspect = |blur_aspect| Camera { blur_aspect, ..usual };
        let read = |read_noise_e| Camera { read_noise_e, ..usual };
        for (camera, wrong) in [
            (gamma(0.9), "a gamma of 0.9 is not 1 to 4: "),
            (gamma(f32::NAN), "a gamma of NaN is not 1 to 4: "),
            (black(65.0), "a black level of 65 is not 0 to 64 of 255: "),
            (blur(0.2), "a blur of 0.2 px is not 0.3 to 4 px: "),
            (blur(f32::INFINITY), "a blur of inf px is not 0.3 to 4 px: "),
            (aspect(2.5), "a blur 2.5 times as wide as high is not 0.5 to 2: "),
            (read(-0.1), "a read noise of -0.1 electrons is not 0 to 1e6: "),
            (read(f32::INFINITY), "a read noise of inf electrons is not 0 to 1e6: "),
        ] {
            let error = camera.checked().unwrap_err().to_string();
            assert!(error.starts_with(wrong), "{error}");
            assert_eq!(camera.clamped().checked(), Ok(camera.clamped()));
        }
    }

    #[test]
    fn light_begins_at_black() {
        let camera = Camera {
            black_grey: 16.0,
            encoding: Encoding::LINEAR,
            ..Camera::default()
        };
        assert_eq!((camera.light(3.0), camera.light(16.0)), (0.0, 0.0));
        assert!((camera.light(255.0) - 255.0 / 118.0).abs() < 1e-6);
        assert_eq!(camera.grey(0.0), 16.0);
        assert!((camera.grey(camera.light(77.0)) - 77.0).abs() < 1e-4);
    }
}
