//! What a receiver is told before its first frame.

use crate::detect::Method;
use crate::likelihood::CameraError;
use crate::locate::{LocateError, LocatorSettings};
use crate::symbols::SymbolRateError;

/// What a receiver has to know of the link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverSettings {
    /// The camera.
    pub locator: LocatorSettings,
    /// How bits are told apart.
    pub method: Method,
    /// Symbols the panel shows in a camera's frame period: above 0, at most 1.
    pub symbols_per_frame: f32,
}

impl Default for ReceiverSettings {
    /// A camera of γ = 2.2 and about 1.5 px of blur, maximum likelihood, and one symbol a frame.
    fn default() -> Self {
        Self {
            locator: LocatorSettings::default(),
            method: Method::default(),
            symbols_per_frame: 1.0,
        }
    }
}

/// Why there is no receiver with these settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReceiverError {
    /// The locator does not take its settings.
    #[error(transparent)]
    Locator(#[from] LocateError),
    /// The detector does not take its camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The symbols cannot be followed at this rate.
    #[error(transparent)]
    SymbolRate(#[from] SymbolRateError),
}
