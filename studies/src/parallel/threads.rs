//! Parallel work by rayon's threads.

pub use rayon::{ThreadPoolBuildError as NoThread, current_num_threads as threads, prelude};

/// Runs all parts of the work on a single thread.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, NoThread> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    Ok(one.install(work))
}
