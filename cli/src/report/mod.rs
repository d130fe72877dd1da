//! Reports of results: documents and figures on disk, and the output of long commands while they work.
//!
//! No sentence here says what came out: numbers and verdicts are filled in from the results.

pub mod claims;
pub mod document;
pub mod figure;
pub mod optimum;
pub mod sweep;
pub mod table;
pub mod work_precision;
