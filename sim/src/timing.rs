//! Interleaved timing: each function runs for a moment, then the next, again and again.
//!
//! Other load then affects all functions alike, so that ratios within one turn compare the same state of the machine. The fastest of a few
//! runs counts in a turn, because it was interrupted least.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// A function to time. It does the same amount of work in each call.
pub type Work<'a> = Box<dyn FnMut() + 'a>;

/// The time since a fixed moment.
pub type Clock = fn() -> Duration;

/// The clock of the computer's system. A web page has another.
pub fn system_clock() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

/// Shorter runs are repeated until they take this long, because calls of the clock cost time.
const SHORTEST_NS: f64 = 20_000.0;
/// Shorter runs, in steps of the clock, are repeated as well; a step is 0.1 ms and more in a browser.
const SHORTEST_STEPS: f64 = 30.0;
/// The longest that runs are repeated, however coarse the clock is.
const SHORTEST_MOST_NS: f64 = 5e6;
/// The time of all runs in a turn, of which the fastest counts.
const TURN_NS: f64 = 2e6;
/// Most runs of a turn.
const RUNS: usize = 8;

/// The time of one run of each function, in ns, turn by turn: for `turns` turns or as many as start within `budget`, at least one.
///
/// ```
/// use std::{hint::black_box, time::Duration};
/// use sim::timing::{Work, by_turns, system_clock};
///
/// let sum_to = |end: u64| -> Work { Box::new(move || drop(black_box((0..black_box(end)).sum::<u64>()))) };
/// let ns = by_turns(&mut [sum_to(10), sum_to(1000)], 5, Duration::MAX, system_clock);
/// assert_eq!((ns.len(), ns[0].len()), (2, 5));
/// ```
pub fn by_turns(works: &mut [Work], turns: usize, budget: Duration, clock: Clock) -> Vec<Vec<f64>> {
    let shortest_ns = (SHORTEST_STEPS * step_ns(clock)).clamp(SHORTEST_NS, SHORTEST_MOST_NS);
    let lengths: Vec<Length> = works.iter_mut().map(|work| Length::of(work, shortest_ns, clock)).collect();
    let mut ns = vec![Vec::new(); works.len()];
    let started = clock();
    for turn in 0..turns.max(1) {
        if turn > 0 && clock() - started >= budget {
            break;
        }
        for ((work, length), ns) in works.iter_mut().zip(&lengths).zip(&mut ns) {
            ns.push(length.turn(work, clock));
        }
    }
    ns
}

/// The length of a turn of a function.
struct Length {
    repetitions: usize,
    runs: usize,
}

impl Length {
    /// Determined by first runs with growing repetitions. A run that seems long enough is repeated, because it may have been interrupted.
    fn of(work: &mut Work, shortest_ns: f64, clock: Clock) -> Self {
        let mut repetitions = 1;
        let mut took = run(work, repetitions, clock);
        loop {
            if took >= shortest_ns {
                took = took.min(run(work, repetitions, clock));
            }
            if took >= shortest_ns {
                break;
            }
            repetitions *= 2;
            took = run(work, repetitions, clock);
        }
        let runs = (TURN_NS / took).clamp(1.0, RUNS as f64);
        Self {
            repetitions,
            runs: runs as usize,
        }
    }

    fn turn(&self, work: &mut Work, clock: Clock) -> f64 {
        let repetitions = self.repetitions;
        let runs = (0..self.runs).map(|_| run(work, repetitions, clock) / repetitions as f64);
        runs.fold(f64::INFINITY, f64::min)
    }
}

/// The time of the repetitions, in ns.
fn run(work: &mut Work, repetitions: usize, clock: Clock) -> f64 {
    let started = clock();
    (0..repetitions).for_each(|_| work());
    (clock() - started).as_secs_f64() * 1e9
}

fn step_ns(clock: Clock) -> f64 {
    let begun = clock();
    loop {
        let step = clock() - begun;
        if !step.is_zero() {
            return step.as_secs_f64() * 1e9;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    thread_local! {
        /// A simulated clock that advances with the work, in ns.
        static TIME_NS: Cell<u64> = const { Cell::new(0) };
    }

    fn work_of(ns: u64) -> Work<'static> {
        Box::new(move || TIME_NS.set(TIME_NS.get() + ns))
    }

    /// A browser's clock with steps of 0.1 ms. Each call takes a while.
    fn coarse_clock() -> Duration {
        TIME_NS.set(TIME_NS.get() + 50);
        Duration::from_micros(TIME_NS.get() / 100_000 * 100)
    }

    #[test]
    fn a_coarse_clock_tells_times_far_below_its_step() {
        let works = &mut [work_of(5_000), work_of(20_000)];
        let ns = by_turns(works, 3, Duration::MAX, coarse_clock);
        for (ns, truth) in ns.iter().zip([5_000.0, 20_000.0]) {
            for ns in ns {
                assert!((ns / truth - 1.0).abs() < 0.1, "{ns} ns of {truth}");
            }
        }
    }
}
