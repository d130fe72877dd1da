//! An outline at its position on the sensor, drawn pixel by pixel.

use std::sync::OnceLock;

use glam::DVec2;

use super::canvas::Canvas;
use crate::disc::outline::Outline;

/// A shape far larger than its blur, which would need too many [`Chords`](crate::disc::chords::Chords).
#[derive(Clone, Debug)]
pub struct LargeShape {
    /// Its boundary.
    pub outline: Outline,
    /// Its centre, in px of the sensor.
    pub centre: DVec2,
    /// Its light without a shift, kept for the next frames, because drawing it takes as long as many frames.
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
