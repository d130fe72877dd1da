//! From a scene and the panels' bits to what the camera records.

pub mod backdrop;
pub mod canvas;
mod compose;
pub mod layout;
pub mod polyphase;
pub mod stamp;

use std::sync::{Arc, OnceLock};

use fearless_simd::dispatch;
use glam::DVec2;
use link::panel::{LEDS, PanelFrame, SIDE};
use rand::Rng;

use self::compose::{Board, board_corners};
use rx_pipeline::corners::{Corners, CornersError};

use crate::accuracy::{Accuracy, Level};
use crate::camera::clock::{Moment, WINDOW};
use crate::camera::exposure::LedLight;
use crate::camera::grey::{self, Encoder};
use crate::camera::noise::{FlatNoise, PixelNoise};
use crate::disc::kernel::{Exact, Tabulated};
use crate::effects;
use crate::formation::Formation;
use crate::plan::Plan;
use crate::random::{Purpose, stream};
use crate::renderer::backdrop::Backdrop;
use crate::renderer::canvas::{Canvas, Region};
use crate::renderer::layout::{Images, Layout};
use crate::scene::Scene;
use crate::view::{Photograph, View, ViewError};

/// What one panel shows during one exposure.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// The symbol at the exposure's start and those after it.
    pub symbols: [PanelFrame; WINDOW],
    /// Its LEDs' light, without the air between.
    pub light: LedLight,
    /// How far the panel's image is moved from where its pose puts it, in px.
    pub shift_px: [f64; 2],
}

/// The least blur a table is made for; none at all needs no table.
const SHARPEST_PX: f64 = 1e-3;

/// Renders frames of one scene.
pub struct Renderer {
    view: View,
    plan: Plan,
    formation: Formation,
    level: Level,
    exact: Exact,
    table: Tabulated,
    margin_px: f64,
    /// For each panel drawn: its layouts over the exposure with their weights.
    layouts: Vec<Vec<(f64, Layout)>>,
    /// The panels drawn, the farthest first: a near board covers what is behind it.
    far_to_near: Vec<usize>,
    /// For each panel drawn: its board over the exposure with weights; empty without a board.
    boards: Vec<Vec<(f64, Board)>>,
    /// For each panel drawn: whether all that is behind its LEDs has one linear value.
    on_even_ground: Vec<bool>,
    encoder: Encoder,
    /// Noise of the pixels drawn, made when it is first asked for.
    pixel_noise: OnceLock<Arc<PixelNoise>>,
    /// The sensor without panels, made when a whole frame is first asked for.
    backdrop: OnceLock<Arc<Backdrop>>,
}

impl Renderer {
    /// A renderer for a valid scene at an accuracy level.
    ///
    /// # Errors
    /// When the scene cannot be seen: see [`ViewError`].
    pub fn new(scene: &Scene, level: Level) -> Result<Self, ViewError> {
        effects::check_names(&scene.effects).map_err(Box::new)?;
        Ok(Self::of(View::new(scene)?, level))
    }

    /// A renderer for a scene worked out.
    pub fn of(view: View, level: Level) -> Self {
        let plan = Plan::of(&view);
        Self::planned(view, plan, level)
    }

    /// The same renderer with one effect more, or one less, than planned.
    pub fn toggled(&self, effect: &str) -> Self {
        let mut toggled = Self::planned(self.view.clone(), self.plan.toggled(effect), self.level);
        if toggled.formation.noise == self.formation.noise {
            toggled.pixel_noise = self.pixel_noise.clone();
        }
        toggled
    }

    fn planned(view: View, plan: Plan, level: Level) -> Self {
        let (formation, range) = (plan.formation(&view), plan.range);
        let accuracy = Accuracy::new(
            level,
            range.floor,
            range.peak - range.floor,
            formation.sigma_px,
            view.scene.camera.gamma,
        );
        Self::with(view, plan, formation, level, accuracy)
    }

    /// A renderer with the knobs set by hand; the bound of `level` is then the caller's to keep.
    pub fn with_accuracy(view: View, level: Level, accuracy: Accuracy) -> Self {
        let plan = Plan::of(&view);
        let formation = plan.formation(&view);
        Self::with(view, plan, formation, level, accuracy)
    }

    fn with(
        view: View,
        plan: Plan,
        formation: Formation,
        level: Level,
        accuracy: Accuracy,
    ) -> Self {
        let scene = &view.scene;
        let margin_px = accuracy.margin_px(formation.sigma_px);
        let drawn = if formation.other_panels {
            view.panels.len()
        } else {
            1
        };
        let at_moments = |panel| {
            formation
                .moments
                .iter()
                .map(|&(after_s, weight)| {
                    (
                        weight,
                        Layout::new(&scene.camera, panel, &formation, &accuracy, after_s),
                    )
                })
                .collect()
        };
        let layouts: Vec<Vec<_>> = view.panels[..drawn].iter().map(at_moments).collect();
        let boards = view.panels[..drawn].iter().zip(&formation.boards);
        let boards = boards.map(|(panel, board)| {
            let images = formation.moments.iter().filter(|_| board.is_some());
            images
                .map(|&(after_s, weight)| {
                    let camera = &scene.camera;
                    (
                        weight,
                        Board::new(camera, panel, &formation, &accuracy, after_s),
                    )
                })
                .collect()
        });
        let boards: Vec<Vec<_>> = boards.collect();
        let mut far_to_near: Vec<usize> = (0..drawn).collect();
        far_to_near.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|index| view.panels[index].pose.distance_m);
            b.total_cmp(&a)
        });
        let per_px = accuracy.phases.max(1);
        let mut renderer = Self {
            exact: Exact::new(formation.sigma_px),
            table: Tabulated::new(formation.sigma_px.max(SHARPEST_PX), margin_px + 1.0, per_px),
            encoder: Encoder::new(scene.camera.gamma),
            margin_px,
            layouts,
            boards,
            on_even_ground: Vec::new(),
            pixel_noise: OnceLock::new(),
            backdrop: OnceLock::new(),
            far_to_near,
            view,
            plan,
            formation,
            level,
        };
        renderer.on_even_ground = (0..drawn)
            .map(|index| renderer.is_on_even_ground(index))
            .collect();
        renderer
    }

    /// A renderer for another scene at the same level. It takes over what both have in common of the photograph, the noise
    /// tables and the backdrop, which are most of the work where panels have only moved.
    ///
    /// # Errors
    /// When the scene cannot be seen: see [`ViewError`].
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
        let photographs =
            [self, other].map(|renderer| renderer.photograph().map(Photograph::relative));
        mine.scene.camera == theirs.scene.camera
            && self.plan.included().eq(other.plan.included())
            && self.plain_background() == other.plain_background()
            && self.formation.background_air == other.formation.background_air
            && match photographs {
                [Some(mine), Some(theirs)] => std::ptr::eq(mine, theirs),
                [mine, theirs] => mine.is_none() && theirs.is_none(),
            }
    }

    /// Whether all behind the LEDs of panel `index` has one value: its board, or a plain background where no farther panel is.
    fn is_on_even_ground(&self, index: usize) -> bool {
        let surroundings = self.surroundings(index);
        let mut farther = self.far_to_near.iter().take_while(|&&other| other != index);
        !self.boards[index].is_empty()
            || self.photograph().is_none()
                && farther.all(|&other| !meet(surroundings, self.surroundings(other)))
    }

    /// The scene, worked out.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// What is simulated and why.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The accuracy level.
    pub fn level(&self) -> Level {
        self.level
    }

    /// The whole sensor.
    pub fn sensor(&self) -> Region {
        Region {
            x: 0,
            y: 0,
            width: self.view.scene.camera.width_px,
            height: self.view.scene.camera.height_px,
        }
    }

    /// The part of the sensor that panel `index` lights, with room for a shift of less than one pixel.
    pub fn surroundings(&self, index: usize) -> Region {
        self.around(index, self.margin_px)
    }

    /// The part of the sensor that the cells of panel `index` cover, with a rim of one pixel for their gradient and room for a shift of
    /// less than one pixel.
    pub fn cells_region(&self, index: usize) -> Region {
        self.around(index, 0.0)
    }

    fn around(&self, index: usize, margin_px: f64) -> Region {
        let panel = &self.view.panels[index];
        let camera = &self.view.scene.camera;
        let moments = self.formation.moments.iter();
        let corners = moments
            .flat_map(|&(after_s, _)| board_corners(camera, panel, &self.formation, after_s));
        let centres = self
            .layouts
            .get(index)
            .into_iter()
            .flatten()
            .flat_map(|(_, layout)| (0..LEDS).map(|led| layout.centre(led)));
        let (low, high) = corners
            .chain(centres)
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| {
                (l.min(p), h.max(p))
            });
        let (low, high) = (low - margin_px - 2.0, high + margin_px + 3.0);
        let sensor = self.sensor();
        let clip = |value: f64, end: usize| value.clamp(0.0, end as f64) as usize;
        let (x, y) = (
            clip(low.x.floor(), sensor.width),
            clip(low.y.floor(), sensor.height),
        );
        Region {
            x,
            y,
            width: clip(high.x.ceil(), sensor.width) - x,
            height: clip(high.y.ceil(), sensor.height) - y,
        }
    }

    /// What panel `index` shows where its symbol does not change: the scene's own light, in its pose.
    pub fn steady(&self, index: usize, bits: PanelFrame) -> Shown {
        Shown {
            symbols: [bits; WINDOW],
            light: self.view.panels[index].light,
            shift_px: [0.0; 2],
        }
    }

    /// The moment of frame `frame`.
    pub fn moment(&self, frame: u64) -> Moment {
        Moment::of(&self.view.scene, &self.view.exposure, frame)
    }

    /// Draws the linear image, in single precision, at the level [`Level::Fine`] or [`Level::Fast`].
    pub fn draw(&self, moment: &Moment, shown: &[Shown], canvas: &mut Canvas<f32>) {
        dispatch!(fearless_simd::Level::new(), _simd => self.draw_f32(moment, shown, canvas));
    }

    #[inline(always)]
    fn draw_f32(&self, moment: &Moment, shown: &[Shown], canvas: &mut Canvas<f32>) {
        self.compose(
            &self.table,
            moment,
            shown,
            canvas,
            #[inline(always)]
            |layout, shift, light, canvas| match &layout.images {
                Images::Chords {
                    table: Some(table), ..
                } => layout.paint(|_| table, shift, light, canvas),
                _ => self.paint(&self.table, layout, shift, light, canvas),
            },
        );
        self.change_rows(canvas);
    }

    /// Draws the linear image in double precision, by the error function. The renderer must have been made for
    /// [`Level::Reference`] to be as exact as that.
    pub fn draw_exact(&self, moment: &Moment, shown: &[Shown], canvas: &mut Canvas<f64>) {
        self.compose(
            &self.exact,
            moment,
            shown,
            canvas,
            |layout, shift, light, canvas| {
                self.paint(&self.exact, layout, shift, light, canvas);
            },
        );
        let Region { x, y, width, .. } = canvas.region();
        for stage in &self.formation.row_stages {
            for (j, row) in canvas.values_mut().chunks_exact_mut(width).enumerate() {
                stage.apply_exact(x, y + j, row);
            }
        }
    }

    /// Reads a drawn canvas out as grey levels, row by row, with the sensor's noise for that seed and frame.
    pub fn read_out(&self, seed: u64, frame: u64, canvas: &Canvas<f32>, grey: &mut [u8]) {
        let mut random = stream(seed, frame, Purpose::Noise);
        self.read_pixels(canvas.values(), &mut random, grey);
    }

    /// Reads pixels out one after another.
    fn read_pixels(&self, linear: &[f32], random: &mut impl Rng, grey: &mut [u8]) {
        match self.pixel_noise() {
            None => {
                dispatch!(fearless_simd::Level::new(), _simd => self.encoder.encode(linear, grey));
            }
            Some(noise) => noise.read(linear, random, grey),
        }
    }

    /// The noise of the pixels that are drawn, where noise is simulated.
    pub fn pixel_noise(&self) -> Option<&Arc<PixelNoise>> {
        let noise = self.formation.noise.as_ref()?;
        Some(
            self.pixel_noise
                .get_or_init(|| Arc::new(PixelNoise::new(noise))),
        )
    }

    /// The sensor without panels.
    fn backdrop(&self) -> Backdrop {
        if self.photograph().is_none() && self.formation.row_stages.is_empty() {
            let plain = self.plain_background();
            return match &self.formation.noise {
                None => Backdrop::Even(self.encoded(&[plain as f32])[0]),
                Some(noise) => Backdrop::EvenNoisy(Box::new(FlatNoise::new(noise, plain))),
            };
        }
        let mut canvas = Canvas::new(self.sensor());
        self.draw_background(&mut canvas);
        self.change_rows(&mut canvas);
        match self.pixel_noise() {
            None => Backdrop::Picture(self.encoded(canvas.values())),
            Some(noise) => Backdrop::noisy(canvas.values(), noise.clone()),
        }
    }

    /// Grey levels without noise.
    fn encoded(&self, linear: &[f32]) -> Vec<u8> {
        let mut grey = vec![0; linear.len()];
        self.encoder.encode(linear, &mut grey);
        grey
    }

    fn change_rows(&self, canvas: &mut Canvas<f32>) {
        let Region { x, y, width, .. } = canvas.region();
        for stage in &self.formation.row_stages {
            for (j, row) in canvas.values_mut().chunks_exact_mut(width).enumerate() {
                stage.apply(x, y + j, row);
            }
        }
    }

    /// The same of a canvas in double precision, by the formula itself.
    pub fn read_out_exact(&self, seed: u64, frame: u64, canvas: &Canvas<f64>, grey: &mut [u8]) {
        if self.formation.noise.is_none() {
            for (grey, &linear) in grey.iter_mut().zip(canvas.values()) {
                *grey = grey::unrounded(linear, self.view.scene.camera.gamma).round() as u8;
            }
            return;
        }
        let linear: Vec<f32> = canvas
            .values()
            .iter()
            .map(|&linear| linear as f32)
            .collect();
        self.read_pixels(&linear, &mut stream(seed, frame, Purpose::Noise), grey);
    }

    /// Renders the whole sensor into `grey` (one byte a pixel, row by row), using `canvas`, which covers
    /// [`Renderer::lit_region`], for the part that is drawn.
    pub fn frame(
        &self,
        seed: u64,
        moment: &Moment,
        shown: &[Shown],
        canvas: &mut Canvas<f32>,
        grey: &mut [u8],
    ) {
        self.draw(moment, shown, canvas);
        let Region {
            x,
            y,
            width,
            height,
        } = canvas.region();
        let sensor = self.sensor();
        if width < sensor.width || height < sensor.height {
            let mut random = stream(seed, moment.frame, Purpose::Background);
            self.backdrop
                .get_or_init(|| Arc::new(self.backdrop()))
                .read_out(&mut random, grey);
        }
        let mut random = stream(seed, moment.frame, Purpose::Noise);
        for (values, row) in canvas
            .values()
            .chunks_exact(width)
            .zip(grey.chunks_exact_mut(sensor.width).skip(y))
        {
            self.read_pixels(values, &mut random, &mut row[x..x + width]);
        }
    }

    /// The part of the sensor that panels light: all their surroundings.
    pub fn lit_region(&self) -> Region {
        let regions = (0..self.layouts.len()).map(|index| self.surroundings(index));
        regions
            .reduce(|a, b| {
                let (x, y) = (a.x.min(b.x), a.y.min(b.y));
                Region {
                    x,
                    y,
                    width: (a.x + a.width).max(b.x + b.width) - x,
                    height: (a.y + a.height).max(b.y + b.height) - y,
                }
            })
            .unwrap_or(self.sensor())
    }

    /// Pixel positions of a panel's corner LEDs as drawn: top left, top right, bottom right, bottom left.
    pub fn corner_leds_px(&self, index: usize) -> [[f64; 2]; 4] {
        let panel = &self.view.panels[index];
        let corners = [(0, 0), (0, 7), (7, 7), (7, 0)];
        let drawn = self.layouts.get(index).and_then(|layouts| layouts.first());
        corners.map(|(row, column)| {
            let place = match drawn {
                Some((_, layout)) => layout.centre(SIDE * row + column),
                None => {
                    let at = panel.projection.led_m(row as f64, column as f64);
                    panel.projection.pixel(at)
                }
            };
            place.into()
        })
    }

    /// The first panel's corner LEDs as drawn, in pixels of a region.
    ///
    /// # Errors
    /// When they make no panel.
    pub fn corners_in(&self, region: Region) -> Result<Corners, CornersError> {
        let (x, y) = (region.x as f64, region.y as f64);
        Corners::new(
            self.corner_leds_px(0)
                .map(|corner| [(corner[0] - x) as f32, (corner[1] - y) as f32]),
        )
    }

    /// What panel `index` shows in the middle of the exposure, each LED in the middle of its own.
    pub fn truth(&self, index: usize, moment: &Moment, shown: &Shown) -> PanelFrame {
        if self.formation.row_delay_s == 0.0 {
            return shown.symbols[moment.middle_symbol(0.0)];
        }
        let delay_s = self.delays_s(index);
        let on =
            (0..LEDS).filter(|&led| shown.symbols[moment.middle_symbol(delay_s[led])].led(led));
        PanelFrame::from_bits(on.fold(0, |bits, led| bits | 1 << led))
    }

    /// Whether the exposure of any LED of panel `index` is shared between symbols.
    pub fn straddles(&self, index: usize, moment: &Moment) -> bool {
        let shared = |delay_s: &f64| {
            moment
                .shares(*delay_s)
                .iter()
                .filter(|&&share| share > 0.0)
                .count()
                > 1
        };
        self.delays_s(index).iter().any(shared)
    }

    /// How much later than the sensor's first row each LED of a panel is exposed.
    fn delays_s(&self, index: usize) -> [f64; LEDS] {
        let ellipses = &self.view.panels[index].ellipses;
        std::array::from_fn(|led| self.formation.row_delay_s * ellipses[led].centre.y)
    }
}

/// Whether two regions have a pixel in common.
fn meet(one: Region, other: Region) -> bool {
    let apart = |a: usize, length: usize, b: usize, other: usize| a + length <= b || b + other <= a;
    !apart(one.x, one.width, other.x, other.width)
        && !apart(one.y, one.height, other.y, other.height)
}
