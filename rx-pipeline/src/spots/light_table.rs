//! The light of grey levels.

use crate::frame::{Frame, bilinear};
use link::camera::{Camera, MIDDLE_GREY};

/// The light of each grey level by a camera's encoding, 1 at grey 118.
#[derive(Clone, Debug)]
pub(crate) struct LightTable {
    light: [f32; 256],
    /// The derivative of light by the grey level, at grey 118.
    middle_slope: f32,
    /// The least light at the highest grey level.
    full: f32,
}

impl LightTable {
    /// No light at all.
    pub const DARK: Self = Self {
        light: [0.0; 256],
        middle_slope: 0.0,
        full: 0.0,
    };

    pub fn new(camera: &Camera) -> Self {
        Self {
            light: core::array::from_fn(|grey| camera.light(grey as f32)),
            middle_slope: camera.light(MIDDLE_GREY + 0.5) - camera.light(MIDDLE_GREY - 0.5),
            full: camera.light(254.5),
        }
    }

    pub fn of(&self, grey: u8) -> f32 {
        self.light[usize::from(grey)]
    }

    /// The light between the pixels of a frame, and whether it is white; `None` beyond the frame.
    pub fn at(&self, frame: &Frame<'_>, at: [f32; 2]) -> Option<(f32, bool)> {
        let (grey, distance) = frame.four_around(at)?;
        Some((bilinear(grey.map(|grey| self.of(grey)), distance), grey.contains(&u8::MAX)))
    }

    pub fn middle_slope(&self) -> f32 {
        self.middle_slope
    }

    pub fn full(&self) -> f32 {
        self.full
    }
}
