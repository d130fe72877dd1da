//! Progress of long work on standard error: a bar on a terminal, otherwise a line from time to time.

use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::output::tell;

/// Help text of long commands.
pub const HELP: &str = "\
Standard error shows the progress and the remaining time: a bar on a terminal, otherwise a line every ten seconds. Ctrl-C ends the run and \
keeps the finished part.";

/// Interval between two lines without a terminal.
const QUIET: Duration = Duration::from_secs(10);

/// The progress of a run. A line is printed during long steps too, to show that the work continues.
pub struct Progress {
    /// Counts even if hidden.
    bar: ProgressBar,
    begun: Arc<Mutex<Start>>,
    /// Without a terminal; taken when the work ends.
    lines: Option<(Sender<()>, JoinHandle<()>)>,
}

/// The start of the run, and the steps of earlier runs.
#[derive(Clone, Copy)]
struct Start {
    at: Instant,
    steps: u64,
}

impl Progress {
    /// Progress over `total` steps of a `unit`.
    pub fn new(total: u64, unit: &'static str) -> Self {
        Self::of(ProgressBar::new(total), unit)
    }

    /// Progress over an unknown number of steps.
    pub fn endless(unit: &'static str) -> Self {
        Self::of(ProgressBar::no_length(), unit)
    }

    fn of(bar: ProgressBar, unit: &'static str) -> Self {
        let begun = Start {
            at: Instant::now(),
            steps: 0,
        };
        let begun = Arc::new(Mutex::new(begun));
        let template = match bar.length() {
            Some(_) => format!("{{bar:30}} {{pos}}/{{len}} {unit}, {{per_sec}}, {{eta}} left"),
            None => format!("{{spinner}} {{pos}} {unit}, {{per_sec}}"),
        };
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style);
        }
        let lines = if std::io::stderr().is_terminal() {
            bar.enable_steady_tick(Duration::from_millis(500));
            None
        } else {
            bar.set_draw_target(indicatif::ProgressDrawTarget::hidden());
            tell_now_and_then(bar.clone(), Arc::clone(&begun), unit)
        };
        Self { bar, begun, lines }
    }

    /// Counts steps of earlier runs, which do not affect the estimated time left.
    pub fn begin_at(&mut self, steps: u64) {
        *self.begun.lock().unwrap_or_else(PoisonError::into_inner) = Start { at: Instant::now(), steps };
        self.bar.set_position(steps);
        // The tick counts these steps as work; `reset_eta` drops that.
        self.bar.tick();
        self.bar.reset_eta();
    }

    /// Runs `print` with the bar hidden.
    pub fn aside<R>(&self, print: impl FnOnce() -> R) -> R {
        self.bar.suspend(print)
    }

    /// Changes the expected total.
    pub fn expect(&mut self, total: u64) {
        self.bar.set_length(total);
    }

    /// Counts finished steps.
    pub fn done(&mut self, steps: u64) {
        self.bar.set_position(steps);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((end, lines)) = self.lines.take() {
            drop(end);
            // A thread that only prints returns no result.
            let _ = lines.join();
        }
        self.bar.finish_and_clear();
    }
}

/// Prints progress until the sender is dropped; `None` if no thread can be started.
fn tell_now_and_then(bar: ProgressBar, begun: Arc<Mutex<Start>>, unit: &'static str) -> Option<(Sender<()>, JoinHandle<()>)> {
    let (end, ended) = channel();
    let lines = std::thread::Builder::new().spawn(move || {
        while ended.recv_timeout(QUIET) == Err(RecvTimeoutError::Timeout) {
            let begun = *begun.lock().unwrap_or_else(PoisonError::into_inner);
            let done = bar.position().saturating_sub(begun.steps);
            tell(line(bar.position(), bar.length(), done, unit, begun.at.elapsed()));
        }
    });
    Some((end, lines.ok()?))
}

/// The line for `steps` of a total, `done` of them within `elapsed`.
fn line(steps: u64, total: Option<u64>, done: u64, unit: &str, elapsed: Duration) -> String {
    let of = total.map_or(String::new(), |total| format!("/{total}"));
    let elapsed_s = elapsed.as_secs_f64();
    if done == 0 {
        return format!("{steps}{of} {unit}, {elapsed_s:.0} s so far");
    }
    let rate = done as f64 / elapsed_s;
    let pace = if rate < 1.0 {
        format!("{:.0} s each", 1.0 / rate)
    } else {
        format!("{rate:.0} a second")
    };
    let left = total.map_or(String::new(), |total| {
        format!(", {:.0} s left", total.saturating_sub(steps) as f64 / rate)
    });
    format!("{steps}{of} {unit}, {pace}{left}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_tell_how_far_work_is_and_how_fast() {
        let elapsed = Duration::from_secs(10);
        let line = |steps, total, done| line(steps, total, done, "frames", elapsed);
        assert_eq!(line(500, Some(1000), 500), "500/1000 frames, 50 a second, 10 s left");
        assert_eq!(line(2, Some(7), 2), "2/7 frames, 5 s each, 25 s left");
        assert_eq!(line(0, Some(7), 0), "0/7 frames, 10 s so far");
        assert_eq!(line(500, None, 500), "500 frames, 50 a second");
    }

    #[test]
    fn steps_of_earlier_runs_are_no_work_of_this_one() {
        let elapsed = Duration::from_secs(10);
        let line = line(500, Some(1000), 100, "frames", elapsed);
        assert_eq!(line, "500/1000 frames, 10 a second, 50 s left");
        let mut progress = Progress::new(1000, "frames");
        progress.begin_at(400);
        progress.done(500);
        let begun = progress.begun.lock().expect("nobody else").steps;
        assert_eq!((progress.bar.position(), begun), (500, 400));
    }
}
