//! The camera: exposure, projection and read-out.
//!
//! - [`exposure`]: time and ISO, luminances to linear values. [`clock`]: the symbols in an exposure.
//! - [`projection`]: positions before the camera to pixels.
//! - [`curve`]: linear values to grey levels, [`encoder`] whole rows of them, [`grey`] by the gamma curve. [`noise`]: the sensor's noise in
//!   them. [`shake`]: the camera's vibration.

pub mod clock;
pub mod curve;
pub mod encoder;
pub mod exposure;
pub mod grey;
pub mod noise;
pub mod projection;
pub mod shake;
