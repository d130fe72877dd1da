//! The error of a picture without small effects, and the time saved.

use link::panel::PanelFrame;
use rand::Rng;

use super::Measurement;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{range, rounded, variant};
use super::point::Point;
use super::scale::Scale;
use super::steps::Steps;
use super::timing::Candidate;
use sim::accuracy::Level;
use sim::effects;
use sim::random::{Purpose, stream, uniform};
use sim::renderer::canvas::{Canvas, Region};
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::Scene;

const PRESETS: [&str; 4] = ["paper", "day", "night", "fog"];
/// Small effects of a drive that the presets do not have, with bounds near the tolerances.
const DRIVE: [&str; 8] = [
    "pose.yaw_deg=0.2",
    "pose.roll_deg=0.5",
    "pose.x_m=0.5",
    "pose.velocity_m_s=[0.02, 0, -2]",
    "panel.led_spread=0.0002",
    "panel.board_reflectance=0.1795",
    "camera.readout_s=0.00001",
    "camera.distortion_k1=-0.05",
];
/// The noise has a bound of its own, by chance, and is not drawn.
const WITHOUT_NOISE: &str = "effects.noise=off";
/// Tolerances in grey levels; the default is 0.5.
const TOLERANCES: [f64; 9] = [0.0, 0.01, 0.03, 0.1, 0.3, 0.5, 1.0, 2.0, 4.0];
const DEFAULT: f64 = 0.5;
/// Frames whose pixels are compared.
const FRAMES: usize = 12;
/// Smaller differences are rounding.
const NOTHING_GREY: f64 = 1e-4;

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let diagrams = PRESETS.map(|preset| steps.take(preset, |_| diagram(preset, scale)));
    let diagrams: Vec<Diagram> = diagrams.into_iter().collect::<Result<_, _>>()?;
    Ok(Measurement {
        method: format!(
            "An effect is left out if its bound is at most the tolerance (`effects.tolerance_grey`). *true error* is the greatest change \
             of a pixel over {FRAMES} frames, *declared bound* the sum of the bounds left out. The scenes are presets with a little of \
             every effect, without noise."
        ),
        reference: format!("All effects, at level `reference`; smaller changes than {NOTHING_GREY} grey levels count as none."),
        diagrams,
    })
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let everything = diagrams.iter().filter_map(|drive| variant(drive, &name(0.0)));
    let above: Vec<Vec<&Point>> = diagrams
        .iter()
        .map(|drive| {
            let larger = TOLERANCES.into_iter().filter(|&tolerance| tolerance > DEFAULT);
            larger.filter_map(|tolerance| variant(drive, &name(tolerance))).collect()
        })
        .collect();
    let quickest = above.iter().map(|points| {
        let ratios = points.iter().map(|point| point.ratio.median);
        ratios.fold(f64::INFINITY, f64::min)
    });
    let errors = above.iter().flatten().map(|point| point.error);
    format!(
        "{DEFAULT} grey levels, the greatest error of rounding. All effects take {} times as long. Larger tolerances take at best {} of \
         the time and change pixels by up to {} grey levels. The tolerance applies to each effect alone, so several omissions can exceed \
         it.",
        range(everything.map(|point| point.ratio.median)),
        range(quickest),
        rounded(errors.fold(0.0, f64::max))
    )
}

/// The variant's name.
fn name(tolerance: f64) -> String {
    format!("tolerance {tolerance}")
}

fn diagram(preset: &str, scale: &Scale) -> Result<Diagram, PrecisionError> {
    let drive = Drive::new(preset, scale)?;
    let mut candidates = Vec::new();
    let mut bounds = Vec::new();
    for tolerance in TOLERANCES {
        let renderer = Renderer::new(&drive.scene(tolerance)?, Level::Fast)?;
        let left_out: Vec<&str> = renderer
            .plan()
            .decisions
            .iter()
            .filter(|decision| !decision.included && decision.bound_grey > 0.0 && decision.effect != "noise")
            .map(|decision| decision.effect)
            .collect();
        let error = drive.error(tolerance)?;
        let point = Point {
            at_most: error < NOTHING_GREY,
            note: match left_out.as_slice() {
                [] => "nothing left out".into(),
                names => format!("left out: {}", names.join(" ")),
            },
            ..Point::new(name(tolerance), error.max(NOTHING_GREY)).with_default(tolerance == DEFAULT)
        };
        bounds.push(bound_grey(&renderer));
        candidates.push(Candidate::new(point.on("true error"), 1.0, drive.work(renderer)));
    }
    let error = ["greatest change of a pixel", "grey levels"];
    let mut diagram = Diagram::timed(preset, error, "one frame", candidates, scale);
    let promised: Vec<Point> = diagram
        .points
        .iter()
        .zip(bounds)
        .map(|(point, bound)| Point {
            variant: format!("{}, bound", point.variant),
            curve: "declared bound".into(),
            error: bound.max(NOTHING_GREY),
            at_most: bound < NOTHING_GREY,
            on_front: false,
            ..point.clone().with_default(false)
        })
        .collect();
    diagram.points.extend(promised);
    Ok(diagram)
}

/// The sum of the bounds of the omitted effects, without the noise.
fn bound_grey(renderer: &Renderer) -> f64 {
    let left_out = renderer
        .plan()
        .decisions
        .iter()
        .filter(|decision| !decision.included && decision.effect != "noise");
    left_out.map(|decision| decision.bound_grey).sum()
}

/// A preset on a drive, its frames and their exact pictures.
struct Drive {
    preset: &'static str,
    region: Region,
    frames: Vec<PanelExposure>,
    exact: Vec<Vec<f64>>,
}

impl Drive {
    fn new(preset: &str, scale: &Scale) -> Result<Self, PrecisionError> {
        let preset = PRESETS.into_iter().find(|known| *known == preset).unwrap_or(PRESETS[0]);
        let mut drive = Self {
            preset,
            region: Region {
                x: 0,
                y: 0,
                width: 0,
                height: 0,
            },
            frames: Vec::new(),
            exact: Vec::new(),
        };
        let everything = effects::names().into_iter().filter(|name| *name != "noise");
        let everything = everything.map(|name| format!("effects.{name}=on"));
        let full = Renderer::new(&drive.load(everything)?, Level::Reference)?;
        drive.region = full.surroundings(0);
        let mut random = stream(scale.seed, 0, Purpose::Phase);
        drive.frames = (0..scale.of(FRAMES, 2))
            .map(|_| PanelExposure {
                symbols: std::array::from_fn(|_| PanelFrame::from_bits(random.next_u64())),
                shift_px: [uniform(&mut random), uniform(&mut random)],
                ..full.steady(0, PanelFrame::default())
            })
            .collect();
        drive.exact = drive.greys(&full);
        Ok(drive)
    }

    fn load(&self, more: impl Iterator<Item = String>) -> Result<Scene, PrecisionError> {
        let settings = DRIVE.into_iter().chain([WITHOUT_NOISE]).map(String::from);
        let settings: Vec<String> = settings.chain(more).collect();
        Ok(Scene::load(self.preset, &settings)?)
    }

    fn scene(&self, tolerance: f64) -> Result<Scene, PrecisionError> {
        self.load(std::iter::once(format!("effects.tolerance_grey={tolerance}")))
    }

    /// The greatest change of a pixel by a tolerance.
    fn error(&self, tolerance: f64) -> Result<f64, PrecisionError> {
        let renderer = Renderer::new(&self.scene(tolerance)?, Level::Reference)?;
        let greys = self.greys(&renderer);
        let pixels = greys.iter().flatten().zip(self.exact.iter().flatten());
        Ok(pixels.map(|(ours, exact)| (ours - exact).abs()).fold(0.0, f64::max))
    }

    /// Unrounded grey levels of all frames.
    fn greys(&self, renderer: &Renderer) -> Vec<Vec<f64>> {
        let curve = renderer.curve();
        let mut canvas = Canvas::<f64>::new(self.region);
        let frames = (0..).zip(&self.frames);
        frames
            .map(|(number, &shown)| {
                renderer.draw_exact(&renderer.moment(1, number), &[shown], &mut canvas);
                let grey = |&linear: &f64| curve.unrounded(linear);
                canvas.values().iter().map(grey).collect()
            })
            .collect()
    }

    /// Draws and reads out one frame after another.
    fn work(&self, renderer: Renderer) -> impl FnMut() {
        let mut canvas = Canvas::<f32>::new(self.region);
        let mut grey = vec![0; self.region.width * self.region.height];
        let mut frames = (0..).zip(&self.frames).cycle();
        move || {
            if let Some((number, &shown)) = frames.next() {
                renderer.draw(&renderer.moment(1, number), &[shown], &mut canvas);
                renderer.read_out(1, number, &canvas, &mut grey);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_larger_tolerance_errs_more_and_never_more_than_its_bound() {
        for preset in PRESETS {
            let drive = Drive::new(preset, &Scale::TINY).unwrap();
            let errors = TOLERANCES.map(|tolerance| drive.error(tolerance).unwrap());
            let bounds = TOLERANCES.map(|tolerance| bound_grey(&Renderer::new(&drive.scene(tolerance).unwrap(), Level::Fast).unwrap()));
            assert!(errors[0] < NOTHING_GREY, "{preset}: {errors:?}");
            for (error, bound) in errors.iter().zip(bounds) {
                assert!(*error <= bound + NOTHING_GREY, "{preset}: {errors:?} {bounds:?}");
            }
            let last = TOLERANCES.len() - 1;
            assert!(
                errors[last] > 100.0 * NOTHING_GREY && bounds[last] > bounds[1],
                "{preset}: {errors:?}"
            );
        }
    }
}
