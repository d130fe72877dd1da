//! What the Pico's reader wants to know of the camera.

use rx_pipeline::hm01b0::Mode;

/// What a Pico 2 sets its camera to.
pub const MODE: Mode = Mode::QVGA;
