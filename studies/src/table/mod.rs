//! Tables of the best LED-to-ambient ratio: made by searches over many settings, written to files, read by transmitters.
//!
//! - [`Survey`]: a search at each illuminance and interval, by any criterion; its results are [`Findings`].
//! - [`CriterionSurvey`]: the best ratio at intervals × distances × illuminances × yaws, and the transmitter's ratio.
//! - [`ReachSurvey`]: the same by the reach of messages, at intervals × illuminances; [`Bounds`]: within the required and allowed light of
//!   a lamp.
//! - [`LeastRegret`]: the ratio for an unknown one of several scenes, from a [`ReachSurvey`] of each.
//! - [`TableFile`]: the file that holds it, with its origin.
//!
//! A transmitter knows the light and its own interval, but not the camera's position: it has one ratio for each illuminance and interval,
//! by one of two rules over the distances ([`Rule`]).

mod by_criterion;
mod by_reach;
mod condition;
mod contradiction;
mod file;
mod findings;
mod intensity;
mod least_regret;
mod regret;
mod seal;
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
pub use survey::{EntryAndDetails, Survey, SurveyError, SurveyEvent};
