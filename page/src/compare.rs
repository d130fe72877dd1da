//! The cost of accuracy: one frame of a scene drawn by four methods, each compared with the reference.

use std::time::Duration;

use serde::Serialize;
use serde_json::{Value, json};
use sim::accuracy::Level;
use sim::cost;
use sim::renderer::canvas::Region;
use sim::renderer::{PanelExposure, Renderer};
use sim::timing::{Work, by_turns};
use studies::baselines::{Panel, straightforward};

use crate::explore::{Explore, Place};
use crate::fault::Fault;

/// The naive renderer.
const STRAIGHTFORWARD: &str = "straightforward";
/// All methods, the reference last.
const WAYS: [(&str, Option<Level>); 4] = [
    ("fast", Some(Level::Fast)),
    ("fine", Some(Level::Fine)),
    (STRAIGHTFORWARD, None),
    ("reference", Some(Level::Reference)),
];
/// Maximum time for timing each method, divided into turns.
const BUDGET: Duration = Duration::from_millis(250);
const TURNS: usize = 5;
/// Time for the cost of each effect: a browser's clock has steps of 0.1 ms and more.
const COST_BUDGET: Duration = Duration::from_millis(60);
/// Maximum rotation of a panel that counts as parallel to the picture, in degrees.
const PARALLEL_DEG: f64 = 1e-6;

/// The result of one method.
#[derive(Serialize)]
struct Row {
    level: &'static str,
    /// Milliseconds for a frame, drawn and read out; none if the method cannot draw the scene.
    ms: Option<f64>,
    /// Maximum difference from the reference, before rounding.
    error_max_grey: Option<f64>,
    error_rms_grey: Option<f64>,
    why: Option<&'static str>,
}

/// The errors and times of all methods for one frame. `out` gets the differences of the method `show` from the reference.
pub fn compare(explore: &Explore, frame: u64, show: &str, out: &mut Vec<u8>) -> Result<Value, Fault> {
    let scene = &explore.renderer.view().scene;
    let reference = Renderer::new(scene, Level::Reference)?;
    let seen = Frame {
        reference: &reference,
        region: explore.region,
        seed: explore.seed,
        number: frame,
        shown: reference.shown(explore.seed, frame, None),
    };
    let exact = seen.rendered(&reference);
    out.clear();
    let mut rows = Vec::new();
    for (level, how) in WAYS {
        let way = match how {
            Some(level) => Way::Rendered(Box::new(Renderer::new(scene, level)?)),
            None => Way::Straightforward,
        };
        if how.is_none() && !seen.is_parallel() {
            rows.push(Row {
                level,
                ms: None,
                error_max_grey: None,
                error_rms_grey: None,
                why: Some("it draws panels that face the camera, and no others"),
            });
            continue;
        }
        let drawn = seen.greys(&way);
        let errors: Vec<f64> = drawn.iter().zip(&exact).map(|(a, b)| a - b).collect();
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        rows.push(Row {
            level,
            ms: Some(seen.ms(&way)),
            error_max_grey: Some(errors.iter().fold(0.0, |most, error| f64::max(most, error.abs()))),
            error_rms_grey: Some((squares / errors.len() as f64).sqrt()),
            why: None,
        });
        if level == show {
            out.extend(errors.iter().flat_map(|&error| (error as f32).to_le_bytes()));
        }
    }
    let shown = WAYS.iter().find(|(level, _)| *level == show);
    Ok(json!({ "rows": rows, "show": shown.map(|(level, _)| level), "difference": Place::from(explore.region) }))
}

/// The cost of each effect on this computer.
pub fn costs(explore: &Explore) -> Value {
    let costs = cost::measure(&explore.renderer, COST_BUDGET, crate::clock);
    let costs = costs
        .iter()
        .map(|cost| json!({ "effect": cost.effect, "frames": cost.frames, "us": cost.ns / 1000.0 }));
    json!({ "costs": costs.collect::<Vec<_>>() })
}

enum Way {
    Rendered(Box<Renderer>),
    Straightforward,
}

/// A frame that is drawn repeatedly.
struct Frame<'a> {
    reference: &'a Renderer,
    region: Region,
    seed: u64,
    number: u64,
    shown: Vec<PanelExposure>,
}

impl Frame<'_> {
    /// Whether the first panel faces the camera.
    fn is_parallel(&self) -> bool {
        let pose = &self.reference.view().panels[0].pose;
        [pose.roll_deg, pose.yaw_deg, pose.pitch_deg]
            .iter()
            .all(|turn| turn.abs() < PARALLEL_DEG)
    }

    /// A renderer's unrounded grey levels.
    fn rendered(&self, renderer: &Renderer) -> Vec<f64> {
        let mut image = renderer.linear_image(self.region);
        renderer.draw_frame(self.seed, self.number, &self.shown, &mut image);
        self.encoded(image.values().into_iter())
    }

    fn encoded(&self, linear: impl Iterator<Item = f64>) -> Vec<f64> {
        let curve = self.reference.curve();
        linear.map(|linear| curve.unrounded(linear)).collect()
    }

    fn greys(&self, way: &Way) -> Vec<f64> {
        match way {
            Way::Rendered(renderer) => self.rendered(renderer),
            Way::Straightforward => {
                let Region { width, height, .. } = self.region;
                let background = self.background();
                let square = straightforward::linear(&self.panel(), self.sigma_px(), self.side());
                let rows = square.chunks_exact(self.side()).take(height);
                self.encoded(rows.flat_map(|row| row[..width].iter().map(|&x| x * background)))
            }
        }
    }

    /// The time of one frame.
    fn ms(&self, way: &Way) -> f64 {
        let mut grey = vec![0; self.region.width * self.region.height];
        let work: Work = match way {
            Way::Rendered(renderer) => {
                let mut image = renderer.linear_image(self.region);
                Box::new(move || {
                    renderer.draw_frame(self.seed, self.number, &self.shown, &mut image);
                    renderer.read_frame(self.seed, self.number, &image, &mut grey);
                })
            }
            Way::Straightforward => {
                let (panel, gamma) = (self.panel(), self.reference.view().scene.camera.gamma);
                let (sigma_px, side) = (self.sigma_px(), self.side());
                Box::new(move || {
                    std::hint::black_box(straightforward::render(&panel, sigma_px, gamma, side));
                })
            }
        };
        let ns = by_turns(&mut [work], TURNS, BUDGET, crate::clock);
        ns[0].iter().copied().fold(f64::INFINITY, f64::min) * 1e-6
    }

    /// The panel in units of a raster: light relative to the background's.
    fn panel(&self) -> Panel {
        let corners = self.reference.corner_leds_px(0);
        let pitch_px = (corners[1][0] - corners[0][0]) / 7.0;
        let view = self.reference.view();
        let panel = &view.panels[0];
        let light = self.shown[0].light;
        Panel {
            bits: self.shown[0].symbols[0].bits(),
            first_px: self
                .reference
                .corner_leds_in(self.region, &self.reference.moment(self.seed, self.number))[0],
            pitch_px,
            radius_px: pitch_px / (1.0 + panel.panel.interval) / 2.0,
            off: light.off / self.background(),
            on: light.on / self.background(),
        }
    }

    fn background(&self) -> f64 {
        self.reference.view().exposure.background
    }

    fn sigma_px(&self) -> f64 {
        self.reference.view().scene.camera.blur_sigma_px
    }

    /// The side of a square that contains the region.
    fn side(&self) -> usize {
        self.region.width.max(self.region.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::scene::Scene;

    fn rows(set: &[&str]) -> (Vec<Value>, Vec<u8>) {
        let set: Vec<String> = set.iter().map(ToString::to_string).collect();
        let scene = Scene::load("paper", &set).unwrap();
        let explore = Explore::new(&scene, Level::Fast, 1).unwrap();
        let mut out = Vec::new();
        let answer = compare(&explore, 0, "fast", &mut out).unwrap();
        (answer["rows"].as_array().unwrap().clone(), out)
    }

    #[test]
    fn each_level_keeps_its_bound_and_the_straightforward_one_is_near() {
        let (rows, difference) = rows(&[]);
        let errors: Vec<f64> = rows.iter().map(|row| row["error_max_grey"].as_f64().unwrap()).collect();
        let [fast, fine, straightforward, reference] = errors[..] else {
            panic!("{rows:?}")
        };
        assert!(fast <= 0.25 && fine <= 0.01 && reference == 0.0, "{rows:?}");
        assert!(straightforward > fine && straightforward < 30.0, "{rows:?}");
        let (values, _) = difference.as_chunks::<4>();
        let most = values.iter().fold(0.0f32, |most, &value| most.max(f32::from_le_bytes(value).abs()));
        assert!((f64::from(most) - fast).abs() < 1e-6);
    }

    #[test]
    fn a_turned_panel_is_beyond_the_straightforward_one() {
        let (rows, _) = rows(&["pose.yaw_deg=20"]);
        assert!(rows[2]["ms"].is_null() && rows[2]["why"].is_string());
        assert!(rows[0]["ms"].as_f64().unwrap() > 0.0);
    }
}
