//! Tables of the best LED-to-ambient ratio: made by searches over many settings, written to files, read by transmitters.
//!
//! - [`Survey`]: the best ratio at intervals × distances × illuminances × yaws, and what of it a transmitter should carry.
//! - [`TableFile`]: the file that holds it, with all that it came from.
//!
//! A transmitter knows the light and its own interval, but not who looks at it from where: it carries one ratio for each
//! illuminance and interval, by one of two rules over the distances ([`Rule`]).

mod condition;
mod file;
mod outcome;
mod survey;

pub use condition::Condition;
pub use file::{SearchRecord, TableFile};
pub use outcome::{Cell, Entry, Rule};
pub use survey::{News, Survey, SurveyError};
