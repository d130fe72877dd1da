//! A point in the paper's three dimensions, and its scene.

use serde::{Deserialize, Serialize};

use sim::scene::{L2a, Scene};

/// A point of the paper's space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OperatingPoint {
    /// Gap between neighbouring LEDs over their diameter.
    pub interval: f64,
    /// Distance in metres.
    pub distance_m: f64,
    /// LED-to-ambient ratio.
    pub l2a: f64,
}

impl OperatingPoint {
    /// The values of interval, distance and ratio in the figures that vary one of them.
    pub const REFERENCE: Self = Self {
        interval: 1.0,
        distance_m: 50.0,
        l2a: 1.0,
    };

    /// [`OperatingPoint::REFERENCE`] with another ratio.
    pub fn at_l2a(l2a: f64) -> Self {
        Self { l2a, ..Self::REFERENCE }
    }

    /// The reference with another interval.
    pub fn at_interval(interval: f64) -> Self {
        Self {
            interval,
            ..Self::REFERENCE
        }
    }

    /// The reference at another distance.
    pub fn at_distance(distance_m: f64) -> Self {
        Self {
            distance_m,
            ..Self::REFERENCE
        }
    }

    /// `scene` with its first panel at this setting.
    pub fn scene(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        if let Some(panel) = scene.panels.first_mut() {
            panel.interval = self.interval;
            if let Some(pose) = &mut panel.pose {
                pose.distance_m = self.distance_m;
            }
        }
        scene.pose.distance_m = self.distance_m;
        scene.link.l2a = L2a::Ratio(self.l2a);
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::camera::exposure::Exposure;

    fn lights(illuminance_lx: f64, overrides: &[&str]) -> [f64; 3] {
        let mut overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
        overrides.push(format!("ambient.illuminance_lx={illuminance_lx}"));
        let scene = Scene::load("paper", &overrides).unwrap();
        let exposure = Exposure::of(&scene);
        let light = exposure.led_light(&scene, &scene.panels[0], 0.4, 2.0);
        [exposure.background, light.off, light.on]
    }

    /// The paper draws each frame's illuminance from 50 to 16 000 lx. Exposure and dimming follow it, so one illuminance represents all.
    #[test]
    fn frames_of_the_paper_do_not_depend_on_the_light() {
        let [bright, dark] = [16_000.0, 50.0].map(|lx| lights(lx, &[]));
        for (a, b) in bright.iter().zip(dark) {
            assert!((a / b - 1.0).abs() < 1e-9, "{a} against {b}");
        }
        let limited = ["camera.iso_max=3200"];
        assert!(lights(50.0, &limited)[0] < 0.2 * lights(16_000.0, &limited)[0]);
    }
}
