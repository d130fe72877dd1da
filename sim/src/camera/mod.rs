//! The camera: what it exposes, where it images things, and how it reads out.
//!
//! - [`exposure`]: time and ISO, luminances to linear values. [`clock`]: which symbols an exposure sees.
//! - [`projection`]: places before the camera to pixels.
//! - [`curve`]: linear values to grey levels, [`encoder`] whole rows of them, [`grey`] by the gamma curve. [`noise`]: the sensor's
//!   noise in them. [`shake`]: how the camera vibrates.

pub mod clock;
pub mod curve;
pub mod encoder;
pub mod exposure;
pub mod grey;
pub mod noise;
pub mod projection;
pub mod shake;
