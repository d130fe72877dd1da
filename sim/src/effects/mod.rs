//! The effects of road, camera and panel on an image, one a file.
//!
//! The file of an effect holds all its parts: its name in a scene's `[effects]`, its model and source, its scene keys, **a bound, in
//! unrounded grey levels, on the change from leaving it out** in a given scene with any other effects present, its widening of the range of
//! light, and its part of the image formation. Its cost is measured: see [`crate::cost`].
//!
//! An effect is included if its bound exceeds the scene's tolerance, or if the scene says so: see [`crate::plan`]. Then it writes its part
//! into the image formation; an effect left out is never called again.
//!
//! To add one: write its file, with the effect's name in a scene, and add it to the list `ALL` below. The `[effects]` table of a scene, the
//! plan, its cost, `vocc plan` and the test of its bound follow from there. Further changes are needed only for new parts: a scene key of
//! its own is a line in `scene/tables.rs`, and a new kind of work, beyond stages of LEDs, of rows, of encoded frames or numbers, belongs in
//! the formation and the renderer.

mod airlight;
mod atmosphere;
mod blur;
mod board;
mod broken_leds;
mod carrier;
mod codec;
mod distortion;
mod encoding;
mod fixed_pattern;
mod flare;
mod hot_pixels;
mod led_spread;
mod mosaic;
mod motion;
mod noise;
mod panels;
mod perspective;
mod photograph;
mod point_spread;
mod pwm;
mod rolling_shutter;
mod scanning;
mod shake;
mod sharpening;
mod symbol_change;
mod vignetting;

pub(crate) use motion::{moments, way_px};
pub use pwm::Pulses;

use crate::formation::Formation;
use crate::scene::{EffectSettings, RangeError};
use crate::view::{LinearRange, View};

/// The description of an effect, independent of the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct About {
    /// Its name in a scene's `[effects]`, and its file's.
    pub name: &'static str,
    /// The model and its source.
    pub model: &'static str,
    /// Its scene keys.
    pub keys: &'static [&'static str],
    /// Its cost, in words.
    pub cost: &'static str,
}

/// One effect.
pub(crate) trait Effect: Sync {
    /// Its name, model, scene keys and cost.
    fn about(&self) -> About;
    /// A bound of the change of a pixel of this scene from leaving it out, in unrounded grey levels.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64;
    /// The greatest factor on the own light of panel `panel`'s LEDs.
    fn gain(&self, _view: &View, _panel: usize) -> f64 {
        1.0
    }
    /// Widens the range for light other than background and LEDs. Called in the order of the list.
    fn widen(&self, _view: &View, _range: &mut LinearRange) {}
    /// Writes its part of the image formation.
    fn include(&self, view: &View, formation: &mut Formation);
}

/// The effect on which all bounds of geometry depend: a blurred image changes less by a shift.
pub(crate) const LENS_BLUR: &dyn Effect = &blur::LensBlur;

/// The effect on which all bounds depend: it converts a change of light to grey levels.
pub(crate) const ENCODING: &dyn Effect = &encoding::Encoding;

/// All effects, in the order in which light meets them.
pub(crate) const ALL: [&dyn Effect; 27] = [
    &broken_leds::BrokenLeds,
    &led_spread::LedSpread,
    &pwm::Pwm,
    &scanning::Scanning,
    &symbol_change::SymbolChange,
    &carrier::Carrier,
    &rolling_shutter::RollingShutter,
    &panels::OtherPanels,
    &board::Board,
    &photograph::Photograph,
    &atmosphere::Attenuation,
    &airlight::Airlight,
    &perspective::Perspective,
    &distortion::Distortion,
    &motion::Motion,
    &shake::ExposureVibration,
    LENS_BLUR,
    &point_spread::PointSpread,
    &vignetting::Vignetting,
    &flare::Flare,
    &mosaic::Mosaic,
    &fixed_pattern::FixedPattern,
    &hot_pixels::HotPixels,
    ENCODING,
    &noise::SensorNoise,
    &sharpening::Sharpening,
    &codec::Codec,
];

/// The names of all effects.
pub fn names() -> [&'static str; ALL.len()] {
    ALL.map(|effect| effect.about().name)
}

/// The range of a view's linear values, with any effects.
pub(crate) fn linear_range(view: &View) -> LinearRange {
    let gain = |panel| ALL.iter().map(|effect| effect.gain(view, panel)).product();
    let mut range = LinearRange::of(view, gain);
    for effect in ALL {
        effect.widen(view, &mut range);
    }
    range
}

/// Checks that a scene's `[effects]` names only effects.
///
/// # Errors
/// The first unknown name.
pub(crate) fn check_names(settings: &EffectSettings) -> Result<(), RangeError> {
    let unknown = |name: &&String| !names().contains(&name.as_str());
    match settings.modes.keys().find(unknown) {
        None => Ok(()),
        Some(name) => Err(RangeError {
            key: format!("effects.{name}"),
            value: "set".into(),
            allowed: format!("one of the effects {}", names().join(", ")),
            way_out: "`vocc plan` lists them".into(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mode, Scene};

    #[test]
    fn every_file_of_this_folder_is_on_the_list_under_its_name() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/effects");
        let files = std::fs::read_dir(folder).unwrap();
        let mut files: Vec<String> = files
            .map(|file| file.unwrap().file_name().into_string().unwrap())
            .filter(|file| file != "mod.rs")
            .collect();
        let mut listed = names().map(|name| format!("{name}.rs"));
        files.sort_unstable();
        listed.sort_unstable();
        assert_eq!(files, listed);
    }

    #[test]
    fn a_scene_s_effects_are_those_of_the_list() {
        for name in names() {
            for (word, mode) in [("auto", Mode::Auto), ("on", Mode::On), ("off", Mode::Off)] {
                let scene = Scene::load("paper", &[format!("effects.{name}={word}")]).unwrap();
                assert_eq!(scene.effects.mode(name), mode, "{name}");
            }
        }
        let fault = Scene::load("paper", &["effects.glare=on".into()]).unwrap_err();
        for name in names() {
            assert!(fault.to_string().contains(name), "{name}: {fault}");
        }
    }

    #[test]
    fn every_effect_s_keys_are_keys_of_a_scene() {
        let known = crate::keys::all();
        for About { name, keys, .. } in ALL.map(|effect| effect.about()) {
            for key in keys {
                assert!(*key == "[[panel]]" || known.contains(&(*key).to_owned()), "{name}: {key}");
            }
        }
    }
}
