//! A single worker, on the present thread.

use super::Worker;

/// The error of a missing thread, which cannot occur.
#[derive(Debug, thiserror::Error)]
pub enum NoThread {}

/// The number of threads.
pub const fn threads() -> usize {
    1
}

/// Runs the work.
pub fn on_one_thread<T>(work: impl FnOnce() -> T) -> Result<T, NoThread> {
    Ok(work())
}

/// Runs tasks 0 to `count` - 1.
pub fn run<'a>(count: usize, worker: &(dyn Fn() -> Worker<'a> + Sync)) {
    (0..count).for_each(worker());
}
