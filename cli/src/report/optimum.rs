//! Output of `vocc optimize` while it works.

use std::path::Path;

use studies::optimum::{FIRST_ROUND, GRID};
use studies::reach::RATIOS;
use studies::table::{
    AtPlace, Cell, CriterionSurvey, Entry, Findings, InFile, Outcome, ReachEntry, ReachPoint, ReachSurvey, Survey, SurveyEvent,
};

use super::table;
use crate::numbers::two_decimals;
use crate::output::{json, line, tell};
use crate::progress::Progress;

/// Number of ratios of a finer grid with all frames.
const FINE: u64 = 5;
/// Approximate number of ratios per entry by reach besides [`RATIOS`].
const BETWEEN: u64 = 6;

/// How a survey is reported.
pub trait Presentation: Survey<Entry: InFile> {
    /// Unit of its work.
    const UNIT: &str;

    /// Number of settings per place.
    fn settings(&self) -> u64;

    /// Maximum or approximate work per setting.
    fn work(&self) -> u64;

    fn print_head(&self) -> anyhow::Result<()>;

    fn print(&self, entry: &Self::Entry, details: &[<Self::Entry as Outcome>::Detail]) -> anyhow::Result<()>;
}

/// Progress on standard error, results on standard output.
pub struct Report<'a, S> {
    survey: &'a S,
    progress: Progress,
    as_json: bool,
    settings: u64,
    settings_done: u64,
    work_done: u64,
}

impl<'a, S: Presentation> Report<'a, S> {
    /// A report on a survey with missing places; prints the others first.
    pub fn new(survey: &'a S, begun: &Findings<S::Entry>, missing: usize, as_json: bool) -> anyhow::Result<Self> {
        let settings = missing as u64 * survey.settings();
        let report = Self {
            survey,
            progress: Progress::new(settings * survey.work(), S::UNIT),
            as_json,
            settings,
            settings_done: 0,
            work_done: 0,
        };
        if !as_json {
            survey.print_head()?;
        }
        for entry in &begun.entries {
            let details: Vec<_> = begun.details_at(entry.place()).cloned().collect();
            report.entry(entry, &details)?;
        }
        Ok(report)
    }

    /// Shows progress. The remaining settings are assumed to take as much work as the finished ones.
    pub fn progress(&mut self, news: &SurveyEvent<S::Piece>) {
        match news {
            SurveyEvent::Piece { work, .. } => self.work_done += work,
            SurveyEvent::Setting => {
                self.settings_done += 1;
                let each = self.work_done / self.settings_done;
                let left = self.settings.saturating_sub(self.settings_done);
                self.progress.expect(self.work_done + left * each);
            }
        }
        self.progress.done(self.work_done);
    }

    /// Prints the entry of a place.
    pub fn entry(&self, entry: &S::Entry, details: &[<S::Entry as Outcome>::Detail]) -> anyhow::Result<()> {
        self.progress.aside(|| match self.as_json {
            true => details.iter().try_for_each(json).and_then(|()| json(entry)),
            false => self.survey.print(entry, details),
        })
    }
}

impl Presentation for CriterionSurvey {
    const UNIT: &str = "frames";

    fn settings(&self) -> u64 {
        self.settings_of_place() as u64
    }

    fn work(&self) -> u64 {
        let frames = self.search.frames;
        GRID as u64 * frames.min(FIRST_ROUND) + FINE * frames
    }

    fn print_head(&self) -> anyhow::Result<()> {
        line(&format!("bit errors are those of {}", self.search.detector.name()))?;
        line("best gains: how far the criterion at the best ratio exceeds that at the table's, or at the ends of the range")
    }

    fn print(&self, entry: &Entry, cells: &[Cell]) -> anyhow::Result<()> {
        let l2a = entry.l2a(self.rule);
        line(
            "illuminance  interval  distance   yaw     L2A   95 %               B2W   BER, all   one symbol  best gains   no worse (best gains)",
        )?;
        for cell in cells {
            let border = if cell.at_border { "≥" } else { " " };
            line(&format!(
                "{:>8} lx  {:>8}  {:>6} m  {:>3}° {border}{:>6.3}   {:.3} to {:.3}  {:>8}  {:>8.1e}  {:>10.1e}  {:>8.1} %   {:.2} to {:.2}{}",
                cell.illuminance_lx,
                cell.interval,
                cell.distance_m,
                cell.yaw_deg,
                cell.l2a,
                cell.l2a_95[0],
                cell.l2a_95[1],
                two_decimals(cell.b2w),
                cell.ber,
                cell.ber_one_symbol.unwrap_or(cell.ber),
                (cell.table_loss - 1.0) * 100.0,
                cell.not_worse[0],
                cell.not_worse[1],
                cell.not_worse_loss.map_or(String::new(), gains),
            ))?;
        }
        let is_silent = cells.iter().all(|cell| cell.ber_one_symbol.unwrap_or(cell.ber) == 0.0);
        let silent = if is_silent { ", no bit wrong at the best ratios" } else { "" };
        line(&format!(
            "  mean {:.3} ({:.3} to {:.3}); least mean BER of one symbol, fitted{silent}: {:.1e} at {:.3} ({:.3} to {:.3}), not significantly \
             more from {:.2} to {:.2}; the table holds {l2a:.3}",
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

/// The gain of the best ratio over both ends of the range that is no worse, in percent.
fn gains(loss: [f64; 2]) -> String {
    let [low, high] = loss.map(|loss| 100.0 * (loss - 1.0));
    format!(" ({low:.1} %, {high:.1} %)")
}

impl Presentation for ReachSurvey {
    const UNIT: &str = "ratios";

    fn settings(&self) -> u64 {
        1
    }

    fn work(&self) -> u64 {
        RATIOS as u64 + BETWEEN
    }

    fn print_head(&self) -> anyhow::Result<()> {
        let rate = 100.0 * self.search.raw_error_rate;
        let asked = self.demand;
        line(&format!(
            "{} bytes within {} s, {} of 100 times: {rate:.1} % of the bits may be wrong, read by {}",
            asked.message_bytes,
            asked.within_s,
            100.0 * asked.probability,
            self.search.detector.name()
        ))?;
        line(table::REACH_HEAD)
    }

    fn print(&self, entry: &ReachEntry, _: &[ReachPoint]) -> anyhow::Result<()> {
        line(&table::reach_line(entry, None))
    }
}

/// Prints how to resume a table.
pub fn interrupted(out: Option<&Path>) {
    match out {
        Some(path) => tell(format_args!(
            "vocc: interrupted; {} holds the finished part; continue with --resume",
            path.display()
        )),
        None => tell("vocc: interrupted"),
    }
}
