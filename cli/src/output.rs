//! What goes to standard output, and progress on standard error.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use sim::accuracy::Level;
use sim::plan::Plan;
use studies::monte_carlo;
use studies::sweep::{Results, Summary};

/// How a command that did its work ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Exit status 0.
    Yes,
    /// Exit status 1.
    No,
}

/// An error and its causes, each said once.
pub fn explain(error: &anyhow::Error) -> String {
    error
        .chain()
        .map(ToString::to_string)
        .fold(String::new(), |text, cause| match text.contains(&cause) {
            _ if text.is_empty() => cause,
            true => text,
            false => format!("{text}: {cause}"),
        })
}

/// Whether nobody reads any more what is printed.
pub fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>())
        .any(|cause| cause.kind() == std::io::ErrorKind::BrokenPipe)
}

/// Whether what was printed found a reader; one who has left is no fault.
pub fn is_read(printed: anyhow::Result<()>) -> anyhow::Result<bool> {
    match printed {
        Err(error) if is_broken_pipe(&error) => Ok(false),
        printed => printed.map(|()| true),
    }
}

/// Prints one line.
pub fn line(text: &str) -> anyhow::Result<()> {
    Ok(writeln!(std::io::stdout(), "{text}")?)
}

/// Prints one line of JSON.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    line(&serde_json::to_string(value)?)
}

/// Prints a plan as a table.
pub fn plan(plan: &Plan) -> anyhow::Result<()> {
    line("effect           bound (grey)  simulated  why")?;
    for decision in &plan.decisions {
        let simulated = if decision.included { "yes" } else { "no" };
        line(&format!(
            "{:<16} {:>12.4}  {simulated:<9}  {}",
            decision.effect, decision.bound_grey, decision.why
        ))?;
    }
    line(&format!(
        "left out in all: at most {:.4} grey levels before rounding",
        plan.left_out_grey()
    ))
}

#[derive(Serialize)]
struct Evaluated {
    #[serde(flatten)]
    summary: Summary,
    seconds: Option<f64>,
    seed: u64,
    level: Level,
    plan: Plan,
}

/// Prints the outcome of the evaluation of one scene; `seconds` where it is known how long it took.
pub fn evaluation(results: &Results, seconds: Option<f64>, as_json: bool) -> anyhow::Result<()> {
    let sweep = results.sweep();
    let view = monte_carlo::view(&sweep.scene, sweep.random_reflectance)?;
    let report = Evaluated {
        summary: results.summary(0),
        seconds,
        seed: sweep.seed,
        level: sweep.level,
        plan: Plan::of(&view),
    };
    if as_json {
        return json(&report);
    }
    plan(&report.plan)?;
    let found = &report.summary;
    match seconds {
        Some(seconds) => line(&format!(
            "frames     {} in all, {seconds:.2} s of work",
            found.frames
        ))?,
        None => line(&format!("frames     {}", found.frames))?,
    }
    if sweep.rare_events {
        line(&format!(
            "swarms     {} reached errors, worth {:.0} counted ones",
            found.bit_errors, found.effective_errors
        ))?;
    } else {
        line(&format!("Bvar       {}", two_decimals(found.bvar)))?;
        line(&format!("Wvar       {}", two_decimals(found.wvar)))?;
        line(&format!("B2W        {}", two_decimals(found.b2w)))?;
        line(&format!(
            "bit errors {} of {}",
            found.bit_errors, found.bits
        ))?;
    }
    line(&format!(
        "BER        {:.3e} (95 %: {:.3e} to {:.3e})",
        found.ber, found.ber_95[0], found.ber_95[1]
    ))
}

/// A variance or a ratio of variances, to two decimals.
pub fn two_decimals(value: Option<f64>) -> String {
    value.map_or("undefined".into(), |value| format!("{value:.2}"))
}

/// Progress of a run over a known number of steps: a bar on a terminal, elsewhere a line now and then.
pub struct Progress {
    bar: ProgressBar,
    unit: &'static str,
    total: u64,
    /// Steps of earlier runs.
    begun_at: u64,
    started: Instant,
    told: Instant,
}

/// Between two lines where there is no terminal.
const QUIET: Duration = Duration::from_secs(10);

impl Progress {
    /// For `total` steps of a `unit`.
    pub fn new(total: u64, unit: &'static str) -> Self {
        let bar = if std::io::stderr().is_terminal() {
            ProgressBar::new(total)
        } else {
            ProgressBar::hidden()
        };
        let template = format!("{{bar:30}} {{pos}}/{{len}} {unit}, {{per_sec}}, {{eta}} left");
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style);
        }
        Self {
            bar,
            unit,
            total,
            begun_at: 0,
            started: Instant::now(),
            told: Instant::now(),
        }
    }

    /// Tells that so many steps were done before now: they say nothing of how long others take.
    pub fn begin_at(&mut self, steps: u64) {
        (self.begun_at, self.started) = (steps, Instant::now());
        self.bar.set_position(steps);
        // The bar takes this for work, once it has seen it.
        self.bar.tick();
        self.bar.reset_eta();
    }

    /// Prints something else without the bar in between.
    pub fn aside<R>(&self, print: impl FnOnce() -> R) -> R {
        self.bar.suspend(print)
    }

    /// Tells that another number of steps is expected in all.
    pub fn expect(&mut self, total: u64) {
        self.total = total;
        self.bar.set_length(total);
    }

    /// Tells that so many steps are done.
    pub fn done(&mut self, steps: u64) {
        self.bar.set_position(steps);
        if self.bar.is_hidden() && self.told.elapsed() > QUIET && steps > self.begun_at {
            self.told = Instant::now();
            eprintln!("{}", self.tell(steps, self.started.elapsed()));
        }
    }

    /// The line for so many steps, reached after a time.
    fn tell(&self, steps: u64, elapsed: Duration) -> String {
        let rate = steps.saturating_sub(self.begun_at) as f64 / elapsed.as_secs_f64();
        let left_s = self.total.saturating_sub(steps) as f64 / rate;
        let (total, unit) = (self.total, self.unit);
        format!("{steps}/{total} {unit}, {rate:.0} a second, {left_s:.0} s left")
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_earlier_runs_are_no_work_of_this_one() {
        let mut progress = Progress::new(1000, "frames");
        let elapsed = Duration::from_secs(10);
        assert_eq!(
            progress.tell(500, elapsed),
            "500/1000 frames, 50 a second, 10 s left"
        );
        progress.begin_at(400);
        assert_eq!(
            progress.tell(500, elapsed),
            "500/1000 frames, 10 a second, 50 s left"
        );
    }
}
