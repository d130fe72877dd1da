//! `vocc optimize`: the best LED-to-ambient ratio at many settings, and the table a transmitter carries.

mod chart;
mod rounds;

use std::path::PathBuf;

use anyhow::{Context, ensure};
use sim::accuracy::Level;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::optimum::{Criterion, RANGE, Search};
use studies::table::{News, Rule, Survey, TableFile};

use crate::commands::evaluate::single_precision;
use crate::files;
use crate::options::Shared;
use crate::output::Answer;
use crate::outputs;
use crate::report::optimum::Report;
use crate::stop::stop;
use crate::{plot, results};
use rounds::{About, Rounds};

/// How long it takes.
const DURATION: &str = "\
Each setting (an illuminance, an interval, a distance and a yaw) takes some ten seconds on two cores, less where the best ratio is soon \
known to --tolerance or --frames are few.";

/// Arguments of `vocc optimize`.
#[derive(clap::Args)]
#[command(after_help = format!("{DURATION} {}", crate::progress::HELP))]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file.
    #[arg(default_value = "paper")]
    scene: String,
    /// Normalised LED intervals, ascending: the table's columns.
    #[arg(long, value_delimiter = ',', default_values_t = [0.5, 1.0, 1.5, 2.0], allow_negative_numbers = true)]
    intervals: Vec<f64>,
    /// Distances in metres.
    #[arg(long, value_delimiter = ',', default_values_t = [30.0, 40.0, 50.0, 60.0, 70.0], allow_negative_numbers = true)]
    distances: Vec<f64>,
    /// Ambient illuminances in lux, ascending: the table's rows; without it, the scene's alone.
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true)]
    illuminances: Option<Vec<f64>>,
    /// Turns of the panel about the vertical, in degrees: the table is for the first, the others show what it costs there.
    #[arg(long, value_delimiter = ',', default_values_t = [0.0], allow_negative_numbers = true)]
    yaws: Vec<f64>,
    /// What is maximised: b2w, fisher or ber (the least bit error rate).
    #[arg(long, default_value = "b2w")]
    criterion: Criterion,
    /// What the table holds of the distances: mean (of their best ratios) or least-ber (the ratio of the least mean bit error rate).
    #[arg(long, default_value = "mean", value_parser = rule)]
    rule: Rule,
    /// The most frames at one ratio, from 64 to 100 000 000.
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    frames: u64,
    /// A search ends when the 95 % interval of the best ratio is no wider than ± this; 0: with all frames.
    #[arg(long, default_value_t = 0.01, allow_negative_numbers = true)]
    tolerance: f64,
    /// The ratios looked among: the lowest and the highest.
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", default_values_t = RANGE, allow_negative_numbers = true)]
    range: Vec<f64>,
    /// Keep the scene's reflectance instead of drawing each frame's from 0.3 to 0.5.
    #[arg(long)]
    fixed_reflectance: bool,
    /// The detector whose errors are counted: best, ml, kmeans, kmeans-raw, fisher, fisher-ngr, otsu or genie. The default is the
    /// paper's; `best` takes longer.
    #[arg(long, default_value = "kmeans")]
    detector: DetectorChoice,
    /// How exactly frames are drawn: fine or fast.
    #[arg(long, default_value = "fast", value_parser = single_precision)]
    level: Level,
    /// Where the table goes; plots go beside it, as .svg and .png.
    #[arg(short, long, value_name = "FILE.toml", value_parser = results::out_file("toml"))]
    out: Option<PathBuf>,
    /// Go on from what --out holds already.
    #[arg(long, requires = "out")]
    resume: bool,
}

/// How a table is made of the distances.
fn rule(text: &str) -> Result<Rule, String> {
    match text {
        "mean" => Ok(Rule::Mean),
        "least-ber" => Ok(Rule::LeastBer),
        _ => Err(format!("no rule {text:?}: choose mean or least-ber")),
    }
}

impl Arguments {
    fn survey(&self, shared: &Shared, scene: &Scene) -> anyhow::Result<Survey> {
        let [low, high] = self.range[..] else {
            anyhow::bail!("--range needs two ratios, such as --range 0.2,4");
        };
        let search = Search {
            criterion: self.criterion,
            range: [low, high],
            frames: self.frames,
            tolerance: self.tolerance,
            seed: shared.seed,
            random_reflectance: !self.fixed_reflectance,
            detector: self.detector,
            level: self.level,
            stop: stop(),
        };
        let own = vec![scene.ambient.illuminance_lx];
        let survey = Survey {
            search,
            rule: self.rule,
            illuminance_lx: self.illuminances.clone().unwrap_or(own),
            interval: self.intervals.clone(),
            distance_m: self.distances.clone(),
            yaw_deg: self.yaws.clone(),
        };
        survey.check(scene)?;
        Ok(survey)
    }

    /// The table to go on from: an empty one, or what an earlier run has left.
    fn begun(&self, survey: &Survey, scene: &Scene) -> anyhow::Result<TableFile> {
        let empty = TableFile::of(survey, scene);
        let Some(path) = self.out.as_ref().filter(|path| path.exists()) else {
            return Ok(empty);
        };
        ensure!(
            self.resume,
            "{} exists: go on from it with --resume, or name another file",
            path.display()
        );
        let begun = TableFile::read(path)?;
        ensure!(
            begun.is_of_same_survey(&empty),
            "{} is of other settings: scene, axes, distances, criterion, rule, frames, tolerance, range, seed, \
             detector, level and version must be the same",
            path.display()
        );
        Ok(begun)
    }

    fn keep(&self, file: &TableFile) -> anyhow::Result<()> {
        let Some(path) = &self.out else { return Ok(()) };
        let text = file
            .to_toml()
            .context("the table cannot be written as TOML")?;
        files::write(path, text)
    }
}

/// Searches, prints and writes.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    let scene = shared.scene(&arguments.scene)?;
    let survey = arguments.survey(shared, &scene)?;
    if let Some(path) = &arguments.out {
        let read = outputs::files_of(&arguments.scene, &scene);
        results::check(path, "toml", &["svg", "png"], read)?;
    }
    let mut file = arguments.begun(&survey, &scene)?;
    // What cannot be written should not be searched first.
    arguments.keep(&file)?;
    let settings = settings(&survey, &scene)?;
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
                .map(|path| Rounds::begin(path, &about));
            let (mut rounds, known) = begun.transpose()?.unzip();
            let known = &mut known.into_iter().flatten();
            let searched = survey.entry_from(&scene, illuminance_lx, interval, known, |news| {
                if let (News::Piece(piece), Some(rounds)) = (&news, &mut rounds)
                    && !piece.is_known
                {
                    rounds.add(piece.batches);
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
    Ok(Answer::Yes)
}

/// What a search depends on, as its table says it.
fn settings(survey: &Survey, scene: &Scene) -> anyhow::Result<String> {
    TableFile::of(survey, scene)
        .to_toml()
        .context("the table cannot be written as TOML")
}
