//! Pixels of different gain (PRNU) and dark offset (DSNU).

use super::{About, Effect};
use crate::camera::noise::electrons_per_linear;
use crate::formation::{Formation, RowStage};
use crate::random::{BELL_MOST, Fixed, Purpose, bell};
use crate::scene::Scene;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct FixedPattern;

impl Effect for FixedPattern {
    fn about(&self) -> About {
        About {
            name: "fixed_pattern",
            model: "photo response and dark signal differ from pixel to pixel, PRNU and DSNU of EMVA 1288, nearly normal and fixed by the \
         camera's seed",
            keys: &["camera.prnu_percent", "camera.dsnu_e", "camera.seed"],
            cost: "two hashes a pixel",
        }
    }

    /// The pattern has no outliers: see [`bell`].
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let (gain, offset) = spread(view);
        range.change(BELL_MOST * ((range.peak + range.lamp) * gain + offset))
    }

    fn widen(&self, view: &View, range: &mut LinearRange) {
        let (gain, offset) = spread(view);
        let [gain, offset] = [gain, offset].map(|spread| BELL_MOST * spread);
        range.floor = (range.floor * (1.0 - gain) - offset).max(0.0);
        range.peak = range.peak * (1.0 + gain) + offset;
        range.lamp *= 1.0 + gain;
        range.pixel_gain += gain;
        range.pixel_offset += offset;
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        let (gain, offset) = spread(view);
        if (gain, offset) != (0.0, 0.0) {
            let seed = view.scene.camera.seed.into();
            formation.row_stages.push(Box::new(Pattern {
                gain,
                offset,
                response: Fixed::new(seed, Purpose::PhotoResponse),
                dark: Fixed::new(seed, Purpose::DarkSignal),
            }));
        }
    }
}

/// Standard deviation of the gain, and of the offset as a linear value.
fn spread(view: &View) -> (f64, f64) {
    let Scene { camera, .. } = &view.scene;
    (
        camera.prnu_percent / 100.0,
        camera.dsnu_e / electrons_per_linear(&view.scene, &view.exposure),
    )
}

struct Pattern {
    gain: f64,
    offset: f64,
    response: Fixed,
    dark: Fixed,
}

impl Pattern {
    fn of(&self, x: usize, y: usize) -> (f64, f64) {
        (
            1.0 + self.gain * bell(self.response.at(x, y)),
            self.offset * bell(self.dark.at(x, y)),
        )
    }
}

impl RowStage for Pattern {
    fn apply(&self, x: usize, y: usize, row: &mut [f32]) {
        for (x, value) in (x..).zip(row) {
            let (gain, offset) = self.of(x, y);
            *value = *value * gain as f32 + offset as f32;
        }
    }

    fn apply_exact(&self, x: usize, y: usize, row: &mut [f64]) {
        for (x, value) in (x..).zip(row) {
            let (gain, offset) = self.of(x, y);
            *value = *value * gain + offset;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::curve::Curve;

    #[test]
    fn the_pattern_spreads_as_the_scene_says_and_stays_where_it_is() {
        let settings = ["camera.prnu_percent=2", "camera.dsnu_e=5"].map(String::from);
        let view = View::new(&Scene::load("night", &settings).unwrap()).unwrap();
        let mut formation = Formation::plain(1, Curve::gamma(2.2));
        FixedPattern.include(&view, &mut formation);
        let rows = |light: f64| {
            let row = |y| {
                let mut row = [light; 1000];
                formation.row_stages[0].apply_exact(0, y, &mut row);
                row
            };
            (0..40).flat_map(row).collect::<Vec<_>>()
        };
        let (dark, bright) = (rows(0.0), rows(3.0));
        let deviation = |values: &[f64], mean: f64| (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
        let response: Vec<f64> = bright.iter().zip(&dark).map(|(b, d)| (b - d) / 3.0).collect();
        assert!((deviation(&response, 1.0) / 0.02 - 1.0).abs() < 0.02);
        let electrons = electrons_per_linear(&view.scene, &view.exposure);
        assert!((deviation(&dark, 0.0) * electrons / 5.0 - 1.0).abs() < 0.02);
        // A part of a row equals that part of the whole row.
        let mut part = [0f32; 10];
        formation.row_stages[0].apply(500, 3, &mut part);
        for (part, &whole) in part.iter().zip(&dark[3500..]) {
            assert!((f64::from(*part) - whole).abs() < 1e-6);
        }
    }
}
