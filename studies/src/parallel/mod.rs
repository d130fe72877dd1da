//! Parallel work by rayon; sequential without the feature `threads`, as in a web page.
//!
//! Results are the same: they come in order, and random numbers are counter-based.
//!
//! Rayon compiles its iterators anew for each closure. Here it gets one type of closure, a boxed one: otherwise a fifth of the code that
//! the compiler has to optimise in this crate is rayon's.

#[cfg_attr(feature = "threads", path = "threads.rs")]
#[cfg_attr(not(feature = "threads"), path = "one_by_one.rs")]
mod workers;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

pub(crate) use workers::{NoThread, on_one_thread, threads};

/// Does one numbered task after another.
type Worker<'a> = Box<dyn FnMut(usize) + 'a>;

/// The results of tasks 0 to `count` - 1.
pub(crate) fn map<T: Send>(count: usize, task: impl Fn(usize) -> T + Sync) -> Vec<T> {
    map_with(count, || (), |(), number| task(number))
}

/// The results of tasks 0 to `count` - 1, with memory that is used for many of them.
pub(crate) fn map_with<M, T: Send>(count: usize, memory: impl Fn() -> M + Sync, task: impl Fn(&mut M, usize) -> T + Sync) -> Vec<T> {
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let worker = || -> Worker<'_> {
        let (mut memory, task, results) = (memory(), &task, &results);
        Box::new(move |number| {
            let result = task(&mut memory, number);
            *results[number].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        })
    };
    workers::run(count, &worker);
    let results = results.into_iter();
    results
        .filter_map(|result| result.into_inner().unwrap_or_else(PoisonError::into_inner))
        .collect()
}

/// As [`map`]; once a task has failed, no other begins.
///
/// # Errors
/// The error of the first failed task.
pub(crate) fn try_map<T: Send, E: Send>(count: usize, task: impl Fn(usize) -> Result<T, E> + Sync) -> Result<Vec<T>, E> {
    try_map_with(count, || (), |(), number| task(number))
}

/// As [`map_with`]; once a task has failed, no other begins.
///
/// # Errors
/// The error of the first failed task.
pub(crate) fn try_map_with<M, T: Send, E: Send>(
    count: usize,
    memory: impl Fn() -> M + Sync,
    task: impl Fn(&mut M, usize) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let has_failed = AtomicBool::new(false);
    let unless_failed = |memory: &mut M, number: usize| {
        let result = (!has_failed.load(Ordering::Relaxed)).then(|| task(memory, number))?;
        has_failed.fetch_or(result.is_err(), Ordering::Relaxed);
        Some(result)
    };
    map_with(count, memory, unless_failed).into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order() {
        assert_eq!(
            map(1000, |number| 3 * number),
            (0..1000).map(|number| 3 * number).collect::<Vec<_>>()
        );
        assert!(map(0, |number| number).is_empty());
    }

    #[test]
    fn memory_is_that_of_one_worker() {
        let done = map_with(
            1000,
            || 0,
            |done: &mut usize, _| {
                *done += 1;
                *done
            },
        );
        // Each worker counts from 1 on.
        let workers = done.iter().filter(|&&count| count == 1).count();
        assert!((1..1000).contains(&workers) && done[0] == 1, "{workers}");
    }

    #[test]
    fn a_failed_task_is_the_result_and_the_last_to_begin() {
        let begun = Mutex::new(0);
        let task = |number| {
            *begun.lock().unwrap() += 1;
            if number == 0 { Err(number) } else { Ok(number) }
        };
        assert_eq!(on_one_thread(|| try_map(1000, task)).unwrap(), Err(0));
        assert_eq!(*begun.lock().unwrap(), 1);
        assert_eq!(try_map(3, Ok::<_, ()>), Ok(vec![0, 1, 2]));
    }
}
