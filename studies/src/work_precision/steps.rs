//! The steps of a measurement, each saved as soon as it is finished, so that an interruption loses at most one.

use std::collections::BTreeMap;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::error::PrecisionError;

/// The results of steps, by their names.
pub type StepResults = BTreeMap<String, Value>;

/// The finished steps of a part, and the function that saves them.
pub struct Steps<'a> {
    finished: StepResults,
    keep: Box<dyn FnMut(&StepResults) + 'a>,
}

impl<'a> Steps<'a> {
    /// Steps, some of them finished; calls `keep` with all after each new one.
    pub fn new(finished: StepResults, keep: impl FnMut(&StepResults) + 'a) -> Self {
        Self {
            finished,
            keep: Box::new(keep),
        }
    }

    /// Steps that are not saved.
    pub fn unkept() -> Self {
        Self::new(StepResults::new(), |_| ())
    }

    /// The saved result of a step, or that of `measure` now. Its name must be unique in the part.
    ///
    /// # Errors
    /// Errors of `measure`.
    pub(super) fn take<T: Serialize + DeserializeOwned>(
        &mut self,
        name: impl Into<String>,
        measure: impl FnOnce(&mut Self) -> Result<T, PrecisionError>,
    ) -> Result<T, PrecisionError> {
        let name = name.into();
        if let Some(kept) = self.finished.get(&name) {
            // A result with a number that JSON cannot hold is incomplete, and is measured again.
            if let Ok(kept) = T::deserialize(kept) {
                return Ok(kept);
            }
        }
        let measured = measure(self)?;
        if let Ok(value) = serde_json::to_value(&measured) {
            self.finished.insert(name, value);
            (self.keep)(&self.finished);
        }
        Ok(measured)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{PARTS, Part, Scale};
    use super::*;

    /// The errors of all points, which do not depend on time.
    fn errors(part: &Part) -> Vec<(String, f64)> {
        let points = part.diagrams.iter().flat_map(|diagram| &diagram.points);
        points.map(|point| (point.variant.clone(), point.error)).collect()
    }

    #[test]
    fn a_part_goes_on_from_any_of_its_steps() {
        let decoder = PARTS.iter().find(|part| part.name == "decoder").unwrap();
        // As few messages as a part measures.
        let scale = Scale { share: 0.0, ..Scale::TINY };
        let mut kept = vec![StepResults::new()];
        let whole = {
            let steps = Steps::new(StepResults::new(), |finished| kept.push(finished.clone()));
            decoder.measure(&scale, &mut { steps }).unwrap()
        };
        assert!(kept.len() > 10, "{}", kept.len());
        // After an early step nearly all is measured again.
        let first = if properties::all_cases() { 0 } else { kept.len() / 2 };
        for finished in kept[first..].iter().step_by(5).chain(kept.last()) {
            let mut measured = 0;
            let steps = Steps::new(finished.clone(), |_| measured += 1);
            let resumed = decoder.measure(&scale, &mut { steps }).unwrap();
            assert_eq!(errors(&resumed), errors(&whole));
            assert_eq!(measured, kept.len() - 1 - finished.len());
        }
        // Once all is measured, the saved times are used, too.
        let all = kept.pop().unwrap();
        let again = decoder.measure(&scale, &mut Steps::new(all, |_| ())).unwrap();
        assert_eq!(again, whole);
    }
}
