//! Wrong bits of each detector, against its time for a panel.

use rx_pipeline::detect::Method;

use super::Measurement;
use super::counts;
use super::diagram::{CostUnit, Diagram};
use super::error::PrecisionError;
use super::numbers::{range, rounded, variant};
use super::panels::{Panels, Reader};
use super::pareto;
use super::point::Point;
use super::quartiles::Quartiles;
use super::scale::Scale;
use super::steps::Steps;
use crate::detectors::{DETECTORS, DetectorChoice};
use crate::monte_carlo::{Evaluator, Settings};
use sim::road::camera_of;
use sim::scene::{Scene, SceneError};

/// Distance in m, interval, illuminance in lx (which sets the ISO), L2A.
pub const PLACES: [(f64, f64, f64, f64); 4] = [
    (50.0, 1.0, 50.0, 1.0),
    (60.0, 0.5, 1000.0, 1.0),
    (70.0, 0.5, 1000.0, 1.0),
    (70.0, 1.0, 50.0, 1.0),
];
const FRAMES: usize = 1000;
const LEAST_FRAMES: usize = 16;
/// Frames for the genie, which takes long.
const GENIE_FRAMES: usize = 100;
/// The baseline of all times.
const BASELINE: &str = "kmeans";
/// The default detector.
const DEFAULT: &str = "ml";
/// The suffix of a detector's name with soft values.
const SOFT: &str = ", soft";
/// Instructions on a small processor.
const INSTRUCTIONS: &str = include_str!("data/cortex-m7.csv");

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let mut diagrams = Vec::new();
    let mut floors = Vec::new();
    for place in PLACES {
        let (diagram, floor) = steps.take(format!("{place:?}"), |_| diagram(place, scale))?;
        diagrams.push(diagram);
        floors.push(floor);
    }
    let instructions: Vec<_> = counts::rows(INSTRUCTIONS).collect();
    let on_the_board: Vec<Diagram> = diagrams
        .iter()
        .enumerate()
        .map(|(place, timed)| counted(timed, &instructions, place))
        .collect();
    diagrams.extend(on_the_board);
    Ok(Measurement {
        method: format!(
            "{FRAMES} noisy frames at each of four places; the time from grey levels and corners to bits. *soft* adds log-likelihood \
             ratios for the error correction. The Cortex-M7 diagrams have instructions, counted by QEMU (`VOCC_WRITE_COUNTS=1 cargo test \
             -p vocc-tests --test mps2 on_file`)."
        ),
        reference: format!(
            "The drawn bits. A genie, which knows everything but the bits, reads {} panels wrongly (first {} frames, 95 % intervals).",
            floors.join(", "),
            scale.of(GENIE_FRAMES, 10)
        ),
        diagrams,
    })
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let timed: Vec<&Diagram> = diagrams.iter().filter(|diagram| diagram.cost_unit == CostUnit::Ns).collect();
    let best: Vec<(&Point, f64)> = timed
        .iter()
        .filter_map(|diagram| {
            let others = diagram.points.iter().filter(|point| point.variant != DEFAULT);
            let next = others.map(|point| point.error).fold(f64::INFINITY, f64::min);
            Some((variant(diagram, DEFAULT)?, next))
        })
        .collect();
    let least = best.iter().filter(|(ours, next)| ours.error < *next).count();
    let rarer = best.iter().filter(|(ours, _)| !ours.at_most);
    let errorless = best.iter().filter(|(ours, _)| ours.at_most).count();
    let mut on_front: Vec<(&str, usize)> = Vec::new();
    for point in timed.iter().flat_map(|diagram| &diagram.points) {
        match on_front.iter_mut().find(|(name, _)| *name == point.variant) {
            _ if !point.on_front || point.variant == DEFAULT => {}
            Some((_, places)) => *places += 1,
            None => on_front.push((&point.variant, 1)),
        }
    }
    let on_front = on_front.iter().map(|(name, places)| format!("{name} at {places}"));
    format!(
        "`{DEFAULT}`, maximum likelihood, in `link`, `receive` and `decode`; k-means in `evaluate`, `sweep` and `optimize`. `{DEFAULT}` \
         errs least at {least} of {} places: without an error at {errorless}, and {} times less often than the next best at the others. \
         It takes {} times as long as k-means in such unclear frames. Faster variants on the front, with the number of places: {}. \
         Fisher's discriminant needs training. Soft values add {} µs.",
        best.len(),
        range(rarer.map(|(ours, next)| next / ours.error)),
        range(best.iter().map(|(ours, _)| ours.ratio.median)),
        on_front.collect::<Vec<_>>().join(", "),
        soft_us(diagrams)
    )
}

/// The time of soft values in addition to bits, in µs.
fn soft_us(diagrams: &[Diagram]) -> String {
    let timed = diagrams.iter().filter(|diagram| diagram.cost_unit == CostUnit::Ns);
    range(timed.flat_map(|diagram| {
        diagram.points.iter().filter_map(|soft| {
            let bits = variant(diagram, soft.variant.strip_suffix(SOFT)?)?;
            Some((soft.cost.median - bits.cost.median) / 1000.0)
        })
    }))
}

/// The scene at one of [`PLACES`], with more settings.
///
/// # Errors
/// [`SceneError`] if a setting is invalid.
pub fn scene_at(place: (f64, f64, f64, f64), more: &[String]) -> Result<Scene, SceneError> {
    let (distance_m, interval, illuminance_lx, l2a) = place;
    let mut settings = vec![
        format!("pose.distance_m={distance_m}"),
        format!("panel.interval={interval}"),
        format!("ambient.illuminance_lx={illuminance_lx}"),
        format!("link.l2a={l2a}"),
        "effects.noise=on".into(),
    ];
    settings.extend_from_slice(more);
    Scene::load("paper", &settings)
}

/// As [`scene_at`], without haze and in the ambient light for an ISO: distance in m, interval, ISO, L2A.
///
/// # Errors
/// [`SceneError`] if a setting is invalid.
pub fn scene_in_clear_air((distance_m, interval, iso, l2a): (f64, f64, f64, f64)) -> Result<Scene, SceneError> {
    let place = (distance_m, interval, 16_000.0 * 100.0 / iso, l2a);
    scene_at(place, &["atmosphere.transmission_at_70m=1".into()])
}

/// The detectors at a place, and the number of panels that the genie misreads.
fn diagram(place: (f64, f64, f64, f64), scale: &Scale) -> Result<(Diagram, String), PrecisionError> {
    let (distance_m, interval, illuminance_lx, l2a) = place;
    let scene = scene_at(place, &[])?;
    let frames = scale.of(FRAMES, LEAST_FRAMES) as u64;
    let panels = Panels::of(&scene, settings(DetectorChoice::KMeans, frames, scale))?;
    let candidate = |name: &str, mut reader: Reader| {
        let wrong = panels.errors(&mut reader, 0..);
        panels.candidate(name, reader, &wrong)
    };
    let mut candidates = Vec::new();
    for (name, choice) in DETECTORS {
        if matches!(choice, DetectorChoice::Best | DetectorChoice::Genie) {
            continue;
        }
        let evaluator = Evaluator::new(&scene, settings(choice, 1, scale))?;
        let Some(method) = evaluator.method() else {
            continue;
        };
        match method {
            Method::Features(detector) => {
                let mut bits = candidate(name, Reader::features(detector, false));
                bits.point.is_baseline = name == BASELINE;
                let soft_name = format!("{name}{SOFT}");
                let mut soft = candidate(&soft_name, Reader::features(detector, true));
                for candidate in [&mut bits, &mut soft] {
                    candidate.point.curve = name.into();
                }
                candidates.extend([bits, soft]);
            }
            Method::MaximumLikelihood => {
                let reader = Reader::pixels(camera_of(&scene), evaluator.experience());
                candidates.push(candidate(name, reader));
            }
        }
    }
    for candidate in &mut candidates {
        candidate.point.is_default = candidate.point.variant == DEFAULT;
    }
    let genie_frames = scale.of(GENIE_FRAMES, 10) as u64;
    let genie = Evaluator::new(&scene, settings(DetectorChoice::Genie, genie_frames, scale))?;
    let errors = genie.run(|_| true)?.errors;
    let [low, high] = errors.frame_error_rate().1.map(|end| rounded(100.0 * end));
    let floor = format!("{} ({low} to {high} %)", errors.wrong_frames());
    let title = format!("{distance_m} m, interval {interval}, {illuminance_lx} lx, L2A {l2a}");
    let diagram = Diagram::timed(title, ["bit error rate", ""], "one panel", candidates, scale);
    Ok((diagram, floor))
}

/// The same errors against counted instructions.
fn counted(timed: &Diagram, instructions: &[(&str, Vec<f64>)], place: usize) -> Diagram {
    let points = timed.points.iter().filter_map(|point| {
        // The board always computes soft values.
        let name = point.variant.strip_suffix(SOFT);
        let name = name.or((point.variant == DEFAULT).then_some(DEFAULT))?;
        let (_, counts) = instructions.iter().find(|(known, _)| *known == name)?;
        Some(Point {
            variant: name.into(),
            cost: Quartiles::exactly(*counts.get(place)?),
            is_baseline: name == BASELINE,
            ..point.clone()
        })
    });
    let mut points: Vec<Point> = points.collect();
    let baseline = points.iter().find(|point| point.is_baseline);
    let yardstick = baseline.map_or(1.0, |point| point.cost.median);
    for point in &mut points {
        point.ratio = point.cost.times(1.0 / yardstick);
    }
    pareto::mark_front(&mut points);
    Diagram {
        title: format!("{}: Cortex-M7", timed.title),
        cost_unit: CostUnit::Instructions,
        points,
        ..timed.clone()
    }
}

fn settings(detector: DetectorChoice, frames: u64, scale: &Scale) -> Settings {
    Settings::fast(frames, scale.seed, detector)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rx_pipeline::detect::Detector;
    use rx_pipeline::likelihood::Experience;

    #[test]
    fn the_likeliest_bits_are_wrong_least_often() {
        let scene = Scene::load(
            "paper",
            &["pose.distance_m=70".into(), "panel.interval=0.5".into(), "effects.noise=on".into()],
        )
        .unwrap();
        let panels = Panels::of(&scene, settings(DetectorChoice::KMeans, 30, &Scale::TINY)).unwrap();
        let of = |mut reader| panels.errors(&mut reader, 0..).iter().sum::<u32>();
        let ml = of(Reader::pixels(camera_of(&scene), Experience::NONE));
        let [kmeans, otsu] = [Detector::KMeans, Detector::Otsu].map(|detector| of(Reader::features(detector, false)));
        assert!(2 * ml < kmeans && kmeans < otsu, "{ml} {kmeans} {otsu}");
        assert_eq!(of(Reader::features(Detector::KMeans, true)), kmeans);
    }

    #[test]
    fn counted_instructions_replace_times() {
        let point = |variant| Point {
            cost: Quartiles::exactly(5.0),
            ..Point::new(variant, 0.1)
        };
        let timed = Diagram {
            title: "here".into(),
            error: String::new(),
            error_unit: String::new(),
            cost: String::new(),
            cost_unit: CostUnit::Ns,
            points: vec![point("kmeans"), point("kmeans, soft"), point("ml"), point("uncounted, soft")],
        };
        let counts = [("kmeans", vec![7.0, 100.0]), ("ml", vec![7.0, 300.0])];
        let counted = counted(&timed, &counts, 1);
        assert_eq!(counted.points.len(), 2);
        assert_eq!(counted.points[1].ratio.median, 3.0);
        assert_eq!(counted.cost_unit, CostUnit::Instructions);
    }
}
