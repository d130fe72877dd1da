//! An outline at its place on the sensor, drawn pixel by pixel.

use std::sync::OnceLock;

use glam::DVec2;

use super::canvas::Canvas;
use crate::disc::outline::Outline;

/// What [`Chords`](crate::disc::chords::Chords) are too many for: something far larger than its blur.
#[derive(Clone, Debug)]
pub struct LargeShape {
    /// Its boundary.
    pub outline: Outline,
    /// Its centre, in px of the sensor.
    pub centre: DVec2,
    /// Its light where nothing shifts it, kept for the next frames: to draw it takes as long as many frames.
    pub(super) still: OnceLock<Canvas<f32>>,
}

impl LargeShape {
    /// `outline` about `centre`.
    pub fn new(outline: Outline, centre: DVec2) -> Self {
        Self {
            outline,
            centre,
            still: OnceLock::new(),
        }
    }
}
