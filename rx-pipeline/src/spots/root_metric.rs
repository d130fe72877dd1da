//! Differences of root light: for the noise of electrons and of read-out.
//!
//! A pixel of light x caught x·k electrons, of which shot and read noise make x ± √((x + c)/k): with root light y = √(x + c) the deviation
//! is 1/(2·√k) throughout (Anscombe 1948; with read noise Murtagh, Starck & Bijaoui 1995). So all pixels weigh the same, and one variance
//! describes the frame's noise. The noise of rounding to grey levels is nearly constant there too, because the encoding is nearly a root.

use super::light_table::LightTable;
#[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
use crate::frame::Frame;
use core::ops::RangeInclusive;
use link::camera::Camera;

/// Range of the addition to light under the root (light, 1 at middle grey). Wider: frames that the model does not explain get a noise above
/// or below any camera's.
const ROOT_OFFSET: RangeInclusive<f32> = 1e-3..=1.0;

/// The properties of a camera that determine root light and its noise.
#[derive(Clone, Debug)]
pub(crate) struct RootMetric {
    light: LightTable,
    read_noise_e: f32,
}

impl RootMetric {
    /// The metric of a camera that sees no light; all zeros.
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

    /// The light between the pixels of a frame, and whether it is white; `None` beyond the frame.
    #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
    pub fn light_at(&self, frame: &Frame<'_>, at: [f32; 2]) -> Option<(f32, bool)> {
        self.light.at(frame, at)
    }

    /// The least light at grey 255.
    pub fn full(&self) -> f32 {
        self.light.full()
    }

    /// The derivative of the grey level by the logarithm of light, at light 1.
    pub fn grey_of_one(&self) -> f32 {
        1.0 / self.light.middle_slope()
    }

    /// The derivative of the grey level by root light, at middle grey: 2·118/γ.
    pub fn grey_of_root(&self) -> f32 {
        2.0 * self.grey_of_one()
    }

    /// The variance of root light by rounding to whole grey levels: 1/12·(dy/dg)², at middle grey.
    pub fn rounding_variance(&self) -> f32 {
        let slope = 0.5 * self.light.middle_slope();
        slope * slope / 12.0
    }

    /// The addition to light under the root if root light has the variance `noise`: 3/8 electron and the read noise's variance (Murtagh et
    /// al. 1995), at the number of electrons that causes that noise.
    pub fn offset(&self, noise: f32) -> f32 {
        let light_of_an_electron = 4.0 * (noise - self.rounding_variance());
        let (least, most) = (*ROOT_OFFSET.start(), *ROOT_OFFSET.end());
        (light_of_an_electron * (0.375 + self.read_noise_e * self.read_noise_e)).clamp(least, most)
    }
}
