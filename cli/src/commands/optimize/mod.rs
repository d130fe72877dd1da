//! `vocc optimize`: the best LED-to-ambient ratio at many settings, and the transmitter's table.

mod by_criterion;
mod by_reach;
mod chart;
mod places;
mod rounds;

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Context, ensure};
use sim::accuracy::Level;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::optimum::{Criterion, RANGE};
use studies::sweep::Shard;
use studies::table::{Rule, TableFile};

use crate::commands::evaluate::single_precision;
use crate::options::{SharedOptions, whole};
use crate::output::{Verdict, tell};
use crate::{files, outputs, results};

/// Help text on run time and sharding.
const DURATION: &str = "\
Each setting (an illuminance, an interval, a distance and a yaw) takes about ten seconds on two cores, less if the search reaches \
--tolerance early or --frames is small. With --criterion reach, an illuminance and an interval take a second with k-means, and some \
minutes with the best detector.

In parts, on one computer or many:
  vocc optimize … -o part-0.toml --shard 0/2
  vocc optimize … -o part-1.toml --shard 1/2
  vocc merge part-0.toml part-1.toml -o table.toml

On a cluster with Slurm, from a folder that all nodes see:
  job=$(sbatch --parsable --array=0-15 --wrap \
    'vocc optimize … --resume -o part-$SLURM_ARRAY_TASK_ID.toml --shard $SLURM_ARRAY_TASK_ID/16')
  sbatch --dependency=afterok:$job --wrap 'vocc merge part-*.toml -o table.toml'
";

/// Arguments of `vocc optimize`.
#[derive(clap::Args)]
#[command(after_help = format!("{DURATION}\n{}", crate::progress::HELP))]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file.
    #[arg(default_value = "paper")]
    scene: OsString,
    /// Normalised LED intervals, ascending: the table's columns.
    #[arg(long, value_delimiter = ',', default_values_t = [0.5, 1.0, 1.5, 2.0], allow_negative_numbers = true)]
    intervals: Vec<f64>,
    /// Distances in metres. Default: 30 to 70. Not with --criterion reach, which searches all distances.
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true)]
    distances: Option<Vec<f64>>,
    /// Ambient illuminances in lux, ascending: the table's rows. Default: the scene's.
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true)]
    illuminances: Option<Vec<f64>>,
    /// Yaw angles of the panel in degrees. The table is for the first; the others show what it costs there. With --criterion reach, the
    /// scene's yaw is used.
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true)]
    yaws: Option<Vec<f64>>,
    /// The criterion: greatest b2w or fisher, least ber (bit error rate), or greatest reach (distance at which a message arrives). Default:
    /// b2w; for a panel with a carrier only reach is possible, and the default.
    #[arg(long, value_parser = aim)]
    criterion: Option<Aim>,
    /// How the distances are combined: mean (of their best ratios, the default) or least-ber (the ratio of the least mean bit error rate).
    #[arg(long, value_parser = rule)]
    rule: Option<Rule>,
    /// Maximum frames per ratio, 64 to 100 000 000. Default: 100 000. With --criterion reach: per ratio and distance; default
    /// 4096.
    #[arg(long, value_parser = whole(1..=100_000_000))]
    frames: Option<u64>,
    /// End a search when the 95 % interval of the best ratio is at most ± this. Default: 0.01. With --criterion reach: ± this share of the
    /// ratio; default 0.05. 0: use all frames.
    #[arg(long, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// A quick search: fewer frames and a wider interval, unless they are given.
    #[arg(long)]
    quick: bool,
    /// The lowest and the highest ratio of the search.
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", default_values_t = RANGE, allow_negative_numbers = true)]
    range: Vec<f64>,
    /// Keep the scene's reflectance instead of drawing each frame's from 0.3 to 0.5.
    #[arg(long)]
    fixed_reflectance: bool,
    /// Count the errors of this detector: best, ml, kmeans, kmeans-raw, fisher, fisher-ngr, otsu or genie. Default: kmeans, the
    /// paper's detector; `best` takes longer.
    #[arg(long)]
    detector: Option<DetectorChoice>,
    /// Rendering level: fine or fast.
    #[arg(long, default_value = "fast", value_parser = single_precision)]
    level: Level,
    /// The table to write, with plots (.svg, .png) beside it.
    #[arg(short, long, value_name = "FILE.toml", value_parser = results::out_file("toml"))]
    out: Option<PathBuf>,
    /// Continue from the results in --out.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Search only entry i of every n, i from 0; `vocc merge` joins the parts.
    #[arg(long, value_name = "i/n", requires = "out")]
    shard: Option<Shard>,
    #[command(flatten)]
    reach: by_reach::Options,
}

/// The objective.
#[derive(Clone, Copy)]
enum Aim {
    /// A criterion at each distance.
    Criterion(Criterion),
    /// Reach over all distances.
    Reach,
}

fn aim(text: &str) -> Result<Aim, String> {
    match text.parse() {
        _ if text == "reach" => Ok(Aim::Reach),
        Ok(criterion) => Ok(Aim::Criterion(criterion)),
        Err(_) => Err(format!("no criterion {text:?}: choose b2w, fisher, ber or reach")),
    }
}

/// Parses the rule that combines the distances.
fn rule(text: &str) -> Result<Rule, String> {
    match text {
        "mean" => Ok(Rule::Mean),
        "least-ber" => Ok(Rule::LeastBer),
        _ => Err(format!("no rule {text:?}: choose mean or least-ber")),
    }
}

impl Arguments {
    fn range(&self) -> anyhow::Result<[f64; 2]> {
        let [low, high] = self.range[..] else {
            anyhow::bail!("--range needs two ratios, such as --range 0.2,4");
        };
        Ok([low, high])
    }

    /// The table's rows.
    fn illuminances(&self, scene: &Scene) -> Vec<f64> {
        let own = || vec![scene.ambient.illuminance_lx];
        self.illuminances.clone().unwrap_or_else(own)
    }

    /// Checks the output files before the search.
    fn check_out(&self, scene: &Scene) -> anyhow::Result<()> {
        let Some(path) = &self.out else { return Ok(()) };
        let read = outputs::files_of(&self.scene, scene);
        results::check(path, "toml", &["svg", "png"], read)
    }

    /// The table to continue: empty, or of an earlier run. Written at once, so that an unwritable file fails before the search.
    fn begun(&self, empty: TableFile) -> anyhow::Result<TableFile> {
        let Some(path) = &self.out else {
            return Ok(empty);
        };
        let begun = if path.exists() {
            ensure!(
                self.resume,
                "{} exists: continue from it with --resume, or give another file",
                path.display()
            );
            let begun = TableFile::read(path)?;
            ensure!(
                begun.is_of_same_survey(&empty),
                "{} is of other settings: scene, axes, distances, criterion, rule, frames, tolerance, range, seed, \
                 detector, level and version, by reach the message, the choice and the light too, must be the same",
                path.display()
            );
            begun.check().with_context(|| path.display().to_string())?;
            begun
        } else {
            empty
        };
        self.write(&begun)?;
        Ok(begun)
    }

    fn write(&self, file: &TableFile) -> anyhow::Result<()> {
        let Some(path) = &self.out else { return Ok(()) };
        files::write(path, as_toml(file)?)
    }
}

/// [`Verdict::Yes`] if every ratio is determined; reports the others.
pub fn verdict(file: &TableFile) -> Verdict {
    let mut answer = Verdict::Yes;
    for unknown in file.unknown() {
        tell(format_args!("vocc: {unknown}"));
        answer = Verdict::No;
    }
    answer
}

/// Searches, prints and writes.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let scene = shared.scene(&arguments.scene)?;
    arguments.check_out(&scene)?;
    let is_still = scene.link.waveform()?.is_still();
    let usual = if is_still { Aim::Criterion(Criterion::B2w) } else { Aim::Reach };
    match arguments.criterion.unwrap_or(usual) {
        Aim::Criterion(criterion) => by_criterion::run(arguments, shared, &scene, criterion),
        Aim::Reach => by_reach::run(arguments, shared, &scene),
    }
}

/// A table as TOML; an empty one lists the inputs of its search.
pub fn as_toml(file: &TableFile) -> anyhow::Result<String> {
    file.to_toml().context("the table cannot be written as TOML")
}
