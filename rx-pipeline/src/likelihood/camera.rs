//! What the detector has to know of the camera.

use core::ops::RangeInclusive;

use crate::locate::LocatorSettings;

/// What is known of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Gamma of the encoding: 1 to 4.
    pub gamma: f32,
    /// Standard deviation of the lens blur in px, where the search for it begins: 0.3 to 4.
    pub blur_sigma_px: f32,
    /// Read noise in electrons, or a guess, 0 to 10⁶: it weighs dark pixels against bright ones.
    pub read_noise_e: f32,
}

/// Its square is still a number.
const READ_NOISE_E: RangeInclusive<f32> = 0.0..=1e6;

impl Default for Camera {
    /// γ = 2.2 and 1.5 px of blur (Do & Yoo 2020), 3 electrons of read noise.
    fn default() -> Self {
        Self {
            gamma: 2.2,
            blur_sigma_px: 1.5,
            read_noise_e: 3.0,
        }
    }
}

impl Camera {
    /// The camera, if all that is said of it is in its range.
    ///
    /// # Errors
    /// [`CameraError`] if something is not.
    pub fn checked(self) -> Result<Self, CameraError> {
        (self == self.bounded())
            .then_some(self)
            .ok_or(CameraError(self))
    }

    /// The nearest camera in range: a search that begins from none at all may have no end.
    pub(super) fn bounded(self) -> Self {
        // What is not a number becomes the least.
        let bounded =
            |value: f32, range: RangeInclusive<f32>| value.max(*range.start()).min(*range.end());
        Self {
            gamma: bounded(self.gamma, LocatorSettings::GAMMA),
            blur_sigma_px: bounded(self.blur_sigma_px, LocatorSettings::BLUR_SIGMA_PX),
            read_noise_e: bounded(self.read_noise_e, READ_NOISE_E),
        }
    }
}

/// No camera is like this one.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "maximum likelihood for gamma {}, a blur of {} px and a read noise of {} electrons: gamma is 1 to 4, the blur 0.3 to 4 px, \
     the read noise 0 to 1e6 electrons; 2.2, 1.5 and 3 are a start where they are not known",
    .0.gamma,
    .0.blur_sigma_px,
    .0.read_noise_e
)]
pub struct CameraError(pub Camera);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_out_of_range_is_refused() {
        let usual = Camera::default();
        assert_eq!(usual.checked(), Ok(usual));
        for (gamma, blur_sigma_px, read_noise_e) in [
            (0.9, 1.5, 3.0),
            (f32::NAN, 1.5, 3.0),
            (2.2, 0.2, 3.0),
            (2.2, f32::INFINITY, 3.0),
            (2.2, 1.5, -0.1),
            (2.2, 1.5, f32::INFINITY),
        ] {
            let camera = Camera {
                gamma,
                blur_sigma_px,
                read_noise_e,
            };
            assert!(camera.checked().is_err(), "{camera:?}");
            assert!(camera.bounded().checked().is_ok(), "{camera:?}");
        }
    }
}
