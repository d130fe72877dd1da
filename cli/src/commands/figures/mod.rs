//! `vocc figures`: the figures of Do & Yoo 2020 and what becomes of their claims.

mod errors;
mod kept;
mod optima;
mod panels;
mod scatters;
#[cfg(test)]
mod tests;
mod variances;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use sim::scene::Scene;
use studies::reproduction::{Claim, Extent, Findings, INTERPRETATIONS, Interpretation, Pieces, Study, judge};

use crate::files;
use crate::kept::Kept as _;
use crate::numbers::{number, with_interval};
use crate::options::Shared;
use crate::output::{self, Answer, line};
use crate::outputs;
use crate::progress::Progress;
use crate::report::claims::{self, Judged};
use crate::report::figure::Figure;
use crate::stop::{interrupted, stop};
use kept::{Kept, Run};

/// Arguments of `vocc figures`.
#[derive(clap::Args)]
#[command(after_help = crate::progress::HELP)]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file; its interval, distance and L2A are varied.
    #[arg(default_value = "paper")]
    scene: String,
    /// The folder to write to.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Frames of each figure, spread over its points; 100000 by default.
    #[arg(long, value_parser = clap::value_parser!(u64).range(FRAMES))]
    frames: Option<u64>,
    /// A first look, in some 15 s on two cores: 4000 frames a figure by default, fewer points, no other readings.
    #[arg(long)]
    quick: bool,
    /// Go on from what an interrupted run of the same settings has left in the folder.
    #[arg(long)]
    resume: bool,
}

/// The fewest and the most frames of a figure: of more, one batch of a point would take a minute.
const FRAMES: std::ops::RangeInclusive<u64> = 1000..=100_000_000;
/// Frames of a figure, as many as the paper's whole set had.
const FULL_FRAMES: u64 = 100_000;
/// The same in a quick run.
const QUICK_FRAMES: u64 = 4000;
/// By how much the other readings have fewer frames.
const READING_SHARE: u64 = 10;
/// Between two times that a run keeps what it has finished.
const KEEP_EVERY: Duration = Duration::from_secs(10);
/// The file that keeps what is finished.
const KEPT: &str = "findings.json";

/// One scene under one reading, and how its findings are filed.
struct Part {
    name: &'static str,
    study: Study,
}

/// Computes, draws and reports.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    let frames = match (arguments.frames, arguments.quick) {
        (None, true) => QUICK_FRAMES,
        (None, false) => FULL_FRAMES,
        (Some(frames), _) => frames,
    };
    let parts = parts(arguments, shared, frames)?;
    std::fs::create_dir_all(&arguments.out).with_context(|| format!("cannot make the folder {}", arguments.out.display()))?;
    let _held = outputs::hold(&arguments.out)?;
    let path = arguments.out.join(KEPT);
    let reports = ["report.md", "report.html"].map(|name| arguments.out.join(name));
    outputs::check_beside(&path, &reports)?;
    outputs::check(
        reports.into_iter().chain([path.clone()]),
        outputs::files_of(&arguments.scene, &parts[0].study.scene),
    )?;
    let run = Run::new(&parts[0].study.scene, frames, arguments.quick, shared.seed);
    let mut kept = if arguments.resume && path.exists() {
        Kept::read(&path, &run)?
    } else {
        Kept::new(run)
    };
    if !compute(&parts, &mut kept, &path)? {
        return Ok(interrupted(&path));
    }
    let nothing = Findings::default();
    let of = |part: &Part| {
        let findings = kept.findings.get(part.name).unwrap_or(&nothing);
        judge(&part.study, findings)
    };
    let (main, others) = (&parts[0], &parts[1..]);
    let claims = of(main);
    let readings: Vec<Judged> = others
        .iter()
        .map(|part| Judged {
            name: part.name,
            claims: of(part),
        })
        .collect();
    let findings = kept.findings.get(main.name).unwrap_or(&nothing);
    let figures = figures(&main.study, findings)?;
    for figure in &figures {
        figure.save(&arguments.out)?;
    }
    let command = command(arguments, shared, frames);
    let report = claims::report(&main.study, &command, &claims, &readings, &figures);
    files::write(&arguments.out.join("report.md"), report.markdown())?;
    files::write(&arguments.out.join("report.html"), report.html())?;
    print(&claims, shared.json)?;
    Ok(Answer::Yes)
}

/// A study that Ctrl-C ends.
fn study(scene: Scene, extent: Extent, frames: u64, seed: u64) -> Study {
    Study {
        stop: stop(),
        ..Study::new(scene, extent, frames, seed)
    }
}

/// The scene itself, and the scene under each other reading.
fn parts(arguments: &Arguments, shared: &Shared, frames: u64) -> anyhow::Result<Vec<Part>> {
    let extent = if arguments.quick { Extent::Quick } else { Extent::Figures };
    let scene = shared.scene(&arguments.scene)?;
    let main = Part {
        name: "",
        study: study(scene, extent, frames, shared.seed),
    };
    // A first look is at the scene alone.
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

/// Does what is not done yet; false if it was asked to stop.
fn compute(parts: &[Part], kept: &mut Kept, path: &Path) -> anyhow::Result<bool> {
    // What cannot be kept should not be worked on first.
    kept.write(path)?;
    let tasks: Vec<_> = parts
        .iter()
        .flat_map(|part| part.study.tasks().into_iter().map(move |task| (part, task)))
        .collect();
    let mut progress = Progress::new(tasks.len() as u64, "tasks");
    let mut written = Instant::now();
    for (done, (part, task)) in (1..).zip(tasks) {
        let known = kept.findings.entry(part.name.into()).or_default().clone();
        if known.of(&task).is_some() {
            progress.begin_at(done);
            continue;
        }
        let mut pieces = kept.take_pieces(part.name, &task);
        let tell = |pieces: &Pieces| {
            if written.elapsed() > KEEP_EVERY {
                kept.keep_pieces(part.name, &task, pieces);
                if let Err(error) = kept.write(path) {
                    output::tell(format_args!("vocc: {error:#}; going on"));
                }
                written = Instant::now();
            }
        };
        let found = part.study.perform_on(&task, &known, &mut pieces, tell)?;
        let Some(found) = found else {
            kept.keep_pieces(part.name, &task, &pieces);
            kept.write(path)?;
            return Ok(false);
        };
        kept.take_pieces(part.name, &task);
        let findings = kept.findings.entry(part.name.into()).or_default();
        findings.keep(task, found);
        progress.done(done);
    }
    kept.write(path)?;
    Ok(true)
}

/// All figures whose data are there.
fn figures(study: &Study, findings: &Findings) -> anyhow::Result<Vec<Figure>> {
    let figures = [
        Some(panels::daylight(study)?),
        Some(panels::over_l2a(study)?),
        Some(scatters::over_l2a(study)?),
        variances::over_l2a(study, findings)?,
        Some(panels::over_interval(study)?),
        Some(scatters::over_interval(study)?),
        variances::over_interval(study, findings)?,
        Some(panels::over_distance(study)?),
        Some(scatters::over_distance(study)?),
        variances::over_distance(study, findings)?,
        optima::figure(study, findings)?,
        errors::figure(study, findings)?,
        errors::detectors(study, findings)?,
    ];
    Ok(figures.into_iter().flatten().collect())
}

/// The command that makes the same.
fn command(arguments: &Arguments, shared: &Shared, frames: u64) -> String {
    let mut words = vec![format!(
        "vocc figures {} --out DIR --frames {frames} --seed {}",
        arguments.scene, shared.seed
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
