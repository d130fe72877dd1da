//! `vocc table diff`: differences between two tables, and their cost.

use std::path::Path;

use link::l2a_table::L2aTable;
use serde::Serialize;
use studies::table::TableFile;

use super::regret;
use crate::output::{Verdict, json, line};

/// Two tables at one illuminance and interval.
#[derive(Serialize)]
struct Difference {
    illuminance_lx: f64,
    interval: f64,
    /// As looked up by a transmitter.
    old_l2a: f64,
    new_l2a: f64,
    /// The old ratio's reach, m, if a table has it; at most the distance at which the panel is found.
    old_reach_m: Option<f64>,
    /// The new ratio's reach, m, likewise.
    new_reach_m: Option<f64>,
}

/// Compares the tables at each illuminance and interval of either.
pub fn run(old: &Path, new: &Path, scene: Option<&Path>, as_json: bool) -> anyhow::Result<Verdict> {
    let scene = scene.map(regret::by_reach).transpose()?;
    let (old, old_table) = TableFile::read_with_table(old)?;
    let (new, new_table) = TableFile::read_with_table(new)?;
    let (files, tables) = ([old, new], [old_table, new_table]);
    let axis = |of: fn(&TableFile) -> &Vec<f64>| {
        let mut axis: Vec<f64> = files.iter().flat_map(|file| of(file).iter().copied()).collect();
        axis.sort_by(f64::total_cmp);
        axis.dedup();
        axis
    };
    let (lights, intervals) = (axis(|file| &file.ratios.illuminance_lx), axis(|file| &file.ratios.interval));
    // Prefer the newer table's reaches.
    let known: Vec<&TableFile> = scene.iter().chain(files.iter().rev()).collect();
    if !as_json {
        line("illuminance  interval     old      new   change       reach")?;
    }
    let mut answer = Verdict::Yes;
    for &illuminance_lx in &lights {
        for &interval in &intervals {
            let difference = Difference::at(&tables, &known, illuminance_lx, interval);
            if difference.old_l2a != difference.new_l2a {
                answer = Verdict::No;
            }
            match as_json {
                true => json(&difference)?,
                false => line(&difference.to_string())?,
            }
        }
    }
    Ok(answer)
}

impl Difference {
    fn at(tables: &[L2aTable; 2], known: &[&TableFile], illuminance_lx: f64, interval: f64) -> Self {
        let [old_l2a, new_l2a] = tables.each_ref().map(|table| super::carried(table, [illuminance_lx, interval]));
        let regret = known.iter().find_map(|file| file.regret_at([illuminance_lx, interval]));
        let reach = |l2a| regret.as_ref().and_then(|regret| regret.reach_m(l2a));
        Self {
            illuminance_lx,
            interval,
            old_l2a,
            new_l2a,
            old_reach_m: reach(old_l2a),
            new_reach_m: reach(new_l2a),
        }
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let change = 100.0 * (self.new_l2a / self.old_l2a - 1.0);
        write!(
            f,
            "{:>8} lx  {:>8}  {:>6.3}   {:>6.3}  {change:>+6.1} %",
            self.illuminance_lx, self.interval, self.old_l2a, self.new_l2a
        )?;
        match (self.old_reach_m, self.new_reach_m) {
            (Some(old), Some(new)) => {
                write!(f, "  {old:.1} to {new:.1} m ({:+.1} %)", 100.0 * (new / old - 1.0))
            }
            _ => Ok(()),
        }
    }
}
