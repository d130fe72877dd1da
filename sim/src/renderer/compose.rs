//! Composition of background, boards and LEDs, the farthest panel first.

use glam::{DMat3, DVec2, DVec3};
use link::panel::LEDS;

use super::{PanelExposure, Renderer};
use crate::accuracy::Level;
use crate::camera::clock::Moment;
use crate::disc::kernel::{Kernel, Real};
use crate::disc::outline::Outline;
use crate::renderer::board::Board;
use crate::renderer::canvas::{Canvas, Region};
use crate::renderer::layout::{Images, Layout, image_of};
use crate::renderer::outlined::LargeShape;
use crate::renderer::placed::{DrawList, ExposureVibration};
use crate::renderer::separable::ChordImage;
use crate::view::Photograph;

/// The most panels for which static images are kept, because each may be as large as the sensor.
const MOST_STILL: usize = 256;

impl Renderer {
    /// Adds the LEDs of a layout by a kernel.
    #[inline(always)]
    pub(super) fn paint<K: Kernel>(
        &self,
        kernel: &K,
        layout: &Layout,
        shift: DVec2,
        light: &[K::Real; LEDS],
        canvas: &mut Canvas<K::Real>,
    ) {
        match &layout.images {
            Images::Chords { shapes, .. } => {
                let image = |led| ChordImage::new(kernel, image_of(shapes, led), &self.spread, self.margin_px);
                layout.paint(image, shift, light, canvas);
            }
            Images::Outlines(outlines) => {
                for (led, &light) in light.iter().enumerate() {
                    self.add_outlined(&outlines[led], shift, light, canvas);
                }
            }
        }
    }

    /// The light of all pixels, of one colour or of three; `paint` adds the LEDs of a layout.
    #[inline(always)]
    pub(super) fn expose<K: Kernel>(
        &self,
        kernel: &K,
        moment: &Moment,
        shown: &[PanelExposure],
        canvas: &mut Canvas<K::Real>,
        paint: impl Fn(&Layout, DVec2, &[K::Real; LEDS], &mut Canvas<K::Real>),
    ) {
        let shaken = self.shaken(moment).map(|shaken| self.placed(Some(shaken)));
        let placed = shaken.as_ref().unwrap_or(&self.still);
        if !self.formation.mosaic {
            return self.compose(kernel, (placed, moment), shown, None, canvas, &paint);
        }
        let region = canvas.region();
        let mut of_colour = Canvas::new(region);
        for colour in 0..3 {
            self.compose(kernel, (placed, moment), shown, Some(colour), &mut of_colour, &paint);
            let pixels = canvas.values_mut().iter_mut().zip(of_colour.values());
            for (k, (pixel, &seen)) in pixels.enumerate() {
                let [x, y] = [region.x + k % region.width, region.y + k / region.width];
                // Red at even columns of even rows, blue at odd ones of odd rows.
                if x % 2 + y % 2 == colour {
                    *pixel = seen;
                }
            }
        }
    }

    /// Background, boards and LEDs, the farthest panel first, for pixels of a colour.
    #[inline(always)]
    fn compose<K: Kernel>(
        &self,
        kernel: &K,
        (placed, moment): (&DrawList, &Moment),
        shown: &[PanelExposure],
        colour: Option<usize>,
        canvas: &mut Canvas<K::Real>,
        paint: &impl Fn(&Layout, DVec2, &[K::Real; LEDS], &mut Canvas<K::Real>),
    ) {
        self.draw_background(placed, canvas);
        for &index in &self.far_to_near {
            let Some(shown) = shown.get(index) else {
                continue;
            };
            let shift = DVec2::from_array(shown.shift_px);
            let touched = self.touched(placed, index, shift);
            if !touched.meets(canvas.region()) {
                continue;
            }
            if let Some(light) = self.board_light(index) {
                canvas.cover(K::Real::from_f64(light), touched, |mask| {
                    for (weight, board) in &placed.boards[index] {
                        self.add_board(kernel, board, shift, K::Real::from_f64(*weight), mask);
                    }
                });
            }
            let mut light = self.led_light(index, moment, shown, colour);
            if placed.on_even_ground[index] {
                let ground = self.board_light(index);
                let ground = ground.unwrap_or_else(|| self.plain_background());
                light = light.map(|light| light - ground);
            } else {
                // Opaque LEDs hide the background before they add their own light.
                canvas.cover(K::Real::default(), touched, |mask| {
                    self.add_leds(&placed.layouts[index], shift, &[1.0; LEDS], mask, paint);
                });
            }
            self.add_leds(&placed.layouts[index], shift, &light, canvas, paint);
        }
    }

    /// Adds the LEDs of a panel, each with its light, over all moments of the exposure.
    #[inline(always)]
    fn add_leds<R: Real>(
        &self,
        layouts: &[(f64, Layout)],
        shift: DVec2,
        light: &[f64; LEDS],
        canvas: &mut Canvas<R>,
        paint: &impl Fn(&Layout, DVec2, &[R; LEDS], &mut Canvas<R>),
    ) {
        for (weight, layout) in layouts {
            let weighted = light.map(|light| R::from_f64(light * weight));
            paint(layout, shift, &weighted, canvas);
        }
    }

    /// Adds a board of the linear value `light` with blurred edges.
    fn add_board<K: Kernel>(&self, kernel: &K, board: &Board, shift: DVec2, light: K::Real, canvas: &mut Canvas<K::Real>) {
        match &board.chords {
            Some(chords) => {
                let image = ChordImage::new(kernel, chords, &self.spread, self.margin_px);
                canvas.add_led(&image, board.outlined.centre + shift, light);
            }
            None => self.add_outlined(&board.outlined, shift, light, canvas),
        }
    }

    /// The photograph, if it is drawn.
    pub(super) fn photograph(&self) -> Option<&Photograph> {
        let photograph = self.view.photograph.as_ref();
        photograph.filter(|_| self.formation.photograph)
    }

    pub(super) fn draw_background<R: Real>(&self, placed: &DrawList, canvas: &mut Canvas<R>) {
        let Some(photograph) = self.photograph() else {
            canvas.fill(R::from_f64(self.plain_background()));
            return;
        };
        let Region { x, y, width, .. } = canvas.region();
        let air = self.formation.background_air;
        let light = |relative: f64| R::from_f64(air.through(self.view.background * relative));
        let rows = canvas.values_mut().chunks_exact_mut(width).enumerate();
        if let Some(shaken) = &placed.shaken {
            for (j, row) in rows {
                let turns = self.picture_turns(shaken, &placed.moments, y + j);
                for (i, value) in row.iter_mut().enumerate() {
                    let at = DVec3::new((x + i) as f64, (y + j) as f64, 1.0);
                    let seen = |(turn, weight): &(DMat3, f64)| {
                        let ray = *turn * at;
                        weight * photograph.at(ray.truncate() / ray.z)
                    };
                    *value = light(turns.iter().map(seen).sum());
                }
            }
            return;
        }
        let source = photograph.relative();
        let source = source.chunks_exact(self.sensor().width).skip(y);
        for ((_, row), source) in rows.zip(source) {
            for (value, &relative) in row.iter_mut().zip(&source[x..x + width]) {
                *value = light(f64::from(relative));
            }
        }
    }

    /// The rotations from pixels of a row of the sensor to the photograph's, with weights, over the exposure of that row. A still camera
    /// sees the photograph unchanged; the lens's distortion is not applied again.
    fn picture_turns(&self, shaken: &ExposureVibration, moments: &[(f64, f64)], row: usize) -> Vec<(DMat3, f64)> {
        let camera = &self.view.scene.camera;
        let (focal, [x, y]) = (camera.focal_px(), camera.principal_px());
        let to_pixels = DMat3::from_cols(DVec3::X * focal, DVec3::Y * focal, DVec3::new(x, y, 1.0));
        let to_rays = to_pixels.inverse();
        let delay_s = self.formation.row_delay_s * row as f64;
        let turn = |&(after_s, weight): &(f64, f64)| (to_pixels * shaken.turn(after_s + delay_s).transpose() * to_rays, weight);
        moments.iter().map(turn).collect()
    }

    /// The linear value of panel `index`'s board through the air, if it is drawn.
    pub(super) fn board_light(&self, index: usize) -> Option<f64> {
        let air = self.formation.air[index];
        Some(air.through(self.formation.boards[index]?))
    }

    /// The linear value of each LED of a panel through the air, for pixels of a colour.
    fn led_light(&self, index: usize, moment: &Moment, shown: &PanelExposure, colour: Option<usize>) -> [f64; LEDS] {
        let delay_s = self.delays_s(index);
        let waveform = self.formation.waveform;
        let lit = |is_one: bool, contrast: f64| 0.5 + 0.5 * if is_one { contrast } else { -contrast };
        let mut own: [f64; LEDS] = if self.formation.mix_symbols {
            std::array::from_fn(|led| {
                let shares = moment.shares(delay_s[led]);
                let contrasts = moment.contrasts(delay_s[led], waveform);
                let seen = shown.symbols.iter().zip(shares).zip(contrasts);
                seen.map(|((symbol, share), contrast)| lit(symbol.led(led), contrast) * share).sum()
            })
        } else {
            let truth = self.truth(index, moment, shown);
            std::array::from_fn(|led| lit(truth.led(led), moment.contrast(delay_s[led], waveform)))
        };
        for stage in &self.formation.led_stages {
            stage.apply(index, moment, &delay_s, &mut own);
        }
        if let Some(colour) = colour {
            let part = self.view.panels[index].panel.colour[colour];
            own.iter_mut().for_each(|light| *light *= part);
        }
        let air = self.formation.air[index];
        std::array::from_fn(|led| air.through(shown.light.off + own[led] * (shown.light.on - shown.light.off)))
    }

    /// The linear value of a background without photograph.
    pub(super) fn plain_background(&self) -> f64 {
        self.formation.background_air.through(self.view.background)
    }

    /// Adds an outlined shape with its linear `light`, moved by `shift`, under the blur and its spread.
    pub(super) fn add_outlined<R: Real>(&self, outlined: &LargeShape, shift: DVec2, light: R, canvas: &mut Canvas<R>) {
        let is_kept = self.far_to_near.len() <= MOST_STILL && self.level != Level::Reference;
        if shift == DVec2::ZERO && is_kept {
            let still = outlined.still.get_or_init(|| self.still(outlined));
            canvas.add(still, light);
        } else {
            self.draw_outline(&outlined.outline, outlined.centre + shift, light, canvas);
        }
    }

    fn still(&self, outlined: &LargeShape) -> Canvas<f32> {
        let reach = outlined.outline.reach() + self.margin_px + 1.0;
        let sensor = self.sensor();
        let size = DVec2::new(sensor.width as f64, sensor.height as f64);
        let low = (outlined.centre - reach).clamp(DVec2::ZERO, size).floor();
        let high = (outlined.centre + reach).clamp(low, size).ceil();
        let mut canvas = Canvas::new(Region {
            x: low.x as usize,
            y: low.y as usize,
            width: (high.x - low.x) as usize,
            height: (high.y - low.y) as usize,
        });
        self.draw_outline(&outlined.outline, outlined.centre, 1.0, &mut canvas);
        canvas
    }

    fn draw_outline<R: Real>(&self, outline: &Outline, centre: DVec2, light: R, canvas: &mut Canvas<R>) {
        for &(place, part) in &self.spread.points {
            let light = light * R::from_f64(part);
            canvas.add_outline(outline, &self.blur, centre + place, light);
        }
    }
}
