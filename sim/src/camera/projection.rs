//! Projects metres on the panel to pixels on the sensor: a pinhole camera.
//!
//! Camera axes: x right, y down, z forward. The panel is rotated by Rz(roll)·Ry(yaw)·Rx(pitch), with its centre at (x, y, distance). Pixel
//! (0, 0) is the centre of the top-left pixel. The image of a disc under a pinhole is exactly an ellipse: [`Projection::ellipse`].

use glam::{DMat2, DMat3, DVec2, DVec3};
use link::panel::SIDE;

use crate::scene::{Camera, Panel, Pose};

/// The image of a disc: the points `centre + shape·(cos φ, sin φ)`, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Its centre.
    pub centre: DVec2,
    /// Two conjugate half-diameters, as columns.
    pub shape: DMat2,
}

impl Ellipse {
    /// Half the width and half the height of the upright box around it.
    pub(crate) fn half_extent(&self) -> DVec2 {
        DVec2::new(self.shape.row(0).length(), self.shape.row(1).length())
    }
}

impl Ellipse {
    /// The smaller of its two half-diameters.
    pub(crate) fn smaller_half_diameter(&self) -> f64 {
        let square = self.shape * self.shape.transpose();
        let (middle, product) = ((square.x_axis.x + square.y_axis.y) / 2.0, square.determinant());
        (middle - (middle * middle - product).max(0.0).sqrt()).max(f64::MIN_POSITIVE).sqrt()
    }
}

/// One panel before one camera.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    rotation: DMat3,
    centre_m: DVec3,
    focal_px: f64,
    principal_px: DVec2,
    pitch_m: f64,
    led_radius_m: f64,
}

impl Projection {
    /// The projection of `panel` in `pose` to `camera`.
    pub fn new(camera: &Camera, panel: &Panel, pose: &Pose) -> Self {
        let rotation = DMat3::from_rotation_z(pose.roll_deg.to_radians())
            * DMat3::from_rotation_y(pose.yaw_deg.to_radians())
            * DMat3::from_rotation_x(pose.pitch_deg.to_radians());
        Self {
            rotation,
            centre_m: DVec3::new(pose.x_m, pose.y_m, pose.distance_m),
            focal_px: camera.focal_px(),
            principal_px: DVec2::from_array(camera.principal_px()),
            pitch_m: panel.pitch_m(),
            led_radius_m: panel.led_diameter_m / 2.0,
        }
    }

    /// The same for a camera that sees the world rotated.
    pub(crate) fn turned(self, by: DMat3) -> Self {
        Self {
            rotation: by * self.rotation,
            centre_m: by * self.centre_m,
            ..self
        }
    }

    /// The panel's own coordinates of LED (`row`, `column`), in metres from its centre; halves mean points between.
    pub fn led_m(&self, row: f64, column: f64) -> DVec2 {
        let middle = (SIDE as f64 - 1.0) / 2.0;
        DVec2::new(column - middle, row - middle) * self.pitch_m
    }

    /// Depth in metres of a point of the panel: at most 0 behind the camera.
    pub(crate) fn depth_m(&self, point_m: DVec2) -> f64 {
        self.in_camera(point_m).z
    }

    /// The pixel position of a point of the panel (its own coordinates in metres).
    ///
    /// ```
    /// use glam::DVec2;
    /// use sim::{camera::projection::Projection, scene::Scene};
    /// let scene = Scene::load("paper", &[])?;
    /// let projection = Projection::new(&scene.camera, &scene.panels[0], &scene.pose);
    /// assert_eq!(projection.pixel(DVec2::ZERO), DVec2::new(959.5, 539.5));
    /// # Ok::<(), sim::scene::SceneError>(())
    /// ```
    pub fn pixel(&self, point_m: DVec2) -> DVec2 {
        let p = self.in_camera(point_m);
        self.principal_px + self.focal_px * DVec2::new(p.x, p.y) / p.z
    }

    /// The first-order change of [`Projection::pixel`] about a point, in px/m: its columns belong to the panel's axes.
    pub fn jacobian(&self, point_m: DVec2) -> DMat2 {
        let p = self.in_camera(point_m);
        let along = |axis: DVec3| self.focal_px * (DVec2::new(axis.x, axis.y) - DVec2::new(p.x, p.y) / p.z * axis.z) / p.z;
        DMat2::from_cols(along(self.rotation.x_axis), along(self.rotation.y_axis))
    }

    /// The exact image of the LED disc about a point of the panel.
    ///
    /// On the circle c + ρ(cos φ, sin φ) the depth is z + a·cos φ + b·sin φ; the image of the circle is an ellipse whose
    /// centre is the image of c moved against the depth's slope.
    pub fn ellipse(&self, point_m: DVec2) -> Ellipse {
        let p = self.in_camera(point_m);
        let slope = self.led_radius_m * DVec2::new(self.rotation.x_axis.z, self.rotation.y_axis.z) / p.z;
        let jacobian = self.jacobian(point_m) * self.led_radius_m;
        let steepness = slope.length();
        // With ψ measured from the steepest direction, the offset from the image of c is
        // (j₁·cos ψ + j₂·sin ψ) / (1 + s·cos ψ): an ellipse with centre −s·j₁/(1 − s²) and the half-diameters
        // j₁/(1 − s²) and j₂/√(1 − s²).
        let steepest = if steepness > 0.0 { slope / steepness } else { DVec2::X };
        let (j1, j2) = (jacobian * steepest, jacobian * steepest.perp());
        let shrink = 1.0 - steepness * steepness;
        Ellipse {
            centre: self.pixel(point_m) - j1 * steepness / shrink,
            shape: DMat2::from_cols(j1 / shrink, j2 / shrink.sqrt()),
        }
    }

    fn in_camera(&self, point_m: DVec2) -> DVec3 {
        self.rotation * point_m.extend(0.0) + self.centre_m
    }
}

/// The local affine image of an ellipse under radial distortion ρ → ρ·(1 + k₁·ρ²).
pub(crate) fn distorted(camera: &Camera, k1: f64, ellipse: Ellipse) -> Ellipse {
    let principal = DVec2::from_array(camera.principal_px());
    let p = (ellipse.centre - principal) / camera.focal_px();
    let gain = 1.0 + k1 * p.length_squared();
    let outer = DMat2::from_cols(p * p.x, p * p.y);
    Ellipse {
        centre: principal + p * gain * camera.focal_px(),
        shape: (DMat2::from_diagonal(DVec2::splat(gain)) + outer * (2.0 * k1)) * ellipse.shape,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn the_ellipse_is_the_image_of_the_circle() {
        let overrides = [
            "pose.yaw_deg=60",
            "pose.roll_deg=20",
            "pose.pitch_deg=-30",
            "pose.distance_m=0.6",
            "pose.x_m=0.1",
        ];
        let scene = Scene::load("paper", &overrides.map(String::from)).unwrap();
        let projection = Projection::new(&scene.camera, &scene.panels[0], &scene.pose);
        let led = projection.led_m(1.0, 6.0);
        let ellipse = projection.ellipse(led);
        for step in 0..12 {
            let on_circle = led + 0.015 * DVec2::from_angle(f64::from(step));
            let unit = ellipse.shape.inverse() * (projection.pixel(on_circle) - ellipse.centre);
            assert!((unit.length() - 1.0).abs() < 1e-12, "{unit}");
        }
    }

    #[test]
    fn the_spacing_is_the_paper_s() {
        let scene = Scene::load("paper", &[]).unwrap();
        let projection = Projection::new(&scene.camera, &scene.panels[0], &scene.pose);
        let spacing = projection.pixel(projection.led_m(0.0, 1.0)) - projection.pixel(projection.led_m(0.0, 0.0));
        // p·f/d/w = 0.06 · 25e-3 / 50 / 6.875e-6.
        assert!((spacing.x - 4.363_636_363_6).abs() < 1e-9 && spacing.y == 0.0);
    }
}
