//! A blur other than a round Gaussian: a disc, as of a lens out of focus, or one that is wider along one axis.
//!
//! For every shape, `camera.blur_sigma_px` is its standard deviation, the geometric mean of those along x and along y.

use super::{About, Effect};
use crate::disc::spread::Shape;
use crate::formation::Formation;
use crate::scene::{Camera, Psf};
use crate::view::{LinearRange, View};

/// Standard deviation of the Gaussian core of diffraction and aberrations at the sharpest rim, in px.
const CORE_PX: f64 = 0.3;
/// The greatest part of the core in the whole deviation, so that a disc remains.
const MOST_CORE: f64 = 0.8;
/// The part of the light that a uniform disc and the Gaussian of its standard deviation distribute differently: ½ − ln 2/2 + e⁻², from the
/// area where the Gaussian is the brighter of the two.
const DISC_FROM_GAUSSIAN: f64 = 0.289;

/// See the [module](self).
pub(super) struct PointSpread;

impl Effect for PointSpread {
    fn about(&self) -> About {
        About {
            name: "point_spread",
            model: "the blur as an evenly lit disc (geometric defocus) on a core of 0.3 px, and wider along one axis; without it a round Gaussian",
            keys: &["camera.psf", "camera.blur_aspect", "camera.blur_sigma_px"],
            cost: "each chord of an LED is drawn once for each chord of the disc",
        }
    }

    /// A pixel changes by at most that part of the range which the two shapes distribute differently: for the disc a constant, for
    /// Gaussians at most ½·|√a − 1/√a| by Pinsker's inequality.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let camera = &view.scene.camera;
        let of_shape = match camera.psf {
            Psf::Gauss => 0.0,
            Psf::Disc => DISC_FROM_GAUSSIAN,
        };
        let root = camera.blur_aspect.sqrt();
        let of_aspect = (root - 1.0 / root).abs() / 2.0;
        if camera.blur_sigma_px == 0.0 {
            return 0.0;
        }
        range.change_by_layers((of_shape + of_aspect).min(1.0))
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        // Without a blur it has no shape.
        if formation.sigma_px > 0.0 {
            (formation.sigma_px, formation.spread) = parts(&view.scene.camera);
        }
    }
}

/// The standard deviation of the blur's core, and the spread beyond it.
fn parts(camera: &Camera) -> (f64, Shape) {
    let sigmas = camera.blur_sigmas_px();
    let least = sigmas[0].min(sigmas[1]);
    let beyond = |core: f64| sigmas.map(|sigma| (sigma * sigma - core * core).max(0.0).sqrt());
    match camera.psf {
        Psf::Gauss if sigmas[0] == sigmas[1] => (least, Shape::Point),
        Psf::Gauss => (least, Shape::Gaussian(beyond(least))),
        Psf::Disc => {
            let core = CORE_PX.min(MOST_CORE * least);
            (core, Shape::Disc(beyond(core).map(|sigma| 2.0 * sigma)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn camera(settings: &[&str]) -> Camera {
        let settings: Vec<String> = settings.iter().map(|set| set.to_string()).collect();
        Scene::load("paper", &settings).unwrap().camera
    }

    #[test]
    fn the_parts_make_the_whole_deviation() {
        for psf in ["gauss", "disc"] {
            for aspect in ["0.5", "1", "1.7"] {
                let [psf, aspect] = [format!("camera.psf={psf}"), format!("camera.blur_aspect={aspect}")];
                let camera = camera(&[&psf, &aspect, "camera.blur_sigma_px=1.2"]);
                let (core, spread) = parts(&camera);
                let beyond = match spread {
                    Shape::Point => [0.0; 2],
                    Shape::Gaussian(sigmas) => sigmas,
                    Shape::Disc(radii) => radii.map(|radius| radius / 2.0),
                };
                for (part, whole) in beyond.iter().zip(camera.blur_sigmas_px()) {
                    assert!((core.hypot(*part) - whole).abs() < 1e-12, "{camera:?}");
                }
                let [x, y] = camera.blur_sigmas_px();
                assert!((x * y - 1.44).abs() < 1e-12 && (x / y - camera.blur_aspect).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_disc_differs_from_its_gaussian_by_the_constant() {
        // Standard deviation 1: density 1/(4π) up to radius 2, against exp(−r²/2)/(2π), in rings of equal width.
        let rings = (0..200_000).map(|k| (f64::from(k) + 0.5) * 5e-5);
        let apart = |r: f64| {
            let disc = if r < 2.0 { 0.25 } else { 0.0 };
            (disc - (-0.5 * r * r).exp() / 2.0).abs() * 2.0 * r * 5e-5
        };
        let half: f64 = rings.map(apart).sum::<f64>() / 2.0;
        assert!(half < DISC_FROM_GAUSSIAN && half > DISC_FROM_GAUSSIAN - 1e-3, "{half}");
    }
}
