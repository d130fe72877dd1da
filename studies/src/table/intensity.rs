//! The light of a panel as in road regulations: luminous intensity, in candela.

use link::intensity::mean_cd;
use serde::{Deserialize, Serialize};
use sim::scene::{Panel, Scene};

/// Lamps by name, with the required and the allowed luminous intensity in candela on their axis: UN Regulation No. 148, section 5 (rear
/// position lamps R1 of steady and R2 of variable intensity, stop lamps S1 and S2, daytime running lamps).
pub const LAMPS: [(&str, Bounds); 5] = [
    ("rear-position", Bounds::of(4.0, 17.0)),
    ("rear-position-variable", Bounds::of(4.0, 42.0)),
    ("stop", Bounds::of(60.0, 260.0)),
    ("stop-variable", Bounds::of(60.0, 730.0)),
    ("daytime-running", Bounds::of(400.0, 1200.0)),
];

/// The required and the allowed mean luminous intensity of a panel, cd.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// At least.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_cd: Option<f64>,
    /// At most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_cd: Option<f64>,
}

impl Bounds {
    const fn of(min_cd: f64, max_cd: f64) -> Self {
        Self {
            min_cd: Some(min_cd),
            max_cd: Some(max_cd),
        }
    }

    /// The bounds of a lamp in `LAMPS`.
    ///
    /// # Errors
    /// The names of all lamps.
    pub fn of_lamp(name: &str) -> Result<Self, String> {
        let lamp = LAMPS.iter().find(|(lamp, _)| *lamp == name);
        lamp.map(|&(_, bounds)| bounds).ok_or_else(|| {
            let names = LAMPS.map(|(lamp, _)| lamp).join(", ");
            format!("no lamp {name:?}: choose one of {names}")
        })
    }

    /// The ratios of a range at which a panel's mean intensity is within these bounds; `None` if there are none.
    pub fn ratios(&self, [low, high]: [f64; 2], panel: &Panel, illuminance_lx: f64) -> Option<[f64; 2]> {
        let of_one = panel_cd(panel, illuminance_lx, 1.0);
        let low = self.min_cd.map_or(low, |least| low.max(least / of_one));
        let high = self.max_cd.map_or(high, |most| high.min(most / of_one));
        (low < high).then_some([low, high])
    }
}

impl std::fmt::Display for Bounds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.min_cd, self.max_cd) {
            (Some(least), Some(most)) => write!(f, "a mean of {least} to {most} cd"),
            (Some(least), None) => write!(f, "a mean of {least} cd or more"),
            (None, Some(most)) => write!(f, "a mean of {most} cd or less"),
            (None, None) => f.write_str("any light"),
        }
    }
}

/// The light of a scene's first panel at a ratio; all 0 without a panel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Light {
    /// The mean luminous intensity straight ahead, cd.
    pub mean_cd: f64,
    /// Luminous intensity with all LEDs On, cd.
    pub peak_cd: f64,
    /// The luminance of an On LED, cd/m².
    pub luminance_cd_m2: f64,
}

impl Light {
    pub fn of(scene: &Scene, l2a: f64) -> Self {
        let illuminance_lx = scene.ambient.illuminance_lx;
        let of_panel = |panel| {
            let mean_cd = panel_cd(panel, illuminance_lx, l2a);
            Self {
                mean_cd,
                peak_cd: 2.0 * mean_cd,
                luminance_cd_m2: luminance_cd_m2(panel, illuminance_lx, l2a),
            }
        };
        scene.panels.first().map(of_panel).unwrap_or_default()
    }
}

/// The luminance of an On LED, cd/m², at a ratio: L2A·E·R (Do & Yoo 2020, Eq. (9)).
pub fn luminance_cd_m2(panel: &Panel, illuminance_lx: f64, l2a: f64) -> f64 {
    l2a * illuminance_lx * panel.reflectance
}

/// The mean luminous intensity of a panel straight ahead, cd, at a ratio.
///
/// ```
/// use sim::scene::Panel;
/// use studies::table::panel_cd;
/// // LEDs of 30 mm and reflectance 0.4.
/// assert!((panel_cd(&Panel::default(), 10_000.0, 2.0) - 181.0).abs() < 0.1);
/// ```
pub fn panel_cd(panel: &Panel, illuminance_lx: f64, l2a: f64) -> f64 {
    mean_cd(luminance_cd_m2(panel, illuminance_lx, l2a), panel.led_diameter_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_within_bounds_give_no_more_and_no_less() {
        let panel = Panel::default();
        let intensity = |l2a| panel_cd(&panel, 1000.0, l2a);
        let [low, high] = LAMPS[0].1.ratios([0.2, 4.0], &panel, 1000.0).unwrap();
        assert!((intensity(low) - 4.0).abs() < 1e-9 || low == 0.2);
        assert!((intensity(high) - 17.0).abs() < 1e-9);
        assert_eq!(Bounds::default().ratios([0.2, 4.0], &panel, 1.0), Some([0.2, 4.0]));
        assert_eq!(LAMPS[2].1.ratios([0.2, 4.0], &panel, 50.0), None, "too dark for a stop lamp");
    }
}
