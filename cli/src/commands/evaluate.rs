//! `vocc evaluate`: Monte Carlo at one setting.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::ensure;
use sim::accuracy::Level;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::Settings;
use studies::sweep::{MOST_FRAMES, Results, Run, Shard, Sweep};

use crate::camera::CameraArguments;
use crate::options::{SharedOptions, whole};
use crate::output::{self, Verdict};
use crate::outputs;
use crate::progress::Progress;
use crate::results;
use crate::stop::stop;

/// Arguments of `vocc evaluate`.
#[derive(clap::Args)]
#[command(after_help = crate::progress::HELP)]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file.
    #[arg(default_value = "paper")]
    scene: OsString,
    /// Frames, each with random bits and a random sub-pixel phase.
    #[arg(long, default_value_t = 1000, value_parser = whole(1..=MOST_FRAMES))]
    frames: u64,
    /// Draw each frame's reflectance from 0.3 to 0.5.
    #[arg(long)]
    random_reflectance: bool,
    /// best, ml, kmeans, kmeans-raw, fisher, fisher-ngr, otsu, or genie (knows everything but the bits: a lower bound on wrong panels). The
    /// default is the paper's detector; `best` takes longer.
    #[arg(long, default_value = "kmeans")]
    detector: DetectorChoice,
    /// Estimate the bit error rate by splitting instead of counting: for rates below about 1e-6. --frames is then the number of frames that
    /// the swarms of 256 start from.
    #[arg(long)]
    rare_events: bool,
    /// Rendering level: fine or fast.
    #[arg(long, default_value = "fast", value_parser = single_precision)]
    level: Level,
    /// Evaluate only part i of n of the frames, i from 0. Needs --out; `vocc merge` adds the parts up.
    #[arg(long, value_name = "i/n", requires = "out")]
    shard: Option<Shard>,
    /// Save the results in this file during the run, and a table (.csv) beside it.
    #[arg(long, value_name = "FILE.json", value_parser = results::out_file("json"))]
    out: Option<PathBuf>,
    /// Continue from the results in --out.
    #[arg(long, requires = "out")]
    resume: bool,
    #[command(flatten)]
    camera: CameraArguments,
}

/// A level that the Monte Carlo can run at.
pub fn single_precision(text: &str) -> Result<Level, String> {
    match text.parse()? {
        Level::Reference => Err("the reference level is for single frames (`vocc render`): choose fine or fast".into()),
        level => Ok(level),
    }
}

/// Evaluates and prints.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let settings = Settings {
        frames: arguments.frames,
        seed: shared.seed,
        random_reflectance: arguments.random_reflectance,
        detector: arguments.detector,
        level: arguments.level,
        camera: arguments.camera.camera_if_any()?,
        stop: stop(),
    };
    let mut sweep = Sweep::single(shared.scene(&arguments.scene)?, &settings);
    sweep.rare_events = arguments.rare_events;
    if let Some(path) = &arguments.out {
        let scene = outputs::files_of(&arguments.scene, &sweep.scene);
        results::check(path, "json", &["csv"], scene.into_iter().chain(arguments.camera.file()))?;
    }
    let place = arguments.out.as_deref().map(results::Place::new);
    let mut results = Results::new(sweep.clone());
    if let Some(path) = arguments.out.as_ref().filter(|path| path.exists()) {
        ensure!(
            arguments.resume,
            "{} exists: continue from it with --resume, or give another file",
            path.display()
        );
        results::merge(&mut results, path)?;
    }
    let shard = arguments.shard.unwrap_or(Shard::WHOLE);
    let run = Run::new(&sweep, shard, None)?.until(settings.stop);
    let mut progress = Progress::new(arguments.frames.div_ceil(shard.count()), "frames");
    progress.begin_at(run.frames_done(&results));
    let started = Instant::now();
    let keep = |results: &Results| match &place {
        Some(place) => place.keep(|path| results::write_with_table(results, path)),
        None => Ok(()),
    };
    if let Some(place) = &place {
        // Reserve the file before the work, so that another run cannot take it and an unwritable file fails first.
        place.keep(|path| results::write(&results, path))?;
    }
    let done = results::advance(&run, &mut results, keep, |news| {
        progress.done(news.frames);
        Ok(true)
    });
    let seconds = started.elapsed().as_secs_f64();
    drop(progress);
    // Results that cannot be stored are at least printed.
    if done.is_ok() || results.chunks_of(0) > 0 {
        output::evaluation(&results, Some(seconds), shared.json)?;
    }
    Ok(if done? { Verdict::Yes } else { Verdict::No })
}
