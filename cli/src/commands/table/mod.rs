//! `vocc table`: shows, validates, compares and transfers tables.

mod diff;
mod regret;
mod transfer;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Subcommand;
use link::l2a_table::{Illuminance, Interval, L2aTable};
use link::waveform::Waveform;
use serde::Serialize;
use sim::l2a::file::RatioFile;
use sim::l2a::{OtherWaveform, SHIPPED_FOR};
use studies::table::TableFile;

use self::regret::Regret;
use self::transfer::Transfer;
use crate::options::SharedOptions;
use crate::output::{self, Verdict, json, line, tell};
use crate::{outputs, plot, report};

/// Arguments of `vocc table`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Print a table's ratios as a transmitter carries them.
    Show {
        /// The table's TOML file. Default: the table in the firmware.
        file: Option<PathBuf>,
        #[command(flatten)]
        shown: TableUse,
        /// Print the Rust source that the firmware's own table is built from.
        #[arg(long, requires = "file")]
        rust: bool,
        /// Draw the ratio over the light with 95 % bands, as NAME.svg and NAME.png. For a table by reach also the reach over the ratio, for
        /// one of least regret the loss of each ratio.
        #[arg(long, value_name = "NAME", value_parser = plot::stem(), conflicts_with = "rust")]
        plot: Option<PathBuf>,
    },
    /// Compare two tables: their ratios, and the difference in reach if one of them, or the table of --in, was made by reach. Exit status
    /// 1 if they differ.
    Diff {
        /// The table's TOML file.
        old: PathBuf,
        /// The other table's TOML file.
        new: PathBuf,
        /// Compare the reaches in the scene of this table, which must be made by reach.
        #[arg(long = "in", value_name = "FILE.toml")]
        scene: Option<PathBuf>,
    },
    /// Compute the loss of reach from a wrong light sensor, other LEDs or another camera.
    Regret(Regret),
    /// Check that a transmitter can use a table, and that each of its ratios was determined.
    Check {
        /// The table's TOML file.
        file: PathBuf,
        #[command(flatten)]
        shown: TableUse,
    },
    /// Write a table to a transmitter, which stores and uses it.
    Push(Transfer),
    /// Read the table that a transmitter uses.
    Pull(Transfer),
    /// Check that a transmitter uses this table.
    Verify(Transfer),
}

/// The waveform that the table is to be used with.
#[derive(clap::Args)]
struct TableUse {
    /// Warn if the table is not made for a carrier of this many cycles per symbol, 0 for still panels.
    #[arg(long, value_name = "N")]
    carrier_cycles: Option<u32>,
}

impl TableUse {
    /// Warns if a table is made for another waveform.
    fn compare(&self, made_for: Waveform) -> anyhow::Result<()> {
        let shown = self.carrier_cycles.map(Waveform::new).transpose()?;
        if let Some(other) = shown.and_then(|shown| OtherWaveform::if_any(made_for, shown)) {
            tell(format_args!("vocc: {other}"));
        }
        Ok(())
    }
}

/// A table as carried by a transmitter: ratios rounded to 1/8192.
#[derive(Serialize)]
struct CarriedTable {
    /// Cycles per symbol of the carrier that the table is made for, 0 for still panels, as recorded in its file.
    carrier_cycles: u16,
    illuminance_lx: Vec<f64>,
    interval: Vec<f64>,
    l2a: Vec<Vec<f64>>,
    /// The reach of each ratio in metres, if the table is by reach.
    #[serde(skip_serializing_if = "Option::is_none")]
    reach_m: Option<Vec<Vec<f64>>>,
    /// The greatest distance at which a panel of each interval is found, in metres, if the table is for one scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    found_to_m: Option<Vec<f64>>,
}

/// Runs the requested action.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    match &arguments.action {
        Action::Show {
            file: Some(path),
            rust: true,
            ..
        } => {
            // Reject a table that transmitters do not accept.
            let (file, _) = TableFile::read_with_table(path)?;
            output::lines(&source(&file))?;
        }
        Action::Show { file, plot, shown, .. } => show(file.as_deref(), plot.as_deref(), shown, shared.json)?,
        Action::Diff { old, new, scene } => {
            return diff::run(old, new, scene.as_deref(), shared.json);
        }
        Action::Regret(regret) => return regret.run(shared.json),
        Action::Push(transfer) => return transfer.push(shared),
        Action::Pull(transfer) => return transfer.pull(shared),
        Action::Verify(transfer) => return transfer.verify(shared),
        Action::Check { file: path, shown } => {
            let (file, table) = checked(path)?;
            if let Some(unknown) = file.unknown().next() {
                return Err(unknown).with_context(|| path.display().to_string());
            }
            let waveform = file.ratios.waveform;
            let carried = CarriedTable::of(&table, waveform);
            match shared.json {
                true => json(&carried)?,
                false => line(&format!(
                    "{}: a table of {} illuminances and {} intervals, made for {}",
                    path.display(),
                    carried.illuminance_lx.len(),
                    carried.interval.len(),
                    OtherWaveform::words(waveform)
                ))?,
            }
            shown.compare(waveform)?;
        }
    }
    Ok(Verdict::Yes)
}

/// A table and its whole file, checked for consistency.
fn checked(path: &Path) -> anyhow::Result<(TableFile, L2aTable)> {
    let (file, table) = TableFile::read_with_table(path)?;
    file.check().with_context(|| path.display().to_string())?;
    Ok((file, table))
}

/// Prints a table, by default the firmware's, and optionally draws it.
fn show(file: Option<&Path>, plot: Option<&Path>, shown: &TableUse, as_json: bool) -> anyhow::Result<()> {
    let plots = plot.map(plot::files_of).into_iter().flatten();
    outputs::check(plots, file.map(Path::to_owned))?;
    let (carried, file) = match file {
        Some(path) => {
            let (file, table) = TableFile::read_with_table(path)?;
            let carried = CarriedTable {
                reach_m: reaches(&file),
                found_to_m: file.found_to_m(),
                ..CarriedTable::of(&table, file.ratios.waveform)
            };
            (carried, file)
        }
        None => {
            let carried = CarriedTable::of(&L2aTable::shipped(), SHIPPED_FOR);
            let file = TableFile::plain(carried.ratios());
            (carried, file)
        }
    };
    if as_json {
        json(&carried)?;
    } else {
        carried.print()?;
        line(&format!("made for {}", OtherWaveform::words(file.ratios.waveform)))?;
        report::table::sketch(&file).iter().try_for_each(|sketch| line(sketch))?;
        let reach = file.reach.entries.iter();
        let reach = reach.map(|entry| report::table::reach_line(entry, file.found_at_m(entry.interval)));
        print_under(report::table::REACH_HEAD, reach)?;
        let regret = file.regret.entries.iter().map(report::table::regret_line);
        print_under(report::table::REGRET_HEAD, regret)?;
        if !file.reach.entries.is_empty() || !file.regret.entries.is_empty() {
            line(&report::table::found_line(&file))?;
        }
    }
    shown.compare(file.ratios.waveform)?;
    match plot {
        Some(stem) => plot::save(stem, &report::table::draw(&file)?),
        None => Ok(()),
    }
}

/// The reach of each of a table's ratios, in the order of [`CarriedTable::l2a`]; `None` if one is unknown.
fn reaches(file: &TableFile) -> Option<Vec<Vec<f64>>> {
    let reach = |place| file.reach.entry(place).map(|entry| entry.reach_m);
    let row = |&illuminance: &f64| {
        file.ratios
            .interval
            .iter()
            .map(|&interval| reach([illuminance, interval]))
            .collect()
    };
    file.ratios.illuminance_lx.iter().map(row).collect()
}

fn print_under(head: &str, lines: impl Iterator<Item = String>) -> anyhow::Result<()> {
    let mut lines = lines.peekable();
    if lines.peek().is_some() {
        line(head)?;
    }
    lines.try_for_each(|entry| line(&entry))
}

impl CarriedTable {
    /// The table in the file format.
    fn ratios(&self) -> RatioFile {
        RatioFile {
            l2a: self.l2a.clone(),
            ..RatioFile::empty(self.illuminance_lx.clone(), self.interval.clone())
        }
    }

    fn of(table: &L2aTable, made_for: Waveform) -> Self {
        let interval: Vec<f64> = table.intervals().iter().map(|i| i.to_num()).collect();
        let ratios: Vec<f64> = table.values().iter().map(|ratio| ratio.to_num()).collect();
        Self {
            carrier_cycles: made_for.cycles(),
            illuminance_lx: table.illuminances_lx().iter().map(|e| e.to_num()).collect(),
            l2a: ratios.chunks(interval.len()).map(<[f64]>::to_vec).collect(),
            interval,
            reach_m: None,
            found_to_m: None,
        }
    }

    fn print(&self) -> anyhow::Result<()> {
        let columns = self.interval.iter().map(|interval| format!("{interval:>8.2}"));
        line(&format!("L2A at interval {}", columns.collect::<String>()))?;
        for (illuminance, ratios) in self.illuminance_lx.iter().zip(&self.l2a) {
            let ratios = ratios.iter().map(|ratio| format!("{ratio:>8.3}"));
            line(&format!("{illuminance:>12} lx {}", ratios.collect::<String>()))?;
        }
        Ok(())
    }
}

/// The ratio that a transmitter looks up.
fn carried(table: &L2aTable, [illuminance_lx, interval]: [f64; 2]) -> f64 {
    let light = Illuminance::saturating_from_num(illuminance_lx);
    table.l2a(light, Interval::saturating_from_num(interval)).to_num()
}

/// Rust source of a table, compiled into `link`.
fn source(file: &TableFile) -> String {
    let of = |name: &str, about: &str, values: &[f64]| {
        let count = values.len();
        format!("/// {about}\n#[rustfmt::skip]\npub const {name}: [f32; {count}] = {values:?};\n")
    };
    [
        "//! The table that the firmware ships with, made from a table file by `vocc table show FILE --rust`.\n".into(),
        of(
            "ILLUMINANCES_LX",
            "Ambient illuminances of its rows, lx.",
            &file.ratios.illuminance_lx,
        ),
        of("INTERVALS", "LED intervals of its columns.", &file.ratios.interval),
        of("L2A", "Its ratios, row by row.", &file.ratios.l2a.concat()),
    ]
    .join("\n")
}
