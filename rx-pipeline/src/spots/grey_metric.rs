//! Differences of light in units of grey levels: for noise that is uniform in grey levels.

use super::light_table::LightTable;
use crate::frame::Frame;
use link::camera::Camera;

/// Darker pixels weigh like one of this level (grey): the encoding is so steep there that the sensor's own noise, not the grey level,
/// determines the uncertainty. Lower: dark pixels decide.
const DARKEST_GREY: usize = 48;

/// The weight of a difference of light at each grey level.
#[derive(Clone, Debug)]
pub(crate) struct GreyMetric {
    light: LightTable,
    /// The square of the light between neighbouring grey levels.
    slope_squared: [f32; 256],
    weight: [f32; 256],
}

impl GreyMetric {
    pub fn new(camera: &Camera) -> Self {
        let light = LightTable::new(camera);
        let slope_squared = core::array::from_fn(|grey| {
            let grey = (grey as f32).max(camera.black_grey + DARKEST_GREY as f32);
            let slope = camera.light(grey + 0.5) - camera.light(grey - 0.5);
            slope * slope
        });
        Self {
            light,
            weight: slope_squared.map(|square: f32| 1.0 / square),
            slope_squared,
        }
    }

    /// The light of a grey level, 1 at grey 118.
    pub fn light(&self, grey: u8) -> f32 {
        self.light.of(grey)
    }

    /// The light between the pixels of a frame, and whether it is white; `None` beyond the frame.
    pub fn light_at(&self, frame: &Frame<'_>, at: [f32; 2]) -> Option<(f32, bool)> {
        self.light.at(frame, at)
    }

    /// The light of pixels, and the weights of their squared differences from a model, in grey levels squared. A white pixel is a lower
    /// bound: it has no weight if the model is at least as bright.
    #[inline]
    pub fn single<const L: usize>(&self, grey: &[u8; L], model: &[f32; L]) -> [[f32; L]; 2] {
        let light = grey.map(|grey| self.light.of(grey));
        let weight = grey.map(|grey| self.weight[usize::from(grey)]);
        let white = self.light.of(u8::MAX);
        let weight = core::array::from_fn(|i| {
            let agrees = light[i] >= white && model[i] >= light[i];
            if agrees { 0.0 } else { weight[i] }
        });
        [light, weight]
    }

    /// The same for the differences from an earlier frame's pixels.
    #[inline]
    pub fn pair<const L: usize>(&self, grey: &[u8; L], earlier: &[u8; L], model: &[f32; L]) -> [[f32; L]; 2] {
        let [now, then] = [grey, earlier].map(|grey| grey.map(|grey| self.light.of(grey)));
        let [slope_now, slope_then] = [grey, earlier].map(|grey| grey.map(|grey| self.slope_squared[usize::from(grey)]));
        let white = self.light.of(u8::MAX);
        let light: [f32; L] = core::array::from_fn(|i| now[i] - then[i]);
        let weight = core::array::from_fn(|i| {
            let (white_now, white_then) = (now[i] >= white, then[i] >= white);
            let agrees = (white_now & (white_then | (model[i] >= light[i]))) | (white_then & (model[i] <= light[i]));
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
        let metric = GreyMetric::new(&Camera::default());
        assert_eq!(metric.light(118), 1.0);
        let [[level], [weight]] = metric.single(&[200], &[0.0]);
        let step = metric.light(201) - level;
        approx::assert_abs_diff_eq!(step * step * weight, 1.0, epsilon = 0.02);
        assert!((0..=255).all(|grey| metric.single(&[grey], &[0.0])[1][0].is_finite()));
    }

    #[test]
    fn white_pixels_count_only_where_the_model_is_darker() {
        let metric = GreyMetric::new(&Camera::default());
        let weights = metric.single(&[255, 255, 254], &[9.0, 2.0, 9.0])[1];
        assert_eq!(weights.map(|weight| weight > 0.0), [false, true, true]);
        // White now, then, both and neither, with a model that changes by more, and by less.
        let (now, then) = ([255, 255, 9, 9, 255, 255, 9, 9], [9, 9, 255, 255, 255, 255, 9, 9]);
        let weights = metric.pair(&now, &then, &[9.0, -9.0, 9.0, -9.0, 9.0, -9.0, 9.0, -9.0])[1];
        let counted = [false, true, true, false, false, false, true, true];
        assert_eq!(weights.map(|weight| weight > 0.0), counted);
    }
}
