//! The light of grey levels.

use link::camera::MIDDLE_GREY;

/// The light of each grey level g by the gamma curve (g/118)^γ, 1 at grey 118.
#[derive(Clone, Debug)]
pub(crate) struct GammaTable {
    light: [f32; 256],
    gamma: f32,
}

impl GammaTable {
    /// No light at all.
    pub const DARK: Self = Self {
        light: [0.0; 256],
        gamma: 0.0,
    };

    pub fn new(gamma: f32) -> Self {
        let mut table = Self {
            gamma,
            ..Self::DARK
        };
        table.light = core::array::from_fn(|grey| table.between(grey as f32));
        table
    }

    pub fn gamma(&self) -> f32 {
        self.gamma
    }

    pub fn of(&self, grey: u8) -> f32 {
        self.light[usize::from(grey)]
    }

    /// The light of a grey level between whole ones, worked out.
    pub fn between(&self, grey: f32) -> f32 {
        libm::powf(grey / MIDDLE_GREY, self.gamma)
    }
}
