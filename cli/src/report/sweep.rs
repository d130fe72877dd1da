//! Output of `vocc sweep`: progress, and a line per finished cell.

use serde_json::{Map, Value};
use studies::sweep::{Results, Summary, Sweep, SweepProgress};

use crate::numbers::two_decimals;
use crate::output::{json, line};
use crate::progress::Progress;

/// Progress on standard error, finished cells on standard output.
pub struct Report {
    progress: Progress,
    lines: Lines,
    told: Vec<bool>,
}

/// Format of the cells.
enum Lines {
    Table,
    Json,
    None,
}

/// Prints all cells.
pub fn print(results: &Results, as_json: bool) -> anyhow::Result<()> {
    Report::new(results.sweep(), as_json)?.end(results)
}

impl Report {
    /// A report on a whole sweep.
    pub fn new(sweep: &Sweep, as_json: bool) -> anyhow::Result<Self> {
        if !as_json {
            line(&heading(sweep))?;
        }
        Ok(Self {
            progress: Progress::new(0, "frames"),
            lines: if as_json { Lines::Json } else { Lines::Table },
            told: vec![false; sweep.cells()],
        })
    }

    /// A report on a shard, whose cells are printed only after merging.
    pub fn silent() -> Self {
        Self {
            progress: Progress::new(0, "frames"),
            lines: Lines::None,
            told: Vec::new(),
        }
    }

    /// Sets the number of frames from earlier runs.
    pub fn begin_at(&mut self, frames: u64) {
        self.progress.begin_at(frames);
    }

    /// Shows progress, and finished cells.
    pub fn progress(&mut self, news: &SweepProgress) -> anyhow::Result<()> {
        self.progress.expect(news.expected.max(news.frames));
        self.progress.done(news.frames);
        news.finished.iter().try_for_each(|&cell| self.cell(news.results, cell))
    }

    /// Shows the remaining cells, finished or not.
    pub fn end(mut self, results: &Results) -> anyhow::Result<()> {
        (0..self.told.len()).try_for_each(|cell| self.cell(results, cell))
    }

    fn cell(&mut self, results: &Results, cell: usize) -> anyhow::Result<()> {
        if self.told.get(cell) != Some(&false) {
            return Ok(());
        }
        self.told[cell] = true;
        let summary = results.summary(cell);
        self.progress.aside(|| match self.lines {
            Lines::Table => line(&row(results.sweep(), &summary)),
            Lines::Json => json(&object(results.sweep(), &summary)?),
            Lines::None => Ok(()),
        })
    }
}

/// Width of a key's column: its last word or its longest value.
fn widths(sweep: &Sweep) -> Vec<usize> {
    let width = |axis: &studies::sweep::Axis| {
        let values = axis.values.iter().map(|value| value.chars().count());
        values.chain([short(&axis.key).len()]).max().unwrap_or(0)
    };
    sweep.grid.iter().map(width).collect()
}

fn short(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

fn heading(sweep: &Sweep) -> String {
    let keys = sweep.grid.iter().zip(widths(sweep));
    let keys = keys.map(|(axis, width)| format!("{:>width$}  ", short(&axis.key)));
    format!(
        "{}{:<10}  {:>12}  {:>10}  {:>9}  {:<22}  {:>10}  {:>9}",
        keys.collect::<String>(),
        "detector",
        "frames",
        "errors",
        "BER, all",
        "95 %",
        "one symbol",
        "B2W"
    )
}

fn row(sweep: &Sweep, summary: &Summary) -> String {
    let values = summary.values.iter().zip(widths(sweep));
    let values = values.map(|(value, width)| format!("{value:>width$}  "));
    if let Some(why) = &summary.why_empty {
        return format!("{}{:<10}  {:>12}  empty: {why}", values.collect::<String>(), summary.detector, 0);
    }
    let [low, high] = summary.ber_95;
    let interval = if summary.bit_errors == 0 {
        format!("below {}", rate(high))
    } else {
        format!("{} to {}", rate(low), rate(high))
    };
    let has_across = summary.frames_across > Some(0);
    let one_symbol = summary.ber_one_symbol.filter(|_| has_across);
    let row = format!(
        "{}{:<10}  {:>12}  {:>10}  {:>9}  {:<22}  {:>10}  {:>9}",
        values.collect::<String>(),
        summary.detector,
        summary.frames,
        summary.bit_errors,
        rate(summary.ber),
        interval,
        one_symbol.map(rate).unwrap_or_default(),
        two_decimals(summary.b2w)
    );
    if summary.finished { row } else { format!("{row}  unfinished") }
}

fn rate(rate: f64) -> String {
    if rate == 0.0 { "0".into() } else { format!("{rate:.3e}") }
}

/// The cell's keys and values, then its results.
fn object(sweep: &Sweep, summary: &Summary) -> anyhow::Result<Map<String, Value>> {
    let keys = sweep.grid.iter().zip(&summary.values);
    let mut object: Map<String, Value> = keys
        .map(|(axis, value)| {
            let value = serde_json::from_str(value).unwrap_or_else(|_| value.clone().into());
            (axis.key.clone(), value)
        })
        .collect();
    if let Value::Object(mut outcome) = serde_json::to_value(summary)? {
        if summary.why_empty.is_some() {
            for name in ["ber", "ber_95", "ber_one_symbol", "ber_one_symbol_95", "panel_error_rate_95"] {
                outcome.get_mut(name).into_iter().for_each(|rate| *rate = Value::Null);
            }
        }
        object.extend(outcome);
    }
    Ok(object)
}
