//! The settings of a receiver.

use crate::detect::Method;
use crate::locate::Locator;
use crate::settings::{LikelihoodSettings, SearchSettings, SettingError, TrackingSettings};
use crate::symbols::{SymbolClock, SymbolRateError};
use link::camera::{Camera, CameraError};

/// The properties of the link, and the methods of the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverSettings {
    /// The camera that makes the frames.
    pub camera: Camera,
    /// The detector.
    pub method: Method,
    /// Symbols per frame period of the camera: above 0, at most 1.
    pub symbols_per_frame: f32,
    /// The search for panels.
    pub search: SearchSettings,
    /// The tracking of panels.
    pub tracking: TrackingSettings,
    /// The settings of maximum likelihood.
    pub likelihood: LikelihoodSettings,
}

impl Default for ReceiverSettings {
    /// The default camera, maximum likelihood, and one symbol a frame.
    fn default() -> Self {
        Self {
            camera: Camera::default(),
            method: Method::default(),
            symbols_per_frame: 1.0,
            search: SearchSettings::DEFAULT,
            tracking: TrackingSettings::DEFAULT,
            likelihood: LikelihoodSettings::DEFAULT,
        }
    }
}

impl ReceiverSettings {
    /// Validates all settings without a receiver.
    ///
    /// # Errors
    /// [`ReceiverError`] if one is out of its range.
    pub fn validate(&self) -> Result<(), ReceiverError> {
        self.clock().map(|_| ())
    }

    /// The clock of a panel's symbols, after all settings have been validated.
    pub(super) fn clock(&self) -> Result<SymbolClock, ReceiverError> {
        self.camera.checked()?;
        if self.method == Method::MaximumLikelihood && cfg!(not(feature = "maximum-likelihood")) {
            return Err(ReceiverError::LeftOut);
        }
        let clock = SymbolClock::new(self.symbols_per_frame)?;
        self.search.validate()?;
        self.tracking.validate()?;
        self.likelihood.validate()?;
        Ok(clock)
    }

    /// The locator of panels.
    pub(super) fn locator(&self) -> Result<Locator, ReceiverError> {
        Ok(Locator::new(self.camera)?.with_settings(self.search)?)
    }
}

/// Why no receiver can have these settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ReceiverError {
    /// The camera is invalid.
    #[error(transparent)]
    Camera(
        #[from]
        #[cfg_attr(feature = "defmt", defmt(Display2Format))]
        CameraError,
    ),
    /// The program was built without maximum likelihood.
    #[error("maximum likelihood was left out of this program: build it with the feature maximum-likelihood, or choose another method")]
    LeftOut,
    /// The symbols cannot be followed at this rate.
    #[error(transparent)]
    SymbolRate(
        #[from]
        #[cfg_attr(feature = "defmt", defmt(Display2Format))]
        SymbolRateError,
    ),
    /// A number is out of its range.
    #[error(transparent)]
    Setting(
        #[from]
        #[cfg_attr(feature = "defmt", defmt(Display2Format))]
        SettingError,
    ),
}
