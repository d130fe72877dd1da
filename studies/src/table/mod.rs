//! Tables of the best LED-to-ambient ratio: made by searches over many settings, written to files, read by transmitters.
//!
//! - [`Survey`]: the best ratio at intervals × distances × illuminances × yaws, and what of it a transmitter should carry.
//! - [`ReachSurvey`]: the same by the distance that messages reach, at intervals × illuminances; [`Bounds`]: within the light that a lamp
//!   must and may give.
//! - [`LeastRegret`]: the ratio to carry where nobody knows which of several scenes it will be, by a [`ReachSurvey`] of each.
//! - [`TableFile`]: the file that holds it, with all that it came from.
//!
//! A transmitter knows the light and its own interval, but not who looks at it from where: it carries one ratio for each
//! illuminance and interval, by one of two rules over the distances ([`Rule`]).

mod axes;
mod by_reach;
mod condition;
mod file;
mod intensity;
mod least_regret;
mod outcome;
mod regret;
mod survey;

pub use by_reach::{ReachEntry, ReachPoint, ReachRecord, ReachSurvey, ReachSurveyError};
pub use condition::Condition;
pub use file::{PartError, TableFile, Unknown};
pub use intensity::{Bounds, LAMPS, luminance_cd_m2, panel_cd};
pub use least_regret::{LeastRegret, RegretEntry, RegretError, RegretPoint, RegretRecord};
pub use outcome::{Cell, Entry, Rule};
pub use regret::Regret;
pub use survey::{News, SearchRecord, Survey, SurveyError};
