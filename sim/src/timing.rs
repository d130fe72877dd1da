//! Timing by turns: each work runs for a moment, then the next, again and again.
//!
//! What else the machine does then falls on all alike, so that ratios of one turn are of one state of the machine. In a turn the
//! fastest of a few runs counts, one that had the processor to itself.

use std::time::{Duration, Instant};

/// Something to be timed. It does the same amount of work each time.
pub type Work<'a> = Box<dyn FnMut() + 'a>;

/// Runs shorter than this are repeated until they take so long: below, the clock's own steps count.
const SHORTEST_NS: f64 = 20_000.0;
/// Of runs up to this time in all the fastest is taken in a turn.
const TURN_NS: f64 = 2e6;
/// Most runs of a turn.
const RUNS: usize = 8;

/// The time of one run of each work, in ns, turn by turn: of `turns` turns or of as many as begin within `budget`, at least one.
///
/// ```
/// use std::{hint::black_box, time::Duration};
/// use sim::timing::{Work, by_turns};
///
/// let sum_to = |end: u64| -> Work { Box::new(move || drop(black_box((0..black_box(end)).sum::<u64>()))) };
/// let ns = by_turns(&mut [sum_to(10), sum_to(1000)], 5, Duration::MAX);
/// assert_eq!((ns.len(), ns[0].len()), (2, 5));
/// ```
pub fn by_turns(works: &mut [Work], turns: usize, budget: Duration) -> Vec<Vec<f64>> {
    let lengths: Vec<Length> = works.iter_mut().map(Length::of).collect();
    let mut ns = vec![Vec::new(); works.len()];
    let started = Instant::now();
    for turn in 0..turns.max(1) {
        if turn > 0 && started.elapsed() >= budget {
            break;
        }
        for ((work, length), ns) in works.iter_mut().zip(&lengths).zip(&mut ns) {
            ns.push(length.turn(work));
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
    /// From a first run.
    fn of(work: &mut Work) -> Self {
        let once = run(work, 1).max(1.0);
        let repetitions = (SHORTEST_NS / once).ceil().max(1.0);
        let runs = (TURN_NS / (once * repetitions)).clamp(1.0, RUNS as f64);
        Self {
            repetitions: repetitions as usize,
            runs: runs as usize,
        }
    }

    fn turn(&self, work: &mut Work) -> f64 {
        let repetitions = self.repetitions;
        let runs = (0..self.runs).map(|_| run(work, repetitions) / repetitions as f64);
        runs.fold(f64::INFINITY, f64::min)
    }
}

/// The time of so many repetitions, in ns.
fn run(work: &mut Work, repetitions: usize) -> f64 {
    let started = Instant::now();
    (0..repetitions).for_each(|_| work());
    started.elapsed().as_secs_f64() * 1e9
}
