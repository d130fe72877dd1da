//! Grey levels as light, and how much of it a grey level leaves unknown.

use super::candidate::Window;
use crate::frame::Frame;

/// The light of each grey level, and the weight that makes a difference of light one of grey levels.
#[derive(Clone, Debug)]
pub(super) struct Light {
    light: [f32; 256],
    weight: [f32; 256],
}

impl Light {
    /// Light is 1 at grey 118, the level of a grey card.
    pub fn new(gamma: f32) -> Self {
        let light_of = |grey: f32| libm::powf(grey / 118.0, gamma);
        Self {
            light: core::array::from_fn(|grey| light_of(grey as f32)),
            // Grey 255 stands for that much light or any more.
            weight: core::array::from_fn(|grey| match grey as f32 {
                255.0 => 0.0,
                grey => 1.0 / (light_of(grey + 0.5) - light_of(f32::max(grey - 0.5, 0.0))),
            }),
        }
    }

    pub fn of(&self, grey: u8) -> f32 {
        self.light[usize::from(grey)]
    }

    /// Grey levels per unit of light; 0 at grey 255, which is no measurement.
    pub fn weight(&self, grey: u8) -> f32 {
        self.weight[usize::from(grey)]
    }
}

/// How a candidate differs from its background.
pub(super) struct Patch {
    pixels: u32,
    brighter: u32,
    saturated: u32,
    squares: f32,
}

impl Patch {
    pub fn of(frame: &Frame<'_>, window: Window, background: u8) -> Self {
        let mut patch = Self {
            pixels: 0,
            brighter: 0,
            saturated: 0,
            squares: 0.0,
        };
        for (_, row) in window.rows(frame) {
            for &grey in row {
                let step = f32::from(grey) - f32::from(background);
                patch.pixels += 1;
                patch.brighter += u32::from(grey > background);
                patch.saturated += u32::from(grey == u8::MAX);
                patch.squares += step * step;
            }
        }
        patch
    }

    /// Pixels at grey 255 among the brighter ones.
    pub fn saturated_percent(&self) -> u8 {
        (100 * u64::from(self.saturated) / u64::from(self.brighter.max(1))) as u8
    }

    /// Root mean square difference from the background beyond that of noise with standard deviation `spread`, in grey levels.
    pub fn contrast_grey(&self, spread: f32) -> f32 {
        libm::sqrtf((self.squares / self.pixels.max(1) as f32 - spread * spread).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_turn_light_into_grey_levels() {
        let light = Light::new(2.2);
        assert_eq!(light.of(118), 1.0);
        let step = (light.of(201) - light.of(200)) * light.weight(200);
        approx::assert_abs_diff_eq!(step, 1.0, epsilon = 0.01);
        assert_eq!(light.weight(255), 0.0);
        assert!((0..=255).all(|grey| light.weight(grey).is_finite()));
    }
}
