//! The finished parts of a task in progress, from which it continues.

use serde::{Deserialize, Serialize};

use super::sums::Sums;
use crate::monte_carlo::Evaluation;
use crate::statistics::FrameErrors;

/// The finished parts of a task in progress.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pieces {
    /// Parts of [`super::Task::Point`].
    pub(super) batches: Vec<Sums>,
    /// Parts of [`super::Task::Optimum`]: pieces of rounds in their order.
    pub(super) rounds: Vec<Vec<Evaluation>>,
    /// Parts of [`super::Task::Errors`]: whole rounds.
    pub(super) errors: FrameErrors,
}
