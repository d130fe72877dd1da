//! The names of a scene's keys, and the nearest key to an unknown name.

use toml::{Table, Value};

use crate::effects;
use crate::scene::{Key, SceneError, TABLES};

/// The table that selects the effects.
const EFFECTS: &str = "effects";
/// The table of a panel's own pose.
const POSE: &str = "pose";

/// All keys, as `TABLE.KEY`; a panel's own pose has those of `pose`.
pub fn all() -> Vec<String> {
    let listed = TABLES
        .iter()
        .flat_map(|table| table.keys.iter().map(|key| (key, format!("{}.{}", table.name(), key.name))));
    // First those that presets show.
    let (shown, others): (Vec<_>, Vec<_>) = listed.partition(|(key, _)| key.line().is_some());
    let listed = shown.into_iter().chain(others).map(|(_, name)| name);
    let effects = effects::names().into_iter().map(|effect| format!("{EFFECTS}.{effect}"));
    listed.chain([format!("panel.{POSE}")]).chain(effects).collect()
}

/// The key of a table; `None` for an effect's, and for a panel's pose.
///
/// ```
/// let light = sim::keys::find("ambient", "illuminance_lx").unwrap();
/// assert_eq!((light.unit, light.range()), ("lx", Some(sim::scene::ILLUMINANCE_LX)));
/// ```
pub fn find(table: &str, name: &str) -> Option<&'static Key> {
    let table = TABLES.iter().find(|of| of.name() == table)?;
    table.keys.iter().find(|key| key.name == name)
}

/// The whole name, `TABLE.KEY`, of a key given by that name or by its last part alone.
///
/// ```
/// use sim::keys;
/// assert_eq!(keys::whole_name("distance_m")?, "pose.distance_m");
/// assert_eq!(keys::whole_name("panel.pose.yaw_deg")?, "panel.pose.yaw_deg");
/// let fault = keys::whole_name("distance_cm").unwrap_err().to_string();
/// assert!(fault.contains("the nearest is pose.distance_m"), "{fault}");
/// # Ok::<(), sim::scene::SceneError>(())
/// ```
///
/// # Errors
/// [`SceneError::Key`] for an unknown name, with the nearest key, and for an ambiguous one.
pub fn whole_name(name: &str) -> Result<String, SceneError> {
    let keys = all();
    let fault = |why: String| SceneError::Key { key: name.into(), why };
    // The pose of one panel has the keys of the scene's pose.
    let (of_panel, looked_up) = match name.strip_prefix("panel.pose.") {
        Some(key) => ("panel.", format!("{POSE}.{key}")),
        None => ("", name.to_owned()),
    };
    if keys.contains(&looked_up) {
        return Ok(format!("{of_panel}{looked_up}"));
    }
    let mut alike: Vec<&String> = keys.iter().filter(|key| last(key) == looked_up).collect();
    // An effect with the name of its own key is given in full.
    if alike.len() > 1 {
        alike.retain(|key| !key.starts_with(EFFECTS));
    }
    match alike[..] {
        [only] => Ok(only.clone()),
        [] => Err(fault(format!(
            "there is no such key; the nearest is {of_panel}{}",
            nearest(&looked_up, &keys)
        ))),
        _ => {
            let names: Vec<&str> = alike.iter().map(|key| key.as_str()).collect();
            Err(fault(format!("write {}", names.join(" or "))))
        }
    }
}

/// Checks that a scene's tables have no unknown keys.
///
/// # Errors
/// [`SceneError::Key`] for the first unknown one.
pub fn check(scene: &Table) -> Result<(), SceneError> {
    scene.iter().try_for_each(|(table, value)| match value {
        Value::Array(panels) => panels
            .iter()
            .filter_map(Value::as_table)
            .try_for_each(|panel| check_table(table, panel)),
        Value::Table(keys) => check_table(table, keys),
        _ => Err(SceneError::Key {
            key: table.clone(),
            why: format!("keys of a scene are in tables; the nearest is {}", nearest(table, &all())),
        }),
    })
}

fn check_table(name: &str, table: &Table) -> Result<(), SceneError> {
    table.iter().try_for_each(|(key, value)| match value {
        Value::Table(own) if name == "panel" && key == POSE => check_table("panel.pose", own),
        _ => whole_name(&format!("{name}.{key}")).map(drop),
    })
}

/// A key without its table.
fn last(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

/// The key most similar to a name, with its table if the name has one. Units count least, because they are often forgotten.
fn nearest(name: &str, keys: &[String]) -> String {
    let likeness = |key: &&String| {
        let key = if name.contains('.') { key } else { last(key) };
        let begun = f64::from(u8::from(key.starts_with(name)));
        begun + strsim::normalized_damerau_levenshtein(name, key)
    };
    let best = keys.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    best.cloned().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{PRESETS, preset_toml};

    #[test]
    fn every_preset_has_known_keys_alone() {
        for preset in PRESETS {
            let text = preset_toml(preset.name).unwrap();
            check(&toml::from_str(&text).unwrap()).unwrap();
        }
        let own = "[[panel]]\npose = { yaw_deg = 3 }\n[link]\ntable = \"t.toml\"\n[effects]\nnoise = \"on\"";
        check(&toml::from_str(own).unwrap()).unwrap();
    }

    #[test]
    fn all_keys_that_a_scene_writes_are_known() {
        let scene = crate::scene::Scene::load("night", &["panel.pose={}".into()]).unwrap();
        check(&Table::try_from(&scene).unwrap()).unwrap();
    }

    #[test]
    fn a_key_that_is_none_is_refused_with_the_nearest() {
        let of_text = |text: &str| check(&toml::from_str(text).unwrap()).unwrap_err();
        for (text, nearest) in [
            ("[pose]\ndistance = 3", "pose.distance_m"),
            ("[poses]\ndistance_m = 3", "pose.distance_m"),
            ("[[panel]]\nintervall = 1", "panel.interval"),
            ("[[panel]]\npose = { yaw = 1 }", "panel.pose.yaw_deg"),
            ("[effects]\nblurr = \"on\"", "effects.blur"),
            ("distance = 3", "pose.distance_m"),
        ] {
            let fault = of_text(text).to_string();
            assert!(fault.contains(&format!("nearest is {nearest}")), "{fault}");
        }
    }

    #[test]
    fn a_name_that_several_keys_have_is_to_be_written_in_full() {
        let fault = whole_name("seed").unwrap_err().to_string();
        assert!(fault.contains("camera.seed or panel.seed"), "{fault}");
        assert_eq!(whole_name("vignetting").unwrap(), "camera.vignetting");
        assert_eq!(whole_name("noise").unwrap(), "effects.noise");
    }
}
