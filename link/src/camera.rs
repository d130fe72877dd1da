//! What a receiver is told of the camera whose frames it reads.
//!
//! It is told little, and learns the rest from the frames: how long an exposure was, how noisy it is, where the panel stands.

use core::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// The grey level of linear light 1: that of a grey card which the exposure meter was held against (Do & Yoo 2020, Eq. 11).
///
/// A grey level g is the linear light (g/118)^γ.
pub const MIDDLE_GREY: f32 = 118.0;

/// A camera, as far as a receiver has to know it. Each value is a fact of the camera that its maker or a calibration tells;
/// where nobody does, the [default](Camera::default) is a start.
///
/// ```
/// use link::camera::{Camera, CameraError};
///
/// let sharp = Camera { blur_sigma_px: 0.8, ..Camera::default() };
/// assert_eq!(sharp.checked(), Ok(sharp));
///
/// let dark = Camera { gamma: 0.0, ..Camera::default() };
/// assert_eq!(dark.checked(), Err(CameraError::Gamma { gamma: 0.0 }));
/// assert_eq!(dark.clamped().gamma, 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// The exponent γ of the encoding, grey = 118·light^(1/γ): 1 to 4.
    pub gamma: f32,
    /// Standard deviation of the lens blur, 0.3 to 4 px. It is where the receiver begins: it fits the blur to the frames.
    pub blur_sigma_px: f32,
    /// Read noise, 0 to 10⁶ electrons. It weighs dark pixels against bright ones; a guess does little harm.
    pub read_noise_e: f32,
}

impl Default for Camera {
    /// γ = 2.2 and 1.5 px of blur (Do & Yoo 2020), 3 electrons of read noise.
    fn default() -> Self {
        Self {
            gamma: Self::USUAL_GAMMA as f32,
            blur_sigma_px: Self::USUAL_BLUR_SIGMA_PX as f32,
            read_noise_e: Self::USUAL_READ_NOISE_E as f32,
        }
    }
}

impl Camera {
    /// `gamma` where nobody tells it, before it is rounded to f32.
    pub const USUAL_GAMMA: f64 = 2.2;
    /// `blur_sigma_px` where nobody tells it.
    pub const USUAL_BLUR_SIGMA_PX: f64 = 1.5;
    /// `read_noise_e` where nobody tells it.
    pub const USUAL_READ_NOISE_E: f64 = 3.0;
    /// The range of `gamma`.
    pub const GAMMA: RangeInclusive<f32> = 1.0..=4.0;
    /// The range of `blur_sigma_px`: a sharper image hides between the pixels, a softer one runs the LEDs of any readable panel together.
    pub const BLUR_SIGMA_PX: RangeInclusive<f32> = 0.3..=4.0;
    /// The range of `read_noise_e`: the square of its end is still a number.
    pub const READ_NOISE_E: RangeInclusive<f32> = 0.0..=1e6;

    /// The camera, if all that is said of it is in its range.
    ///
    /// # Errors
    /// [`CameraError`] about the first value that is not.
    pub fn checked(self) -> Result<Self, CameraError> {
        let Self {
            gamma,
            blur_sigma_px,
            read_noise_e,
        } = self;
        if !Self::GAMMA.contains(&gamma) {
            return Err(CameraError::Gamma { gamma });
        }
        if !Self::BLUR_SIGMA_PX.contains(&blur_sigma_px) {
            return Err(CameraError::Blur { blur_sigma_px });
        }
        if !Self::READ_NOISE_E.contains(&read_noise_e) {
            return Err(CameraError::ReadNoise { read_noise_e });
        }
        Ok(self)
    }

    /// The nearest camera in range; what is not a number becomes the least.
    pub fn clamped(self) -> Self {
        let clamped =
            |value: f32, range: RangeInclusive<f32>| value.max(*range.start()).min(*range.end());
        Self {
            gamma: clamped(self.gamma, Self::GAMMA),
            blur_sigma_px: clamped(self.blur_sigma_px, Self::BLUR_SIGMA_PX),
            read_noise_e: clamped(self.read_noise_e, Self::READ_NOISE_E),
        }
    }
}

/// No camera that a receiver can read for is like this.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The encoding's exponent.
    #[error(
        "a gamma of {gamma} is not {} to {}: give the camera's, 1 where it is linear; 2.2 is a start where it is not known",
        Camera::GAMMA.start(),
        Camera::GAMMA.end()
    )]
    Gamma {
        /// The exponent asked for.
        gamma: f32,
    },
    /// The lens blur.
    #[error(
        "a blur of {blur_sigma_px} px is not {} to {} px: focus, or shrink the frames; 1.5 is a start where it is not known",
        Camera::BLUR_SIGMA_PX.start(),
        Camera::BLUR_SIGMA_PX.end()
    )]
    Blur {
        /// The standard deviation asked for, in pixels.
        blur_sigma_px: f32,
    },
    /// The read noise.
    #[error(
        "a read noise of {read_noise_e} electrons is not {} to {:e}: a data sheet has it; 3 is a start where it is not known",
        Camera::READ_NOISE_E.start(),
        Camera::READ_NOISE_E.end()
    )]
    ReadNoise {
        /// The read noise asked for, in electrons.
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
        for (gamma, blur_sigma_px, read_noise_e, wrong) in [
            (0.9, 1.5, 3.0, "a gamma of 0.9 is not 1 to 4: "),
            (f32::NAN, 1.5, 3.0, "a gamma of NaN is not 1 to 4: "),
            (2.2, 0.2, 3.0, "a blur of 0.2 px is not 0.3 to 4 px: "),
            (
                2.2,
                f32::INFINITY,
                3.0,
                "a blur of inf px is not 0.3 to 4 px: ",
            ),
            (
                2.2,
                1.5,
                -0.1,
                "a read noise of -0.1 electrons is not 0 to 1e6: ",
            ),
            (
                2.2,
                1.5,
                f32::INFINITY,
                "a read noise of inf electrons is not 0 to 1e6: ",
            ),
        ] {
            let camera = Camera {
                gamma,
                blur_sigma_px,
                read_noise_e,
            };
            let error = camera.checked().unwrap_err().to_string();
            assert!(error.starts_with(wrong), "{error}");
            assert_eq!(camera.clamped().checked(), Ok(camera.clamped()));
        }
    }
}
