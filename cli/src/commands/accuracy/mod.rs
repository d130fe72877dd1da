//! `vocc accuracy`: accuracy against run time, as work-precision diagrams.

mod checkpoint;
mod diagram;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use serde::Serialize;
use studies::stop::Stop;
use studies::work_precision::{CostUnit, Diagram, Measurable, PARTS, Part, Point, Scale, Steps};

use crate::checkpoint::{Resumable as _, hold_folder};
use crate::files;
use crate::options::SharedOptions;
use crate::output::{self, Verdict, line};
use crate::plot;
use crate::progress::Progress;
use crate::report::figure::{Figure, csv};
use crate::report::work_precision::{OVERVIEW, Provenance, page};
use crate::stop::{interrupted, stop};
use checkpoint::{Checkpoint, Run};

/// Arguments of `vocc accuracy`.
#[derive(clap::Args)]
#[command(after_help = crate::progress::HELP)]
pub struct Arguments {
    /// The folder to write to: accuracy.md, and a folder accuracy with plots and numbers.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// A quick run of about 90 s on two cores: fewer frames, fewer repetitions.
    #[arg(long)]
    quick: bool,
    /// Measure only this part (repeatable) and take the others from the folder.
    #[arg(long = "part", value_name = "NAME", value_parser = part_name)]
    parts: Vec<String>,
    /// Continue an interrupted run of the same settings from what it left in the folder.
    #[arg(long)]
    resume: bool,
}

/// The folder of plots and numbers, next to the page.
const FOLDER: &str = "accuracy";
/// The checkpoint file.
const CHECKPOINT: &str = "points.json";

fn part_name(name: &str) -> Result<String, String> {
    let names = PARTS.iter().map(|part| part.name);
    if names.clone().any(|known| known == name) {
        return Ok(name.into());
    }
    let names: Vec<&str> = names.collect();
    Err(format!("no part {name:?}: choose one of {}", names.join(", ")))
}

/// Measures, draws and writes the report.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    ensure!(
        shared.set.is_empty(),
        "vocc accuracy measures fixed scenes: omit --set {}",
        shared.set.join(" --set ")
    );
    let scale = Scale {
        seed: shared.seed,
        ..if arguments.quick { Scale::QUICK } else { Scale::FULL }
    };
    let folder = arguments.out.join(FOLDER);
    let path = folder.join(CHECKPOINT);
    let _held = hold_folder(&path, vec![arguments.out.join("accuracy.md")], [])?;
    let mut checkpoint = begin(arguments, Run::new(scale), &path)?;
    let asked = checkpoint.missing.clone();
    let stop = stop();
    let finished = measure(&mut checkpoint, &path, stop)?;
    // If the run is interrupted, the points are kept, and --resume does the rest.
    if finished {
        write(&checkpoint, arguments, &folder)?;
    }
    let measured = checkpoint.parts.iter().filter(|part| asked.contains(&part.name));
    for part in measured {
        print(part, shared.json)?;
    }
    Ok(if finished { Verdict::Yes } else { interrupted(&path) })
}

/// The checkpoint to start from: parts that need not be measured again.
fn begin(arguments: &Arguments, run: Run, path: &Path) -> anyhow::Result<Checkpoint> {
    let goes_on = arguments.resume || !arguments.parts.is_empty();
    if !goes_on || !path.exists() {
        let wanted = |name: &&str| arguments.parts.is_empty() || arguments.parts.iter().any(|part| part == name);
        let mut checkpoint = Checkpoint::new(run);
        checkpoint.missing = PARTS.iter().map(|part| part.name).filter(wanted).map(String::from).collect();
        return Ok(checkpoint);
    }
    let mut checkpoint = Checkpoint::read(path, &run)?;
    checkpoint.parts.retain(|part| !arguments.parts.contains(&part.name));
    if !arguments.resume {
        checkpoint.begun.retain(|name, _| !arguments.parts.contains(name));
    }
    checkpoint.missing = if arguments.parts.is_empty() {
        let names = PARTS.iter().map(|part| part.name.to_string());
        names
            .filter(|name| checkpoint.parts.iter().all(|part| part.name != *name))
            .collect()
    } else {
        arguments.parts.clone()
    };
    Ok(checkpoint)
}

/// Measures the missing parts; false if interrupted.
fn measure(checkpoint: &mut Checkpoint, path: &Path, stop: Stop) -> anyhow::Result<bool> {
    // Fail before measuring if the file cannot be written.
    checkpoint.write(path)?;
    let missing = std::mem::take(&mut checkpoint.missing);
    let mut progress = Progress::new(missing.len() as u64, "parts");
    for (done, name) in (0..).zip(&missing) {
        if stop.is_asked() {
            return Ok(false);
        }
        output::tell(format_args!("{name} …"));
        let Some(part) = PARTS.iter().find(|part| part.name == name) else {
            continue;
        };
        let measured = measure_part(part, checkpoint, path).with_context(|| format!("the part {name} cannot be measured"))?;
        checkpoint.begun.remove(name);
        checkpoint.parts.push(measured);
        let place = |part: &Part| PARTS.iter().position(|known| known.name == part.name);
        checkpoint.parts.sort_by_key(place);
        checkpoint.write(path)?;
        progress.done(done + 1);
    }
    Ok(true)
}

/// Measures a part, and writes the checkpoint after each of its steps.
fn measure_part(part: &Measurable, checkpoint: &mut Checkpoint, path: &Path) -> anyhow::Result<Part> {
    let (scale, name) = (checkpoint.run.scale, part.name);
    let finished = checkpoint.begun.get(name).cloned().unwrap_or_default();
    let mut unwritten = Ok(());
    let steps = Steps::new(finished, |finished| {
        checkpoint.begun.insert(name.into(), finished.clone());
        if unwritten.is_ok() {
            unwritten = checkpoint.write(path);
        }
    });
    let measured = part.measure(&scale, &mut { steps })?;
    unwritten?;
    Ok(measured)
}

/// Writes the page, its plots and its numbers.
fn write(checkpoint: &Checkpoint, arguments: &Arguments, folder: &Path) -> anyhow::Result<()> {
    let mut figures = Vec::new();
    for part in &checkpoint.parts {
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
    let overview = diagram::summary(&checkpoint.parts)?;
    if let Some(drawing) = &overview {
        plot::save(&folder.join(OVERVIEW), drawing)?;
    }
    let made = Provenance {
        options: &options(arguments, &checkpoint.run.scale),
        scale: &checkpoint.run.scale,
        machine: &checkpoint.run.machine,
        folder: FOLDER,
    };
    let page = page(&checkpoint.parts, &made, overview.as_ref(), &figures);
    files::write(&arguments.out.join("accuracy.md"), page.markdown())
}

/// The command-line options that reproduce this run.
fn options(arguments: &Arguments, scale: &Scale) -> String {
    let quick = if arguments.quick { " --quick" } else { "" };
    match scale.seed {
        1 => format!(" --out docs{quick}"),
        seed => format!(" --out docs{quick} --seed {seed}"),
    }
}

/// A column of a part's numbers: heading, and the cell of a point.
type Column = (&'static str, fn(&Diagram, &Point) -> String);

/// The columns of a part's numbers.
const COLUMNS: [Column; 20] = [
    ("diagram", |diagram, _| diagram.title.clone()),
    ("variant", |_, point| point.variant.clone()),
    ("curve", |_, point| point.curve.clone()),
    ("error", |_, point| point.error.to_string()),
    ("error_unit", |diagram, _| diagram.error_unit.clone()),
    ("rms", |_, point| point.rms.map_or_else(String::new, |rms| rms.to_string())),
    ("error_low", |_, point| {
        point.error_95.map_or(point.error, |[low, _]| low).to_string()
    }),
    ("error_high", |_, point| {
        point.error_95.map_or(point.error, |[_, high]| high).to_string()
    }),
    ("at_most", |_, point| point.at_most.to_string()),
    ("cost", |_, point| point.cost.median.to_string()),
    ("cost_low", |_, point| point.cost.low.to_string()),
    ("cost_high", |_, point| point.cost.high.to_string()),
    ("cost_unit", |diagram, _| unit(diagram.cost_unit).into()),
    ("ratio", |_, point| point.ratio.median.to_string()),
    ("ratio_low", |_, point| point.ratio.low.to_string()),
    ("ratio_high", |_, point| point.ratio.high.to_string()),
    ("baseline", |_, point| point.is_baseline.to_string()),
    ("default", |_, point| point.is_default.to_string()),
    ("on_front", |_, point| point.on_front.to_string()),
    ("note", |_, point| point.note.clone()),
];

fn numbers(part: &Part) -> anyhow::Result<String> {
    let points = part
        .diagrams
        .iter()
        .flat_map(|diagram| diagram.points.iter().map(move |point| (diagram, point)));
    let rows = points.map(|(diagram, point)| COLUMNS.map(|(_, of)| of(diagram, point)).to_vec());
    csv(&COLUMNS.map(|(name, _)| name), rows)
}

fn unit(unit: CostUnit) -> &'static str {
    match unit {
        CostUnit::Ns => "ns",
        CostUnit::Instructions => "instructions",
        CostUnit::Cycles => "cycles",
    }
}

/// A point as JSON on standard output.
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
