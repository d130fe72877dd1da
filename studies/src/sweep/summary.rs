//! A cell's results as numbers, and a table of all cells.

use serde::Serialize;

use super::{Results, Sweep};
use crate::monte_carlo::{ChunkProgress, Evaluation};
use crate::statistics::{FrameErrors, SWARM};

/// The results of one cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The cell's number.
    pub cell: usize,
    /// A value for each axis of the grid.
    #[serde(skip)]
    pub values: Vec<String>,
    /// The detector.
    pub detector: &'static str,
    /// Whether the cell is finished.
    pub finished: bool,
    /// Frames.
    pub frames: u64,
    /// Evaluated bits: all of a frame, or one with rare events.
    pub bits: u64,
    /// Wrong bits; with rare events, the swarms that reached one.
    pub bit_errors: u64,
    /// The number of counted errors with the same uncertainty.
    pub effective_errors: f64,
    /// Bit error rate.
    pub ber: f64,
    /// Its 95 % interval.
    pub ber_95: [f64; 2],
    /// The bit error rate of the frames that show one symbol; `None` if that is not known of each frame, or with rare events.
    pub ber_one_symbol: Option<f64>,
    /// Its 95 % interval; `None` in the same cases.
    pub ber_one_symbol_95: Option<[f64; 2]>,
    /// Frames that are exposed across a change of symbols; `None` in the same cases.
    pub frames_across: Option<u64>,
    /// Wrong bits of these; `None` in the same cases.
    pub bit_errors_across: Option<u64>,
    /// Panels with any wrong bit; `None` with splitting, which uses single bits.
    pub panel_errors: Option<u64>,
    /// The 95 % interval of their share; `None` with splitting.
    pub panel_error_rate_95: Option<[f64; 2]>,
    /// Between-class variance; `None` with splitting, which measures no features.
    pub bvar: Option<f64>,
    /// Within-class variance; `None` with splitting.
    pub wvar: Option<f64>,
    /// Their ratio, if defined.
    pub b2w: Option<f64>,
    /// Why the cell cannot be measured, if it cannot: its numbers are those of no frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_empty: Option<String>,
}

impl Results {
    /// The results of a cell so far.
    pub fn summary(&self, cell: usize) -> Summary {
        let setting = self.sweep().cell(cell);
        Summary {
            cell,
            values: setting.values,
            finished: matches!(self.standing(cell), ChunkProgress::Done(_)),
            why_empty: self.why_empty(cell).map(String::from),
            ..Summary::of(&self.total(cell), setting.detector.name())
        }
    }

    /// All cells as comma-separated values: a line of names, then a line a cell.
    pub fn to_csv(&self) -> String {
        let mut text = line(&names(self.sweep()));
        for cell in 0..self.sweep().cells() {
            text += &line(&self.summary(cell).fields(self.sweep().seed));
        }
        text
    }
}

/// The columns beside the keys.
const MEASURED: [&str; 20] = [
    "detector",
    "finished",
    "frames",
    "bits",
    "bit_errors",
    "effective_errors",
    "ber",
    "ber_low_95",
    "ber_high_95",
    "bvar",
    "wvar",
    "b2w",
    "seed",
    "version",
    "ber_one_symbol",
    "ber_one_symbol_low_95",
    "ber_one_symbol_high_95",
    "frames_across",
    "bit_errors_across",
    "why_empty",
];

/// The names of all columns.
fn names(sweep: &Sweep) -> Vec<String> {
    let keys = sweep.grid.iter().map(|axis| axis.key.clone());
    keys.chain(MEASURED.map(String::from)).collect()
}

impl Summary {
    /// The numbers of an evaluation's frames for a detector.
    pub fn of(total: &Evaluation, detector: &'static str) -> Self {
        let (counted, rare) = (total.errors, total.rare);
        let variances = total.distinguishability();
        let ber_95 = if rare.is_empty() {
            counted.interval_95()
        } else {
            rare.interval_95()
        };
        let apart = total.symbol_changes.apart(&counted);
        let [one_symbol, across] = apart.filter(|_| rare.is_empty()).map_or([None; 2], |apart| apart.map(Some));
        let variance = |value| rare.is_empty().then_some(value);
        let rare_frames = rare.swarms() * SWARM as u64;
        // If all frames show one symbol, the interval need not be computed again.
        let interval_95 = |errors: FrameErrors| match errors == counted {
            true => ber_95,
            false => errors.interval_95(),
        };
        Self {
            cell: 0,
            values: Vec::new(),
            detector,
            finished: true,
            frames: counted.frames() + rare_frames,
            bits: counted.bits() + rare_frames,
            bit_errors: total.bit_errors(),
            effective_errors: if rare.is_empty() {
                counted.errors() as f64
            } else {
                rare.effective_errors()
            },
            ber: counted.rate() + rare.rate(),
            ber_95,
            ber_one_symbol: one_symbol.map(|errors| errors.rate()),
            ber_one_symbol_95: one_symbol.map(interval_95),
            frames_across: across.map(|errors| errors.frames()),
            bit_errors_across: across.map(|errors| errors.errors()),
            panel_errors: rare.is_empty().then(|| counted.wrong_frames()),
            panel_error_rate_95: rare.is_empty().then(|| counted.frame_error_rate().1),
            bvar: variance(variances.bvar),
            wvar: variance(variances.wvar),
            b2w: variances.b2w,
            why_empty: None,
        }
    }

    /// Bit error rate, its 95 % interval and the number of errors, of the frames for a comparison of detectors: those of one symbol if that
    /// is known for each frame, otherwise all.
    pub fn comparable(&self) -> (f64, [f64; 2], u64) {
        match (self.ber_one_symbol, self.ber_one_symbol_95) {
            (Some(rate), Some(interval)) => {
                let across = self.bit_errors_across.unwrap_or(0);
                (rate, interval, self.bit_errors - across)
            }
            _ => (self.ber, self.ber_95, self.bit_errors),
        }
    }

    fn fields(self, seed: u64) -> Vec<String> {
        if let Some(why) = self.why_empty {
            let own = [self.detector.into(), self.finished.to_string(), "0".into()];
            let nothing = std::iter::repeat_n(String::new(), MEASURED.len() - own.len() - 1);
            return self.values.into_iter().chain(own).chain(nothing).chain([why]).collect();
        }
        let own = [
            self.detector.into(),
            self.finished.to_string(),
            self.frames.to_string(),
            self.bits.to_string(),
            self.bit_errors.to_string(),
            number(self.effective_errors),
            number(self.ber),
            number(self.ber_95[0]),
            number(self.ber_95[1]),
            known(self.bvar),
            known(self.wvar),
            known(self.b2w),
            seed.to_string(),
            env!("CARGO_PKG_VERSION").into(),
            known(self.ber_one_symbol),
            known(self.ber_one_symbol_95.map(|[low, _]| low)),
            known(self.ber_one_symbol_95.map(|[_, high]| high)),
            count(self.frames_across),
            count(self.bit_errors_across),
            String::new(),
        ];
        self.values.into_iter().chain(own).collect()
    }
}

/// All digits.
fn number(value: f64) -> String {
    format!("{value:e}")
}

/// All digits of a known number, otherwise an empty text.
fn known(value: Option<f64>) -> String {
    value.map(number).unwrap_or_default()
}

/// A known count, otherwise an empty text.
fn count(value: Option<u64>) -> String {
    value.map(|count| count.to_string()).unwrap_or_default()
}

fn line(fields: &[String]) -> String {
    let fields: Vec<String> = fields.iter().map(|field| cell(field)).collect();
    fields.join(",") + "\n"
}

/// A field as a cell that no spreadsheet evaluates: a text that starts like a formula gets an apostrophe before it.
fn cell(field: &str) -> String {
    let is_formula = field.starts_with(['=', '+', '-', '@', '\t', '\r']) && field.parse::<f64>().is_err();
    let text = format!("{}{field}", if is_formula { "'" } else { "" });
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_is_a_formula() {
        assert_eq!(
            ["=1+1", "@SUM(A1)", "+cmd", "-cmd", "-3.2", "+1e3", "a=b", "=\"a\",b"].map(cell),
            ["'=1+1", "'@SUM(A1)", "'+cmd", "'-cmd", "-3.2", "+1e3", "a=b", "\"'=\"\"a\"\",b\""]
        );
    }
}
