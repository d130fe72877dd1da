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

/// The results of a task for each item, in order.
pub(crate) fn map<I: Send, T: Send>(items: impl IntoIterator<Item = I>, task: impl Fn(I) -> T + Sync) -> Vec<T> {
    map_with(items, || (), |(), item| task(item))
}

/// As [`map`], with memory that is used for many items.
pub(crate) fn map_with<I: Send, M, T: Send>(
    items: impl IntoIterator<Item = I>,
    memory: impl Fn() -> M + Sync,
    task: impl Fn(&mut M, I) -> T + Sync,
) -> Vec<T> {
    // Each pair has its item first, and its result in the end.
    let pairs: Vec<_> = items.into_iter().map(|item| Mutex::new((Some(item), None))).collect();
    let worker = || -> Worker<'_> {
        let (mut memory, task, pairs) = (memory(), &task, &pairs);
        Box::new(move |number| {
            let mut pair = pairs[number].lock().unwrap_or_else(PoisonError::into_inner);
            pair.1 = pair.0.take().map(|item| task(&mut memory, item));
        })
    };
    workers::run(pairs.len(), &worker);
    let pairs = pairs.into_iter();
    pairs
        .filter_map(|pair| pair.into_inner().unwrap_or_else(PoisonError::into_inner).1)
        .collect()
}

/// As [`map`]; once a task has failed, no other begins.
///
/// # Errors
/// The first error in the order of the items among those that were begun.
pub(crate) fn try_map<I: Send, T: Send, E: Send>(
    items: impl IntoIterator<Item = I>,
    task: impl Fn(I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    try_map_with(items, || (), |(), item| task(item))
}

/// As [`try_map`], with memory that is used for many items.
///
/// # Errors
/// As [`try_map`].
pub(crate) fn try_map_with<I: Send, M, T: Send, E: Send>(
    items: impl IntoIterator<Item = I>,
    memory: impl Fn() -> M + Sync,
    task: impl Fn(&mut M, I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let has_failed = AtomicBool::new(false);
    let unless_failed = |memory: &mut M, item: I| {
        let result = (!has_failed.load(Ordering::Relaxed)).then(|| task(memory, item))?;
        has_failed.fetch_or(result.is_err(), Ordering::Relaxed);
        Some(result)
    };
    map_with(items, memory, unless_failed).into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order() {
        assert_eq!(
            map(0..1000, |number| 3 * number),
            (0..1000).map(|number| 3 * number).collect::<Vec<_>>()
        );
        assert!(map(0..0, |number| number).is_empty());
    }

    #[test]
    fn memory_is_that_of_one_worker() {
        let count = |done: &mut usize, _| {
            *done += 1;
            *done
        };
        let done = on_one_thread(|| map_with(0..1000, || 0, count)).unwrap();
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
        assert_eq!(on_one_thread(|| try_map(0..1000, task)).unwrap(), Err(0));
        assert_eq!(*begun.lock().unwrap(), 1);
        assert_eq!(try_map(0..3, Ok::<_, ()>), Ok(vec![0, 1, 2]));
    }
}
