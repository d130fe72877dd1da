//! `vocc evaluate`: Monte Carlo at one setting.

use std::time::Instant;

use serde::Serialize;
use sim::accuracy::Level;
use sim::detectors::DetectorChoice;
use sim::evaluate::{Evaluator, Settings};
use sim::plan::Plan;

use crate::options::{Shared, detector, until_interrupted};
use crate::output::{self, Answer, Progress, line};

/// The most frames of a run: at 100 000 a second, four months.
const MOST_FRAMES: u64 = 1_000_000_000_000;

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
    /// best, kmeans, kmeans-raw, fisher or otsu.
    #[arg(long, default_value = "best", value_parser = detector)]
    detector: DetectorChoice,
    /// How exactly frames are drawn: fine or fast.
    #[arg(long, default_value = "fast", value_parser = single_precision)]
    level: Level,
}

#[derive(Serialize)]
struct Report<'a> {
    frames: u64,
    bvar: f64,
    wvar: f64,
    b2w: f64,
    ber: f64,
    ber_95: [f64; 2],
    bits: u64,
    bit_errors: u64,
    seconds: f64,
    seed: u64,
    level: Level,
    plan: &'a Plan,
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
    let evaluator = Evaluator::new(&shared.scene(&arguments.scene)?, settings)?;
    let going_on = until_interrupted()?;
    let mut progress = Progress::new(arguments.frames, "frames");
    let started = Instant::now();
    let evaluation = evaluator.run(|frames| {
        progress.done(frames);
        going_on()
    })?;
    let seconds = started.elapsed().as_secs_f64();
    drop(progress);
    let variances = evaluation.distinguishability();
    let errors = evaluation.errors;
    let report = Report {
        frames: errors.frames(),
        bvar: variances.bvar,
        wvar: variances.wvar,
        b2w: variances.b2w,
        ber: errors.rate(),
        ber_95: errors.interval_95(),
        bits: errors.bits(),
        bit_errors: errors.errors(),
        seconds,
        seed: shared.seed,
        level: arguments.level,
        plan: evaluator.renderer().plan(),
    };
    if shared.json {
        output::json(&report)?;
    } else {
        output::plan(report.plan)?;
        line(&format!(
            "frames     {} in {seconds:.2} s ({:.0} a second)",
            report.frames,
            report.frames as f64 / seconds
        ))?;
        line(&format!("Bvar       {:.2}", report.bvar))?;
        line(&format!("Wvar       {:.2}", report.wvar))?;
        line(&format!("B2W        {:.2}", report.b2w))?;
        line(&format!(
            "bit errors {} of {}",
            report.bit_errors, report.bits
        ))?;
        line(&format!(
            "BER        {:.3e} (95 %: {:.3e} to {:.3e})",
            report.ber, report.ber_95[0], report.ber_95[1]
        ))?;
    }
    Ok(if report.frames == arguments.frames {
        Answer::Yes
    } else {
        Answer::No
    })
}
