//! The best ratio at each distance by variances or bit errors, and what of it a transmitter carries.

use anyhow::ensure;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::Evaluation;
use studies::optimum::{Criterion, Search};
use studies::table::{Cell, Entry, News, Rule, Survey, TableFile};

use super::entries::{Finder, find_all};
use super::rounds::Rounds;
use super::{Arguments, chart};
use crate::options::Shared;
use crate::output::Answer;
use crate::plot::Drawing;
use crate::report::optimum::Report;
use crate::stop::stop;

/// Distances where none are given, m.
const DISTANCES_M: [f64; 5] = [30.0, 40.0, 50.0, 60.0, 70.0];
/// The most frames at one ratio, as they are and of a first look.
const FRAMES: [u64; 2] = [100_000, 2048];
/// Half the width of an interval that ends a search, as it is and of a first look.
const TOLERANCE: [f64; 2] = [0.01, 0.05];

impl Arguments {
    fn survey(&self, shared: &Shared, scene: &Scene, criterion: Criterion) -> anyhow::Result<Survey> {
        ensure!(
            !self.reach.is_given(),
            "--message-bytes, --within, --probability, --choose, --min-cd, --max-cd and --lamp are of --criterion reach: give that, or \
             leave them out"
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
        let survey = Survey {
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

/// A search, and what is told of it.
struct ByCriterion<'a> {
    survey: &'a Survey,
    scene: &'a Scene,
    report: Report,
}

impl Finder for ByCriterion<'_> {
    type Piece = Vec<Evaluation>;
    type Entry = (Entry, Vec<Cell>);

    fn is_in(file: &TableFile, [illuminance_lx, interval]: [f64; 2]) -> bool {
        file.entry(illuminance_lx, interval).is_some()
    }

    fn is_read(&self) -> bool {
        self.report.is_read()
    }

    fn find(
        &mut self,
        illuminance_lx: f64,
        interval: f64,
        known: Vec<Self::Piece>,
        rounds: &mut Rounds,
    ) -> anyhow::Result<Option<Self::Entry>> {
        let (survey, scene, report) = (self.survey, self.scene, &mut self.report);
        let known = &mut known.into_iter();
        let found = survey.entry_from(scene, illuminance_lx, interval, known, |news| {
            if let News::Piece(piece) = &news
                && !piece.is_known
            {
                rounds.add(&piece.batches);
            }
            report.heard(news);
        });
        match found {
            Err(error) if error.is_interruption() => Ok(None),
            found => Ok(Some(found?)),
        }
    }

    fn add(&mut self, (entry, cells): Self::Entry, file: &mut TableFile) -> anyhow::Result<()> {
        let told = self.report.entry(&entry, &cells);
        file.add(self.survey.rule, entry, cells);
        told
    }

    fn draw(&self, file: &TableFile) -> anyhow::Result<Drawing> {
        chart::draw(file, self.survey)
    }
}

/// Searches, prints and writes.
pub fn run(arguments: &Arguments, shared: &Shared, scene: &Scene, criterion: Criterion) -> anyhow::Result<Answer> {
    let survey = &arguments.survey(shared, scene, criterion)?;
    find_all(arguments, TableFile::of(survey, scene), |begun, missing| {
        let report = Report::new(survey, begun, missing, shared.json)?;
        Ok(ByCriterion { survey, scene, report })
    })
}
