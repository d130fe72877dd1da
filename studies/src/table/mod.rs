//! Tables of the best LED-to-ambient ratio: made by searches over many settings, written to files, read by transmitters.
//!
//! - [`survey`]: the best ratio at intervals × distances × illuminances × yaws, and what of it a transmitter should carry.
//! - [`mod@file`]: the file that holds it, with all that it came from.
//!
//! A transmitter knows the light and its own interval, but not who looks at it from where: it carries one ratio for each
//! illuminance and interval, by one of two rules over the distances ([`survey::Rule`]).

pub mod file;
pub mod survey;

pub use file::TableFile;
pub use survey::{Cell, Entry, News, Rule, Setting, Survey, SurveyError};
