//! By rayon's threads.

pub use rayon::{ThreadPoolBuildError as NoThread, current_num_threads as threads, prelude};

/// Does all of a work's parts on one thread of its own.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, NoThread> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    Ok(one.install(work))
}
