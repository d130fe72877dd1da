//! Workers on rayon's threads.

use rayon::prelude::*;
pub use rayon::{ThreadPoolBuildError as NoThread, current_num_threads as threads};

use super::Worker;

/// Runs all parts of the work on a single thread.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, NoThread> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    Ok(one.install(work))
}

/// Runs tasks 0 to `count` - 1. Each thread calls `worker` at least once for those that it does.
pub fn run<'a>(count: usize, worker: &(dyn Fn() -> Worker<'a> + Sync)) {
    (0..count).into_par_iter().for_each_init(worker, |work, number| work(number));
}
