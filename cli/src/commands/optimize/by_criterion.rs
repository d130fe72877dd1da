//! The best ratio at each distance by variances or bit errors, and the transmitter's table from it.

use anyhow::ensure;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::optimum::{Criterion, Search};
use studies::table::{CriterionSurvey, Rule};

use super::places::search;
use super::{Arguments, chart};
use crate::options::SharedOptions;
use crate::output::Verdict;
use crate::stop::stop;

/// Default distances, m.
const DISTANCES_M: [f64; 5] = [30.0, 40.0, 50.0, 60.0, 70.0];
/// Maximum frames per ratio: by default, and with `--quick`.
const FRAMES: [u64; 2] = [100_000, 2048];
/// Half-width of the interval that ends a search: by default, and with `--quick`.
const TOLERANCE: [f64; 2] = [0.01, 0.05];

impl Arguments {
    fn survey(&self, shared: &SharedOptions, scene: &Scene, criterion: Criterion) -> anyhow::Result<CriterionSurvey> {
        ensure!(
            !self.reach.is_given(),
            "--message-bytes, --within, --probability, --choose, --min-cd, --max-cd and --lamp are for --criterion reach: give that, or \
             omit them"
        );
        let search = Search {
            criterion,
            range: self.range()?,
            frames: self.frames.unwrap_or(FRAMES[usize::from(self.quick)]),
            tolerance: self.tolerance.unwrap_or(TOLERANCE[usize::from(self.quick)]),
            seed: shared.seed,
            random_reflectance: !self.fixed_reflectance,
            detector: self.detector.unwrap_or(DetectorChoice::KMeans),
            level: self.level,
            stop: stop(),
        };
        let survey = CriterionSurvey {
            search,
            rule: self.rule.unwrap_or(Rule::Mean),
            illuminance_lx: self.illuminances(scene),
            interval: self.intervals.clone(),
            distance_m: self.distances.clone().unwrap_or(DISTANCES_M.into()),
            yaw_deg: self.yaws.clone().unwrap_or(vec![0.0]),
        };
        survey.check(scene)?;
        Ok(survey)
    }
}

/// Searches, prints and writes.
pub fn run(arguments: &Arguments, shared: &SharedOptions, scene: &Scene, criterion: Criterion) -> anyhow::Result<Verdict> {
    let survey = arguments.survey(shared, scene, criterion)?;
    search(arguments, &survey, scene, shared.json, |file| chart::draw(file, &survey))
}
