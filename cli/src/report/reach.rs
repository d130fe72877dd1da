//! What `vocc optimize --criterion reach` tells while it works.

use studies::reach::RATIOS;
use studies::table::{ReachEntry, ReachPoint, ReachSurvey, TableFile};

use super::table;
use crate::output::{is_read, json, line};
use crate::progress::Progress;

/// Ratios of one entry that are tried besides [`RATIOS`], about.
const BETWEEN: u64 = 6;

/// Progress on standard error, results on standard output while somebody reads them.
pub struct Report {
    progress: Progress,
    as_json: bool,
    is_read: bool,
    entries: u64,
    entries_done: u64,
    ratios_done: u64,
}

impl Report {
    /// For a survey of which so many entries are missing; those that are there are printed first.
    pub fn new(survey: &ReachSurvey, begun: &TableFile, missing: usize, as_json: bool) -> anyhow::Result<Self> {
        let entries = missing as u64;
        let report = Self {
            progress: Progress::new(entries * (RATIOS as u64 + BETWEEN), "ratios"),
            as_json,
            is_read: true,
            entries,
            entries_done: 0,
            ratios_done: 0,
        };
        if !as_json {
            let rate = 100.0 * survey.search.raw_error_rate;
            let asked = survey.demand;
            line(&format!(
                "{} bytes within {} s, {} of 100 times: {rate:.1} % of the bits may be wrong",
                asked.message_bytes,
                asked.within_s,
                100.0 * asked.probability
            ))?;
            line(table::REACH_HEAD)?;
        }
        for entry in &begun.reach_entries {
            let points = begun.points(entry.illuminance_lx, entry.interval);
            let points: Vec<ReachPoint> = points.copied().collect();
            report.print(entry, &points)?;
        }
        Ok(report)
    }

    /// Shows progress: one ratio more. The entries to come are expected to take as many as those done.
    pub fn heard(&mut self) {
        self.ratios_done += 1;
        self.progress.done(self.ratios_done);
    }

    /// Whether somebody reads the results.
    pub fn is_read(&self) -> bool {
        self.is_read
    }

    /// Prints what was found for one illuminance and interval.
    pub fn entry(&mut self, entry: &ReachEntry, points: &[ReachPoint]) -> anyhow::Result<()> {
        self.entries_done += 1;
        let left = self.entries.saturating_sub(self.entries_done);
        let each = self.ratios_done / self.entries_done;
        self.progress.expect(self.ratios_done + left * each);
        if self.is_read {
            self.is_read = is_read(self.progress.aside(|| self.print(entry, points)))?;
        }
        Ok(())
    }

    fn print(&self, entry: &ReachEntry, points: &[ReachPoint]) -> anyhow::Result<()> {
        if self.as_json {
            points.iter().try_for_each(json)?;
            return json(entry);
        }
        line(&table::reach_line(entry))
    }
}
