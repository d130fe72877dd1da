//! `vocc accuracy`: what accuracy costs in time, as work-precision diagrams.

mod diagram;
mod kept;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use serde::Serialize;
use studies::stop::Stop;
use studies::work_precision::{CostUnit, Diagram, Measurable, PARTS, Part, Point, Scale, Steps};

use crate::files;
use crate::kept::Kept as _;
use crate::options::Shared;
use crate::output::{self, Answer, line};
use crate::outputs;
use crate::plot;
use crate::progress::Progress;
use crate::report::figure::{Figure, csv};
use crate::report::work_precision::{Made, page};
use crate::stop::{interrupted, stop};
use kept::{Kept, Run};

/// Arguments of `vocc accuracy`.
#[derive(clap::Args)]
#[command(after_help = crate::progress::HELP)]
pub struct Arguments {
    /// The folder to write to: accuracy.md, and a folder accuracy with its plots and numbers.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// A first look, in some 90 s on two cores: fewer frames, fewer turns.
    #[arg(long)]
    quick: bool,
    /// Measure only this part (repeatable) and take the others from what the folder holds.
    #[arg(long = "part", value_name = "NAME", value_parser = part_name)]
    parts: Vec<String>,
    /// Go on from what an interrupted run of the same settings has left in the folder.
    #[arg(long)]
    resume: bool,
}

/// The folder of plots and numbers beside the page.
const FOLDER: &str = "accuracy";
/// The file that keeps what is finished.
const KEPT: &str = "points.json";

fn part_name(name: &str) -> Result<String, String> {
    let names = PARTS.iter().map(|part| part.name);
    if names.clone().any(|known| known == name) {
        return Ok(name.into());
    }
    let names: Vec<&str> = names.collect();
    Err(format!("no part {name:?}: choose one of {}", names.join(", ")))
}

/// Measures, draws and writes.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    ensure!(
        shared.set.is_empty(),
        "vocc accuracy measures scenes of its own: leave --set {} out",
        shared.set.join(" --set ")
    );
    let scale = Scale {
        seed: shared.seed,
        ..if arguments.quick { Scale::QUICK } else { Scale::FULL }
    };
    let folder = arguments.out.join(FOLDER);
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let _held = outputs::hold(&folder)?;
    let path = folder.join(KEPT);
    let page = arguments.out.join("accuracy.md");
    outputs::check_beside(&path, std::slice::from_ref(&page))?;
    outputs::check([path.clone(), page], [])?;
    let mut kept = begin(arguments, Run::new(scale), &path)?;
    let asked = kept.missing.clone();
    let stop = stop();
    let finished = measure(&mut kept, &path, stop)?;
    // Whoever waits for the end of it has the points, and all else with --resume.
    if finished {
        write(&kept, arguments, &folder)?;
    }
    let measured = kept.parts.iter().filter(|part| asked.contains(&part.name));
    for part in measured {
        print(part, shared.json)?;
    }
    Ok(if finished { Answer::Yes } else { interrupted(&path) })
}

/// What need not be measured again.
fn begin(arguments: &Arguments, run: Run, path: &Path) -> anyhow::Result<Kept> {
    let goes_on = arguments.resume || !arguments.parts.is_empty();
    if !goes_on || !path.exists() {
        let wanted = |name: &&str| arguments.parts.is_empty() || arguments.parts.iter().any(|part| part == name);
        let mut kept = Kept::new(run);
        kept.missing = PARTS.iter().map(|part| part.name).filter(wanted).map(String::from).collect();
        return Ok(kept);
    }
    let mut kept = Kept::read(path, &run)?;
    kept.parts.retain(|part| !arguments.parts.contains(&part.name));
    if !arguments.resume {
        kept.begun.retain(|name, _| !arguments.parts.contains(name));
    }
    kept.missing = if arguments.parts.is_empty() {
        let names = PARTS.iter().map(|part| part.name.to_string());
        names.filter(|name| kept.parts.iter().all(|part| part.name != *name)).collect()
    } else {
        arguments.parts.clone()
    };
    Ok(kept)
}

/// Measures what is missing; false if it was asked to stop.
fn measure(kept: &mut Kept, path: &Path, stop: Stop) -> anyhow::Result<bool> {
    // What cannot be kept should not be measured first.
    kept.write(path)?;
    let missing = std::mem::take(&mut kept.missing);
    let mut progress = Progress::new(missing.len() as u64, "parts");
    for (done, name) in (0..).zip(&missing) {
        if stop.is_asked() {
            return Ok(false);
        }
        output::tell(format_args!("{name} …"));
        let Some(part) = PARTS.iter().find(|part| part.name == name) else {
            continue;
        };
        let measured = measure_part(part, kept, path).with_context(|| format!("the part {name} cannot be measured"))?;
        kept.begun.remove(name);
        kept.parts.push(measured);
        let place = |part: &Part| PARTS.iter().position(|known| known.name == part.name);
        kept.parts.sort_by_key(place);
        kept.write(path)?;
        progress.done(done + 1);
    }
    Ok(true)
}

/// Measures a part, and keeps each of its steps.
fn measure_part(part: &Measurable, kept: &mut Kept, path: &Path) -> anyhow::Result<Part> {
    let (scale, name) = (kept.run.scale, part.name);
    let finished = kept.begun.get(name).cloned().unwrap_or_default();
    let mut unwritten = Ok(());
    let steps = Steps::new(finished, |finished| {
        kept.begun.insert(name.into(), finished.clone());
        if unwritten.is_ok() {
            unwritten = kept.write(path);
        }
    });
    let measured = (part.measure)(&scale, &mut { steps })?;
    unwritten?;
    Ok(measured)
}

/// The page, its plots and its numbers.
fn write(kept: &Kept, arguments: &Arguments, folder: &Path) -> anyhow::Result<()> {
    let mut figures = Vec::new();
    for part in &kept.parts {
        let figure = Figure {
            name: PARTS
                .iter()
                .find(|known| known.name == part.name)
                .map_or("part", |known| known.name),
            caption: part.title.clone(),
            drawing: diagram::figure(part)?,
            csv: numbers(part)?,
        };
        figure.save(folder)?;
        figures.push(figure);
    }
    if let Some(drawing) = diagram::summary(&kept.parts)? {
        plot::save(&folder.join("summary"), &drawing)?;
    }
    let made = Made {
        options: &options(arguments, &kept.run.scale),
        scale: &kept.run.scale,
        machine: &kept.run.machine,
        folder: FOLDER,
    };
    let page = page(&kept.parts, &made, &figures);
    files::write(&arguments.out.join("accuracy.md"), page.markdown())
}

/// The options that make the same.
fn options(arguments: &Arguments, scale: &Scale) -> String {
    let quick = if arguments.quick { " --quick" } else { "" };
    match scale.seed {
        1 => format!(" --out docs{quick}"),
        seed => format!(" --out docs{quick} --seed {seed}"),
    }
}

/// All points of a part.
fn numbers(part: &Part) -> anyhow::Result<String> {
    let head = [
        "diagram",
        "variant",
        "curve",
        "error",
        "error_unit",
        "rms",
        "error_low",
        "error_high",
        "at_most",
        "cost",
        "cost_low",
        "cost_high",
        "cost_unit",
        "ratio",
        "ratio_low",
        "ratio_high",
        "baseline",
        "default",
        "on_front",
        "note",
    ];
    let rows = part.diagrams.iter().flat_map(|diagram| {
        diagram.points.iter().map(move |point| {
            let [low, high] = point.error_95.unwrap_or([point.error; 2]);
            let cost = [point.cost.median, point.cost.low, point.cost.high];
            let ratio = [point.ratio.median, point.ratio.low, point.ratio.high];
            let mut row = vec![
                diagram.title.clone(),
                point.variant.clone(),
                point.curve.clone(),
                point.error.to_string(),
                diagram.error_unit.clone(),
            ];
            row.push(point.rms.map_or_else(String::new, |rms| rms.to_string()));
            row.extend([low, high].map(|value| value.to_string()));
            row.push(point.at_most.to_string());
            row.extend(cost.map(|value| value.to_string()));
            row.push(unit(diagram.cost_unit).into());
            row.extend(ratio.map(|value| value.to_string()));
            row.extend([point.is_baseline, point.is_default, point.on_front].map(|is| is.to_string()));
            row.push(point.note.clone());
            row
        })
    });
    csv(&head, rows)
}

fn unit(unit: CostUnit) -> &'static str {
    match unit {
        CostUnit::Ns => "ns",
        CostUnit::Instructions => "instructions",
        CostUnit::Cycles => "cycles",
    }
}

/// A point on standard output.
#[derive(Serialize)]
struct Line<'a> {
    part: &'a str,
    diagram: &'a str,
    variant: &'a str,
    error: f64,
    error_unit: &'a str,
    error_rms: Option<f64>,
    error_95: Option<[f64; 2]>,
    error_at_most: bool,
    time_ns: Option<f64>,
    instructions: Option<f64>,
    cycles: Option<f64>,
    ratio: f64,
    ratio_quartiles: [f64; 2],
    on_front: bool,
    default: bool,
    baseline: bool,
}

fn print(part: &Part, as_json: bool) -> anyhow::Result<()> {
    for diagram in &part.diagrams {
        if !as_json {
            line(&format!("{}: {}, {}", part.name, diagram.title, diagram.error))?;
        }
        for point in &diagram.points {
            if as_json {
                output::json(&Line::of(part, diagram, point))?;
            } else {
                line(&row(point, diagram.cost_unit))?;
            }
        }
    }
    Ok(())
}

impl<'a> Line<'a> {
    fn of(part: &'a Part, diagram: &'a Diagram, point: &'a Point) -> Self {
        let cost = |unit| (diagram.cost_unit == unit).then_some(point.cost.median);
        Self {
            part: &part.name,
            diagram: &diagram.title,
            variant: &point.variant,
            error: point.error,
            error_unit: &diagram.error_unit,
            error_rms: point.rms,
            error_95: point.error_95,
            error_at_most: point.at_most,
            time_ns: cost(CostUnit::Ns),
            instructions: cost(CostUnit::Instructions),
            cycles: cost(CostUnit::Cycles),
            ratio: point.ratio.median,
            ratio_quartiles: [point.ratio.low, point.ratio.high],
            on_front: point.on_front,
            default: point.is_default,
            baseline: point.is_baseline,
        }
    }
}

fn row(point: &Point, cost_unit: CostUnit) -> String {
    format!(
        "  {} {:<24} {}{:<12.3e} {:>14.0} {}  × {:.3} ({:.3} to {:.3}){}",
        if point.on_front { "*" } else { " " },
        point.variant,
        if point.at_most { "<" } else { " " },
        point.error,
        point.cost.median,
        unit(cost_unit),
        point.ratio.median,
        point.ratio.low,
        point.ratio.high,
        if point.is_default { "  default" } else { "" },
    )
}
