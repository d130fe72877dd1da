//! Loads a checked scene from TOML, a preset's name and overrides.

use std::ffi::OsStr;
use std::path::Path;

use toml::Table;

use crate::effects;
use crate::input;
use crate::scene::{Panel, Scene, SceneError, overrule, preset_toml};

impl Scene {
    /// The scene `name` (a preset or, if there is none, a TOML file) with `overrides` of the form `TABLE.KEY=VALUE` applied in order.
    ///
    /// `panel.KEY` means the first panel.
    ///
    /// # Errors
    /// [`SceneError`] gives the fault, its place, the allowed range and the remedy.
    pub fn load(name: impl AsRef<OsStr>, overrides: &[String]) -> Result<Self, SceneError> {
        let name = name.as_ref();
        Self::from_toml(&name.to_string_lossy(), &Self::toml(name)?, overrides)
    }

    /// The TOML text of the scene `name`: a preset or, if there is none, a file.
    ///
    /// # Errors
    /// If it is neither, or cannot be read.
    pub fn toml(name: impl AsRef<OsStr>) -> Result<String, SceneError> {
        let name = name.as_ref();
        let text = || name.to_string_lossy().into_owned();
        match name.to_str().and_then(preset_toml) {
            Some(preset) => Ok(preset),
            None if input::is_there(Path::new(name)) => {
                input::read_text(Path::new(name), input::SCENE_MAX).map_err(|source| SceneError::Read { path: text(), source })
            }
            None => Err(SceneError::NotFound { name: text() }),
        }
    }

    /// The scene of the TOML `text`, called `name` in errors, with overrides as in [`Scene::load`].
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_toml(name: &str, text: &str, overrides: &[String]) -> Result<Self, SceneError> {
        let parse_error = |source| SceneError::Parse {
            name: name.into(),
            source: Box::new(source),
        };
        // Checked first as written, so that a fault is reported with its line; then with the overrides.
        let written: Scene = toml::from_str(text).map_err(parse_error)?;
        let scene = if overrides.is_empty() {
            written
        } else {
            let table = toml::from_str(text).map_err(parse_error)?;
            Self::overruled(&table, "--set", overrides)?
        };
        scene.checked()
    }

    /// This scene with overrides as in [`Scene::load`]; errors name `source` as their origin.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn with(&self, source: &str, overrides: &[String]) -> Result<Self, SceneError> {
        let fault = |why: String| SceneError::Override {
            text: overrides.join(", "),
            why,
        };
        let table = Table::try_from(self).map_err(|error| fault(error.to_string()))?;
        Self::overruled(&table, source, overrides)?.checked()
    }

    /// The scene of a table with overrides; errors name the first override that fails.
    fn overruled(table: &Table, source: &str, overrides: &[String]) -> Result<Self, SceneError> {
        let with = |count: usize| {
            let mut table = table.clone();
            for text in &overrides[..count] {
                overrule(&mut table, text)?;
            }
            table.try_into().map_err(|fault| SceneError::Parse {
                name: overrides[..count]
                    .last()
                    .map_or_else(|| source.to_owned(), |at_fault| format!("{source} {at_fault}")),
                source: Box::new(fault),
            })
        };
        let first_fault = || (1..overrides.len()).find_map(|count| with(count).err());
        with(overrides.len()).map_err(|fault| first_fault().unwrap_or(fault))
    }

    /// The scene with at least one panel, if it is valid.
    fn checked(mut self) -> Result<Self, SceneError> {
        if self.panels.is_empty() {
            self.panels.push(Panel::default());
        }
        self.validate()?;
        effects::check_names(&self.effects)?;
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_without_a_panel_is_an_error_and_no_panic() {
        use crate::accuracy::Level;
        use crate::renderer::Renderer;
        let error = Renderer::new(&Scene::default(), Level::Fast).err().unwrap().to_string();
        assert!(error.contains("0 panels") && error.contains("give the one that sends"), "{error}");
        let scene = Scene {
            panels: vec![Panel::default()],
            ..Scene::default()
        };
        assert!(Renderer::new(&scene, Level::Fast).is_ok());
    }

    fn message(overrides: &[&str]) -> String {
        let overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
        Scene::load("paper", &overrides).unwrap_err().to_string()
    }

    #[test]
    fn overrides_reach_their_keys() {
        let overrides = [
            "panel.interval=0.5",
            "link.contrast=eq10",
            "pose.velocity_m_s=[1, 0, -3]",
            "effects.blur=off",
        ];
        let scene = Scene::load("paper", &overrides.map(String::from)).unwrap();
        assert_eq!(scene.panels[0].interval, 0.5);
        assert_eq!(scene.link.contrast, crate::scene::Contrast::Eq10);
        assert_eq!(scene.pose.velocity_m_s, [1.0, 0.0, -3.0]);
        assert_eq!(scene.effects.mode("blur"), crate::scene::Mode::Off);
    }

    #[test]
    fn overrides_of_a_scene_are_those_of_its_text() {
        for preset in ["paper", "night", "fog"] {
            let scene = Scene::load(preset, &[]).unwrap();
            assert_eq!(scene.with("a grid", &[]).unwrap(), scene);
            let overrides = ["pose.distance_m=70", "link.l2a=table", "effects.noise=on", "panel.interval=0.5"];
            let overrides = overrides.map(String::from);
            assert_eq!(scene.with("a grid", &overrides).unwrap(), Scene::load(preset, &overrides).unwrap());
        }
        let scene = Scene::default();
        let fault = scene.with("a grid", &["pose.distance_cm=1".into()]);
        let fault = fault.unwrap_err().to_string();
        assert!(fault.contains("a grid") && fault.contains("distance_m"), "{fault}");
    }

    #[test]
    fn faults_name_the_key_the_value_and_the_range() {
        let too_near = message(&["pose.distance_m=0"]);
        assert!(
            too_near.contains("pose.distance_m") && too_near.contains("0.5 to 2000"),
            "{too_near}"
        );
        assert!(message(&["pose.distance_m=nan"]).contains("pose.distance_m"));
        assert!(
            message(&["pose.distance_cm=3000"]).contains("distance_m"),
            "unknown keys list the known ones"
        );
        assert!(message(&["pose.distance_m=fifty"]).contains("fifty"));
        assert!(message(&["distance_m=3"]).contains("names no table"));
        assert!(message(&["pose.distance_m"]).contains("no '='"));
        assert!(message(&["effects.blurr=on"]).contains("blurr"));
        let two_lines = message(&["pose.distance_m=5\nlink.l2a=3"]);
        assert!(two_lines.contains("one line"), "{two_lines}");
        assert!(message(&["pose.distance_m.x=1"]).contains("value stands"));
    }

    #[test]
    fn a_missing_scene_lists_the_presets() {
        let text = Scene::load("no-such-scene", &[]).unwrap_err().to_string();
        assert!(text.contains("paper-18mm"), "{text}");
    }
}
