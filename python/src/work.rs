//! Runs long calls: without Python's lock, on threads that end with the call, and with checks for Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use studies::stop::Stop;

use crate::errors::{guarded, refused};

/// Interval between two checks for Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// The stack must hold the working memory of a frame.
const STACK_BYTES: usize = 8 << 20;
/// Maximum number of threads, as on the command line.
const THREADS_MAX: usize = 1024;

/// Flags of finished calls, for reuse: a [`Stop`] is never freed, so there are as many as there have been simultaneous calls. Between
/// calls, they have no meaning.
static FLAGS: Mutex<Vec<&'static AtomicBool>> = Mutex::new(Vec::new());

/// A flag that is returned for reuse.
struct Flag(&'static AtomicBool);

impl Flag {
    fn take() -> Self {
        let left = FLAGS.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let flag = left.unwrap_or_else(|| Box::leak(Box::default()));
        flag.store(false, Ordering::Relaxed);
        Self(flag)
    }
}

impl Drop for Flag {
    fn drop(&mut self) {
        FLAGS.lock().unwrap_or_else(PoisonError::into_inner).push(self.0);
    }
}

/// The settings of long work: the number of threads, by default that of the processors.
pub struct Work {
    threads: Option<usize>,
}

/// The connection between long work and its caller: progress, and the request to stop.
pub struct WorkControl {
    done: Sender<u64>,
    reported: u64,
    /// Whether the caller has requested the end.
    pub stop: Stop,
}

impl WorkControl {
    /// Reports the total that is done.
    pub fn done(&mut self, total: u64) {
        if total > self.reported {
            // The caller may have stopped listening.
            let _ = self.done.send(total - self.reported);
            self.reported = total;
        }
    }
}

impl Work {
    /// Work on threads that start and end with each call: a longer-lived thread would be missing in a forked process.
    pub fn on(threads: Option<usize>) -> PyResult<Self> {
        if threads.is_some_and(|threads| !(1..=THREADS_MAX).contains(&threads)) {
            let threads = threads.unwrap_or_default();
            return Err(refused(format!(
                "threads = {threads}: give 1 to {THREADS_MAX}, or None for all processors"
            )));
        }
        Ok(Self { threads })
    }

    fn pool(&self) -> PyResult<rayon::ThreadPool> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.unwrap_or_default())
            .stack_size(STACK_BYTES)
            .build();
        let fault = |fault| refused(format!("cannot start threads: {fault}; ask for fewer with threads="));
        pool.map_err(fault)
    }

    /// Runs `work`; `progress`, if there is one, is called in the calling thread with the amount done since its last call.
    ///
    /// # Errors
    /// Errors of the work, exceptions of `progress`, and `KeyboardInterrupt`.
    pub fn run<T: Send, E: Send + std::fmt::Display>(
        &self,
        py: Python<'_>,
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(WorkControl) -> Result<T, E> + Send,
    ) -> PyResult<T> {
        let pool = self.pool()?;
        let flag = Flag::take();
        let (done, news) = channel();
        let control = WorkControl {
            done,
            reported: 0,
            stop: Stop::at(flag.0),
        };
        let progress = progress.map(|progress| progress.clone().unbind());
        guarded(|| {
            let progress = progress.as_ref();
            let stop = flag.0;
            let (outcome, heard) = py.detach(move || {
                let mut outcome = None;
                let slot = &mut outcome;
                let heard = pool.in_place_scope(|scope| {
                    scope.spawn(move |_| *slot = Some(work(control)));
                    let heard = listen(&news, progress);
                    if heard.is_err() {
                        stop.store(true, Ordering::Relaxed);
                    }
                    heard
                });
                (outcome, heard)
            });
            heard?;
            match outcome {
                Some(outcome) => outcome.map_err(refused),
                None => Err(refused("the work was not started: try again")),
            }
        })
    }
}

/// Passes progress on until the work ends.
fn listen(news: &Receiver<u64>, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    loop {
        let more = match news.recv_timeout(LOOK_EVERY) {
            Ok(more) => more,
            Err(RecvTimeoutError::Timeout) => 0,
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        };
        Python::attach(|py| {
            py.check_signals()?;
            match progress {
                Some(progress) if more > 0 => progress.call1(py, (more,)).map(drop),
                _ => Ok(()),
            }
        })?;
    }
}
