//! Parallel work by rayon; sequential without the feature `threads`, as in a web page.
//!
//! Results are the same: chunks are folded in order, and random numbers are counter-based.

#[cfg_attr(feature = "threads", path = "threads.rs")]
#[cfg_attr(not(feature = "threads"), path = "one_by_one.rs")]
mod work;

pub(crate) use work::{NoThread, on_one_thread, prelude, threads};
