//! Reports of results: documents and figures on disk, and the output of long commands while they work.
//!
//! No text here states a result: numbers and verdicts come from the results.

pub mod claims;
pub mod document;
pub mod figure;
pub mod optimum;
pub mod sweep;
pub mod table;
pub mod work_precision;
