//! Predefined scenes.

use super::key::with_remark;
use super::tables::TABLES;

/// A named scene.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Its name on a command line.
    pub name: &'static str,
    /// A summary of one line.
    pub summary: &'static str,
    /// Its differences from the defaults.
    settings: &'static [&'static str],
}

/// Presets, each with the names of the TOML files that hold its settings.
macro_rules! presets {
    ($($name:literal: $summary:literal, $($file:literal)+;)*) => {
        [$(Preset { name: $name, summary: $summary, settings: &[$(include_str!(concat!("presets/", $file, ".toml"))),+] }),*]
    };
}

/// All presets; the first spells out the defaults.
pub const PRESETS: [Preset; 13] = presets! {
    "paper": "Table 1 of Do & Yoo 2020 at interval 1 and 50 m, without noise", "paper";
    "paper-18mm": "the paper with the 18 mm lens of its text", "paper" "paper-18mm";
    "paper-iso3200": "the paper with the ISO limit of its Table 1", "paper" "paper-iso3200";
    "day": "an overcast day: noise, free-running clocks, PWM dimming", "day" "road" "usual-rate";
    "dusk": "dusk at 500 lx: more noise, free-running clocks, PWM dimming", "dusk" "road" "usual-rate";
    "night": "a lit street at 50 lx: ISO 32 000, free-running clocks, PWM dimming", "night" "road" "usual-rate";
    "day-driving": "day from a passenger car that drives: its camera vibrates", "car" "day" "road" "usual-rate";
    "dusk-driving": "dusk from a passenger car that drives: its camera vibrates", "car" "dusk" "road" "usual-rate";
    "night-driving": "night from a passenger car that drives: its camera vibrates", "car" "night" "road" "usual-rate";
    "fog": "day in fog of 160 m visibility", "fog" "road" "usual-rate";
    "phone": "day through a phone's camera: 30 frames a second, read out line by line, small pixels", "phone" "road";
    "dashcam": "day through a dash camera with a long lens: 60 frames a second, read out line by line", "dashcam" "road";
    "hm01b0":
        "a lit hall through a microcontroller's camera of 324 x 244 pixels: 30 frames a second, read out line by line", "hm01b0" "road";
};

/// The preset `name` as a commented TOML file; `None` if there is no such preset.
///
/// ```
/// assert!(sim::scene::preset_toml("night").unwrap().contains("illuminance_lx = 50"));
/// assert!(sim::scene::preset_toml("noon").is_none());
/// ```
pub fn preset_toml(name: &str) -> Option<String> {
    let at = PRESETS.iter().position(|preset| preset.name == name)?;
    let preset = &PRESETS[at];
    Some(format!(
        "# {}: {}.\n# In comments: keys left out, with their defaults or, where they have none, examples.\n{}",
        preset.name,
        preset.summary,
        filled(&preset.settings.concat(), at == 0)
    ))
}

/// Settings among all keys, in their order; the others are comments, or are set to their defaults if `spells_defaults`.
fn filled(settings: &str, spells_defaults: bool) -> String {
    let mut own: Vec<(&str, &str)> = in_tables(settings).filter(|(_, line)| key(line).is_some()).collect();
    let mut text = String::new();
    for table in TABLES {
        text += &format!("\n{}\n", with_remark(table.header, table.remark));
        for listed in table.keys {
            let is_set = |(of, line): &mut (&str, &str)| *of == table.header && key(line) == Some(listed.name);
            match (own.extract_if(.., is_set).last(), listed.line()) {
                (Some((_, set)), _) => text += set,
                (None, Some(line)) if spells_defaults || listed.is_unset() => text += &line,
                (None, Some(line)) => text += &format!("# {line}"),
                (None, None) => continue,
            }
            text += "\n";
        }
        // The table's own keys beyond the common ones.
        for (_, line) in own.extract_if(.., |(of, _)| *of == table.header) {
            text += &format!("{line}\n");
        }
    }
    text
}

/// The lines of a TOML text, each with the header of its table.
fn in_tables(text: &str) -> impl Iterator<Item = (&str, &str)> {
    text.lines().scan("", |table, line| {
        if line.starts_with('[') {
            *table = line.split(" #").next().unwrap_or_default().trim_end();
        }
        Some((*table, line))
    })
}

/// The key that a line sets.
fn key(line: &str) -> Option<&str> {
    Some(line.split_once('=')?.0.trim())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn every_preset_is_a_valid_scene() {
        for preset in PRESETS {
            Scene::load(preset.name, &[]).unwrap_or_else(|error| panic!("{}: {error}", preset.name));
        }
    }

    #[test]
    fn presets_show_all_keys_and_set_their_own_alone() {
        for preset in PRESETS {
            let text = preset_toml(preset.name).unwrap();
            for table in TABLES {
                for listed in table.keys.iter().filter(|listed| listed.line().is_some()) {
                    let shown = in_tables(&text).filter(|(of, _)| *of == table.header);
                    let shown = shown.filter(|(_, line)| key(line.trim_start_matches("# ")) == Some(listed.name));
                    assert_eq!(shown.count(), 1, "{}: {}", preset.name, listed.name);
                }
            }
            // Only defaults are added; the settings are the preset's.
            let bare = Scene::from_toml("bare", &settings_in_order(preset.settings), &[]);
            assert_eq!(Scene::load(preset.name, &[]).unwrap(), bare.unwrap());
        }
    }

    /// Settings with each table once.
    fn settings_in_order(settings: &[&str]) -> String {
        let text = settings.concat();
        let mut tables: Vec<(&str, String)> = Vec::new();
        for (table, line) in in_tables(&text).filter(|(_, line)| !line.starts_with('[')) {
            match tables.iter_mut().find(|(of, _)| *of == table) {
                Some((_, lines)) => *lines += &format!("{line}\n"),
                None => tables.push((table, format!("{line}\n"))),
            }
        }
        let written = tables.iter().map(|(table, lines)| format!("{table}\n{lines}"));
        written.collect()
    }

    #[test]
    fn the_paper_preset_spells_out_the_defaults() {
        let mut paper = Scene::load("paper", &[]).unwrap();
        paper.effects = Default::default();
        let defaults = Scene {
            panels: vec![Default::default()],
            ..Default::default()
        };
        assert_eq!(paper, defaults);
    }
}
