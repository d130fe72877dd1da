//! The precision of a pose's convergence, against its time.

use std::hint::black_box;

use link::camera::Camera;
use link::panel::PanelFrame;
use rand::{Rng, RngExt};
use rx_pipeline::corners::Corners;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Lens, PanelObservation, PanelSize, PlaneFit, PlaneImage, PoseEstimator};
use sim::accuracy::Level;
use sim::random::{Purpose, stream};
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::road::camera_of;
use sim::scene::Scene;

use super::Measurement;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{range, rounded, variant};
use super::point::Point;
use super::scale::Scale;
use super::steps::Steps;
use super::timing::Candidate;

type Estimator = PoseEstimator<16384>;

/// The distances of panels.
const DISTANCES_M: [f64; 3] = [30.0, 50.0, 100.0];
const PANELS: usize = 100;
const TIMED: usize = 8;
/// The last step, in standard deviations of the image.
const TOLERANCES: [f64; 7] = [10.0, 3.0, 1.0, 0.3, Estimator::TOLERANCE, 0.03, 0.01];
/// The tolerance of the reference.
const EXHAUSTIVE: f64 = 1e-3;
/// The greatest error of the initial corners (px).
const OFF_PX: f64 = 0.2;

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let mut diagrams = Vec::new();
    for distance_m in DISTANCES_M {
        diagrams.push(diagram(distance_m, scale, steps)?);
    }
    Ok(Measurement {
        method: format!(
            "{} panels by day at each distance, yaw and pitch to 30°, LEDs 3 % unequal. The time covers the whole pose with its \
             covariance.",
            scale.of(PANELS, 4)
        ),
        reference: format!(
            "The same fit, stopped at {EXHAUSTIVE} standard deviations. Errors are relative to the noise: 1 equals the Cramér–Rao bound."
        ),
        diagrams,
    })
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let points = |tolerance: f64| {
        let of = move |diagram: &Diagram| variant(diagram, &name(tolerance)).cloned();
        diagrams.iter().filter_map(of)
    };
    let least = TOLERANCES[TOLERANCES.len() - 1];
    let times = points(least).zip(points(Estimator::TOLERANCE));
    let times = times.map(|(least, usual)| least.ratio.median / usual.ratio.median);
    let errors = points(Estimator::TOLERANCE).map(|point| point.error);
    format!(
        "A last step of {} standard deviations. The fit's remaining error is then {} of the error from noise. A tenth of that \
         step takes {} times as long.",
        rounded(Estimator::TOLERANCE),
        range(errors.collect::<Vec<_>>()),
        range(times.collect::<Vec<_>>()),
    )
}

/// The name of a variant.
fn name(tolerance: f64) -> String {
    format!("last step {tolerance}")
}

/// Error against time at one distance.
fn diagram(distance_m: f64, scale: &Scale, steps: &mut Steps) -> Result<Diagram, PrecisionError> {
    let count = scale.of(PANELS, 4) as u64;
    let panels: Vec<Panel> = (0..count)
        .map(|number| Panel::film(1000 * scale.seed + number, distance_m))
        .collect::<Result<_, _>>()?;
    let mut exhaustive = Box::new(Estimator::settling_to(EXHAUSTIVE));
    // Panels without a pose have none at any tolerance.
    let references: Vec<(&Panel, PlaneFit)> = panels
        .iter()
        .filter_map(|panel| Some((panel, panel.fit(&mut exhaustive)?)))
        .collect();
    let mut candidates = Vec::new();
    for tolerance in TOLERANCES {
        let mut estimator = Box::new(Estimator::settling_to(tolerance));
        let error = steps.take(format!("{distance_m} m, {}", name(tolerance)), |_| {
            let squares = references.iter().map(|(panel, reference)| {
                let fit = panel.fit(&mut estimator);
                fit.map_or(f64::INFINITY, |fit| squared(&fit.image, reference))
            });
            Ok((squares.sum::<f64>() / references.len() as f64 / 8.0).sqrt())
        })?;
        let timed = &panels[..TIMED.min(panels.len())];
        let point = Point::new(name(tolerance), error).with_default(tolerance == Estimator::TOLERANCE);
        candidates.push(Candidate::new(point, timed.len() as f64, move || {
            for panel in timed {
                let _ = black_box(panel.seen(|seen| estimator.pose(seen)));
            }
        }));
    }
    let error = ["rms distance from the settled fit", "standard deviations"];
    Ok(Diagram::timed(format!("{distance_m} m"), error, "one pose", candidates, scale))
}

/// A panel's frame.
struct Panel {
    pixels: Vec<u8>,
    side: usize,
    corners: Option<Corners>,
    bits: PanelFrame,
    camera: Camera,
    lens: Lens,
}

impl Panel {
    fn film(seed: u64, distance_m: f64) -> Result<Self, PrecisionError> {
        let mut random = stream(seed, 0, Purpose::Panel);
        let mut turn = |most: f64| random.random_range(-most..=most);
        let angles = [turn(30.0), turn(30.0), turn(15.0)];
        let focal_px = 25e-3 / 6.875e-6;
        let shift = [turn(4.0), turn(4.0)].map(|px| px * distance_m / focal_px);
        let side = (1.3 * (0.48 * focal_px / distance_m + 32.0)) as usize;
        let scene = Scene::load(
            "day",
            &[
                format!("camera.width_px={side}"),
                format!("camera.height_px={side}"),
                format!("pose.distance_m={distance_m}"),
                format!("pose.x_m={}", shift[0]),
                format!("pose.y_m={}", shift[1]),
                format!("pose.yaw_deg={}", angles[0]),
                format!("pose.pitch_deg={}", angles[1]),
                format!("pose.roll_deg={}", angles[2]),
                "panel.led_spread=0.03".into(),
                format!("panel.seed={seed}"),
            ],
        )?;
        let renderer = Renderer::new(&scene, Level::Fine)?;
        let mut canvas = Canvas::new(renderer.lit_region());
        let mut panel = Self {
            pixels: vec![0; side * side],
            side,
            corners: None,
            bits: PanelFrame::from_bits(0),
            camera: camera_of(&scene),
            lens: Lens::pinhole(focal_px, [side; 2]),
        };
        panel.bits = PanelFrame::from_bits(random.next_u64());
        let shown = [renderer.steady(0, panel.bits)];
        let moment = renderer.moment(seed, 0);
        renderer.frame(seed, &moment, &shown, &mut canvas, &mut panel.pixels);
        let corners = renderer
            .corner_leds_px(0)
            .map(|corner| corner.map(|at| (at + random.random_range(-OFF_PX..OFF_PX)) as f32));
        panel.corners = Corners::new(corners).ok();
        Ok(panel)
    }

    /// Calls `of` with the observation.
    fn seen<T>(&self, of: impl FnOnce(&PanelObservation) -> T) -> Option<T> {
        Some(of(&PanelObservation {
            frame: &Frame::new(&self.pixels, self.side, self.side).ok()?,
            corners: self.corners.as_ref()?,
            bits: self.bits,
            camera: &self.camera,
            lens: &self.lens,
            size: PanelSize::new(0.03, 1.0).ok()?,
        }))
    }

    fn fit(&self, estimator: &mut Estimator) -> Option<PlaneFit> {
        self.seen(|seen| estimator.image(seen).ok())?
    }
}

/// Squared distance of an image from a reference, by the reference's information.
fn squared(image: &PlaneImage, reference: &PlaneFit) -> f64 {
    let numbers = |image: &PlaneImage| [image.centre, image.column, image.row, image.tilt];
    let (image, wanted) = (numbers(image), numbers(&reference.image));
    let off: [f64; 8] = std::array::from_fn(|i| image[i / 2][i % 2] - wanted[i / 2][i % 2]);
    let rows = reference.information.iter().zip(off);
    rows.map(|(row, off_i)| row.iter().zip(off).map(|(c, off_j)| off_i * c * off_j).sum::<f64>())
        .sum()
}
