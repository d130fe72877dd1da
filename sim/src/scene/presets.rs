//! Scenes to start from.

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

/// All presets, the default first.
pub const PRESETS: [Preset; 10] = [
    Preset {
        name: "paper",
        summary: "Table 1 of Do & Yoo 2020 at interval 1 and 50 m, without noise",
        settings: &[DEFAULTS, PAPER],
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
    let preset = PRESETS.iter().find(|preset| preset.name == name)?;
    Some(format!(
        "# {}: {}.\n# In comments: keys left out, with their defaults or, where they have none, examples.\n{}",
        preset.name,
        preset.summary,
        filled(&preset.settings.concat())
    ))
}

/// The keys that presets write, or show in comments, each with its table.
pub(crate) fn written_keys() -> impl Iterator<Item = (&'static str, &'static str)> {
    in_tables(DEFAULTS).filter_map(|(table, line)| Some((table.trim_matches(['[', ']']), key(line)?)))
}

/// Settings among all keys there are, in their order; those that are not set are comments.
fn filled(settings: &str) -> String {
    let mut own: Vec<(&str, &str)> = in_tables(settings)
        .filter(|(_, line)| key(line).is_some() && !line.starts_with('#'))
        .collect();
    let mut lines = Vec::new();
    let mut last = "";
    for (table, line) in in_tables(DEFAULTS).chain([("", "")]) {
        if table != last {
            // What a table has beyond the keys that all share.
            lines.extend(own.extract_if(.., |(of, _)| *of == last).map(|(_, line)| line.to_owned()));
            last = table;
        }
        let is_set = |(of, set): &mut (&str, &str)| *of == table && key(set) == key(line);
        match (own.extract_if(.., is_set).last(), key(line)) {
            (Some((_, set)), Some(_)) => lines.push(set.to_owned()),
            (None, Some(_)) if !line.starts_with('#') => lines.push(format!("# {line}")),
            _ => lines.push(line.to_owned()),
        }
    }
    lines.join("\n")
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

/// The key that a line sets, or would if it were no comment.
fn key(line: &str) -> Option<&str> {
    let key = line.trim_start_matches("# ").split_once('=')?.0.trim();
    (!key.is_empty() && !key.contains(' ')).then_some(key)
}

/// All keys with their defaults.
const DEFAULTS: &str = r#"
[camera]
focal_length_mm = 25         # 18 in the paper's text
pixel_pitch_um = 6.875       # 13.2 mm / 1920
width_px = 1920
height_px = 1080
frame_rate_hz = 100
exposure_max_s = 0.001
f_number = 2.7
iso_min = 100
iso_max = 32000              # 3200 in the paper's Table 1
meter_constant = 12.5
encoding = "gamma"           # linear, srgb, rec709, shoulder
gamma = 2.2
black_grey = 0
blur_sigma_px = 1.5
psf = "gauss"                # disc: of a radius of 2 blur_sigma_px
blur_aspect = 1              # along x over along y
exposure_bias_ev = 0
vignetting = false
full_well_e = 20000          # electrons at grey 255, ISO 100
read_noise_e = 3
readout_s = 0                # 0: global shutter
distortion_k1 = 0
mosaic = false               # true: raw frames of red, green, green and blue pixels
prnu_percent = 0
dsnu_e = 0
hot_pixels_ppm = 0
hot_pixel_grey = 255
seed = 0                     # of the fixed pattern and the hot pixels
sharpening = 0               # amount of an unsharp mask
sharpening_radius_px = 1
# jpeg_quality = 75          # left out: no loss

[[panel]]                    # one or more
led_diameter_m = 0.03
interval = 1                 # gap / diameter
reflectance = 0.4
# luminance_min_cd_m2 = 50   # left out: unlimited
# luminance_max_cd_m2 = 8000
led_spread = 0
colour = [1, 1, 1]           # what such pixels see of the LEDs' own light; red: [1, 0.15, 0.05]
dead_leds = 0                # how many, or which: [3, 17] with 8*row + column
stuck_leds = 0
# dim_row = 2                # left out: none
dim_row_light = 0.5
seed = 0                     # of the spread and of which LEDs are broken
pwm_hz = 0                   # 0: ideal dimming
scan_rows = 0                # 0: static drive
# board_reflectance = 0.05   # left out: no board

[pose]
distance_m = 50
x_m = 0                      # right
y_m = 0                      # down
roll_deg = 0
yaw_deg = 0
pitch_deg = 0
velocity_m_s = [0, 0, 0]

[ambient]
illuminance_lx = 10000
background_reflectance = 0.18
# background_image = "road.png"

[atmosphere]
transmission_at_70m = 0.9932
airlight = false
# airlight_cd_m2 = 3000      # left out: from the illuminance

[link]
l2a = 2                      # or "table", with table = "FILE"
contrast = "exposure"        # 1 + pi*r; "eq10": 1 + r
symbol_rate_hz = 100
phase = 0.5
clock_ppm = 0
tells_size = false           # true: the panel says how large it is

[effects]
tolerance_grey = 0.5         # for each effect: NAME = "auto", "on" or "off"
"#;

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
            for (table, line) in in_tables(DEFAULTS) {
                let shown = in_tables(&text).filter(|(of, _)| *of == table);
                let shown = shown.filter(|(_, other)| key(other) == key(line)).count();
                assert!(key(line).is_none() || shown == 1, "{}: {line}", preset.name);
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
