//! Bit errors of a receiver that learns the camera from its frames, and of a configured one, against the time for a panel.

use link::camera::Camera;
use serde::{Deserialize, Serialize};
use sim::road::calibrated_camera_of;
use sim::scene::{Scene, SceneError};

use super::Measurement;
use super::detectors::scene_at;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{range, variant};
use super::panels::{Panels, Reader};
use super::scale::Scale;
use super::steps::Steps;
use crate::detectors::DetectorChoice;
use crate::monte_carlo::{Evaluator, Settings};
use crate::statistics::ratio_95;

/// A camera, and a panel before it in so little light that bits are read wrongly.
struct Case {
    /// A description of the camera.
    name: &'static str,
    /// Distance in m, interval, illuminance in lx, L2A.
    place: (f64, f64, f64, f64),
    /// The scene settings of the camera.
    settings: &'static [&'static str],
    /// Whether each pixel's grey level depends on its own light alone, as the genie assumes.
    has_genie: bool,
}

/// Cameras from sharp to soft, and of several curves.
const CASES: [Case; 8] = [
    case("1.5 px, γ 2.2: as assumed", (70.0, 1.0, 50.0, 1.0), &[]),
    case("0.7 px", (80.0, 0.5, 25.0, 1.0), &["camera.blur_sigma_px=0.7"]),
    case("3 px", (46.0, 1.0, 50.0, 1.0), &["camera.blur_sigma_px=3"]),
    case(
        "linear",
        (80.0, 1.0, 50.0, 1.0),
        &["camera.encoding=linear", "camera.exposure_bias_ev=-1"],
    ),
    case("γ 2.6", (70.0, 1.0, 50.0, 1.0), &["camera.gamma=2.6"]),
    case("sRGB", (70.0, 1.0, 50.0, 1.0), &["camera.encoding=srgb"]),
    case(
        "Rec. 709, black at 16",
        (70.0, 1.0, 50.0, 1.0),
        &["camera.encoding=rec709", "camera.black_grey=16"],
    ),
    Case {
        has_genie: false,
        ..case(
            "sharpened by 1.2",
            (70.0, 1.0, 50.0, 1.0),
            &["camera.sharpening=1.2", "camera.sharpening_radius_px=1"],
        )
    },
];

const fn case(name: &'static str, place: (f64, f64, f64, f64), settings: &'static [&'static str]) -> Case {
    Case {
        name,
        place,
        settings,
        has_genie: true,
    }
}

impl Case {
    fn scene(&self) -> Result<Scene, SceneError> {
        let settings: Vec<String> = self.settings.iter().map(ToString::to_string).collect();
        scene_at(self.place, &settings)
    }
}

/// Frames of one panel.
fn settings(frames: usize, detector: DetectorChoice, scale: &Scale) -> Settings {
    Settings {
        random_reflectance: false,
        ..Settings::fast(frames as u64, scale.seed, detector)
    }
}

/// Frames to read, except for the genie, which takes long.
const FRAMES: usize = 400;
const GENIE_FRAMES: usize = 100;
/// Numbers of earlier frames that a receiver has learnt from.
const LEARNT_FROM: [usize; 4] = [0, 1, 5, MOST_LEARNT_FROM];
const MOST_LEARNT_FROM: usize = 20;
/// A receiver without settings.
const LEARNT: &str = "learnt";
/// A receiver with the camera's curve, black level and blur.
const CONFIGURED: &str = "configured";

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let (mut diagrams, mut genies) = (Vec::new(), Vec::new());
    let mut wrong = WrongBits::default();
    for case in &CASES {
        let (diagram, wrong_here) = steps.take(case.name, |_| diagram(case, scale))?;
        diagrams.push(diagram);
        wrong.learnt.extend(wrong_here.learnt);
        wrong.configured.extend(wrong_here.configured);
        if case.has_genie {
            genies.push(steps.take(format!("genie, {}", case.name), |_| genie(case, scale))?);
        }
    }
    let frames = scale.of(FRAMES, 16);
    Ok(Measurement {
        method: format!(
            "{frames} frames of one panel by each of {} cameras, so dark that bits are wrong. *configured*: `ml` with the camera's \
             curve, black level and blur. *learnt*: `ml` without them. Both learn the LEDs' levels and the noise.",
            CASES.len()
        ),
        reference: format!(
            "The drawn bits. Over all cameras, *learnt, {MOST_LEARNT_FROM} frames* makes {} times as many errors as *configured* (95 %). \
             A genie reads {} of the bits wrongly (first {} frames; it does not model sharpening).",
            wrong.ratio(),
            range(genies),
            scale.of(GENIE_FRAMES, 10)
        ),
        diagrams,
    })
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let of = |name: &str, frames| {
        let name = after(name, frames);
        diagrams.iter().filter_map(move |diagram| variant(diagram, &name))
    };
    let times = |frames| {
        let pairs = of(LEARNT, frames).zip(of(CONFIGURED, frames));
        range(pairs.map(|(learnt, configured)| learnt.error / configured.error))
    };
    let first = [LEARNT, CONFIGURED].into_iter().flat_map(|name| {
        let pairs = of(name, 0).zip(of(name, MOST_LEARNT_FROM));
        pairs.map(|(first, last)| first.error / last.error)
    });
    format!(
        "The receiver learns the camera. After {MOST_LEARNT_FROM} frames it makes {} times as many errors as a configured receiver, in \
         {} times the time; in the first frame, {} times as many. Both make {} times as many errors in the first frame as after \
         {MOST_LEARNT_FROM}.",
        times(MOST_LEARNT_FROM),
        range(of(LEARNT, MOST_LEARNT_FROM).map(|point| point.ratio.median)),
        times(0),
        range(first),
    )
}

fn after(name: &str, frames: usize) -> String {
    let s = if frames == 1 { "" } else { "s" };
    format!("{name}, {frames} frame{s}")
}

/// Wrong bits of each frame, by the receivers with the most earlier frames.
#[derive(Default, Serialize, Deserialize)]
struct WrongBits {
    learnt: Vec<u64>,
    configured: Vec<u64>,
}

impl WrongBits {
    /// The ratio of one to the other, with the interval.
    fn ratio(&self) -> String {
        let [learnt, configured] = [&self.learnt, &self.configured].map(|wrong| wrong.iter().sum::<u64>());
        let [low, high] = ratio_95(&self.learnt, &self.configured);
        format!("{:.2} ({low:.2} to {high:.2})", learnt as f64 / configured as f64)
    }
}

fn diagram(case: &Case, scale: &Scale) -> Result<(Diagram, WrongBits), PrecisionError> {
    let scene = case.scene()?;
    let frames = MOST_LEARNT_FROM + scale.of(FRAMES, 16);
    let panels = Panels::of(&scene, settings(frames, DetectorChoice::KMeans, scale))?;
    let mut candidates = Vec::new();
    let mut wrong_bits = WrongBits::default();
    for (name, camera, wrong_of_all) in [
        (CONFIGURED, calibrated_camera_of(&scene), &mut wrong_bits.configured),
        (LEARNT, Camera::default(), &mut wrong_bits.learnt),
    ] {
        for frames in LEARNT_FROM {
            let mut reader = Reader::pixels(camera, panels.experience(camera, frames));
            let wrong = panels.errors(&mut reader, MOST_LEARNT_FROM..);
            let mut candidate = panels.candidate(&after(name, frames), reader, &wrong);
            candidate.point.curve = name.into();
            if frames == MOST_LEARNT_FROM {
                candidate.point.is_baseline = name == CONFIGURED;
                candidate.point.is_default = name == LEARNT;
                wrong_of_all.extend(wrong.into_iter().map(u64::from));
            }
            candidates.push(candidate);
        }
    }
    let (distance_m, interval, illuminance_lx, _) = case.place;
    let title = format!("{}; {distance_m} m, interval {interval}, {illuminance_lx} lx", case.name);
    let diagram = Diagram::timed(title, ["bit error rate", ""], "one panel", candidates, scale);
    Ok((diagram, wrong_bits))
}

/// The genie's bit error rate.
fn genie(case: &Case, scale: &Scale) -> Result<f64, PrecisionError> {
    let settings = settings(scale.of(GENIE_FRAMES, 10), DetectorChoice::Genie, scale);
    let evaluator = Evaluator::new(&case.scene()?, settings)?;
    Ok(evaluator.run(|_| true)?.errors.rate())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_frame_teaches_the_width_that_was_not_configured() {
        let soft = CASES.iter().find(|case| case.name == "3 px").expect("a case");
        let (diagram, wrong) = diagram(soft, &Scale::TINY).expect("a diagram");
        assert_eq!([wrong.learnt.len(), wrong.configured.len()], [16, 16]);
        let error = |name, frames| {
            let point = variant(&diagram, &after(name, frames)).expect("a point");
            point.error
        };
        assert_eq!(error(LEARNT, 1), error(CONFIGURED, 1));
        assert!(error(LEARNT, MOST_LEARNT_FROM) < error(LEARNT, 0));
        assert!(diagram.points.iter().any(|point| point.is_default && !point.is_baseline));
    }
}
