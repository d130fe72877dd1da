//! What is written of results: documents, figures with their numbers.

pub mod document;
pub mod figure;
