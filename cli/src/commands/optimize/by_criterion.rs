//! The best ratio at each distance by variances or bit errors, and what of it a transmitter carries.

use anyhow::ensure;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::Evaluation;
use studies::optimum::{Criterion, Search};
use studies::table::{News, Rule, Survey, TableFile};

use super::rounds::{About, Rounds};
use super::{Arguments, as_toml, chart};
use crate::options::Shared;
use crate::output::Answer;
use crate::report::optimum::Report;
use crate::stop::stop;
use crate::{plot, results};

/// Distances where none are given, m.
const DISTANCES_M: [f64; 5] = [30.0, 40.0, 50.0, 60.0, 70.0];
/// The most frames at one ratio, as they are and of a first look.
const FRAMES: [u64; 2] = [100_000, 2048];
/// Half the width of an interval that ends a search, as it is and of a first look.
const TOLERANCE: [f64; 2] = [0.01, 0.05];

impl Arguments {
    fn survey(
        &self,
        shared: &Shared,
        scene: &Scene,
        criterion: Criterion,
    ) -> anyhow::Result<Survey> {
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

/// Searches, prints and writes.
pub fn run(
    arguments: &Arguments,
    shared: &Shared,
    scene: &Scene,
    criterion: Criterion,
) -> anyhow::Result<Answer> {
    let survey = arguments.survey(shared, scene, criterion)?;
    let mut file = arguments.begun(TableFile::of(&survey, scene), scene)?;
    let settings = as_toml(&TableFile::of(&survey, scene))?;
    let mut report = Report::new(&survey, &file, shared.json)?;
    for &illuminance_lx in &survey.illuminance_lx {
        for &interval in &survey.interval {
            if file.entry(illuminance_lx, interval).is_some() {
                continue;
            }
            // What is kept may be read later.
            if arguments.out.is_none() && !report.is_read() {
                return Ok(Answer::Yes);
            }
            let about = About {
                table: &settings,
                illuminance_lx,
                interval,
            };
            let begun = arguments
                .out
                .as_deref()
                .map(|path| Rounds::begin::<Vec<Evaluation>>(path, &about));
            let (mut rounds, known) = begun.transpose()?.unzip();
            let known = &mut known.into_iter().flatten();
            let searched = survey.entry_from(scene, illuminance_lx, interval, known, |news| {
                if let (News::Piece(piece), Some(rounds)) = (&news, &mut rounds)
                    && !piece.is_known
                {
                    rounds.add(&piece.batches);
                }
                report.heard(news);
            });
            match searched {
                Ok((entry, cells)) => {
                    let told = report.entry(&entry, &cells);
                    file.add(survey.rule, entry, cells);
                    arguments.keep(&file)?;
                    rounds.map_or(Ok(()), Rounds::finish)?;
                    told?;
                }
                Err(error) if error.is_interruption() => {
                    report.interrupted(arguments.out.as_deref());
                    return Ok(Answer::No);
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
    if let Some(path) = &arguments.out {
        plot::save(&results::stem(path, "toml"), &chart::draw(&file, &survey)?)?;
    }
    arguments.verdict(&file)
}
