//! Grey levels as light, and how much of it a grey level leaves unknown.

use link::camera::MIDDLE_GREY;

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
        let light_of = |grey: f32| libm::powf(grey / MIDDLE_GREY, gamma);
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

    /// The light of pixels, and the weights of their squared differences from a model, in grey levels squared. A white pixel is at least
    /// as bright as that: where the model is too, it has no weight.
    #[inline]
    pub fn single<const L: usize>(&self, grey: &[u8; L], model: &[f32; L]) -> [[f32; L]; 2] {
        let light = grey.map(|grey| self.of(grey));
        let weight = grey.map(|grey| self.weight[usize::from(grey)]);
        let white = self.of(u8::MAX);
        let weight = core::array::from_fn(|i| {
            let agrees = light[i] >= white && model[i] >= light[i];
            if agrees { 0.0 } else { weight[i] }
        });
        [light, weight]
    }

    /// The same for the differences from an earlier frame's pixels.
    #[inline]
    pub fn pair<const L: usize>(
        &self,
        grey: &[u8; L],
        earlier: &[u8; L],
        model: &[f32; L],
    ) -> [[f32; L]; 2] {
        let [now, then] = [grey, earlier].map(|grey| grey.map(|grey| self.of(grey)));
        let [slope_now, slope_then] =
            [grey, earlier].map(|grey| grey.map(|grey| self.slope_squared[usize::from(grey)]));
        let white = self.of(u8::MAX);
        let light: [f32; L] = core::array::from_fn(|i| now[i] - then[i]);
        let weight = core::array::from_fn(|i| {
            let (white_now, white_then) = (now[i] >= white, then[i] >= white);
            let agrees = (white_now & (white_then | (model[i] >= light[i])))
                | (white_then & (model[i] <= light[i]));
            let weight = 1.0 / (slope_now[i] + slope_then[i]);
            if agrees { 0.0 } else { weight }
        });
        [light, weight]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_turn_light_into_grey_levels() {
        let light = Light::new(2.2);
        assert_eq!(light.of(118), 1.0);
        let [[level], [weight]] = light.single(&[200], &[0.0]);
        let step = light.of(201) - level;
        approx::assert_abs_diff_eq!(step * step * weight, 1.0, epsilon = 0.02);
        assert!((0..=255).all(|grey| light.single(&[grey], &[0.0])[1][0].is_finite()));
    }

    #[test]
    fn white_pixels_count_only_where_the_model_is_darker() {
        let light = Light::new(2.2);
        let weights = light.single(&[255, 255, 254], &[9.0, 2.0, 9.0])[1];
        assert_eq!(weights.map(|weight| weight > 0.0), [false, true, true]);
        // White now, then, both and neither, and each time a model that changes by more, and by less.
        let (now, then) = (
            [255, 255, 9, 9, 255, 255, 9, 9],
            [9, 9, 255, 255, 255, 255, 9, 9],
        );
        let weights = light.pair(&now, &then, &[9.0, -9.0, 9.0, -9.0, 9.0, -9.0, 9.0, -9.0])[1];
        let counted = [false, true, true, false, false, false, true, true];
        assert_eq!(weights.map(|weight| weight > 0.0), counted);
    }
}
