//! Differences of root light: for the noise of electrons and of read-out.
//!
//! A pixel of light x caught x·k electrons, of which shot and read noise make x ± √((x + c)/k): with root light y = √(x + c) the
//! deviation is 1/(2·√k) throughout (Anscombe 1948; with read noise Murtagh, Starck & Bijaoui 1995). So all pixels weigh the same, and
//! one variance says how noisy the frame is. What rounding to grey levels adds is nearly constant there too, since the encoding
//! is nearly a root.

use super::light_table::LightTable;
use core::ops::RangeInclusive;
use link::camera::Camera;

/// What is added to light under the root (light, 1 at middle grey). Wider: frames that the model does not explain look
/// as if they were noisier or less noisy than any camera's.
const ROOT_OFFSET: RangeInclusive<f32> = 1e-3..=1.0;

/// What of a camera decides on root light and its noise.
#[derive(Clone, Debug)]
pub(crate) struct RootMetric {
    light: LightTable,
    read_noise_e: f32,
}

impl RootMetric {
    /// That of a camera that sees no light; all zeros.
    pub const DARK: Self = Self {
        light: LightTable::DARK,
        read_noise_e: 0.0,
    };

    pub fn new(camera: &Camera) -> Self {
        Self {
            light: LightTable::new(camera),
            read_noise_e: camera.read_noise_e,
        }
    }

    /// The light of a grey level, 1 at grey 118.
    #[inline]
    pub fn light(&self, grey: u8) -> f32 {
        self.light.of(grey)
    }

    /// The least light that is read as 255.
    pub fn full(&self) -> f32 {
        self.light.full()
    }

    /// Grey levels by which light 1 brighter by a small part of itself is more, over that part.
    pub fn grey_of_one(&self) -> f32 {
        1.0 / self.light.middle_slope()
    }

    /// Grey levels by which root light 1 higher by a small step is more, over that step, at middle grey: 2·118/γ.
    pub fn grey_of_root(&self) -> f32 {
        2.0 * self.grey_of_one()
    }

    /// The variance of root light that rounding to whole grey levels adds: 1/12·(dy/dg)², at middle grey.
    pub fn rounding_variance(&self) -> f32 {
        let slope = 0.5 * self.light.middle_slope();
        slope * slope / 12.0
    }

    /// What is added to light under the root where root light has the variance `noise`: 3/8 electron and the read noise's variance
    /// (Murtagh et al. 1995), at the electrons that make the noise.
    pub fn offset(&self, noise: f32) -> f32 {
        let light_of_an_electron = 4.0 * (noise - self.rounding_variance());
        let (least, most) = (*ROOT_OFFSET.start(), *ROOT_OFFSET.end());
        (light_of_an_electron * (0.375 + self.read_noise_e * self.read_noise_e)).clamp(least, most)
    }
}
