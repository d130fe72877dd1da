//! What `vocc optimize` tells while it works.

use std::path::Path;

use studies::optimum::{FIRST_ROUND, GRID};
use studies::table::{Cell, Entry, News, Rule, Survey, TableFile};

use crate::numbers::two_decimals;
use crate::output::{is_read, json, line, tell};
use crate::progress::Progress;

/// Ratios of a finer grid that get all frames.
const FINE: u64 = 5;

/// Progress on standard error, results on standard output while somebody reads them.
pub struct Report {
    progress: Progress,
    rule: Rule,
    as_json: bool,
    is_read: bool,
    cells: u64,
    cells_done: u64,
    frames_done: u64,
}

impl Report {
    /// For a survey of which so many entries are missing; those that are there are printed first.
    pub fn new(survey: &Survey, begun: &TableFile, missing: usize, as_json: bool) -> anyhow::Result<Self> {
        let cells = (missing * survey.cells_of_entry()) as u64;
        let frames = survey.search.frames;
        let at_most = cells * (GRID as u64 * frames.min(FIRST_ROUND) + FINE * frames);
        let mut report = Self {
            progress: Progress::new(at_most, "frames"),
            rule: survey.rule,
            as_json,
            is_read: true,
            cells,
            cells_done: 0,
            frames_done: 0,
        };
        for entry in &begun.entries {
            let of_entry = |cell: &&Cell| (cell.illuminance_lx, cell.interval) == (entry.illuminance_lx, entry.interval);
            let cells: Vec<Cell> = begun.cells.iter().filter(of_entry).copied().collect();
            report.entry(entry, &cells)?;
        }
        Ok(report)
    }

    /// Shows progress. The settings to come are expected to take as long as those done.
    pub fn heard(&mut self, news: News) {
        match news {
            News::Piece(piece) => self.frames_done += piece.frames(),
            News::Cell(_) => {
                self.cells_done += 1;
                let each = self.frames_done / self.cells_done;
                let left = self.cells.saturating_sub(self.cells_done);
                self.progress.expect(self.frames_done + left * each);
            }
        }
        self.progress.done(self.frames_done);
    }

    /// Whether somebody reads the results.
    pub fn is_read(&self) -> bool {
        self.is_read
    }

    /// Prints what was found for one illuminance and interval.
    pub fn entry(&mut self, entry: &Entry, cells: &[Cell]) -> anyhow::Result<()> {
        if self.is_read {
            self.is_read = is_read(self.print(entry, cells))?;
        }
        Ok(())
    }

    fn print(&self, entry: &Entry, cells: &[Cell]) -> anyhow::Result<()> {
        let l2a = entry.l2a(self.rule);
        if self.as_json {
            cells.iter().try_for_each(json)?;
            return json(entry);
        }
        line("illuminance  interval  distance   yaw     L2A   95 %               B2W      BER   table costs")?;
        for cell in cells {
            let border = if cell.at_border { "≥" } else { " " };
            line(&format!(
                "{:>8} lx  {:>8}  {:>6} m  {:>3}° {border}{:>6.3}   {:.3} to {:.3}  {:>8}  {:.1e}  {:>5.1} %",
                cell.illuminance_lx,
                cell.interval,
                cell.distance_m,
                cell.yaw_deg,
                cell.l2a,
                cell.l2a_95[0],
                cell.l2a_95[1],
                two_decimals(cell.b2w),
                cell.ber,
                (cell.table_loss - 1.0) * 100.0,
            ))?;
        }
        line(&format!(
            "  mean {:.3} ({:.3} to {:.3}); least mean BER {:.1e} at {:.3} ({:.3} to {:.3}), not significantly more from {:.2} to \
             {:.2}; the table holds {l2a:.3}",
            entry.mean_l2a,
            entry.mean_l2a_95[0],
            entry.mean_l2a_95[1],
            entry.least_ber,
            entry.least_ber_l2a,
            entry.least_ber_l2a_95[0],
            entry.least_ber_l2a_95[1],
            entry.least_ber_not_worse[0],
            entry.least_ber_not_worse[1],
        ))
    }
}

/// Says how to go on with a table.
pub fn interrupted(out: Option<&Path>) {
    match out {
        Some(path) => tell(format_args!(
            "vocc: interrupted; {} holds what is finished, go on with --resume",
            path.display()
        )),
        None => tell("vocc: interrupted"),
    }
}
