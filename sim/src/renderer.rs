//! From a scene and the panels' bits to what the camera records.

use std::sync::{Arc, OnceLock};

use fearless_simd::dispatch;
use glam::DVec2;
use link::panel::{LEDS, PanelFrame, SIDE};
use rand::Rng;

use crate::accuracy::{Accuracy, Level};
use crate::backdrop::Backdrop;
use crate::canvas::{Canvas, Region};
use crate::chords::Chords;
use crate::clock::{Moment, WINDOW};
use crate::effects;
use crate::exposure::LedLight;
use crate::grey::{self, Encoder};
use crate::kernel::{Exact, Kernel, Real, Tabulated};
use crate::layout::{self, Images, Layout, image_of};
use crate::noise::PixelNoise;
use crate::outline::Outline;
use crate::plan::Plan;
use crate::random::{Purpose, stream};
use crate::recipe::Recipe;
use crate::scene::{Camera, Scene};
use crate::stamp::Chorded;
use crate::view::{BOARD_CORNERS, PanelView, View, ViewError};

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
    recipe: Recipe,
    level: Level,
    exact: Exact,
    table: Tabulated,
    margin_px: f64,
    /// For each panel drawn: its layouts over the exposure with their weights.
    layouts: Vec<Vec<(f64, Layout)>>,
    /// The panels drawn, the farthest first: a near board covers what is behind it.
    far_to_near: Vec<usize>,
    /// For each panel drawn: its board, where it has one.
    boards: Vec<Option<Board>>,
    encoder: Encoder,
    /// Noise of the pixels drawn, made when it is first asked for.
    pixel_noise: OnceLock<Arc<PixelNoise>>,
    /// The sensor without panels, made when a whole frame is first asked for.
    backdrop: OnceLock<Backdrop>,
}

impl Renderer {
    /// A renderer for a valid scene at an accuracy level.
    ///
    /// # Errors
    /// When the scene cannot be seen: see [`ViewError`].
    pub fn new(scene: &Scene, level: Level) -> Result<Self, ViewError> {
        Ok(Self::of(View::new(scene)?, level))
    }

    /// A renderer for a scene worked out.
    pub fn of(view: View, level: Level) -> Self {
        let plan = Plan::of(&view);
        let recipe = plan.recipe(&view);
        let accuracy = Accuracy::new(
            level,
            view.floor,
            view.peak - view.floor,
            recipe.sigma_px,
            view.scene.camera.gamma,
        );
        Self::with(view, plan, recipe, level, accuracy)
    }

    /// A renderer with the knobs set by hand; the bound of `level` is then the caller's to keep.
    pub fn with_accuracy(view: View, level: Level, accuracy: Accuracy) -> Self {
        let plan = Plan::of(&view);
        let recipe = plan.recipe(&view);
        Self::with(view, plan, recipe, level, accuracy)
    }

    fn with(view: View, plan: Plan, recipe: Recipe, level: Level, accuracy: Accuracy) -> Self {
        let scene = &view.scene;
        let margin_px = accuracy.margin_px(recipe.sigma_px);
        let drawn = if recipe.neighbours {
            view.panels.len()
        } else {
            1
        };
        let at_moments = |panel| {
            recipe
                .moments
                .iter()
                .map(|&(after_s, weight)| {
                    (
                        weight,
                        Layout::new(&scene.camera, panel, &recipe, &accuracy, after_s),
                    )
                })
                .collect()
        };
        let layouts: Vec<Vec<_>> = view.panels[..drawn].iter().map(at_moments).collect();
        let boards = view.panels[..drawn].iter().map(|panel| {
            panel
                .panel
                .board_reflectance
                .filter(|_| recipe.boards)
                .map(|_| Board::new(&scene.camera, panel, &recipe, &accuracy))
        });
        let boards = boards.collect();
        let mut far_to_near: Vec<usize> = (0..drawn).collect();
        far_to_near.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|index| view.panels[index].pose.distance_m);
            b.total_cmp(&a)
        });
        let per_px = accuracy.phases.max(1);
        Self {
            exact: Exact::new(recipe.sigma_px),
            table: Tabulated::new(recipe.sigma_px.max(SHARPEST_PX), margin_px + 1.0, per_px),
            encoder: Encoder::new(scene.camera.gamma),
            margin_px,
            layouts,
            boards,
            pixel_noise: OnceLock::new(),
            backdrop: OnceLock::new(),
            far_to_near,
            view,
            plan,
            recipe,
            level,
        }
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
        let corners = BOARD_CORNERS.map(|(row, column)| {
            layout::place(
                camera,
                panel,
                &self.recipe,
                0.0,
                panel.projection.led_m(row, column),
            )
        });
        let centres = self
            .layouts
            .get(index)
            .into_iter()
            .flatten()
            .flat_map(|(_, layout)| (0..LEDS).map(|led| layout.centre(led)));
        let (low, high) = corners
            .into_iter()
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
        for stage in &self.recipe.row_stages {
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

    fn pixel_noise(&self) -> Option<&Arc<PixelNoise>> {
        let noise = self.recipe.noise.as_ref()?;
        Some(
            self.pixel_noise
                .get_or_init(|| Arc::new(PixelNoise::new(noise))),
        )
    }

    /// The sensor without panels.
    fn backdrop(&self) -> Backdrop {
        if !self.recipe.photograph && self.recipe.row_stages.is_empty() {
            let noise = self.recipe.noise.as_ref();
            return Backdrop::even(self.plain_background(), &self.encoder, noise);
        }
        let mut canvas = Canvas::new(self.sensor());
        self.draw_background(&mut canvas);
        self.change_rows(&mut canvas);
        Backdrop::picture(canvas.values(), &self.encoder, self.pixel_noise().cloned())
    }

    fn change_rows(&self, canvas: &mut Canvas<f32>) {
        let Region { x, y, width, .. } = canvas.region();
        for stage in &self.recipe.row_stages {
            for (j, row) in canvas.values_mut().chunks_exact_mut(width).enumerate() {
                stage.apply(x, y + j, row);
            }
        }
    }

    /// The same of a canvas in double precision, by the formula itself.
    pub fn read_out_exact(&self, seed: u64, frame: u64, canvas: &Canvas<f64>, grey: &mut [u8]) {
        if self.recipe.noise.is_none() {
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
                .get_or_init(|| self.backdrop())
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

    /// What panel `index` shows in the middle of the exposure, each LED in the middle of its own.
    pub fn truth(&self, index: usize, moment: &Moment, shown: &Shown) -> PanelFrame {
        if self.recipe.row_delay_s == 0.0 {
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
        std::array::from_fn(|led| self.recipe.row_delay_s * ellipses[led].centre.y)
    }

    /// Adds the LEDs of a layout by a kernel.
    #[inline(always)]
    fn paint<K: Kernel>(
        &self,
        kernel: &K,
        layout: &Layout,
        shift: DVec2,
        light: &[K::Real; LEDS],
        canvas: &mut Canvas<K::Real>,
    ) {
        match &layout.images {
            Images::Chords { shapes, .. } => {
                let stamp = |led| Chorded::new(kernel, image_of(shapes, led), self.margin_px);
                layout.paint(stamp, shift, light, canvas);
            }
            Images::Outlines(outlines) => {
                for (led, &light) in light.iter().enumerate() {
                    canvas.add_outline(
                        image_of(outlines, led),
                        self.recipe.sigma_px,
                        self.margin_px,
                        layout.centre(led) + shift,
                        light,
                    );
                }
            }
        }
    }

    /// Background, boards and LEDs, the farthest panel first; `paint` adds the LEDs of a layout.
    #[inline(always)]
    fn compose<K: Kernel>(
        &self,
        kernel: &K,
        moment: &Moment,
        shown: &[Shown],
        canvas: &mut Canvas<K::Real>,
        paint: impl Fn(&Layout, DVec2, &[K::Real; LEDS], &mut Canvas<K::Real>),
    ) {
        self.draw_background(canvas);
        for &index in &self.far_to_near {
            let (Some(shown), layouts) = (shown.get(index), &self.layouts[index]) else {
                continue;
            };
            let shift = DVec2::from_array(shown.shift_px);
            if let Some(board) = &self.boards[index] {
                self.draw_board(kernel, index, board, shift, canvas);
            }
            let light = self.amplitudes(index, moment, shown);
            for (weight, layout) in layouts {
                let weighted = light.map(|light| K::Real::from_f64(light * weight));
                paint(layout, shift, &weighted, canvas);
            }
        }
    }

    fn draw_background<R: Real>(&self, canvas: &mut Canvas<R>) {
        if !self.recipe.photograph {
            canvas.fill(R::from_f64(self.plain_background()));
            return;
        }
        let Region { x, y, width, .. } = canvas.region();
        let photograph = self
            .view
            .photograph
            .chunks_exact(self.sensor().width)
            .skip(y);
        for (row, source) in canvas.values_mut().chunks_exact_mut(width).zip(photograph) {
            for (value, &source) in row.iter_mut().zip(&source[x..x + width]) {
                *value = R::from_f64(self.recipe.background_air.through(source.into()));
            }
        }
    }

    /// Covers what is behind panel `index` by its board, edges blurred.
    fn draw_board<K: Kernel>(
        &self,
        kernel: &K,
        index: usize,
        board: &Board,
        shift: DVec2,
        canvas: &mut Canvas<K::Real>,
    ) {
        let mut mask = Canvas::new(canvas.region());
        let (centre, full) = (board.centre + shift, K::Real::from_f64(1.0));
        match &board.chords {
            Some(chords) => {
                let stamp = Chorded::new(kernel, chords, self.margin_px);
                mask.add_led(&stamp, centre, full);
            }
            None => mask.add_outline(
                &board.outline,
                self.recipe.sigma_px,
                self.margin_px,
                centre,
                full,
            ),
        }
        let light = self
            .board_light(index)
            .unwrap_or_else(|| self.plain_background());
        for (value, &covered) in canvas.values_mut().iter_mut().zip(mask.values()) {
            *value += covered * (K::Real::from_f64(light) - *value);
        }
    }

    /// The linear value of panel `index`'s board through the air, where it is drawn.
    fn board_light(&self, index: usize) -> Option<f64> {
        let air = self.recipe.air[index];
        let reflectance = self.view.panels[index]
            .panel
            .board_reflectance
            .filter(|_| self.recipe.boards)?;
        Some(air.through(effects::board::linear(&self.view, reflectance)))
    }

    /// By how much each LED of a panel is brighter than what is behind it.
    fn amplitudes(&self, index: usize, moment: &Moment, shown: &Shown) -> [f64; LEDS] {
        let panel = &self.view.panels[index];
        let delay_s = self.delays_s(index);
        let mut own: [f64; LEDS] = if self.recipe.mix_symbols {
            std::array::from_fn(|led| {
                let shares = moment.shares(delay_s[led]);
                let seen = shown.symbols.iter().zip(shares);
                seen.map(|(symbol, share)| f64::from(u8::from(symbol.led(led))) * share)
                    .sum()
            })
        } else {
            let truth = self.truth(index, moment, shown);
            std::array::from_fn(|led| f64::from(u8::from(truth.led(led))))
        };
        for stage in &self.recipe.led_stages {
            stage.apply(index, moment, &delay_s, &mut own);
        }
        let air = self.recipe.air[index];
        let board = self.board_light(index);
        std::array::from_fn(|led| {
            let light = shown.light.off + own[led] * (shown.light.on - shown.light.off);
            air.through(light) - board.unwrap_or_else(|| self.behind(panel.ellipses[led].centre))
        })
    }

    /// The linear value of the background at a pixel position.
    fn behind(&self, at: DVec2) -> f64 {
        if !self.recipe.photograph {
            return self.plain_background();
        }
        let sensor = self.sensor();
        let clip = |value: f64, end: usize| value.round().clamp(0.0, end as f64 - 1.0) as usize;
        let seen = self.view.photograph
            [clip(at.y, sensor.height) * sensor.width + clip(at.x, sensor.width)];
        self.recipe.background_air.through(seen.into())
    }

    /// The linear value of a background without photograph.
    fn plain_background(&self) -> f64 {
        self.recipe.background_air.through(self.view.background)
    }
}

/// A panel's board of 8 × 8 pitches, where it is in the middle of the exposure.
struct Board {
    centre: DVec2,
    outline: Outline,
    /// None where it is drawn pixel by pixel.
    chords: Option<Chords>,
}

impl Board {
    fn new(camera: &Camera, panel: &PanelView, recipe: &Recipe, accuracy: &Accuracy) -> Self {
        let corners = BOARD_CORNERS.map(|(row, column)| {
            layout::place(
                camera,
                panel,
                recipe,
                0.0,
                panel.projection.led_m(row, column),
            )
        });
        let centre = corners.iter().sum::<DVec2>() / 4.0;
        let outline = Outline::Quadrilateral(corners.map(|corner| corner - centre));
        Self {
            centre,
            outline,
            chords: Chords::within(&outline, recipe.sigma_px, accuracy.quadrature),
        }
    }
}
