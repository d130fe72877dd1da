//! A scene with the quantities that effects need, computed once.

mod error;
mod meeting;
mod panel;
mod photograph;
mod range;

pub(crate) use error::DEPTH_MIN_M;
pub use error::ViewError;
pub(crate) use meeting::for_each_meeting;
pub(crate) use panel::BOARD_CORNERS;
pub use panel::PanelView;
pub use photograph::Photograph;
pub use range::LinearRange;

use glam::DVec2;
use image::GrayImage;
use link::waveform::Waveform;

use crate::air::Air;
use crate::camera::exposure::{self, Exposure};
use crate::scene::Scene;

/// A prepared scene: its exposure, panels, air and background.
#[derive(Clone, Debug)]
pub struct View {
    /// The scene.
    pub scene: Scene,
    /// The result of the automatic exposure.
    pub exposure: Exposure,
    /// The waveform of symbols.
    pub waveform: Waveform,
    /// The panels.
    pub panels: Vec<PanelView>,
    /// The air before each panel, its veil as a linear value.
    pub air: Vec<Air>,
    /// The air before the background, its veil as a linear value.
    pub background_air: Air,
    /// Linear value of the plain background, without the air before it.
    pub background: f64,
    /// The photograph behind the panels; `None`: a plain background.
    pub photograph: Option<Photograph>,
    /// Further reflectances of the first panel: the ends of a range.
    pub reflectances: Option<[f64; 2]>,
    /// The greatest number of panels behind each other in a pixel.
    pub layers: usize,
}

impl View {
    /// Prepares a scene.
    ///
    /// # Errors
    /// If a key is out of its range, a panel is behind the camera, off the sensor or too small, or a file of the scene cannot be used.
    pub fn new(scene: &Scene) -> Result<Self, ViewError> {
        Self::with_reflectances(scene, None)
    }

    /// As [`View::new`], with a range of the first panel's reflectance: the linear range then holds for all of them.
    ///
    /// # Errors
    /// As [`View::new`].
    pub fn with_reflectances(scene: &Scene, reflectances: Option<[f64; 2]>) -> Result<Self, ViewError> {
        Self::with_photograph(scene, reflectances, Photograph::of(scene)?)
    }

    /// As [`View::new`], with a picture in memory in place of the scene's background.
    ///
    /// # Errors
    /// As [`View::new`], and if the picture has no pixels or is black.
    pub fn before(scene: &Scene, picture: &GrayImage) -> Result<Self, ViewError> {
        let photograph = Photograph::new(picture, "the picture given", scene)?;
        Self::with_photograph(scene, None, Some(photograph))
    }

    /// Prepares another scene, reusing the photograph if both have the same.
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

    fn with_photograph(scene: &Scene, reflectances: Option<[f64; 2]>, photograph: Option<Photograph>) -> Result<Self, ViewError> {
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
            waveform: scene.link.waveform().map_err(Box::new)?,
            air: panels.iter().map(air).collect(),
            background_air: exposure.linear_air(Air::before_background(scene)),
            background,
            panels,
            photograph,
            reflectances,
            layers: 1,
        };
        view.layers = layers(&view);
        Ok(view)
    }
}

/// The greatest number of panels that any one can overlap in the image, itself included: boxes are widened by their own size and by the
/// blur.
fn layers(view: &View) -> usize {
    let boxes: Vec<_> = view
        .panels
        .iter()
        .map(|panel| wide_box(panel, 6.0 * view.scene.camera.blur_sigma_px))
        .collect();
    let mut layers = vec![1; boxes.len()];
    for_each_meeting(&boxes, |a, b| {
        layers[a] += 1;
        layers[b] += 1;
    });
    layers.into_iter().max().unwrap_or(1)
}

/// The box around a panel's LEDs, widened by its size and a margin on each side.
fn wide_box(panel: &PanelView, margin_px: f64) -> [DVec2; 2] {
    let centres = panel.ellipses.iter().map(|ellipse| ellipse.centre);
    let (low, high) = centres.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let wider = high - low + margin_px;
    [low - wider, high + wider]
}
