//! Work-precision diagrams: the cost of accuracy in time, for every step with more than one variant.
//!
//! A [`Part`] answers one question. Its [`Diagram`]s hold [`Point`]s: variants with their error relative to a reference that is solved far
//! tighter, and their cost. A point is on the front if no other beats it in both. All of a diagram's variants are timed alternately in the
//! same run, and as multiples of one of them, its baseline. So the numbers hold on other machines too, and other load affects all variants
//! alike. After Rackauckas & Nie 2017, whose `WorkPrecisionSet` compares differential equation solvers in this way.
//!
//! ```
//! use studies::work_precision::{PARTS, Scale, Steps};
//! let decoder = PARTS.iter().find(|part| part.name == "decoder").expect("a part");
//! let part = decoder.measure(&Scale::TINY, &mut Steps::unkept())?;
//! assert!(part.diagrams.iter().all(|diagram| diagram.points.iter().any(|point| point.on_front)));
//! # Ok::<(), studies::work_precision::PrecisionError>(())
//! ```

mod best_ratio;
mod camera;
mod counts;
mod decoder;
mod detectors;
mod diagram;
mod effects;
mod error;
mod locator;
mod monte_carlo;
mod numbers;
mod panels;
mod pareto;
mod point;
mod pose;
mod quartiles;
mod renderer;
mod scale;
mod single_search;
mod steps;
mod timing;
mod transmitter;

pub use counts::rows as counted_rows;
pub use detectors::{PLACES, scene_at, scene_in_clear_air};
pub use diagram::{CostUnit, Diagram, Part};
pub use error::PrecisionError;
pub use point::Point;
pub use quartiles::Quartiles;
pub use scale::Scale;
pub use steps::{StepResults, Steps};

/// A part of the measurement.
pub struct Measurable {
    /// Its name, a word.
    pub name: &'static str,
    title: &'static str,
    measure: fn(&Scale, &mut Steps) -> Result<Measurement, PrecisionError>,
    /// The default and its numbers, from the points.
    why: fn(&[Diagram]) -> String,
}

/// The measurement of a part, and its method.
struct Measurement {
    method: String,
    reference: String,
    diagrams: Vec<Diagram>,
}

impl Measurable {
    /// Measures it.
    ///
    /// # Errors
    /// If a variant cannot be measured.
    pub fn measure(&self, scale: &Scale, steps: &mut Steps) -> Result<Part, PrecisionError> {
        let measured = (self.measure)(scale, steps)?;
        Ok(Part {
            name: self.name.into(),
            title: self.title.into(),
            method: measured.method,
            reference: measured.reference,
            diagrams: measured.diagrams,
        })
    }
}

/// A part of the module of that name.
macro_rules! part {
    ($name:literal, $title:literal, $module:ident) => {
        Measurable {
            name: $name,
            title: $title,
            measure: $module::measure,
            why: $module::why,
        }
    };
}

/// All parts.
pub const PARTS: [Measurable; 10] = [
    part!("renderer", "Rendering a panel", renderer),
    part!("effects", "Leaving effects out", effects),
    part!("monte-carlo", "Monte Carlo", monte_carlo),
    part!("best-ratio", "The best ratio by reach", best_ratio),
    part!("detectors", "Detecting the bits", detectors),
    part!("camera", "Learning the camera", camera),
    part!("locator", "Finding the panel", locator),
    part!("pose", "Estimating the pose", pose),
    part!("transmitter", "Computing the luminance", transmitter),
    part!("decoder", "Correcting errors", decoder),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_parts_have_known_names_titles_and_choices() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/accuracy/points.json");
        let text = std::fs::read_to_string(path).expect("the published points");
        let mut page: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let published: Vec<Part> = serde_json::from_value(page["parts"].take()).expect("parts");
        assert_eq!(published.len(), PARTS.len());
        for (part, measurable) in published.iter().zip(&PARTS) {
            assert_eq!((part.name.as_str(), part.title.as_str()), (measurable.name, measurable.title));
            assert_eq!(part.default_choice(), (measurable.why)(&part.diagrams), "{}", part.name);
        }
    }
}
