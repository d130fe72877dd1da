//! The numbers that a user may turn of how panels are looked for, followed and read; of each its unit, its effect, its default and its
//! range.
//!
//! With the defaults a receiver does what `docs/receiver.md` states the results of. What a camera is like is told by
//! [`link::camera::Camera`]; what memory there is, is a type's `PIXELS`. All other numbers stand in the code that uses them.
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

/// A setting that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}: give {min} to {max}, or leave it at {default}")]
pub struct SettingError {
    /// The setting's name.
    pub name: &'static str,
    /// The value asked for.
    pub value: f32,
    /// The least that may be.
    pub min: f32,
    /// The most that may be.
    pub max: f32,
    /// What serves where nobody says.
    pub default: f32,
}

/// Settings with their defaults and ranges, which stand here and nowhere else.
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

            /// Whether each value is in its range.
            ///
            /// # Errors
            /// [`SettingError`] about the first that is not.
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
    /// How a panel is looked for in whole frames: see [`Locator`](crate::locate::Locator).
    SearchSettings {
        /// Poses tried where the frame has changed, in each frame (count).
        ///
        /// More: panels that blink are found in fewer frames, and each frame takes longer.
        changed_poses: u16 = 8 in 1..=1000,
        /// Poses tried where a single frame is busy, in each frame (count).
        ///
        /// More: panels among clutter are found in fewer frames, and each frame takes longer. 0: only what blinks is found.
        busy_poses: u16 = 3 in 0..=1000,
        /// By how much likelier a panel has to be in a single frame, where its LEDs run into each other, than spots of any brightness
        /// (natural logarithm of the odds).
        ///
        /// Higher: fewer things are taken for panels, and more panels are found only by their blinking.
        min_log_odds: f32 = 10.0 in 0.0..=100.0,
        /// Pixels at grey 255 of a panel that is found, at most (percent).
        ///
        /// Higher: panels are found of which little is known; lower: overexposed ones are refused.
        max_saturated_percent: u8 = 60 in 0..=100,
    }
}

settings! {
    /// How a panel that was found is followed from frame to frame.
    TrackingSettings {
        /// Frames in a row that may miss the panel before it is given up (frames): 0.12 s at 100 a second.
        ///
        /// More: longer gaps are bridged, and a panel that has gone is looked for later.
        patience_frames: u16 = 12 in 0..=10000,
        /// The widest distance of neighbouring LEDs that is looked at in the frame's own pixels (px). Nearer panels are drawn in larger
        /// pixels, in which it is the widest, too.
        ///
        /// Less: faster, and less noise is averaged away.
        max_pitch_px: f32 = 7.2 in 4.0..=7.2,
        /// A panel is looked for again where its bits of late are less sure (probability that one is right). Maximum likelihood alone
        /// tells.
        ///
        /// Higher: lattices that lie a line off are mended sooner, and noise costs more time.
        min_confidence: f32 = 0.95 in 0.5..=1.0,
    }
}

settings! {
    /// How bits are read by maximum likelihood: see [`MaximumLikelihood`](crate::likelihood::MaximumLikelihood).
    LikelihoodSettings {
        /// Sets of flips that the sphere decoder keeps (count).
        ///
        /// Fewer: faster, more wrong bits where LEDs overlap, and soft values less sure.
        list_sets: u8 = 64 in 1..=64,
        /// Frames in which other curves of the camera are tried (frames).
        ///
        /// More: a wrong curve is mended more surely, and the first frames take longer for longer. 0: the curve is the one that was told.
        curve_frames: u16 = 32 in 0..=1000,
    }
}
