//! Grey levels of a rendered panel: the project's levels and their parameters, and raster renderers.

use std::hint::black_box;

use glam::DVec2;
use link::panel::PanelFrame;
use rand::Rng;

use super::Measurement;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{range, rounded, variant};
use super::point::Point;
use super::scale::Scale;
use super::steps::Steps;
use super::timing::{Candidate, time_by_turns};
use crate::baselines::supersampled;
use crate::baselines::{Panel, straightforward};
use sim::accuracy::{Accuracy, Level};
use sim::random::{Purpose, stream, uniform};
use sim::renderer::canvas::{Canvas, Region};
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::Scene;
use sim::view::View;

/// Distance in m and interval: far and near, LEDs close together and far apart.
const SCENES: [(f64, f64); 4] = [(30.0, 0.5), (30.0, 2.0), (70.0, 0.5), (70.0, 2.0)];
/// Frames whose pixels are compared.
const FRAMES: usize = 6;
/// Bounds for all parameters at once, in grey levels, as `fine` and `fast` do with theirs.
const BOUNDS: [f64; 7] = [0.001, 0.003, 0.03, 0.1, 0.5, 1.0, 3.0];
/// Values of one parameter, with the others those of `fine`.
const TOLERANCES: [f64; 6] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
const PHASES: [usize; 6] = [2, 4, 16, 64, 256, 1024];
/// The curves of varied parameters.
const KNOBS: [&str; 4] = ["bound", "quadrature", "truncation", "phases"];
/// Tolerances of drawing in f64.
const EXACT: [f64; 4] = [1e-3, 1e-5, 1e-7, 1e-9];
/// Cells along a pixel's side.
const FINER: [usize; 5] = [1, 2, 4, 8, 16];
const FINEST: &str = "supersampled 16×";

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let (mut diagrams, mut reference_times) = (Vec::new(), Vec::new());
    for (distance_m, interval) in SCENES {
        let name = format!("{distance_m} m, interval {interval}");
        let (side, points, reference_time) = steps.take(&name, |_| {
            let scene = TestScene::new(distance_m, interval, scale)?;
            let (points, reference_time) = scene.measure(scale);
            Ok((scene.side(), points, reference_time))
        })?;
        reference_times.push(reference_time);
        let diagram = |what: &str, wanted: fn(&&Point) -> bool| {
            let points = points.iter().filter(wanted).cloned().collect();
            let title = format!("{what}: {name} ({side} × {side} px)");
            Diagram::of(title, ["error of a pixel", "grey levels"], "one frame", points)
        };
        diagrams.push(diagram("all variants", |point| !has_a_knob(point)));
        diagrams.push(diagram("knobs", |point| has_a_knob(point) || is_a_level(point)));
    }
    Ok(Measurement {
        method: "Dots are the greatest error of a pixel before rounding, ticks the root mean square; the paper's camera, L2A 2. *bound* \
                 sets all parameters for a bound in grey levels; *quadrature*, *truncation* and *phases* vary one and keep the others at \
                 `fine`. *f64* has no tables. *supersampled* averages a finer raster, *straightforward* blurs whole pixels."
            .into(),
        reference: format!(
            "Level `reference`: {} times as long as `fast`, exact to 1e-9 of an LED's light.",
            range(reference_times)
        ),
        diagrams,
    })
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let levels = [Level::Fast, Level::Fine].map(Level::error_bound_grey);
    let mut kept = [vec![], vec![]];
    let (mut exacter, mut longer, mut saved) = (vec![], vec![], 0.0f64);
    let (mut raster_times, mut raster_errors) = (vec![], vec![]);
    for diagram in diagrams {
        let [fast, fine, exact] = ["fast", "fine", "bound 0.001"].map(|name| variant(diagram, name));
        for ((kept, level), bound) in kept.iter_mut().zip([fast, fine]).zip(levels) {
            kept.extend(level.map(|level| bound / level.error));
        }
        if let (Some(fast), Some(exact)) = (fast, exact) {
            exacter.push(fast.error / exact.error);
            longer.push(exact.ratio.median);
        }
        for point in &diagram.points {
            saved = saved.max(1.0 - point.ratio.median);
            if point.curve == "supersampled" && point.variant == FINEST {
                raster_times.push(point.ratio.median);
                raster_errors.push(point.error);
            }
        }
    }
    let [fast, fine] = levels;
    let [fast_kept, fine_kept] = kept;
    format!(
        "`fast` for Monte Carlo, `fine` for pictures. They guarantee {fast} and {fine} grey levels in any scene; here their errors are \
         {} and {} times smaller. A bound of 0.001 makes the errors of `fast` {} times smaller in {} times the time; no coarser variant \
         saves more than {} %. A raster of 16 × 16 cells a pixel takes {} times as long and still errs by {} grey levels.",
        range(fast_kept),
        range(fine_kept),
        range(exacter),
        range(longer),
        rounded(100.0 * saved),
        range(raster_times),
        range(raster_errors)
    )
}

fn has_a_knob(point: &Point) -> bool {
    KNOBS.contains(&point.curve.as_str())
}

fn is_a_level(point: &Point) -> bool {
    ["fine", "fast"].contains(&point.variant.as_str())
}

/// One scene and its frames.
struct TestScene {
    scene: Scene,
    reference: Renderer,
    region: Region,
    frames: Vec<PanelExposure>,
    /// Unrounded grey levels of each frame.
    exact: Vec<Vec<f64>>,
}

impl TestScene {
    fn new(distance_m: f64, interval: f64, scale: &Scale) -> Result<Self, PrecisionError> {
        let scene = Scene::load(
            "paper",
            &[
                format!("pose.distance_m={distance_m}"),
                format!("panel.interval={interval}"),
                "atmosphere.transmission_at_70m=1".into(),
            ],
        )?;
        let reference = Renderer::new(&scene, Level::Reference)?;
        let around = reference.surroundings(0);
        let side = around.width.max(around.height);
        let region = Region {
            width: side,
            height: side,
            ..around
        };
        let mut random = stream(scale.seed, 0, Purpose::Phase);
        let frames: Vec<PanelExposure> = (0..scale.of(FRAMES, 2))
            .map(|_| PanelExposure {
                shift_px: [uniform(&mut random), uniform(&mut random)],
                ..reference.steady(0, PanelFrame::from_bits(random.next_u64()))
            })
            .collect();
        let mut drawn = Self {
            scene,
            reference,
            region,
            frames,
            exact: Vec::new(),
        };
        let truth = Way::Double(Renderer::new(&drawn.scene, Level::Reference)?);
        drawn.exact = (0..drawn.frames.len()).map(|frame| drawn.greys(&truth, frame)).collect();
        Ok(drawn)
    }

    fn side(&self) -> usize {
        self.region.width
    }

    fn gamma(&self) -> f64 {
        self.scene.camera.gamma
    }

    fn sigma_px(&self) -> f64 {
        self.scene.camera.blur_sigma_px
    }

    fn view(&self) -> View {
        self.reference.view().clone()
    }

    /// All variants with their errors and costs, and the cost of the reference relative to the baseline.
    fn measure(&self, scale: &Scale) -> (Vec<Point>, f64) {
        let variants = self.variants().into_iter().map(|(point, way)| {
            let (greatest, rms) = self.errors(&way);
            let point = Point {
                error: greatest,
                rms: Some(rms),
                ..point
            };
            Candidate::new(point, 1.0, self.work(way))
        });
        let reference = Way::Double(Renderer::of(self.view(), Level::Reference));
        let reference = Candidate::new(Point::new("reference", 0.0), 1.0, self.work(reference));
        let mut points = time_by_turns(variants.chain([reference]).collect(), scale.turns);
        let reference = points.pop().map_or(f64::NAN, |point| point.ratio.median);
        (points, reference)
    }

    fn variants(&self) -> Vec<(Point, Way)> {
        let range = self.reference.plan().range;
        let (floor, excess) = (range.floor, range.peak - range.floor);
        let curve = self.reference.curve();
        let within = |bound| Accuracy::within(bound, floor, excess, self.sigma_px(), &curve);
        let single = |accuracy| Way::Single(Renderer::with_accuracy(self.view(), Level::Fine, accuracy));
        let fine = within(Level::Fine.error_bound_grey());
        let mut variants = vec![
            (Point::new("fine", 0.0), Way::Single(Renderer::of(self.view(), Level::Fine))),
            (
                Point::new("fast", 0.0).with_default(true),
                Way::Single(Renderer::of(self.view(), Level::Fast)),
            ),
            (Point::new("straightforward", 0.0), Way::Straightforward),
        ];
        let on = |curve: &str, name: String, way| (Point::new(name, 0.0).on(curve), way);
        let turned = |knob: &str, value: f64, accuracy| on(knob, format!("{knob} {value:e}"), single(accuracy));
        variants.extend(BOUNDS.map(|bound| on("bound", format!("bound {bound}"), single(within(bound)))));
        variants.extend(TOLERANCES.map(|quadrature| turned("quadrature", quadrature, Accuracy { quadrature, ..fine })));
        variants.extend(TOLERANCES.map(|truncation| turned("truncation", truncation, Accuracy { truncation, ..fine })));
        variants.extend(PHASES.map(|phases| on("phases", format!("{phases} phases"), single(Accuracy { phases, ..fine }))));
        variants.extend(EXACT.map(|tolerance| {
            let renderer = Renderer::with_accuracy(self.view(), Level::Reference, Accuracy::even(tolerance));
            on("f64", format!("f64 {tolerance:e}"), Way::Double(renderer))
        }));
        variants.extend(FINER.map(|finer| {
            let name = match finer {
                1 => "point-sampled".into(),
                _ => format!("supersampled {finer}×"),
            };
            on("supersampled", name, Way::Supersampled(finer))
        }));
        variants
    }

    /// The greatest and the rms error over all frames.
    fn errors(&self, way: &Way) -> (f64, f64) {
        let (mut greatest, mut squares, mut count) = (0.0f64, 0.0, 0.0);
        for (frame, exact) in self.exact.iter().enumerate() {
            for (ours, exact) in self.greys(way, frame).into_iter().zip(exact) {
                let error = (ours - exact).abs();
                greatest = greatest.max(error);
                squares += error * error;
                count += 1.0;
            }
        }
        (greatest, f64::sqrt(squares / count))
    }

    /// The unrounded grey levels of a frame.
    fn greys(&self, way: &Way, frame: usize) -> Vec<f64> {
        let shown = self.frames[frame];
        let moment = self.reference.moment(1, 0);
        let linear: Vec<f64> = match way {
            Way::Single(renderer) => {
                let mut canvas = Canvas::<f32>::new(self.region);
                renderer.draw(&moment, &[shown], &mut canvas);
                canvas.values().iter().map(|&value| value.into()).collect()
            }
            Way::Double(renderer) => {
                let mut canvas = Canvas::<f64>::new(self.region);
                renderer.draw_exact(&moment, &[shown], &mut canvas);
                canvas.values().to_vec()
            }
            Way::Straightforward => straightforward::linear(&self.panel(shown), self.sigma_px(), self.side()),
            Way::Supersampled(finer) => supersampled::linear(&self.panel(shown), self.sigma_px(), self.side(), *finer),
        };
        let grey = |linear| self.reference.curve().unrounded(linear);
        linear.into_iter().map(grey).collect()
    }

    /// Draws and reads out one frame after another.
    fn work(&self, way: Way) -> Box<dyn FnMut() + '_> {
        let moment = self.reference.moment(1, 0);
        let mut grey = vec![0; self.side() * self.side()];
        let mut frames = self.frames.iter().copied().cycle();
        let mut next = move || frames.next().into_iter();
        match way {
            Way::Single(renderer) => {
                let mut canvas = Canvas::<f32>::new(self.region);
                Box::new(move || {
                    for shown in next() {
                        renderer.draw(&moment, &[shown], &mut canvas);
                        renderer.read_out(1, 0, &canvas, &mut grey);
                    }
                })
            }
            Way::Double(renderer) => {
                let mut canvas = Canvas::<f64>::new(self.region);
                Box::new(move || {
                    for shown in next() {
                        renderer.draw_exact(&moment, &[shown], &mut canvas);
                        renderer.read_out_exact(1, 0, &canvas, &mut grey);
                    }
                })
            }
            Way::Straightforward => Box::new(move || {
                for panel in next().map(|shown| self.panel(shown)) {
                    let (sigma_px, gamma) = (self.sigma_px(), self.gamma());
                    black_box(straightforward::render(&panel, sigma_px, gamma, self.side()));
                }
            }),
            Way::Supersampled(finer) => Box::new(move || {
                for panel in next().map(|shown| self.panel(shown)) {
                    let (sigma_px, gamma, side) = (self.sigma_px(), self.gamma(), self.side());
                    black_box(supersampled::render(&panel, sigma_px, gamma, side, finer));
                }
            }),
        }
    }

    /// The panel for raster renderers.
    fn panel(&self, shown: PanelExposure) -> Panel {
        let corners = self.reference.corner_leds_px(0).map(DVec2::from_array);
        let origin = DVec2::new(self.region.x as f64, self.region.y as f64);
        let first = corners[0] - origin + DVec2::from_array(shown.shift_px);
        let pitch_px = corners[0].distance(corners[1]) / 7.0;
        Panel {
            bits: shown.symbols[0].bits(),
            first_px: first.to_array(),
            pitch_px,
            radius_px: pitch_px / (2.0 * (1.0 + self.scene.panels[0].interval)),
            off: shown.light.off,
            on: shown.light.on,
        }
    }
}

/// A variant of drawing.
enum Way {
    Single(Renderer),
    Double(Renderer),
    Straightforward,
    Supersampled(usize),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors alone, because times depend on the machine.
    #[test]
    fn the_errors_fall_in_the_order_of_the_levels() {
        for (distance_m, interval) in SCENES {
            let scene = TestScene::new(distance_m, interval, &Scale::TINY).unwrap();
            let errors: Vec<(String, f64)> = scene
                .variants()
                .into_iter()
                .filter(|(point, _)| !point.variant.contains("16×"))
                .map(|(point, way)| (point.variant, scene.errors(&way).0))
                .collect();
            let of = |name: &str| errors.iter().find(|(variant, _)| variant == name).unwrap().1;
            let descending = [
                "point-sampled",
                "supersampled 2×",
                "supersampled 4×",
                "supersampled 8×",
                "fast",
                "fine",
                "f64 1e-7",
                "f64 1e-9",
            ];
            for pair in descending.windows(2) {
                assert!(of(pair[0]) >= of(pair[1]), "{pair:?} at {distance_m} m, {interval}: {errors:?}");
            }
            for level in [Level::Fine, Level::Fast] {
                let name = format!("{level:?}").to_lowercase();
                assert!(of(&name) <= level.error_bound_grey());
            }
            assert!(of("supersampled 8×") > Level::Fast.error_bound_grey());
            // The reference itself has no error.
            let reference = Way::Double(Renderer::of(scene.view(), Level::Reference));
            assert_eq!(scene.errors(&reference).0, 0.0);
            assert!(errors.iter().all(|(name, error)| name != "reference" && *error > 0.0));
        }
    }
}
