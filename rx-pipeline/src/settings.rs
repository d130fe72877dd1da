//! The user's settings for finding, following and reading panels, each with its unit, effect, default and range.
//!
//! The results in `docs/receiver.md` are for the defaults. [`link::camera::Camera`] describes the camera, and the memory is a type's
//! `PIXELS`. All other constants are next to the code that uses them.
//!
//! ```
//! use rx_pipeline::receiver::{ReceiverError, ReceiverSettings};
//! use rx_pipeline::settings::TrackingSettings;
//! let tracking = TrackingSettings { patience_frames: 30, ..TrackingSettings::default() };
//! let settings = ReceiverSettings { tracking, ..ReceiverSettings::default() };
//! assert_eq!(settings.validate(), Ok(()));
//!
//! let tracking = TrackingSettings { min_confidence: 2.0, ..tracking };
//! let error = ReceiverSettings { tracking, ..settings }.validate().unwrap_err();
//! assert_eq!(error.to_string(), "min_confidence is 2: give 0.5 to 1, or leave it at 0.95");
//! ```

/// A setting out of its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}: give {min} to {max}, or leave it at {default}")]
pub struct SettingError {
    /// The setting's name.
    pub name: &'static str,
    /// The requested value.
    pub value: f32,
    /// The minimum.
    pub min: f32,
    /// The maximum.
    pub max: f32,
    /// The default.
    pub default: f32,
}

/// Defines settings with their defaults and ranges, in one place.
macro_rules! settings {
    ($(#[$about:meta])* $Settings:ident { $($(#[$effect:meta])* $name:ident: $Number:ty = $default:literal in $min:literal..=$max:literal,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $Settings {
            $(
                $(#[$effect])*
                #[doc = concat!("\n\nDefault ", stringify!($default), "; ", stringify!($min), " to ", stringify!($max), ".")]
                pub $name: $Number,
            )*
        }

        impl $Settings {
            /// All defaults.
            pub const DEFAULT: Self = Self { $($name: $default,)* };

            /// Checks that each value is in its range.
            ///
            /// # Errors
            /// [`SettingError`] for the first value out of its range.
            pub fn validate(&self) -> Result<(), SettingError> {
                $(
                    let (min, max): ($Number, $Number) = ($min, $max);
                    if !(min..=max).contains(&self.$name) {
                        return Err(SettingError {
                            name: stringify!($name),
                            value: f32::from(self.$name),
                            min: f32::from(min),
                            max: f32::from(max),
                            default: f32::from(Self::DEFAULT.$name),
                        });
                    }
                )*
                Ok(())
            }
        }

        impl Default for $Settings {
            fn default() -> Self {
                Self::DEFAULT
            }
        }
    };
}

settings! {
    /// The search for panels in whole frames: see [`Locator`](crate::locate::Locator).
    SearchSettings {
        /// Poses tried at changed places in each frame (count).
        ///
        /// More: panels that blink are found in fewer frames, and each frame takes longer.
        changed_poses: u16 = 8 in 1..=1000,
        /// Poses tried at busy places of a single frame, in each frame (count).
        ///
        /// More: panels among clutter are found in fewer frames, and each frame takes longer. 0: only what blinks is found.
        busy_poses: u16 = 3 in 0..=1000,
        /// Busy places of a single frame that a full search examines for any panel (count). Isolated spots are searched at all.
        ///
        /// More: panels beside busier things are found, and frames without a panel take longer.
        full_places: u16 = 8 in 1..=96,
        /// Minimum log odds (natural logarithm) of a panel against spots of any brightness, in a single frame in which its LEDs merge.
        ///
        /// Higher: fewer false positives, and more panels are found only by their blinking.
        min_log_odds: f32 = 10.0 in 0.0..=100.0,
        /// Maximum share of pixels at grey 255 in a found panel (percent).
        ///
        /// Higher: panels with little readable content are found; lower: overexposed ones are refused.
        max_saturated_percent: u8 = 60 in 0..=100,
    }
}

settings! {
    /// How a panel is followed from frame to frame.
    TrackingSettings {
        /// Frames in a row that may miss the panel before it is given up (frames): 0.12 s at 100 a second.
        ///
        /// More: longer gaps are bridged, and the search for a panel that has gone starts later.
        patience_frames: u16 = 12 in 0..=10000,
        /// The greatest pitch in the frame's own pixels (px). Nearer panels are drawn in larger pixels, in which the same limit applies.
        ///
        /// Less: faster, and less noise is averaged away.
        max_pitch_px: f32 = 7.2 in 4.0..=7.2,
        /// A panel is searched again if its recent bits are less sure (probability that one is right). Only maximum likelihood provides
        /// this.
        ///
        /// Higher: lattices off by a line are corrected sooner, and noise costs more time.
        min_confidence: f32 = 0.95 in 0.5..=1.0,
    }
}

settings! {
    /// How maximum likelihood reads bits: see [`MaximumLikelihood`](crate::likelihood::MaximumLikelihood).
    LikelihoodSettings {
        /// Sets of flips that the sphere decoder keeps (count).
        ///
        /// Fewer: faster, more wrong bits if LEDs overlap, and soft values less sure.
        list_sets: u8 = 64 in 1..=64,
        /// Frames that try other curves of the camera (frames).
        ///
        /// More: a wrong curve is corrected more reliably, and more of the first frames take longer. 0: the configured curve stays.
        curve_frames: u16 = 32 in 0..=1000,
    }
}
