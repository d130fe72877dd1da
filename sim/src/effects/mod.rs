//! What a road does to an image, one effect a file.
//!
//! Each effect states its model and source, the scene keys it reads, its cost, and **a bound, in unrounded grey levels,
//! on what leaving it out would change** in a given scene whichever other effects are present. An effect is included
//! when the bound exceeds the scene's tolerance, or when the scene says so. Then it writes its part into the
//! [`Recipe`]; an effect left out is never called again.
//!
//! To add one: write its file, and name it in [`ALL`].

pub mod airlight;
pub mod atmosphere;
pub mod blur;
pub mod board;
pub mod distortion;
pub mod led_spread;
pub mod motion;
pub mod noise;
pub mod panels;
pub mod perspective;
pub mod photograph;
pub mod pwm;
pub mod rolling_shutter;
pub mod scanning;
pub mod symbol_change;
pub mod vignetting;

use crate::renderer::recipe::Recipe;
use crate::scene::Mode;
use crate::view::View;

/// One effect.
pub trait Effect: Sync {
    /// Its name in a scene's `[effects]`.
    fn name(&self) -> &'static str;
    /// The model and where it comes from.
    fn model(&self) -> &'static str;
    /// The scene keys it reads.
    fn keys(&self) -> &'static [&'static str];
    /// What including it costs.
    fn cost(&self) -> &'static str;
    /// The most that leaving it out could change a pixel of this scene, in unrounded grey levels.
    fn bound_grey(&self, view: &View) -> f64;
    /// Writes its part into the recipe.
    fn include(&self, view: &View, recipe: &mut Recipe);
}

/// All effects, in the order in which light meets them.
pub const ALL: [&dyn Effect; 16] = [
    &led_spread::LedSpread,
    &pwm::Pwm,
    &scanning::Scanning,
    &symbol_change::SymbolChange,
    &rolling_shutter::RollingShutter,
    &panels::OtherPanels,
    &board::Board,
    &photograph::Photograph,
    &atmosphere::Attenuation,
    &airlight::Airlight,
    &perspective::Perspective,
    &distortion::Distortion,
    &motion::Motion,
    &blur::LensBlur,
    &vignetting::Vignetting,
    &noise::SensorNoise,
];

/// The effect of that name.
pub fn by_name(name: &str) -> Option<&'static dyn Effect> {
    ALL.into_iter().find(|effect| effect.name() == name)
}

/// The names of all effects.
pub fn names() -> [&'static str; ALL.len()] {
    ALL.map(|effect| effect.name())
}

/// Whether the scene calls for the effect.
pub fn is_included(effect: &dyn Effect, view: &View) -> bool {
    match view.scene.effects.mode(effect.name()) {
        Mode::On => true,
        Mode::Off => false,
        Mode::Auto => effect.bound_grey(view) > view.scene.effects.tolerance_grey,
    }
}
