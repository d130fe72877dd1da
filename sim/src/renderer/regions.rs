//! The positions of panels on the sensor, and the parts of it that they light.

use glam::DVec2;
use link::panel::SIDE;
use rx_pipeline::corners::{Corners, CornersError};

use super::Renderer;
use super::canvas::Region;
use super::placed::DrawList;
use super::polyphase;
use crate::camera::clock::Moment;

/// Rows and columns of the corner LEDs.
const CORNERS: [(usize, usize); 4] = [(0, 0), (0, SIDE - 1), (SIDE - 1, SIDE - 1), (SIDE - 1, 0)];

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

    /// The part of the sensor that panel `index` lights in any frame, with a margin for a shift of less than one pixel, and for the reach
    /// of the camera's processing of encoded levels.
    pub fn surroundings(&self, index: usize) -> Region {
        self.around(&self.still, index, self.margin_px + self.shake_px(index))
    }

    /// The part of the sensor that drawing panel `index`, moved by `shift`, can change.
    pub(super) fn touched(&self, placed: &DrawList, index: usize, shift: DVec2) -> Region {
        placed.surroundings[index].widened(shift.abs().max_element().ceil() as usize + polyphase::LANES)
    }

    /// The part of the sensor covered by the cells of panel `index`, with a rim of one pixel for their gradient and a margin for a shift of
    /// less than one pixel.
    pub fn cells_region(&self, index: usize) -> Region {
        self.around(&self.still, index, self.shake_px(index))
    }

    /// The part of the sensor that panels light, with all their surroundings: the whole of it if a photograph behind them moves.
    pub fn lit_region(&self) -> Region {
        if self.formation.shake.is_some() && self.photograph().is_some() {
            return self.sensor();
        }
        let regions = (0..self.far_to_near.len()).map(|index| self.surroundings(index));
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

    /// Pixel positions of a panel's corner LEDs as drawn by a still camera: top left, top right, bottom right, bottom left.
    pub fn corner_leds_px(&self, index: usize) -> [[f64; 2]; 4] {
        let panel = &self.view.panels[index];
        let drawn = self.still.layouts.get(index).and_then(|layouts| layouts.first());
        CORNERS.map(|(row, column)| {
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

    /// The first panel's corner LEDs at a moment, in pixels of a region; under vibration, the middle of their paths.
    pub fn corner_leds_in(&self, region: Region, moment: &Moment) -> [[f64; 2]; 4] {
        let corners = match self.shaken(moment) {
            None => self.corner_leds_px(0),
            Some(shaken) => {
                let moments = self.moments(&shaken);
                let images = moments.iter().map(|&(after_s, weight)| {
                    let ellipses = self.imaging(0, Some(&shaken), after_s).ellipses();
                    CORNERS.map(|(row, column)| ellipses[SIDE * row + column].centre * weight)
                });
                let sum = images.reduce(|a, b| std::array::from_fn(|corner| a[corner] + b[corner]));
                sum.unwrap_or_default().map(Into::into)
            }
        };
        corners.map(|[x, y]| [x - region.x as f64, y - region.y as f64])
    }

    /// As [`corner_leds_in`](Self::corner_leds_in), as corners in single precision.
    ///
    /// # Errors
    /// If they are not the corners of a panel.
    pub fn corners_in(&self, region: Region, moment: &Moment) -> Result<Corners, CornersError> {
        Corners::new(self.corner_leds_in(region, moment).map(|corner| corner.map(|place| place as f32)))
    }

    /// The shift of the first panel in the image by the camera's vibration at a moment, in px.
    pub fn shaken_px(&self, moment: &Moment) -> [f64; 2] {
        if !self.shakes() {
            return [0.0; 2];
        }
        let (still, moved) = (self.corner_leds_px(0), self.corner_leds_in(self.sensor(), moment));
        let mean = |axis: usize| {
            moved
                .iter()
                .zip(&still)
                .map(|(moved, still)| moved[axis] - still[axis])
                .sum::<f64>()
                / 4.0
        };
        [mean(0), mean(1)]
    }

    /// Whether the positions of panels differ from frame to frame.
    pub fn shakes(&self) -> bool {
        self.formation.shake.is_some()
    }
}
