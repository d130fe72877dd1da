//! Where on the sensor panels are, and the parts of it that they light.

use glam::DVec2;
use link::panel::{LEDS, SIDE};
use rx_pipeline::corners::{Corners, CornersError};

use super::Renderer;
use super::board::board_corners;
use super::canvas::Region;
use super::polyphase;

impl Renderer {
    /// The whole sensor.
    pub fn sensor(&self) -> Region {
        Region {
            x: 0,
            y: 0,
            width: self.view.scene.camera.width_px,
            height: self.view.scene.camera.height_px,
        }
    }

    /// The part of the sensor that panel `index` lights, with room for a shift of less than one pixel, and for what the
    /// camera does to encoded levels around.
    pub fn surroundings(&self, index: usize) -> Region {
        let drawn = self.surroundings.get(index).copied();
        drawn.unwrap_or_else(|| self.around(index, self.margin_px))
    }

    /// The part of the sensor outside which drawing panel `index`, moved by `shift`, changes nothing.
    pub(super) fn touched(&self, index: usize, shift: DVec2) -> Region {
        self.surroundings(index)
            .widened(shift.abs().max_element().ceil() as usize + polyphase::LANES)
    }

    /// The part of the sensor that the cells of panel `index` cover, with a rim of one pixel for their gradient and room for a shift of
    /// less than one pixel.
    pub fn cells_region(&self, index: usize) -> Region {
        self.around(index, 0.0)
    }

    pub(super) fn around(&self, index: usize, margin_px: f64) -> Region {
        let panel = &self.view.panels[index];
        let camera = &self.view.scene.camera;
        let samples = self.formation.motion_samples.iter();
        let corners = samples.flat_map(|&(after_s, _)| board_corners(camera, panel, &self.formation, after_s));
        let centres = self
            .layouts
            .get(index)
            .into_iter()
            .flatten()
            .flat_map(|(_, layout)| (0..LEDS).map(|led| layout.centre(led)));
        let (low, high) = corners
            .chain(centres)
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let stages = || self.formation.grey_stages.iter();
        let margin_px = margin_px + stages().map(|stage| stage.reach_px()).sum::<usize>() as f64;
        let block = stages().map(|stage| stage.block_px()).max().unwrap_or(1);
        let (low, high) = (low - margin_px - 2.0, high + margin_px + 3.0);
        let sensor = self.sensor();
        let clip = |value: f64, end: usize| value.clamp(0.0, end as f64) as usize;
        let (x, y) = (clip(low.x.floor(), sensor.width), clip(low.y.floor(), sensor.height));
        let (x, y) = (x - x % block, y - y % block);
        let end = |high: f64, end: usize| clip(high.ceil(), end).next_multiple_of(block).min(end);
        Region {
            x,
            y,
            width: end(high.x, sensor.width) - x,
            height: end(high.y, sensor.height) - y,
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

    /// Those of the first panel, in pixels of a region.
    pub fn corner_leds_in(&self, region: Region) -> [[f64; 2]; 4] {
        self.corner_leds_px(0).map(|[x, y]| [x - region.x as f64, y - region.y as f64])
    }

    /// The same in single precision.
    ///
    /// # Errors
    /// When they make no panel.
    pub fn corners_in(&self, region: Region) -> Result<Corners, CornersError> {
        Corners::new(self.corner_leds_in(region).map(|corner| corner.map(|place| place as f32)))
    }
}
