//! One panel in the camera's view, and whether it is visible.

use glam::{DMat2, DVec2};
use link::panel::{LEDS, SIDE};

use super::error::{DEPTH_MIN_M, PITCH_MIN_PX, ViewError};
use crate::camera::exposure::{Exposure, LedLight};
use crate::camera::projection::{Ellipse, Projection, distorted};
use crate::camera::shake::{Reach, Shake};
use crate::l2a;
use crate::scene::{Camera, Panel, Pose, Scene};

/// Rows and columns, in LEDs, of the corners of a panel's 8 × 8 cells.
pub(crate) const BOARD_CORNERS: [(f64, f64); 4] = [(-0.5, -0.5), (-0.5, 7.5), (7.5, 7.5), (7.5, -0.5)];

/// One panel in the camera's view.
#[derive(Clone, Debug)]
pub struct PanelView {
    /// The panel.
    pub panel: Panel,
    /// Its pose.
    pub pose: Pose,
    /// Its projection.
    pub projection: Projection,
    /// Its LED-to-ambient ratio.
    pub l2a: f64,
    /// Its LEDs, at the panel's own reflectance, without the air between.
    pub light: LedLight,
    /// The exact images of its LEDs.
    pub ellipses: [Ellipse; LEDS],
}

impl PanelView {
    /// Panel `index` of a scene under its exposure.
    pub(super) fn new(scene: &Scene, exposure: &Exposure, index: usize) -> Result<Self, ViewError> {
        let (panel, pose) = (scene.panels[index].clone(), scene.pose_of(index).clone());
        let projection = Projection::new(&scene.camera, &panel, &pose);
        let corners = BOARD_CORNERS.map(|(row, column)| projection.led_m(row, column));
        let depth_m = corners.iter().map(|&c| projection.depth_m(c)).fold(f64::INFINITY, f64::min);
        if depth_m < DEPTH_MIN_M {
            return Err(ViewError::Behind { panel: index, depth_m });
        }
        let l2a = l2a::of_panel(scene, &panel)?;
        let light = exposure.led_light(scene, &panel, panel.reflectance, l2a);
        let ellipses = std::array::from_fn(|led| projection.ellipse(projection.led_m((led / SIDE) as f64, (led % SIDE) as f64)));
        let view = Self {
            panel,
            pose,
            projection,
            l2a,
            light,
            ellipses,
        };
        check_place(scene, index, &view)?;
        Ok(view)
    }

    /// The greatest distance of a corner of its 8 × 8 cells from its centre in the image.
    pub(crate) fn radius_px(&self) -> f64 {
        let centre = self.projection.pixel(DVec2::ZERO);
        let corners = BOARD_CORNERS.map(|(row, column)| self.projection.pixel(self.projection.led_m(row, column)));
        corners.into_iter().map(|corner| (corner - centre).length()).fold(0.0, f64::max)
    }

    /// Bounds of the effect of the camera's vibration on its image.
    pub(crate) fn reach_of(&self, shake: &Shake, camera: &Camera) -> Reach {
        let off_axis = self.projection.pixel(DVec2::ZERO) - DVec2::from_array(camera.principal_px());
        shake.reach(camera, off_axis.length() + self.radius_px())
    }
}

/// Checks that the panel's image is wholly on the sensor and large enough.
fn check_place(scene: &Scene, index: usize, panel: &PanelView) -> Result<(), ViewError> {
    let camera = &scene.camera;
    let k1 = scene.distortion_k1();
    let place = |(row, column)| {
        let centre = panel.projection.pixel(panel.projection.led_m(row, column));
        let shape = DMat2::IDENTITY;
        distorted(camera, k1, Ellipse { centre, shape }).centre
    };
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for at in rim() {
        let radius = panel.projection.pixel(panel.projection.led_m(at.0, at.1));
        let radius = (radius - DVec2::from_array(camera.principal_px())).length();
        let radius = radius / camera.focal_px();
        // Beyond the radius at which ρ·(1 + k₁·ρ²) stops rising, the formula folds the image over, which no lens does.
        if 1.0 + 3.0 * k1 * radius * radius <= 0.0 {
            return Err(ViewError::Folded {
                panel: index,
                radius,
                k1,
                most: (-3.0 * k1).sqrt().recip(),
            });
        }
        let pixel = place(at);
        (low, high) = (low.min(pixel), high.max(pixel));
    }
    let (width, height) = (camera.width_px, camera.height_px);
    // A rim of two pixels for the gradient and for a shift of less than one pixel.
    if low.min_element() < 2.0 || high.x > width as f64 - 3.0 || high.y > height as f64 - 3.0 {
        return Err(ViewError::OffSensor {
            panel: index,
            left: low.x,
            right: high.x,
            top: low.y,
            bottom: high.y,
            width,
            height,
        });
    }
    let corners = BOARD_CORNERS.map(place);
    let pitch_px = (corners[1] - corners[0]).length().min((corners[3] - corners[0]).length()) / SIDE as f64;
    if pitch_px < PITCH_MIN_PX {
        return Err(ViewError::TooSmall { panel: index, pitch_px });
    }
    Ok(())
}

/// Rows and columns, in LEDs, of points around a panel's 8 × 8 cells, because distortion bends its edges outwards or inwards.
fn rim() -> impl Iterator<Item = (f64, f64)> {
    let (first, last) = (BOARD_CORNERS[0].0, BOARD_CORNERS[2].0);
    (0..=SIDE).flat_map(move |step| {
        let at = first + step as f64;
        [(first, at), (last, at), (at, first), (at, last)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::View;

    fn view(overrides: &[&str]) -> Result<View, ViewError> {
        let overrides: Vec<String> = overrides.iter().map(|set| set.to_string()).collect();
        View::new(&Scene::load("paper", &overrides).unwrap())
    }

    #[test]
    fn a_panel_must_be_on_the_sensor_as_the_lens_images_it() {
        let near_the_edge = ["pose.x_m=12.6", "camera.focal_length_mm=25"];
        let with = |extra: &[&str]| view(&[&near_the_edge[..], extra].concat());
        assert!(with(&[]).is_ok());
        // A pincushion moves it outwards, a barrel inwards.
        let outwards = with(&["camera.distortion_k1=0.4"]);
        assert!(matches!(outwards, Err(ViewError::OffSensor { .. })), "{outwards:?}");
        assert!(with(&["camera.distortion_k1=-0.4"]).is_ok());
        assert!(with(&["camera.distortion_k1=0.4", "effects.distortion=off"]).is_ok());
        assert!(view(&["pose.x_m=13.3"]).is_err());
        assert!(view(&["pose.x_m=13.3", "camera.distortion_k1=-0.4"]).is_ok());
    }

    #[test]
    fn a_lens_does_not_fold_the_image() {
        // 8 mm from the axis at a focal length of 4 mm: the formula would return the panel to the middle.
        let folded = view(&[
            "camera.focal_length_mm=4",
            "camera.distortion_k1=-0.5",
            "pose.distance_m=8",
            "pose.x_m=11",
        ]);
        assert!(matches!(folded, Err(ViewError::Folded { .. })), "{folded:?}");
    }
}
