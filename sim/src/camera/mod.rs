//! The camera: what it exposes, where it images things, and how it reads out.
//!
//! - [`exposure`]: time and ISO, luminances to linear values. [`clock`]: which symbols an exposure sees.
//! - [`projection`]: places before the camera to pixels.
//! - [`grey`]: linear values to grey levels. [`noise`]: the sensor's noise in them.

pub mod clock;
pub mod exposure;
pub mod grey;
pub mod noise;
pub mod projection;
