//! An outline at its place on the sensor, drawn pixel by pixel.

use std::sync::OnceLock;

use glam::DVec2;

use super::Renderer;
use super::canvas::{Canvas, Region};
use crate::accuracy::Level;
use crate::disc::kernel::Real;
use crate::disc::outline::Outline;

/// What [`Chords`](crate::disc::chords::Chords) are too many for: something far larger than its blur.
#[derive(Clone, Debug)]
pub struct Outlined {
    /// Its boundary.
    pub outline: Outline,
    /// Its centre, in px of the sensor.
    pub centre: DVec2,
    /// Its light where nothing shifts it, kept for the next frames: to draw it takes as long as many frames.
    still: OnceLock<Canvas<f32>>,
}

impl Outlined {
    /// `outline` about `centre`.
    pub fn new(outline: Outline, centre: DVec2) -> Self {
        Self {
            outline,
            centre,
            still: OnceLock::new(),
        }
    }
}

/// Of more panels than these, what is still is not kept: where they overlap, each may be as large as the sensor.
const MOST_STILL: usize = 256;

impl Renderer {
    /// Adds what is outlined with its linear `light`, moved by `shift`, under the blur and its spread.
    pub(super) fn add_outlined<R: Real>(&self, outlined: &Outlined, shift: DVec2, light: R, canvas: &mut Canvas<R>) {
        let is_kept = self.layouts.len() <= MOST_STILL && self.level != Level::Reference;
        if shift == DVec2::ZERO && is_kept {
            let still = outlined.still.get_or_init(|| self.still(outlined));
            canvas.add(still, light);
        } else {
            self.draw_outline(&outlined.outline, outlined.centre + shift, light, canvas);
        }
    }

    fn still(&self, outlined: &Outlined) -> Canvas<f32> {
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

    /// Draws an outline at each point of the spread.
    fn draw_outline<R: Real>(&self, outline: &Outline, centre: DVec2, light: R, canvas: &mut Canvas<R>) {
        for &(place, part) in &self.spread.points {
            let light = light * R::from_f64(part);
            canvas.add_outline(outline, &self.blur, centre + place, light);
        }
    }
}
