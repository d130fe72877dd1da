//! A curve from light to grey levels other than the gamma curve.

use super::{About, Effect};
use crate::camera::curve::Curve;
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Encoding;

impl Effect for Encoding {
    fn about(&self) -> About {
        About {
            name: "encoding",
            model: "the curve of sRGB (IEC 61966-2-1), of ITU-R BT.709, a straight line, or gamma with a shoulder, above a black level; else gamma",
            keys: &["camera.encoding", "camera.black_grey", "camera.gamma"],
            cost: "a look-up a pixel instead of two polynomials",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let camera = &view.scene.camera;
        let difference = Curve::of(camera).greatest_difference(&Curve::gamma(camera.gamma));
        range.sharpened(difference)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.curve = Curve::of(&view.scene.camera);
    }
}
