//! A scene's frames in turn, each read as soon as it is drawn.

use link::panel::{LEDS, PanelFrame};
use reception::still::{LIKELIHOOD_PIXELS, PANEL_PIXELS};
use rx_pipeline::cells::CellMap;
use rx_pipeline::detect::Detector;
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::MaximumLikelihood;
use serde::Serialize;
use serde_json::Value;
use sim::accuracy::Level;
use sim::camera::clock::Moment;
use sim::plan::Plan;
use sim::renderer::canvas::Region;
use sim::renderer::{LinearImage, PanelExposure, Renderer};
use sim::road::camera_of;
use sim::scene::Scene;

use crate::fault::Fault;
use crate::scene_text::Settings;

/// The readings of a frame.
#[derive(Clone, Debug)]
pub struct FrameReadings {
    /// The bits of the panel in the middle of the exposure.
    pub sent: PanelFrame,
    /// The bits that k-means reads; all Off if it reads none.
    pub kmeans: PanelFrame,
    /// The bits that maximum likelihood reads.
    pub likeliest: PanelFrame,
    /// Whether k-means and maximum likelihood could read the frame.
    pub is_read: [bool; 2],
    /// The confidence of maximum likelihood.
    pub confidence: f32,
    /// Whether the exposure seems to show two symbols.
    pub is_mixed: bool,
    /// AGR of each LED.
    pub agr: [f32; LEDS],
    /// GRI of each LED, in grey levels.
    pub gri: [f32; LEDS],
    /// The decision boundary of k-means in the plane of (AGR, GRI): x·AGR + y·GRI = d.
    pub border: [f32; 3],
    /// Why the frame cannot be read, if it cannot.
    pub why: String,
}

impl FrameReadings {
    /// The readings before the first frame.
    pub const NOTHING: Self = Self {
        sent: PanelFrame::from_bits(0),
        kmeans: PanelFrame::from_bits(0),
        likeliest: PanelFrame::from_bits(0),
        is_read: [false; 2],
        confidence: 0.5,
        is_mixed: false,
        agr: [0.0; LEDS],
        gri: [0.0; LEDS],
        border: [0.0; 3],
        why: String::new(),
    };
}

/// The open scene.
pub struct Explore {
    pub(crate) renderer: Renderer,
    pub(crate) seed: u64,
    pub(crate) region: Region,
    image: LinearImage,
    shown: Vec<PanelExposure>,
    /// The camera's grey levels in the region.
    pub(crate) grey: Vec<u8>,
    map: Box<CellMap<PANEL_PIXELS>>,
    likelihood: Box<MaximumLikelihood<LIKELIHOOD_PIXELS>>,
    pub(crate) sight: FrameReadings,
}

/// A scene's properties, sent to the page once.
#[derive(Serialize)]
struct SceneReport<'a> {
    region: Place,
    sensor: Place,
    corners_px: [[f64; 2]; 4],
    pitch_px: f64,
    #[serde(flatten)]
    settings: Settings,
    plan: &'a Plan,
    left_out_grey: f64,
    error_bound_grey: f64,
    values: &'a Scene,
    toml: String,
}

/// A part of the sensor.
#[derive(Serialize)]
pub struct Place {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

impl From<Region> for Place {
    fn from(region: Region) -> Self {
        Self {
            x: region.x,
            y: region.y,
            width: region.width,
            height: region.height,
        }
    }
}

impl Explore {
    /// Opens a scene.
    pub fn new(scene: &Scene, level: Level, seed: u64) -> Result<Self, Fault> {
        let renderer = Renderer::new(scene, level)?;
        let region = renderer.surroundings(0);
        Ok(Self {
            shown: renderer.shown(seed, 0, None),
            grey: vec![0; region.width * region.height],
            map: Box::new(CellMap::empty()),
            likelihood: Box::new(MaximumLikelihood::new(camera_of(scene))),
            sight: FrameReadings::NOTHING,
            image: renderer.linear_image(region),
            renderer,
            seed,
            region,
        })
    }

    /// The description of the open scene.
    pub fn opened(&self) -> Result<Value, Fault> {
        let view = self.renderer.view();
        let corners_px = self.renderer.corner_leds_in(self.region, &self.renderer.moment(self.seed, 0));
        let [[left, top], [right, bottom], ..] = corners_px;
        Ok(serde_json::to_value(SceneReport {
            region: self.region.into(),
            sensor: self.renderer.sensor().into(),
            corners_px,
            pitch_px: (right - left).hypot(bottom - top) / 7.0,
            settings: Settings::of(view)?,
            plan: self.renderer.plan(),
            left_out_grey: self.renderer.plan().left_out_grey(),
            error_bound_grey: self.renderer.level().error_bound_grey(),
            values: &view.scene,
            toml: toml::to_string(&view.scene)?,
        })?)
    }

    /// Draws frame `frame` of the scene, as `vocc render --crop` does, and reads it.
    pub fn frame(&mut self, frame: u64) {
        self.draw(frame);
        let moment = self.renderer.moment(self.seed, frame);
        // The reason of the frame before is cleared; its memory is reused.
        let mut why = std::mem::take(&mut self.sight.why);
        why.clear();
        self.sight = FrameReadings {
            sent: self.renderer.seen(0, &moment, &self.shown[0]),
            why,
            ..FrameReadings::NOTHING
        };
        if let Err(why) = self.read(&moment)
            && !self.sight.why.contains(&why)
        {
            let apart = if self.sight.why.is_empty() { "" } else { "; " };
            self.sight.why += apart;
            self.sight.why += &why;
        }
    }

    fn draw(&mut self, frame: u64) {
        let (renderer, seed) = (&self.renderer, self.seed);
        renderer.show(seed, frame, None, &mut self.shown);
        renderer.draw_frame(seed, frame, &self.shown, &mut self.image);
        renderer.read_frame(seed, frame, &self.image, &mut self.grey);
    }

    fn read(&mut self, moment: &Moment) -> Result<(), String> {
        let why = |fault: &dyn std::error::Error| fault.to_string();
        let Region { width, height, .. } = self.region;
        let corners = &self.renderer.corners_in(self.region, moment).map_err(|fault| why(&fault))?;
        let picture = Frame::new(&self.grey, width, height).map_err(|fault| why(&fault))?;
        let sight = &mut self.sight;
        match self.likelihood.detect(&picture, corners) {
            Ok(detection) => {
                sight.is_read[1] = true;
                sight.likeliest = detection.bits;
                sight.confidence = detection.confidence;
                sight.is_mixed = detection.mixed.is_some();
            }
            Err(fault) => sight.why = fault.to_string(),
        }
        self.map.build(corners, width, height).map_err(|fault| why(&fault))?;
        let features = Features::measure(&picture, &self.map).map_err(|fault| why(&fault))?;
        (sight.agr, sight.gri) = (features.agr, features.gri);
        sight.kmeans = Detector::KMeans.decide(&features).map_err(|fault| why(&fault))?;
        sight.is_read[0] = true;
        sight.border = border(&features, sight.kmeans);
        Ok(())
    }
}

/// The line between the two clusters of k-means: points at equal distances from both centres, with each feature relative to its standard
/// deviation.
fn border(features: &Features, bits: PanelFrame) -> [f32; 3] {
    let axis = |feature: &[f32; LEDS]| {
        let mean = feature.iter().sum::<f32>() / LEDS as f32;
        let variance = feature.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / LEDS as f32;
        let deviation = if variance > 0.0 { variance.sqrt() } else { 1.0 };
        let centre = |of: PanelFrame| {
            let members = (0..LEDS).filter(|&led| of.led(led));
            members.map(|led| feature[led]).sum::<f32>() / of.bits().count_ones() as f32 / deviation
        };
        (deviation, centre(bits), centre(PanelFrame::from_bits(!bits.bits())))
    };
    let (agr, gri) = (axis(&features.agr), axis(&features.gri));
    let along = |(deviation, on, off): (f32, f32, f32)| (on - off) / deviation;
    let middle = |(_, on, off): (f32, f32, f32)| (on * on - off * off) / 2.0;
    [along(agr), along(gri), middle(agr) + middle(gri)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn explore(set: &[&str]) -> Explore {
        let set: Vec<String> = set.iter().map(ToString::to_string).collect();
        Explore::new(&Scene::load("day", &set).unwrap(), Level::Fast, 1).unwrap()
    }

    #[test]
    fn the_border_parts_what_k_means_parts() {
        let mut explore = explore(&["pose.distance_m=40"]);
        for frame in 0..20 {
            explore.frame(frame);
            let sight = &explore.sight;
            assert!(sight.is_read[0]);
            let [x, y, d] = sight.border;
            for led in 0..LEDS {
                let is_on = x * sight.agr[led] + y * sight.gri[led] > d;
                assert_eq!(is_on, sight.kmeans.led(led), "frame {frame}, LED {led}");
            }
        }
    }

    #[test]
    fn near_and_far_panels_are_read_or_say_why_not() {
        for metres in [2.0, 3.0, 10.0, 70.0, 140.0] {
            let mut explore = explore(&[&format!("pose.distance_m={metres}")]);
            explore.frame(0);
            let FrameReadings { is_read, why, .. } = &explore.sight;
            assert!(*is_read == [true; 2] || !why.is_empty(), "{metres} m");
        }
    }
}
