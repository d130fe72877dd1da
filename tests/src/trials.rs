//! Tests that require external programs: skipped if one is absent, failed on any other error.

use std::borrow::Borrow;
use std::fmt;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::{Arc, Mutex};

use libtest_mimic::{Arguments, Trial};

/// Why a test's requirements are not met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unready {
    /// A program is neither installed nor installable: the tests are skipped.
    Absent(String),
    /// All programs are available, but a build or a start failed: the tests fail.
    Failed(String),
}

impl fmt::Display for Unready {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Absent(why) | Self::Failed(why)) = self;
        write!(to, "{why}")
    }
}

impl From<std::io::Error> for Unready {
    fn from(error: std::io::Error) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Tests of the type `Test` in scope, each with its function's name.
#[macro_export]
macro_rules! tests {
    ($($test:path),* $(,)?) => {
        [$(($crate::trials::last_word(stringify!($test)), $test as Test)),*]
    };
}

/// Checks all items, `threads` at a time, and returns what is wrong with them.
pub fn faults<I: Send>(
    items: impl Iterator<Item = I> + Send,
    threads: usize,
    check: impl Fn(I) -> Result<(), String> + Sync,
) -> Vec<String> {
    let (items, faults) = (Mutex::new(items), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    // Not `while let`, which would hold the lock during the check.
                    let Some(item) = items.lock().expect("nobody panics").next() else {
                        return;
                    };
                    if let Err(why) = check(item) {
                        faults.lock().expect("nobody panics").push(why);
                    }
                }
            });
        }
    });
    faults.into_inner().expect("nobody panics")
}

/// The number in an environment variable, if it is set.
pub fn number(name: &str) -> Option<u64> {
    let told = std::env::var(name).ok()?;
    Some(told.parse().unwrap_or_else(|_| panic!("{name}={told} is not a number")))
}

/// A function's name without its module path.
pub fn last_word(path: &'static str) -> &'static str {
    path.rsplit([':', ' ']).next().unwrap_or(path)
}

/// [`run`] for tests that also need an empty folder each.
pub fn run_in_folders<T: Send + Sync + 'static>(
    subject: &str,
    tests: impl IntoIterator<Item = (&'static str, fn(&T, &Path))>,
    provide: impl FnOnce() -> Result<T, Unready>,
) -> ExitCode {
    let in_a_folder = tests.into_iter().map(|(name, test)| {
        let run = move |provided: &T| test(provided, tempfile::tempdir().expect("a folder").path());
        (name, run)
    });
    run(subject, None, in_a_folder, provide)
}

/// Runs tests by name with the value of `provide`, which is called once, on `threads` threads or one per processor.
///
/// If a program is absent, each test is reported as ignored and `SKIPPED subject: why` is printed, which `tests/run` repeats at its end.
pub fn run<T, B: ?Sized, F>(
    subject: &str,
    threads: Option<usize>,
    tests: impl IntoIterator<Item = (&'static str, F)>,
    provide: impl FnOnce() -> Result<T, Unready>,
) -> ExitCode
where
    T: Borrow<B> + Send + Sync + 'static,
    F: Fn(&B) + Send + 'static,
{
    let mut arguments = Arguments::from_args();
    arguments.test_threads = threads.or(arguments.test_threads);
    let provided = (!arguments.list).then(|| provide().map(Arc::new));
    if let Some(Err(Unready::Absent(why))) = &provided {
        let _ = writeln!(std::io::stderr(), "SKIPPED {subject}: {why}");
    }
    let trials = tests.into_iter().map(|(name, test)| {
        let provided = provided.clone();
        let is_skipped = matches!(provided, Some(Err(Unready::Absent(_))));
        let trial = Trial::test(name, move || match provided {
            Some(Ok(ready)) => {
                test((*ready).borrow());
                Ok(())
            }
            Some(Err(unready)) => Err(unready.into()),
            None => Ok(()),
        });
        trial.with_ignored_flag(is_skipped)
    });
    libtest_mimic::run(&arguments, trials.collect()).exit_code()
}
