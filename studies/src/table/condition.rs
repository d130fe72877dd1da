//! The conditions of a search.

use sim::scene::Scene;

/// One combination of the four keys' values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// Distance, m.
    pub distance_m: f64,
    /// Rotation about the vertical, degrees.
    pub yaw_deg: f64,
}

impl std::fmt::Display for Condition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            illuminance_lx,
            interval,
            distance_m,
            yaw_deg,
        } = self;
        write!(f, "{illuminance_lx} lx, interval {interval}, {distance_m} m, yaw {yaw_deg}°")
    }
}

impl Condition {
    /// The scene with its first panel in this condition.
    pub(super) fn of(self, scene: &Scene) -> Scene {
        let mut scene = with_panel(scene, self.illuminance_lx, self.interval);
        let pose = scene.pose_of_mut(0);
        (pose.distance_m, pose.yaw_deg) = (self.distance_m, self.yaw_deg);
        scene
    }
}

/// The scene with that illuminance, its first panel with that interval.
pub(super) fn with_panel(scene: &Scene, illuminance_lx: f64, interval: f64) -> Scene {
    let mut scene = scene.clone();
    scene.ambient.illuminance_lx = illuminance_lx;
    for panel in scene.panels.iter_mut().take(1) {
        panel.interval = interval;
    }
    scene
}
