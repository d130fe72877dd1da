//! Shot noise and read noise. A pixel at grey 255 holds `full_well_e`·100/ISO electrons.

use super::{About, Effect};
use crate::camera::noise::Noise;
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct SensorNoise;

impl Effect for SensorNoise {
    fn about(&self) -> About {
        About {
            name: "noise",
            model: "shot noise (Poisson electrons) and read noise (normal), at the ISO of the exposure: EMVA 1288",
            keys: &["camera.full_well_e", "camera.read_noise_e", "camera.iso_min", "camera.iso_max"],
            cost: "a random number a pixel of the frame",
        }
    }

    /// The 1 − 10⁻⁹ quantile of the change, at the level at which it is greatest.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let noise = Noise::new(&view.scene, &view.exposure, range.curve);
        let [darkest, brightest] = [range.floor, range.peak + range.lamp].map(|linear| range.curve.unrounded(linear));
        let level = |k: i32| {
            let grey = darkest + (brightest - darkest) * f64::from(k) / 200.0;
            range.curve.linear(grey)
        };
        let changes = (0..=200).map(|k| noise.rare_change_grey(level(k)));
        range.sharpened(changes.fold(0.0, f64::max))
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.noise = Some(Noise::new(&view.scene, &view.exposure, formation.curve));
    }
}
