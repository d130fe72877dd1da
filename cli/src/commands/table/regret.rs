//! `vocc table regret`: the reach lost because a transmitter does not know its scene.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use link::l2a_table::L2aTable;
use serde::Serialize;
use studies::table::{AtPlace, ReachEntry, TableFile};

use crate::commands::optimize::{as_toml, verdict};
use crate::output::{Verdict, json, line};
use crate::{files, outputs, report};

/// Arguments of `vocc table regret`.
#[derive(clap::Args)]
pub struct Regret {
    /// The table's TOML file.
    table: PathBuf,
    /// A table that `vocc optimize --criterion reach` made for another scene, in which the loss is computed (repeatable). Default: the
    /// table's own scene.
    #[arg(long = "in", value_name = "FILE.toml")]
    scenes: Vec<PathBuf>,
    /// Factors on the table's ratios: the light sensor's reading over the true illuminance, or the assumed reflectance over the true one.
    #[arg(long, value_delimiter = ',', default_values_t = [0.5, 0.8, 1.0, 1.25, 2.0], value_parser = factor, allow_negative_numbers = true)]
    times: Vec<f64>,
    /// Write the table with the smallest loss in its worst scene.
    #[arg(short, long, value_name = "FILE.toml", requires = "scenes")]
    out: Option<PathBuf>,
}

/// The loss of a ratio at one illuminance and interval.
#[derive(Serialize)]
struct Loss {
    illuminance_lx: f64,
    interval: f64,
    /// Factor on the table's ratio.
    times: f64,
    l2a: f64,
    /// Its reach, m, at most the distance at which the panel is found; `None` outside the searched ratios.
    reach_m: Option<f64>,
    /// The best ratio's, likewise.
    best_reach_m: f64,
}

fn factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(factor) if (0.01..=100.0).contains(&factor) => Ok(factor),
        _ => Err("give a factor from 0.01 to 100".into()),
    }
}

impl Regret {
    /// Prints the reach lost at each illuminance and interval per scene, and the ratios with the least loss over all scenes.
    pub fn run(&self, as_json: bool) -> anyhow::Result<Verdict> {
        outputs::check(self.out.clone(), self.scenes.iter().chain([&self.table]).cloned())?;
        if let Some(path) = &self.out {
            ensure!(
                !path.is_file() || TableFile::read(path).map_or(true, |there| !there.is_searched()),
                "{} holds the results of a search, which would be lost: give another file",
                path.display()
            );
        }
        let (_, table) = TableFile::read_with_table(&self.table)?;
        let own = std::slice::from_ref(&self.table);
        let paths = if self.scenes.is_empty() { own } else { &self.scenes };
        let scenes: Vec<TableFile> = paths.iter().map(|path| by_reach(path)).collect::<Result<_, _>>()?;
        for (path, scene) in paths.iter().zip(&scenes) {
            if !as_json {
                line(&format!("reach in {}:", path.display()))?;
                let columns = self.times.iter().map(|times| format!("{:>9}", format!("x{times}")));
                line(&format!("illuminance  interval     L2A    best{}", columns.collect::<String>()))?;
            }
            for entry in &scene.reach.entries {
                let losses = self.losses(&table, scene, entry);
                match as_json {
                    true => losses.iter().try_for_each(json)?,
                    false => line(&row(entry, super::carried(&table, entry.place()), &losses))?,
                }
            }
        }
        // For a single scene it repeats the scene's own table.
        if scenes.len() > 1 || self.out.is_some() {
            let names = paths.iter().map(|path| path.display().to_string());
            let named: Vec<(String, TableFile)> = names.zip(scenes).collect();
            let robust = TableFile::of_least_regret(&named)?;
            print(&robust, as_json)?;
            if let Some(path) = &self.out {
                files::write(path, as_toml(&robust)?)?;
            }
            return Ok(verdict(&robust));
        }
        Ok(Verdict::Yes)
    }

    /// The loss of an entry at each factor on the table's ratio.
    fn losses(&self, table: &L2aTable, scene: &TableFile, entry: &ReachEntry) -> Vec<Loss> {
        let (illuminance_lx, interval) = (entry.illuminance_lx, entry.interval);
        let regret = scene.regret_at([illuminance_lx, interval]);
        let carried = super::carried(table, entry.place());
        let loss = |&times: &f64| Loss {
            illuminance_lx,
            interval,
            times,
            l2a: times * carried,
            reach_m: regret.as_ref().and_then(|regret| regret.reach_m(times * carried)),
            best_reach_m: regret.as_ref().map_or(entry.best_reach_m, studies::table::Regret::best_m),
        };
        self.times.iter().map(loss).collect()
    }
}

/// Reads a table with the reach of each ratio.
pub fn by_reach(path: &Path) -> anyhow::Result<TableFile> {
    let scene = TableFile::read(path)?;
    scene.check().with_context(|| path.display().to_string())?;
    ensure!(
        !scene.reach.entries.is_empty(),
        "{} has no reaches: make it with `vocc optimize --criterion reach`",
        path.display()
    );
    Ok(scene)
}

/// Prints the ratios with the smallest loss in their worst scene.
fn print(robust: &TableFile, as_json: bool) -> anyhow::Result<()> {
    if as_json {
        return robust.regret.entries.iter().try_for_each(json);
    }
    line("smallest loss in the worst scene:")?;
    line(report::table::REGRET_HEAD)?;
    let mut entries = robust.regret.entries.iter();
    entries.try_for_each(|entry| line(&report::table::regret_line(entry)))
}

/// An entry as text: the loss of the best ratio's reach.
fn row(entry: &ReachEntry, carried: f64, losses: &[Loss]) -> String {
    let lost = losses.iter().map(|loss| match loss.reach_m {
        Some(reach_m) => format!("{:>+7.1} %", 100.0 * (reach_m / loss.best_reach_m - 1.0)),
        None => format!("{:>9}", "?"),
    });
    format!(
        "{:>8} lx  {:>8}  {:>6.3}  {:>6.3}{}",
        entry.illuminance_lx,
        entry.interval,
        carried,
        entry.best_l2a,
        lost.collect::<String>()
    )
}
