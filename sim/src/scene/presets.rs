//! Scenes to start from.

use super::key::with_remark;
use super::tables::TABLES;

/// A named scene.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// The name that stands for it on a command line.
    pub name: &'static str,
    /// What it is, in a line.
    pub summary: &'static str,
    /// What it sets apart from the defaults.
    settings: &'static [&'static str],
}

/// All presets; the first spells out the defaults.
pub const PRESETS: [Preset; 13] = [
    Preset {
        name: "paper",
        summary: "Table 1 of Do & Yoo 2020 at interval 1 and 50 m, without noise",
        settings: &[PAPER],
    },
    Preset {
        name: "paper-18mm",
        summary: "the paper with the 18 mm lens of its text",
        settings: &[PAPER_18MM],
    },
    Preset {
        name: "paper-iso3200",
        summary: "the paper with the ISO limit of its Table 1",
        settings: &[PAPER_ISO3200],
    },
    Preset {
        name: "day",
        summary: "an overcast day: noise, free-running clocks, PWM dimming",
        settings: &[DAY, ROAD, USUAL_RATE],
    },
    Preset {
        name: "dusk",
        summary: "dusk at 500 lx: more noise, free-running clocks, PWM dimming",
        settings: &[DUSK, ROAD, USUAL_RATE],
    },
    Preset {
        name: "night",
        summary: "a lit street at 50 lx: ISO 32 000, free-running clocks, PWM dimming",
        settings: &[NIGHT, ROAD, USUAL_RATE],
    },
    Preset {
        name: "day-driving",
        summary: "day from a passenger car that drives: its camera vibrates",
        settings: &[CAR, DAY, ROAD, USUAL_RATE],
    },
    Preset {
        name: "dusk-driving",
        summary: "dusk from a passenger car that drives: its camera vibrates",
        settings: &[CAR, DUSK, ROAD, USUAL_RATE],
    },
    Preset {
        name: "night-driving",
        summary: "night from a passenger car that drives: its camera vibrates",
        settings: &[CAR, NIGHT, ROAD, USUAL_RATE],
    },
    Preset {
        name: "fog",
        summary: "day in fog of 160 m visibility",
        settings: &[FOG, ROAD, USUAL_RATE],
    },
    Preset {
        name: "phone",
        summary: "day through a phone's camera: 30 frames a second, read out line by line, small pixels",
        settings: &[PHONE, ROAD, PHONE_RATE],
    },
    Preset {
        name: "dashcam",
        summary: "day through a dash camera with a long lens: 60 frames a second, read out line by line",
        settings: &[DASHCAM, ROAD, DASHCAM_RATE],
    },
    Preset {
        name: "hm01b0",
        summary: "a lit hall through a microcontroller's camera of 324 x 244 pixels: 30 frames a second, read out line by line",
        settings: &[HM01B0, ROAD, HM01B0_RATE],
    },
];

/// The preset `name` as a commented TOML file, or none of that name.
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

/// Settings among all keys there are, in their order; those that are not set are comments, unless defaults are to be spelt out.
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
        // What a table has beyond the keys that all share.
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

const PAPER: &str = r#"[effects]
noise = "off"
"#;

const PAPER_18MM: &str = r#"
[camera]
focal_length_mm = 18
[effects]
noise = "off"
"#;

const PAPER_ISO3200: &str = r#"
[camera]
iso_max = 3200
[effects]
noise = "off"
"#;

const DAY: &str = r#"
[ambient]
illuminance_lx = 10000
"#;

const DUSK: &str = r#"
[ambient]
illuminance_lx = 500
"#;

const NIGHT: &str = r#"
[ambient]
illuminance_lx = 50
"#;

/// A camera behind the windscreen of a passenger car: where its numbers are from is in `docs/physics.md`.
const CAR: &str = r#"
[camera]
shake_deg = 0.1              # a passenger car on a road of ISO 8608's class B
shake_roll_deg = 0.1         # assumed as large
shake_lowest_hz = 1          # the body on its springs
shake_highest_hz = 15        # wheels and the camera's mount
"#;

const FOG: &str = r#"
[ambient]
illuminance_lx = 5000
[atmosphere]
transmission_at_70m = 0.27   # extinction 0.0187 per metre: 5 % contrast is left at 160 m
airlight = true
"#;

/// Sony's IMX219 in its mode of 1920 x 1080: pixels of 1.12 um, lines of 3448 cycles of 182.4 MHz (datasheet IMX219PQH5-C; imx219.c of
/// Linux), behind the lens of Raspberry Pi's camera module 2. How many electrons such a pixel holds Sony does not say.
const PHONE: &str = r#"
[camera]
focal_length_mm = 3.04       # f/2.0: Raspberry Pi's camera module 2
pixel_pitch_um = 1.12        # Sony IMX219, 1920 x 1080 cut from its middle
frame_rate_hz = 30
exposure_max_s = 0.0333      # all of the frame: what a phone does by night
f_number = 2
iso_max = 1600
encoding = "rec709"
blur_sigma_px = 1
full_well_e = 5000           # assumed: of the order of what 1.12 um hold
readout_s = 0.0204           # 1079 lines of 18.9 us
prnu_percent = 1
sharpening = 0.5             # as phones do to films
[ambient]
illuminance_lx = 10000
"#;

const PHONE_RATE: &str = r#"[link]
symbol_rate_hz = 27          # 0.9 of the frames
"#;

/// Sony's IMX290, a sensor of dash and street cameras: pixels of 2.9 um, 1125 lines in each of 60 frames (imx290.c of Linux).
const DASHCAM: &str = r#"
[camera]
focal_length_mm = 8          # 38 degrees across; usual wide ones, of 3 to 4 mm, see half as far
pixel_pitch_um = 2.9         # Sony IMX290
frame_rate_hz = 60
exposure_max_s = 0.0166
f_number = 2
iso_max = 6400
encoding = "rec709"
blur_sigma_px = 1
full_well_e = 12000          # assumed: of the order of what 2.9 um hold
readout_s = 0.016            # 1079 lines of 14.8 us
prnu_percent = 1
sharpening = 0.3
[ambient]
illuminance_lx = 10000
"#;

const DASHCAM_RATE: &str = r#"[link]
symbol_rate_hz = 54          # 0.9 of the frames
"#;

/// Himax's HM01B0 with its lens of 87 degrees from corner to corner (HM01B0-MNA-00FT870), read as the receiver's boards set it: 266 lines of
/// 376 cycles of 3 MHz. What its pixels hold and read, and the lens's f-number, are assumed.
const HM01B0: &str = r#"
[camera]
focal_length_mm = 0.87       # 87 degrees across the diagonal of 324 x 324 pixels
pixel_pitch_um = 3.6         # Himax HM01B0
width_px = 324
height_px = 244
frame_rate_hz = 29.995
exposure_max_s = 0.0083      # 66 lines, a quarter of a frame: what the receiver's boards expose for at most
f_number = 2.8               # assumed
iso_min = 200                # assumed: full with 6000 electrons after 0.09 lx s; gain 1
iso_max = 1600               # gain 8
encoding = "linear"          # no curve
black_grey = 8               # what public drivers set
blur_sigma_px = 0.7          # assumed
full_well_e = 12000          # assumed: 6000 at ISO 200, of the order of what 3.6 um hold
read_noise_e = 4             # assumed
readout_s = 0.0305           # 243 lines of 125.3 us
prnu_percent = 1             # assumed
[pose]
distance_m = 4
[ambient]
illuminance_lx = 500
"#;

const HM01B0_RATE: &str = r#"[link]
symbol_rate_hz = 20.4
"#;

/// What a road has and the paper has not: a table, PWM dimming, clocks that nobody synchronises.
const ROAD: &str = r#"[[panel]]
pwm_hz = 61803               # no multiple of the frame rate, so that its phase wanders
[link]
l2a = "table"
phase = 0.3
clock_ppm = 100
"#;

const USUAL_RATE: &str = r#"[link]
symbol_rate_hz = 90
"#;

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
            // Only defaults are added: what is set is what the preset sets.
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
