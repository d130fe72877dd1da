//! Finds and reads panels on this chip.

#[cfg(not(feature = "rp2040"))]
mod float;
#[cfg(feature = "rp2040")]
mod integer;

#[cfg(not(feature = "rp2040"))]
pub use float::{Reader, take};
#[cfg(feature = "rp2040")]
pub use integer::{Reader, take};

#[cfg(not(feature = "rp2040"))]
use link::camera::{Camera, Encoding};
use rx_pipeline::receiver::BlinkSearch;

use crate::capture::CAMERA_MODE;

/// The memory for a search of the whole frame.
const ROOM: usize = BlinkSearch::bytes(CAMERA_MODE.width, CAMERA_MODE.height);

/// The properties of the camera that the receiver must know: linear, with a small lens.
#[cfg(not(feature = "rp2040"))]
const CAMERA: Camera = Camera {
    encoding: Encoding::LINEAR,
    black_grey: CAMERA_MODE.black_grey as f32,
    blur_sigma_px: 0.7,
    blur_aspect: 1.0,
    read_noise_e: Camera::USUAL_READ_NOISE_E as f32,
};
