//! Grey levels as light, and how much of it a grey level leaves unknown.

/// The light of each grey level, and how much a difference of light counts there.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    light: [f32; 256],
    /// The square of the light that one grey level more makes.
    slope_squared: [f32; 256],
    weight: [f32; 256],
}

/// Darker pixels count as uncertain as one of this grey level: there the encoding is so steep that not the grey level but the sensor's own
/// noise says how sure the light is.
const DARKEST: usize = 48;

impl Light {
    /// Light is 1 at grey 118, the level of a grey card.
    pub fn new(gamma: f32) -> Self {
        let light_of = |grey: f32| libm::powf(grey / 118.0, gamma);
        let slope_squared = core::array::from_fn(|grey| {
            let grey = grey.max(DARKEST) as f32;
            let slope = light_of(grey + 0.5) - light_of(grey - 0.5);
            slope * slope
        });
        Self {
            light: core::array::from_fn(|grey| light_of(grey as f32)),
            weight: slope_squared.map(|square: f32| 1.0 / square),
            slope_squared,
        }
    }

    pub fn of(&self, grey: u8) -> f32 {
        self.light[usize::from(grey)]
    }

    /// The light of a pixel, and the weight of its squared difference from a model, in grey levels squared. A white pixel is at least
    /// as bright as that.
    pub fn single(&self, grey: u8, model: f32) -> (f32, f32) {
        let light = self.of(grey);
        if grey == u8::MAX && model >= light {
            return (model, 0.0);
        }
        (light, self.weight[usize::from(grey)])
    }

    /// The same for the difference from an earlier frame's pixel.
    pub fn pair(&self, grey: u8, earlier: u8, model: f32) -> (f32, f32) {
        let light = self.of(grey) - self.of(earlier);
        let (white_now, white_then) = (grey == u8::MAX, earlier == u8::MAX);
        if (white_now && (white_then || model >= light)) || (white_then && model <= light) {
            return (model, 0.0);
        }
        let [now, then] = [grey, earlier].map(|grey| self.slope_squared[usize::from(grey)]);
        (light, 1.0 / (now + then))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_turn_light_into_grey_levels() {
        let light = Light::new(2.2);
        assert_eq!(light.of(118), 1.0);
        let (level, weight) = light.single(200, 0.0);
        let step = light.of(201) - level;
        approx::assert_abs_diff_eq!(step * step * weight, 1.0, epsilon = 0.02);
        assert_eq!(light.single(255, 9.0), (9.0, 0.0));
        assert!((0..=255).all(|grey| light.single(grey, 0.0).1.is_finite()));
    }
}
