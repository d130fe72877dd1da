//! Timing by turns: each work runs for a moment, then the next, again and again.
//!
//! What else the machine does then falls on all alike, so that ratios of one turn are of one state of the machine. In a turn the
//! fastest of a few runs counts, one that had the processor to itself.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Something to be timed. It does the same amount of work each time.
pub type Work<'a> = Box<dyn FnMut() + 'a>;

/// The time since a moment that is the same at each call.
pub type Clock = fn() -> Duration;

/// The clock of the computer's system. A page of a browser has another.
pub fn system_clock() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

/// Runs shorter than this are repeated until they take so long: below, calls of the clock count.
const SHORTEST_NS: f64 = 20_000.0;
/// And until they take so many of the clock's own steps: a browser's are of up to 100 µs.
const SHORTEST_STEPS: f64 = 50.0;
/// Of runs up to this time in all the fastest is taken in a turn.
const TURN_NS: f64 = 2e6;
/// Most runs of a turn.
const RUNS: usize = 8;

/// The time of one run of each work, in ns, turn by turn: of `turns` turns or of as many as begin within `budget`, at least one.
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
    let shortest_ns = SHORTEST_NS.max(SHORTEST_STEPS * step_ns(clock));
    let lengths: Vec<Length> = works
        .iter_mut()
        .map(|work| Length::of(work, shortest_ns, clock))
        .collect();
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

/// How long a turn of a work is.
struct Length {
    repetitions: usize,
    runs: usize,
}

impl Length {
    /// From first runs, of ever more repetitions.
    fn of(work: &mut Work, shortest_ns: f64, clock: Clock) -> Self {
        let mut repetitions = 1;
        let mut took = run(work, repetitions, clock);
        while took < shortest_ns {
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

/// The time of so many repetitions, in ns.
fn run(work: &mut Work, repetitions: usize, clock: Clock) -> f64 {
    let started = clock();
    (0..repetitions).for_each(|_| work());
    (clock() - started).as_secs_f64() * 1e9
}

/// One step of the clock, in ns.
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

    /// A browser's clock.
    fn coarse_clock() -> Duration {
        let ms = system_clock().as_secs_f64() * 1e3;
        Duration::from_secs_f64((10.0 * ms).floor() / 1e4)
    }

    #[test]
    fn a_coarse_clock_tells_times_far_below_its_step() {
        let spin = |us: u64| -> Work {
            Box::new(move || {
                let until = system_clock() + Duration::from_micros(us);
                while system_clock() < until {}
            })
        };
        let ns = by_turns(&mut [spin(5), spin(20)], 3, Duration::MAX, coarse_clock);
        let least = |ns: &[f64]| ns.iter().copied().fold(f64::INFINITY, f64::min);
        let ratio = least(&ns[1]) / least(&ns[0]);
        assert!((2.0..6.0).contains(&ratio), "{ns:?}");
    }
}
