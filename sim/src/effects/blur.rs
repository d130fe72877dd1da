//! The lens blur: a Gaussian, convolved exactly with disc and pixel (see [`crate::disc::chords`]).

use super::{About, Effect};
use crate::formation::Formation;
use crate::scene::Psf;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct LensBlur;

impl Effect for LensBlur {
    fn about(&self) -> About {
        About {
            name: "blur",
            model: "Gaussian blur of the lens, Do & Yoo 2020, Eqs. (14) and (15), applied to the linear image",
            keys: &["camera.blur_sigma_px"],
            cost: "LEDs reach 4 to 6 sigma farther",
        }
    }

    /// A Gaussian moves light by σ·√(2/π) on average along each axis, and no shape by more than σ; the mean of an edge over a pixel's width
    /// moves by at most its displacement.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let camera = &view.scene.camera;
        let mean = match camera.psf {
            Psf::Gauss => (2.0 / std::f64::consts::PI).sqrt(),
            Psf::Disc => 1.0,
        };
        let displacement = camera.blur_sigmas_px().map(|sigma| sigma * mean).iter().sum();
        range.change_by_layers(displacement)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.sigma_px = view.scene.camera.blur_sigma_px;
    }
}
