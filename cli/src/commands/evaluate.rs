//! `vocc evaluate`: Monte Carlo at one setting.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::ensure;
use sim::accuracy::Level;
use sim::detectors::DetectorChoice;
use sim::evaluate::{Evaluator, Settings};
use sim::tally::Tally;

use crate::options::{Shared, until_interrupted};
use crate::output::{Answer, Progress};
use crate::results::{Results, Run};

/// The most frames of a run: at 100 000 a second, four months.
const MOST_FRAMES: u64 = 1_000_000_000_000;

/// The most parts of a run.
const MOST_SHARDS: u64 = 1_000_000;

/// Arguments of `vocc evaluate`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A preset or a TOML file.
    #[arg(default_value = "paper")]
    scene: String,
    /// Frames, each with random bits and a random sub-pixel phase.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=MOST_FRAMES))]
    frames: u64,
    /// Draw each frame's reflectance from 0.3 to 0.5.
    #[arg(long)]
    random_reflectance: bool,
    /// best, ml, kmeans, kmeans-raw, fisher, fisher-ngr, otsu, or genie (told everything but the bits: a bound). The default is
    /// the paper's, which takes a small part of a frame's time; `best` takes most of it.
    #[arg(long, default_value = "kmeans")]
    detector: DetectorChoice,
    /// How exactly frames are drawn: fine or fast.
    #[arg(long, default_value = "fast", value_parser = single_precision)]
    level: Level,
    /// Do only the i-th of n parts of the frames, i from 0; needs --out, and `vocc merge` to add the parts up.
    #[arg(long, value_name = "i/n", value_parser = shard, requires = "out")]
    shard: Option<(u64, u64)>,
    /// Keep what is finished in this file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Go on from what --out holds already.
    #[arg(long, requires = "out")]
    resume: bool,
}

/// Between two times that a run keeps what it has finished.
const KEEP_EVERY: Duration = Duration::from_secs(10);

/// One part of several.
fn shard(text: &str) -> Result<(u64, u64), String> {
    let parsed = text
        .split_once('/')
        .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parsed {
        Some((i, n)) if i < n && n <= MOST_SHARDS => Ok((i, n)),
        _ => Err(format!(
            "{text:?} is not i/n with i from 0 and below n, and n at most {MOST_SHARDS}, such as 0/8"
        )),
    }
}

/// A level that the Monte Carlo can run at.
pub fn single_precision(text: &str) -> Result<Level, String> {
    match text.parse()? {
        Level::Reference => Err(
            "the reference level is for single frames (`vocc render`): choose fine or fast".into(),
        ),
        level => Ok(level),
    }
}

/// Evaluates and prints.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    let settings = Settings {
        frames: arguments.frames,
        seed: shared.seed,
        random_reflectance: arguments.random_reflectance,
        detector: arguments.detector,
        level: arguments.level,
    };
    let scene = shared.scene(&arguments.scene)?;
    let run = Run::new(&scene, &settings);
    let mut results = Results {
        run,
        tally: Tally::default(),
    };
    if let Some(path) = arguments.out.as_ref().filter(|path| path.exists()) {
        ensure!(
            arguments.resume,
            "{} exists: go on from it with --resume, or name another file",
            path.display()
        );
        results.merge(path)?;
    }
    let (shard, shards) = arguments.shard.unwrap_or((0, 1));
    let chunks = u128::from(results.run.chunks());
    let border = |shard: u64| (chunks * u128::from(shard) / u128::from(shards)) as u64;
    let mine = border(shard)..border(shard + 1);
    let evaluator = Evaluator::new(&scene, settings)?;
    let going_on = until_interrupted()?;
    let mut progress = Progress::new(arguments.frames.div_ceil(shards), "frames");
    let (started, mut kept, mut trouble) = (Instant::now(), Instant::now(), None);
    let run = results.run.clone();
    evaluator.run_chunks(mine.clone(), &mut results.tally, |tally| {
        progress.done(tally.total().errors.frames());
        if let Some(path) = arguments
            .out
            .as_ref()
            .filter(|_| kept.elapsed() > KEEP_EVERY)
        {
            kept = Instant::now();
            let so_far = Results {
                run: run.clone(),
                tally: tally.clone(),
            };
            trouble = so_far.write(path).err();
        }
        trouble.is_none() && going_on()
    })?;
    let seconds = started.elapsed().as_secs_f64();
    drop(progress);
    if let Some(path) = &arguments.out {
        results.write(path)?;
    }
    let plan = evaluator.renderer().plan();
    results.report(plan, Some(seconds), shared.json)?;
    let finished = mine.into_iter().all(|chunk| results.tally.contains(chunk));
    Ok(if finished { Answer::Yes } else { Answer::No })
}
