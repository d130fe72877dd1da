//! Renders a scene and the panels' bits to a camera's frames.

mod backdrop;
mod board;
pub mod canvas;
mod compose;
mod layout;
mod linear_image;
mod outlined;
mod placed;
mod polyphase;
mod read_out;
mod regions;
mod separable;
mod symbols;

use std::sync::{Arc, OnceLock};

use fearless_simd::dispatch;
use link::panel::PanelFrame;

use crate::accuracy::{Accuracy, Level};
use crate::camera::clock::{Moment, WINDOW};
use crate::camera::curve::Curve;
use crate::camera::encoder::Encoder;
use crate::camera::exposure::LedLight;
use crate::camera::noise::PixelNoise;
use crate::disc::kernel::{Exact, KernelTables};
use crate::disc::outline::Blur;
use crate::disc::spread::Spread;
use crate::effects;
use crate::formation::Formation;
use crate::plan::Plan;
use crate::renderer::backdrop::Backdrop;
use crate::renderer::canvas::{Canvas, Region};
use crate::renderer::layout::Images;
use crate::renderer::placed::DrawList;
use crate::scene::Scene;
use crate::view::{Photograph, View, ViewError};

pub use linear_image::LinearImage;

/// The light of one panel during one exposure.
#[derive(Clone, Copy, Debug)]
pub struct PanelExposure {
    /// The symbol at the exposure's start and those after it.
    pub symbols: [PanelFrame; WINDOW],
    /// Its LEDs' light, without the air between.
    pub light: LedLight,
    /// The shift of the panel's image from its pose, in px.
    pub shift_px: [f64; 2],
}

/// The least blur with a table; without a blur none is needed.
const SHARPEST_PX: f64 = 1e-3;

/// Renders frames of one scene.
pub struct Renderer {
    view: View,
    plan: Plan,
    formation: Formation,
    level: Level,
    accuracy: Accuracy,
    exact: Exact,
    table: KernelTables,
    spread: Spread,
    /// The blur's round core, for drawing pixel by pixel.
    blur: Blur,
    margin_px: f64,
    /// The drawn panels, the farthest first, because a near board covers farther panels.
    far_to_near: Vec<usize>,
    /// All positions while the camera is still.
    still: DrawList,
    encoder: Encoder,
    /// Noise of the drawn pixels, made on first use.
    pixel_noise: OnceLock<Arc<PixelNoise>>,
    /// The sensor without panels, made for the first whole frame.
    backdrop: OnceLock<Arc<Backdrop>>,
}

impl Renderer {
    /// A renderer for a valid scene at an accuracy level.
    ///
    /// # Errors
    /// If the scene cannot be seen: see [`ViewError`].
    pub fn new(scene: &Scene, level: Level) -> Result<Self, ViewError> {
        effects::check_names(&scene.effects).map_err(Box::new)?;
        Ok(Self::of(View::new(scene)?, level))
    }

    /// A renderer for a prepared scene.
    pub fn of(view: View, level: Level) -> Self {
        let plan = Plan::of(&view);
        Self::planned(view, plan, level)
    }

    /// The same renderer with one effect added to the plan or left out of it.
    pub fn toggled(&self, effect: &str) -> Self {
        let mut toggled = Self::planned(self.view.clone(), self.plan.toggled(effect), self.level);
        if toggled.formation.noise == self.formation.noise {
            toggled.pixel_noise = self.pixel_noise.clone();
        }
        toggled
    }

    fn planned(view: View, plan: Plan, level: Level) -> Self {
        let (formation, range) = (plan.formation(&view), plan.range);
        let accuracy = Accuracy::new(level, range.floor, range.peak - range.floor, formation.sigma_px, &formation.curve);
        Self::with(view, plan, formation, level, accuracy)
    }

    /// A renderer with explicit accuracy parameters; the caller is responsible for the bound of `level`.
    pub fn with_accuracy(view: View, level: Level, accuracy: Accuracy) -> Self {
        let plan = Plan::of(&view);
        let formation = plan.formation(&view);
        Self::with(view, plan, formation, level, accuracy)
    }

    fn with(view: View, plan: Plan, formation: Formation, level: Level, accuracy: Accuracy) -> Self {
        let (shape, tolerance) = (formation.spread, accuracy.quadrature / 4.0);
        let spread = Spread::new(shape, formation.sigma_px, tolerance);
        let blur = accuracy.blur(formation.sigma_px);
        let margin_px = blur.margin_px() + spread.reach_px;
        let drawn = if formation.other_panels { view.panels.len() } else { 1 };
        let mut far_to_near: Vec<usize> = (0..drawn).collect();
        far_to_near.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|index| view.panels[index].pose.distance_m);
            b.total_cmp(&a)
        });
        let per_px = accuracy.phases.max(1);
        let mut renderer = Self {
            exact: Exact::new(formation.sigma_px),
            table: KernelTables::new(formation.sigma_px.max(SHARPEST_PX), margin_px + 1.0, per_px),
            encoder: Encoder::new(&formation.curve),
            spread,
            blur,
            margin_px,
            still: DrawList::default(),
            pixel_noise: OnceLock::new(),
            backdrop: OnceLock::new(),
            far_to_near,
            view,
            plan,
            formation,
            accuracy,
            level,
        };
        renderer.still = renderer.placed(None);
        renderer
    }

    /// A renderer for another scene at the same level. It reuses the common parts of the photograph, the noise tables and the backdrop,
    /// which are most of the work if panels have only moved.
    ///
    /// # Errors
    /// If the scene cannot be seen: see [`ViewError`].
    pub fn rebuilt_for(&self, scene: &Scene) -> Result<Self, ViewError> {
        let mut rebuilt = Self::of(self.view.rebuilt_for(scene)?, self.level);
        if rebuilt.formation.noise == self.formation.noise {
            rebuilt.pixel_noise = self.pixel_noise.clone();
            if rebuilt.has_the_backdrop_of(self) {
                rebuilt.backdrop = self.backdrop.clone();
            }
        }
        Ok(rebuilt)
    }

    fn has_the_backdrop_of(&self, other: &Self) -> bool {
        let (mine, theirs) = (&self.view, &other.view);
        let photographs = [self, other].map(|renderer| renderer.photograph().map(Photograph::relative));
        mine.scene.camera == theirs.scene.camera
            && self.plan.included().eq(other.plan.included())
            && mine.exposure == theirs.exposure
            && mine.scene.ambient == theirs.scene.ambient
            && self.formation.background_air == other.formation.background_air
            && match photographs {
                [Some(mine), Some(theirs)] => std::ptr::eq(mine, theirs),
                [mine, theirs] => mine.is_none() && theirs.is_none(),
            }
    }

    /// The prepared scene.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// The simulated effects and their reasons.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The curve from linear values to grey levels.
    pub fn curve(&self) -> Curve {
        self.formation.curve
    }

    /// The accuracy level.
    pub fn level(&self) -> Level {
        self.level
    }

    /// The light of panel `index` without a symbol change: the scene's own light, in its pose.
    pub fn steady(&self, index: usize, bits: PanelFrame) -> PanelExposure {
        PanelExposure {
            symbols: [bits; WINDOW],
            light: self.view.panels[index].light,
            shift_px: [0.0; 2],
        }
    }

    /// The LEDs of panel `index` if each On one has `luminance_cd_m2` of its own light, even beyond the scene's limits.
    pub fn lit(&self, index: usize, luminance_cd_m2: f64) -> LedLight {
        let scene = &self.view.scene;
        let panel = &self.view.panels[index].panel;
        let l2a = luminance_cd_m2 / (scene.ambient.illuminance_lx * panel.reflectance);
        let mut unlimited = panel.clone();
        (unlimited.luminance_min_cd_m2, unlimited.luminance_max_cd_m2) = (None, None);
        self.view.exposure.led_light(scene, &unlimited, panel.reflectance, l2a)
    }

    /// The moment of frame `frame` of run `seed`.
    pub fn moment(&self, seed: u64, frame: u64) -> Moment {
        Moment::of(&self.view.scene, &self.view.exposure, seed, frame)
    }

    /// Draws the linear image, in single precision, at the level [`Level::Fine`] or [`Level::Fast`].
    ///
    /// ```
    /// use link::panel::PanelFrame;
    /// use sim::{accuracy::Level, renderer::Renderer, renderer::canvas::Canvas, scene::Scene};
    ///
    /// let renderer = Renderer::new(&Scene::load("paper", &[])?, Level::Fine)?;
    /// let mut canvas = Canvas::new(renderer.surroundings(0));
    /// renderer.draw(&renderer.moment(1, 0), &[renderer.steady(0, PanelFrame::from_bits(1))], &mut canvas);
    /// let brightest = canvas.values().iter().fold(0.0f32, |a, &b| a.max(b));
    /// // An On LED of 16 times the background, blurred to less than half of that.
    /// assert!(brightest > 3.0 && brightest < 8.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn draw(&self, moment: &Moment, shown: &[PanelExposure], canvas: &mut Canvas<f32>) {
        dispatch!(fearless_simd::Level::new(), _simd => self.draw_f32(moment, shown, canvas));
    }

    #[inline(always)]
    fn draw_f32(&self, moment: &Moment, shown: &[PanelExposure], canvas: &mut Canvas<f32>) {
        self.expose(
            &self.table,
            moment,
            shown,
            canvas,
            #[inline(always)]
            |layout, shift, light, canvas| match &layout.images {
                Images::Chords { table: Some(table), .. } => layout.paint(|_| table, shift, light, canvas),
                _ => self.paint(&self.table, layout, shift, light, canvas),
            },
        );
        self.change_rows(canvas);
    }

    /// Draws the linear image in double precision, by the error function. The full precision needs a renderer of [`Level::Reference`].
    pub fn draw_exact(&self, moment: &Moment, shown: &[PanelExposure], canvas: &mut Canvas<f64>) {
        self.expose(&self.exact, moment, shown, canvas, |layout, shift, light, canvas| {
            self.paint(&self.exact, layout, shift, light, canvas);
        });
        let Region { x, y, width, .. } = canvas.region();
        for stage in &self.formation.row_stages {
            for (j, row) in canvas.values_mut().chunks_exact_mut(width).enumerate() {
                stage.apply_exact(x, y + j, row);
            }
        }
    }

    fn change_rows(&self, canvas: &mut Canvas<f32>) {
        let Region { x, y, width, .. } = canvas.region();
        for stage in &self.formation.row_stages {
            for (j, row) in canvas.values_mut().chunks_exact_mut(width).enumerate() {
                stage.apply(x, y + j, row);
            }
        }
    }
}
