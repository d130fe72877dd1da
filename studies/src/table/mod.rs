//! Tables of the best LED-to-ambient ratio: made by searches over many settings, written to files, read by transmitters.
//!
//! - [`Survey`]: a search at each illuminance and interval, by whatever criterion; what it finds are [`Findings`].
//! - [`CriterionSurvey`]: the best ratio at intervals × distances × illuminances × yaws, and what of it a transmitter should carry.
//! - [`ReachSurvey`]: the same by the distance that messages reach, at intervals × illuminances; [`Bounds`]: within the light that a lamp
//!   must and may give.
//! - [`LeastRegret`]: the ratio to carry where nobody knows which of several scenes it will be, by a [`ReachSurvey`] of each.
//! - [`TableFile`]: the file that holds it, with all that it came from.
//!
//! A transmitter knows the light and its own interval, but not who looks at it from where: it carries one ratio for each
//! illuminance and interval, by one of two rules over the distances ([`Rule`]).

mod by_criterion;
mod by_reach;
mod condition;
mod contradiction;
mod file;
mod findings;
mod intensity;
mod least_regret;
mod regret;
mod survey;

pub use by_criterion::{Cell, CriterionSurvey, Entry, Rule, SearchRecord};
pub use by_reach::{ReachEntry, ReachPoint, ReachRecord, ReachSurvey};
pub use condition::Condition;
pub use contradiction::Contradiction;
pub use file::{InFile, PartError, TableFile};
pub use findings::{AtPlace, Findings, Outcome, Unknown};
pub use intensity::{Bounds, luminance_cd_m2, panel_cd};
pub use least_regret::{LeastRegret, RegretError};
pub use regret::{Regret, RegretEntry, RegretPoint, RegretRecord};
pub use survey::{EntryAndDetails, News, Survey, SurveyError};
