//! What a receiver is told before its first frame.

use crate::detect::Method;
use crate::locate::Locator;
use crate::settings::{LikelihoodSettings, SearchSettings, SettingError, TrackingSettings};
use crate::symbols::{SymbolClock, SymbolRateError};
use link::camera::{Camera, CameraError};

/// What a receiver has to know of the link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverSettings {
    /// The camera that makes the frames.
    pub camera: Camera,
    /// How bits are told apart.
    pub method: Method,
    /// Symbols the panel shows in a camera's frame period: above 0, at most 1.
    pub symbols_per_frame: f32,
    /// How panels are looked for.
    pub search: SearchSettings,
    /// How they are followed.
    pub tracking: TrackingSettings,
    /// How maximum likelihood reads them.
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
    /// Checks all of them, without a receiver.
    ///
    /// # Errors
    /// [`ReceiverError`] if one is out of its range.
    pub fn validate(&self) -> Result<(), ReceiverError> {
        self.clock().map(|_| ())
    }

    /// The clock of a panel's symbols, once all settings are checked.
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

    /// What looks for panels.
    pub(super) fn locator(&self) -> Result<Locator, ReceiverError> {
        Ok(Locator::new(self.camera)?.with_settings(self.search)?)
    }
}

/// Why there is no receiver with these settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReceiverError {
    /// No camera is like that.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The program has no maximum likelihood.
    #[error("maximum likelihood was left out of this program: build it with the feature maximum-likelihood, or choose another method")]
    LeftOut,
    /// The symbols cannot be followed at this rate.
    #[error(transparent)]
    SymbolRate(#[from] SymbolRateError),
    /// A number is out of its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
}
