//! A scene with all that effects need to know of it worked out once.

mod error;
mod panel;
mod photograph;

pub use error::ViewError;
pub use panel::{BOARD_CORNERS, DEPTH_MIN_M, PITCH_MIN_PX, PanelView};
pub use photograph::Photograph;

use glam::DVec2;
use image::GrayImage;

use crate::air::Air;
use crate::camera::exposure::{self, Exposure};
use crate::camera::grey;
use crate::camera::projection::Ellipse;
use crate::effects;
use crate::scene::Scene;

/// A scene worked out: exposure, panels, and the range of linear values that its pixels can take.
#[derive(Clone, Debug)]
pub struct View {
    /// The scene.
    pub scene: Scene,
    /// What the automatic exposure set.
    pub exposure: Exposure,
    /// The panels.
    pub panels: Vec<PanelView>,
    /// The air before each panel, its veil as a linear value.
    pub air: Vec<Air>,
    /// The air before the background, likewise.
    pub background_air: Air,
    /// Linear value of the plain background, without the air before it.
    pub background: f64,
    /// The photograph behind the panels; none: a plain background.
    pub photograph: Option<Photograph>,
    /// No pixel is darker than this linear value, noise apart.
    pub floor: f64,
    /// No pixel is brighter than this linear value, noise apart. It may be above what is encoded as 255.
    pub peak: f64,
    /// The blur that the image has: 0 where the lens blur is left out.
    pub sigma_px: f64,
    /// How many panels may lie one behind the other in a pixel.
    pub layers: usize,
}

impl View {
    /// Works a scene out.
    ///
    /// # Errors
    /// When a key is out of its range, a panel is behind the camera, off the sensor or too small, or a file the scene names cannot be used.
    pub fn new(scene: &Scene) -> Result<Self, ViewError> {
        Self::with_reflectances(scene, None)
    }

    /// The same where the first panel's reflectance will be anything in a range: its linear range then holds for all of them.
    ///
    /// # Errors
    /// As [`View::new`].
    pub fn with_reflectances(scene: &Scene, range: Option<[f64; 2]>) -> Result<Self, ViewError> {
        Self::with_photograph(scene, range, Photograph::of(scene)?)
    }

    /// The same before a picture in memory in place of the background that the scene names.
    ///
    /// # Errors
    /// As [`View::new`], and when the picture has no pixels or is black.
    pub fn before(scene: &Scene, picture: &GrayImage) -> Result<Self, ViewError> {
        let photograph = Photograph::new(picture, "the picture given", scene)?;
        Self::with_photograph(scene, None, Some(photograph))
    }

    /// Works another scene out, taking the photograph over if both have the same.
    ///
    /// # Errors
    /// As [`View::new`].
    pub fn rebuilt_for(&self, scene: &Scene) -> Result<Self, ViewError> {
        let same = self.photograph.iter().find(|kept| kept.is_of(scene));
        let photograph = match same {
            Some(photograph) => Some(photograph.clone()),
            None => Photograph::of(scene)?,
        };
        Self::with_photograph(scene, None, photograph)
    }

    fn with_photograph(
        scene: &Scene,
        range: Option<[f64; 2]>,
        photograph: Option<Photograph>,
    ) -> Result<Self, ViewError> {
        scene.validate().map_err(Box::new)?;
        let exposure = Exposure::of(scene);
        let panels = (0..scene.panels.len())
            .map(|index| PanelView::new(scene, &exposure, index))
            .collect::<Result<Vec<_>, _>>()?;
        let background = exposure.linear(exposure::background_cd_m2(scene));
        let air = |panel: &PanelView| exposure.linear_air(Air::over(scene, panel.pose.distance_m));
        let mut view = Self {
            scene: scene.clone(),
            exposure,
            air: panels.iter().map(air).collect(),
            background_air: exposure.linear_air(Air::before_background(scene)),
            background,
            panels,
            photograph,
            floor: 0.0,
            peak: 0.0,
            sigma_px: scene.camera.blur_sigma_px,
            layers: 1,
        };
        view.layers = layers(&view);
        (view.floor, view.peak) = linear_range(&view, range);
        if !effects::is_included(&effects::blur::LensBlur, &view) {
            view.sigma_px = 0.0;
        }
        Ok(view)
    }

    /// The most, in unrounded grey, that moving LEDs by `shift_px` and their rims by another `rim_px` can change.
    ///
    /// An image between floor and peak that has been blurred changes by at most their difference over σ·√(2π) a pixel of
    /// shift, and through the four sides of a square pixel alone by √2 of it. Moving the rim of a disc of radius a also makes
    /// it larger, by at most (1 + rim/a)². Panels one behind the other each do so, as far as they are not hidden.
    pub fn change_by_geometry(&self, shift_px: f64, rim_px: f64) -> f64 {
        let slope = (1.0 / (self.sigma_px * (2.0 * std::f64::consts::PI).sqrt()))
            .min(std::f64::consts::SQRT_2);
        let larger = (1.0 + rim_px / self.smallest_radius_px()).powi(2) - 1.0;
        self.change_by_layers(slope * (shift_px + rim_px) + larger)
    }

    /// The most, in unrounded grey, that can change where the image of a lone panel changes by at most `part` of the whole range.
    pub fn change_by_layers(&self, part: f64) -> f64 {
        self.change((self.peak - self.floor) * (part * self.layers as f64).min(1.0))
    }

    /// The most, in unrounded grey, that can change where the light of each panel's LEDs strays by a part of itself.
    pub fn change_by_strays(&self, stray: impl Fn(&PanelView) -> f64) -> f64 {
        let strays = self.panels.iter().map(stray);
        self.change((self.peak - self.floor) * strays.fold(0.0, f64::max))
    }

    /// The smallest half-diameter of any LED's image.
    fn smallest_radius_px(&self) -> f64 {
        let radii = self
            .panels
            .iter()
            .flat_map(|panel| &panel.ellipses)
            .map(Ellipse::smaller_half_diameter);
        radii.fold(f64::INFINITY, f64::min)
    }

    /// The most that a change of `linear_change` can move an unrounded grey level of this scene.
    pub fn change(&self, linear_change: f64) -> f64 {
        grey::greatest_change(self.floor, linear_change, self.scene.camera.gamma)
    }

    /// The most, in unrounded grey, that scaling all light by a factor of at least `factor` (at most 1) can change.
    pub fn change_by_factor(&self, factor: f64) -> f64 {
        grey::unrounded(self.peak, self.scene.camera.gamma)
            * (1.0 - factor.max(0.0).powf(1.0 / self.scene.camera.gamma))
    }

    /// The whole range of unrounded grey levels.
    pub fn range_grey(&self) -> f64 {
        self.change(self.peak - self.floor)
    }
}

/// The darkest and the brightest linear value of any pixel, whichever effects are simulated.
fn linear_range(view: &View, reflectances: Option<[f64; 2]>) -> (f64, f64) {
    let (scene, exposure) = (&view.scene, &view.exposure);
    let (mut floor, mut peak) = (f64::INFINITY, 0.0f64);
    let mut seen = |light: f64, air: Air| {
        floor = floor.min(light * air.transmission);
        peak = peak.max(light + air.veil);
    };
    seen(view.background, view.background_air);
    for relative in view.photograph.iter().flat_map(Photograph::range) {
        seen(relative * view.background, view.background_air);
    }
    for (index, (panel, &air)) in view.panels.iter().zip(&view.air).enumerate() {
        let stray = effects::pwm::stray(scene, exposure, panel)
            .max(effects::scanning::stray(exposure, panel));
        let gain = (1.0 + stray) * effects::led_spread::greatest_gain(&panel.panel, index);
        let range = reflectances.filter(|_| index == 0).into_iter().flatten();
        for reflectance in range.chain([panel.panel.reflectance]) {
            let light = exposure.led_light(scene, &panel.panel, reflectance, panel.l2a);
            seen(light.off, air);
            seen(light.off + (light.on - light.off) * gain, air);
        }
        if let Some(reflectance) = panel.panel.board_reflectance {
            seen(effects::board::linear(view, reflectance), air);
        }
    }
    if scene.camera.vignetting {
        floor *= effects::vignetting::corner_gain(scene);
    }
    (floor, peak)
}

/// All panels where any two may meet in the image, else one: their boxes are widened by their own size, and by the blur.
fn layers(view: &View) -> usize {
    let boxes: Vec<_> = view
        .panels
        .iter()
        .map(|panel| wide_box(panel, 6.0 * view.sigma_px))
        .collect();
    let meet =
        |(a, b): (&[DVec2; 2], &[DVec2; 2])| a[0].cmplt(b[1]).all() && b[0].cmplt(a[1]).all();
    let pairs = boxes
        .iter()
        .enumerate()
        .flat_map(|(i, a)| boxes[..i].iter().map(move |b| (a, b)));
    if pairs.into_iter().any(meet) {
        view.panels.len()
    } else {
        1
    }
}

/// The box around a panel's LEDs, wider by its size and a margin on each side.
fn wide_box(panel: &PanelView, margin_px: f64) -> [DVec2; 2] {
    let centres = panel.ellipses.iter().map(|ellipse| ellipse.centre);
    let (low, high) = centres.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    let wider = high - low + margin_px;
    [low - wider, high + wider]
}
