//! A scene as the page describes it.

use serde::{Deserialize, Serialize};
use sim::road;
use sim::scene::{L2a, Scene, TableWord};
use sim::view::View;

use crate::fault::Fault;

/// A preset or a file's text, with separate overrides: `KEY=VALUE`, as `vocc --set` takes it.
#[derive(Clone, Debug, Deserialize)]
pub struct SceneText {
    name: String,
    #[serde(default)]
    toml: Option<String>,
    #[serde(default)]
    set: Vec<String>,
}

impl SceneText {
    /// The scene.
    pub fn scene(&self) -> Result<Scene, Fault> {
        Ok(match &self.toml {
            Some(text) => Scene::from_toml(&self.name, text, &self.set)?,
            None => Scene::load(&self.name, &self.set)?,
        })
    }
}

/// The quantities of the transmitter and the camera in a scene.
#[derive(Serialize)]
pub struct Settings {
    exposure_s: f64,
    iso: f64,
    l2a: f64,
    luminance_cd_m2: f64,
    duty: Option<f64>,
    /// Why no transmitter can dim to this L2A, if none can.
    no_duty: Option<String>,
    /// The luminous intensity straight ahead, averaged over a message: half of the LEDs are On.
    candela: f64,
    candela_max: f64,
    /// The L2A of the transmitter's table for this light and interval, if it has one.
    table_l2a: Option<f64>,
}

impl Settings {
    /// The quantities of a scene.
    pub fn of(view: &View) -> Result<Self, Fault> {
        let scene = &view.scene;
        let mut by_table = scene.clone();
        by_table.link.l2a = L2a::Table(TableWord::Table);
        let panel = &view.panels[0];
        let dimming = road::dimming(scene);
        let (luminance_cd_m2, duty) = match &dimming {
            Ok(dimming) => (dimming.luminance_cd_m2.to_num(), Some(dimming.duty.to_num())),
            // An L2A that can be drawn, but that no transmitter has.
            Err(_) => (panel.l2a * scene.ambient.illuminance_lx * panel.panel.reflectance, None),
        };
        let mean_cd = link::intensity::mean_cd(luminance_cd_m2, panel.panel.led_diameter_m);
        Ok(Self {
            exposure_s: view.exposure.time_s,
            iso: view.exposure.iso,
            l2a: panel.l2a,
            luminance_cd_m2,
            duty,
            no_duty: dimming.err().map(|why| why.to_string()),
            candela: mean_cd,
            candela_max: 2.0 * mean_cd,
            table_l2a: road::dimming(&by_table).ok().map(|dimming| dimming.l2a.to_num()),
        })
    }
}

#[cfg(test)]
mod tests {
    use sim::keys;

    #[test]
    fn sliders_have_the_units_and_the_ranges_of_scenes() {
        let mut sliders = include_str!("../web/controls.js").split("{ key: \"").skip(1).peekable();
        assert!(sliders.peek().is_some());
        for slider in sliders {
            let between = |from, to| slider.split_once(from).unwrap().1.split_once(to).unwrap().0;
            let (key, _) = slider.split_once('"').unwrap();
            let (table, name) = key.split_once('.').unwrap();
            let listed = keys::find(table, name).expect(key);
            assert_eq!(between("unit: \"", "\""), listed.unit, "{key}");
            let allowed = between("allowed: [", "]").replace('_', "");
            let (low, high) = allowed.split_once(", ").unwrap();
            assert_eq!(listed.range(), Some(low.parse().unwrap()..=high.parse().unwrap()), "{key}");
        }
    }
}
