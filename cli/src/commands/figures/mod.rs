//! `vocc figures`: the figures of Do & Yoo 2020, and a verdict on each of their claims.

mod checkpoint;
mod errors;
mod optima;
mod panels;
mod scatters;
#[cfg(test)]
mod tests;
mod variances;
mod variation;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use sim::scene::Scene;
use studies::reproduction::{Claim, Extent, Findings, INTERPRETATIONS, Interpretation, Pieces, Study, judge};

use crate::checkpoint::{Periodic, Resumable as _, hold_folder};
use crate::files;
use crate::numbers::{number, with_interval};
use crate::options::{SharedOptions, whole};
use crate::output::{self, Verdict, line};
use crate::outputs;
use crate::progress::Progress;
use crate::report::claims::{self, ReadingClaims};
use crate::report::figure::Figure;
use crate::stop::{interrupted, stop};
use checkpoint::{Checkpoint, Run};
use variation::{DISTANCE, INTERVAL, L2A};

/// Arguments of `vocc figures`.
#[derive(clap::Args)]
#[command(after_help = crate::progress::HELP)]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file; its interval, distance and L2A are varied.
    #[arg(default_value = "paper")]
    scene: OsString,
    /// The folder to write to.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Frames per figure, divided among its points. Default: 100000.
    #[arg(long, value_parser = whole(FRAMES))]
    frames: Option<u64>,
    /// A quick run of about 15 s on two cores: 4000 frames per figure by default, fewer points, no other readings.
    #[arg(long)]
    quick: bool,
    /// Continue an interrupted run of the same settings from what it left in the folder.
    #[arg(long)]
    resume: bool,
}

/// Minimum and maximum frames of a figure. Beyond, one batch of a point takes a minute.
const FRAMES: std::ops::RangeInclusive<u64> = 1000..=100_000_000;
/// Frames of a figure, as in the paper's whole set.
const FULL_FRAMES: u64 = 100_000;
/// Frames of a figure in a quick run.
const QUICK_FRAMES: u64 = 4000;
/// Divisor of the frames for the other readings.
const READING_SHARE: u64 = 10;
/// The checkpoint file.
const CHECKPOINT: &str = "findings.json";

/// A scene under one reading, and the key of its findings.
struct Part {
    name: &'static str,
    study: Study,
}

/// Computes, draws and reports.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let frames = match (arguments.frames, arguments.quick) {
        (None, true) => QUICK_FRAMES,
        (None, false) => FULL_FRAMES,
        (Some(frames), _) => frames,
    };
    let parts = parts(arguments, shared, frames)?;
    let path = arguments.out.join(CHECKPOINT);
    let reports = ["report.md", "report.html"].map(|name| arguments.out.join(name));
    let inputs = outputs::files_of(&arguments.scene, &parts[0].study.scene);
    let _held = hold_folder(&path, reports.into(), inputs)?;
    let run = Run::new(&parts[0].study.scene, frames, arguments.quick, shared.seed);
    let mut checkpoint = if arguments.resume && path.exists() {
        Checkpoint::read(&path, &run)?
    } else {
        Checkpoint::new(run)
    };
    if !compute(&parts, &mut checkpoint, &path)? {
        return Ok(interrupted(&path));
    }
    let nothing = Findings::default();
    let of = |part: &Part| {
        let findings = checkpoint.findings.get(part.name).unwrap_or(&nothing);
        judge(&part.study, findings)
    };
    let (main, others) = (&parts[0], &parts[1..]);
    let claims = of(main);
    let readings: Vec<ReadingClaims> = others
        .iter()
        .map(|part| ReadingClaims {
            name: part.name,
            claims: of(part),
        })
        .collect();
    let findings = checkpoint.findings.get(main.name).unwrap_or(&nothing);
    let figures = figures(&main.study, findings)?;
    for figure in &figures {
        figure.save(&arguments.out)?;
    }
    let command = command(arguments, shared, frames);
    let report = claims::report(&main.study, &command, &claims, &readings, &figures);
    files::write(&arguments.out.join("report.md"), report.markdown())?;
    files::write(&arguments.out.join("report.html"), report.html())?;
    print(&claims, shared.json)?;
    Ok(Verdict::Yes)
}

/// A study that Ctrl-C stops.
fn study(scene: Scene, extent: Extent, frames: u64, seed: u64) -> Study {
    Study {
        stop: stop(),
        ..Study::new(scene, extent, frames, seed)
    }
}

/// The scene itself, and under each other reading.
fn parts(arguments: &Arguments, shared: &SharedOptions, frames: u64) -> anyhow::Result<Vec<Part>> {
    let extent = if arguments.quick { Extent::Quick } else { Extent::Figures };
    let scene = shared.scene(&arguments.scene)?;
    let main = Part {
        name: "",
        study: study(scene, extent, frames, shared.seed),
    };
    // A quick run has the scene alone.
    let others: &[Interpretation] = if arguments.quick { &[] } else { &INTERPRETATIONS };
    let others = others.iter().map(|reading| {
        let own = reading.overrides.iter().map(|text| text.to_string());
        let settings: Vec<String> = shared.set.iter().cloned().chain(own).collect();
        let scene = Scene::load(&arguments.scene, &settings)?;
        let frames = frames / READING_SHARE;
        Ok(Part {
            name: reading.name,
            study: study(scene, Extent::Claims, frames, shared.seed),
        })
    });
    std::iter::once(Ok(main)).chain(others).collect()
}

/// Computes the missing tasks; false if interrupted.
fn compute(parts: &[Part], checkpoint: &mut Checkpoint, path: &Path) -> anyhow::Result<bool> {
    // Fail before computing if the file cannot be written.
    checkpoint.write(path)?;
    let tasks: Vec<_> = parts
        .iter()
        .flat_map(|part| part.study.tasks().into_iter().map(move |task| (part, task)))
        .collect();
    let mut progress = Progress::new(tasks.len() as u64, "tasks");
    let mut now_and_then = Periodic::begin();
    for (done, (part, task)) in (1..).zip(tasks) {
        let known = checkpoint.findings.entry(part.name.into()).or_default().clone();
        if known.of(&task).is_some() {
            progress.begin_at(done);
            continue;
        }
        let mut pieces = checkpoint.take_pieces(part.name, &task);
        let tell = |pieces: &Pieces| {
            now_and_then.write(|| {
                checkpoint.keep_pieces(part.name, &task, pieces);
                checkpoint.write(path)
            });
        };
        let found = part.study.perform_on(&task, &known, &mut pieces, tell)?;
        let Some(found) = found else {
            checkpoint.keep_pieces(part.name, &task, &pieces);
            checkpoint.write(path)?;
            return Ok(false);
        };
        checkpoint.take_pieces(part.name, &task);
        let findings = checkpoint.findings.entry(part.name.into()).or_default();
        findings.keep(task, found);
        progress.done(done);
    }
    checkpoint.write(path)?;
    Ok(true)
}

/// All figures with complete data.
fn figures(study: &Study, findings: &Findings) -> anyhow::Result<Vec<Figure>> {
    let panels = |name, caption, variation, values: &[f64]| panels::figure(study, name, caption, variation, values).map(Some);
    let scatters = |name, caption, variation, values: &[f64]| scatters::figure(study, name, caption, variation, values).map(Some);
    let axes = &study.axes;
    let figures = [
        panels::daylight(study).map(Some),
        panels(
            "figure-12",
            "The same bits at L2A 0.2, 1, 2 and 4: interval 1, 50 m.",
            &L2A,
            &[0.2, 1.0, 2.0, 4.0],
        ),
        scatters(
            "figure-13",
            "Features of the LEDs in ten frames at low, mid and high L2A: interval 1, 50 m.",
            &L2A,
            &[0.2, 2.0, 4.0],
        ),
        variances::figure(
            findings,
            (
                "figure-14",
                "Variances over L2A (interval 1, 50 m), and the grey levels at the centres of On and Off LEDs. Vertical lines: the paper's \
                 numbers.",
            ),
            &L2A,
            (&axes.l2a, &study.over_l2a()),
            true,
        ),
        panels(
            "figure-15",
            "The same bits at intervals 0.5, 1, 1.5 and 2, zoomed to the same size: L2A 1, 50 m.",
            &INTERVAL,
            &[0.5, 1.0, 1.5, 2.0],
        ),
        scatters(
            "figure-16",
            "Features of the LEDs in ten frames at four intervals: L2A 1, 50 m.",
            &INTERVAL,
            &[0.5, 1.0, 1.5, 2.0],
        ),
        variances::figure(
            findings,
            (
                "figure-17",
                "Variances over the interval (L2A 1, 50 m). Vertical line: the paper's number.",
            ),
            &INTERVAL,
            (&axes.interval, &study.over_interval()),
            false,
        ),
        panels(
            "figure-18",
            "The same bits at 30, 50 and 70 m, zoomed to the same size: L2A 1, interval 1.",
            &DISTANCE,
            &[30.0, 50.0, 70.0],
        ),
        scatters(
            "figure-19",
            "Features of the LEDs in ten frames at three distances: L2A 1, interval 1.",
            &DISTANCE,
            &[30.0, 50.0, 70.0],
        ),
        variances::figure(
            findings,
            ("figure-20", "Variances over the distance (L2A 1, interval 1)."),
            &DISTANCE,
            (&axes.distance_m, &study.over_distance()),
            false,
        ),
        optima::figure(study, findings),
        errors::figure(study, findings),
        errors::detectors(study, findings),
    ];
    figures.into_iter().filter_map(Result::transpose).collect()
}

/// The command that reproduces this run.
fn command(arguments: &Arguments, shared: &SharedOptions, frames: u64) -> String {
    let mut words = vec![format!(
        "vocc figures {} --out DIR --frames {frames} --seed {}",
        arguments.scene.display(),
        shared.seed
    )];
    words.extend(arguments.quick.then(|| "--quick".into()));
    words.extend(shared.set.iter().map(|set| format!("--set {set}")));
    words.join(" ")
}

fn print(claims: &[Claim], as_json: bool) -> anyhow::Result<()> {
    if as_json {
        return claims.iter().try_for_each(output::json);
    }
    for claim in claims {
        line(&format!(
            "{:<4} {:<5} {} — {}: {}",
            claim.figure,
            claims::verdict(claim.holds),
            claim.claim,
            claim.quantity,
            with_interval(claim.measured, claim.measured_95, number)
        ))?;
    }
    Ok(())
}
