//! The positions of panels during one exposure: the same in all frames, or, if the camera vibrates, different in each.

use glam::{DMat3, DVec2};
use link::panel::{LEDS, SIDE};

use super::Renderer;
use super::board::{Board, board_corners};
use super::canvas::Region;
use super::layout::{Imaging, Layout};
use crate::accuracy::Accuracy;
use crate::camera::clock::Moment;
use crate::camera::shake::Vibration;
use crate::effects::moments;
use crate::view::for_each_meeting;

/// Time steps per period of the highest frequency: chords of the way are shorter than the way by less than 1 %.
const STEPS_PER_PERIOD: f64 = 16.0;

/// The camera's vibration about the middle of an exposure.
#[derive(Clone, Copy, Debug)]
pub struct ExposureVibration {
    vibration: Vibration,
    middle_s: f64,
}

impl ExposureVibration {
    /// The rotation of the world as the camera sees it, `after_s` seconds after the middle of the exposure.
    pub(super) fn turn(&self, after_s: f64) -> DMat3 {
        self.vibration.turn(self.middle_s + after_s)
    }
}

/// The content of an exposure, with positions.
#[derive(Default)]
pub(super) struct DrawList {
    /// The camera's vibration; `None`: it is still.
    pub(super) shaken: Option<ExposureVibration>,
    /// The moments to average: (time from the exposure's middle in seconds, weight).
    pub(super) moments: Vec<(f64, f64)>,
    /// For each drawn panel: its layouts over the exposure with their weights.
    pub(super) layouts: Vec<Vec<(f64, Layout)>>,
    /// For each drawn panel: its board over the exposure with weights; empty without a board.
    pub(super) boards: Vec<Vec<(f64, Board)>>,
    /// For each drawn panel: the part of the sensor that it lights.
    pub(super) surroundings: Vec<Region>,
    /// For each drawn panel: whether all light behind its LEDs has one linear value.
    pub(super) on_even_ground: Vec<bool>,
}

impl Renderer {
    /// The camera's vibration at a moment, if it is simulated.
    pub(super) fn shaken(&self, moment: &Moment) -> Option<ExposureVibration> {
        let shake = self.formation.shake.as_ref()?;
        Some(ExposureVibration {
            vibration: shake.of_run(moment.seed),
            middle_s: moment.middle_s(),
        })
    }

    /// The inputs of panel `index`'s image `after_s` seconds after the middle of an exposure.
    pub(super) fn imaging<'a>(&'a self, index: usize, shaken: Option<&'a ExposureVibration>, after_s: f64) -> Imaging<'a> {
        Imaging {
            camera: &self.view.scene.camera,
            panel: &self.view.panels[index],
            formation: &self.formation,
            shaken,
            after_s,
        }
    }

    /// All positions in an exposure with that vibration of the camera, or with a still camera.
    pub(super) fn placed(&self, shaken: Option<ExposureVibration>) -> DrawList {
        let moments = match &shaken {
            Some(shaken) => self.moments(shaken),
            None => self.formation.motion_samples.clone(),
        };
        // The table of an image pays off over many frames only.
        let phases = if shaken.is_some() { 0 } else { self.accuracy.phases };
        let accuracy = Accuracy { phases, ..self.accuracy };
        let vibration = shaken.as_ref();
        let images = |index| {
            let moments = moments.iter();
            moments.map(move |&(after_s, weight)| (weight, self.imaging(index, vibration, after_s)))
        };
        let panels = 0..self.far_to_near.len();
        let layouts = panels.clone().map(|index| {
            let layout = |(weight, imaging)| (weight, Layout::new(&imaging, &accuracy, &self.spread));
            images(index).map(layout).collect()
        });
        let boards = panels.zip(&self.formation.boards).map(|(index, board)| {
            let images = images(index).filter(|_| board.is_some());
            images.map(|(weight, imaging)| (weight, Board::new(&imaging, &accuracy))).collect()
        });
        let mut placed = DrawList {
            layouts: layouts.collect(),
            boards: boards.collect(),
            surroundings: Vec::new(),
            on_even_ground: Vec::new(),
            shaken,
            moments,
        };
        let surroundings = |index| self.around(&placed, index, self.margin_px);
        placed.surroundings = (0..self.far_to_near.len()).map(surroundings).collect();
        placed.on_even_ground = self.even_grounds(&placed);
        placed
    }

    /// The moments of an exposure: one for each quarter pixel of the longest way of a corner LED, by its own motion and the camera's.
    pub(super) fn moments(&self, shaken: &ExposureVibration) -> Vec<(f64, f64)> {
        let exposure_s = self.view.exposure.time_s;
        let highest_hz = self.formation.shake.map_or(0.0, |shake| shake.highest_hz());
        let steps = (highest_hz * exposure_s * STEPS_PER_PERIOD).ceil().max(1.0);
        let corners = [0, SIDE - 1, LEDS - SIDE, LEDS - 1];
        let ways = (0..self.far_to_near.len()).flat_map(|index| {
            corners.map(|led| {
                let at = self.view.panels[index].projection.led_m((led / SIDE) as f64, (led % SIDE) as f64);
                let place = |step: u32| {
                    let after_s = (f64::from(step) / steps - 0.5) * exposure_s;
                    self.imaging(index, Some(shaken), after_s).place(at)
                };
                (0..steps as u32).map(|step| (place(step + 1) - place(step)).length()).sum()
            })
        });
        // Independent of whether the panels' own motion is drawn, so that this changes nothing else.
        let own = crate::effects::way_px(&self.view);
        moments(own + ways.fold(0.0, f64::max), exposure_s)
    }

    /// The part of the sensor that a panel lights in an exposure, with a margin.
    pub(super) fn around(&self, placed: &DrawList, index: usize, margin_px: f64) -> Region {
        let moments = placed.moments.iter();
        let corners = moments.flat_map(|&(after_s, _)| board_corners(&self.imaging(index, placed.shaken.as_ref(), after_s)));
        let centres = placed
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

    /// The greatest shift of panel `index` by the camera's vibration.
    pub(super) fn shake_px(&self, index: usize) -> f64 {
        let panel = &self.view.panels[index];
        let reach = self.formation.shake.map(|shake| panel.reach_of(&shake, &self.view.scene.camera));
        reach.map_or(0.0, |reach| reach.shift_px + reach.stretch * panel.radius_px())
    }

    /// For each drawn panel, whether all light behind its LEDs has one value: its board, or a plain background without a farther panel.
    fn even_grounds(&self, placed: &DrawList) -> Vec<bool> {
        let mut even = vec![self.photograph().is_none(); placed.surroundings.len()];
        let mut turn = vec![0; even.len()];
        for (place, &index) in self.far_to_near.iter().enumerate() {
            turn[index] = place;
        }
        let boxes: Vec<_> = placed.surroundings.iter().map(|part| part.corners()).collect();
        for_each_meeting(&boxes, |a, b| {
            even[if turn[a] > turn[b] { a } else { b }] = false;
        });
        let boards = placed.boards.iter();
        boards.zip(even).map(|(board, even)| even || !board.is_empty()).collect()
    }
}
