//! A search for the best ratio at each place of a table, by any criterion.

use link::l2a_table::{L2A_MIN, L2aTable, TableError};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sim::scene::{RangeError, Scene};

use super::condition::Condition;
use super::findings::Outcome;
use crate::optimum::OptimumError;
use crate::reach::ReachError;

/// The result at a place, and its details.
pub type EntryAndDetails<E> = (E, Vec<<E as Outcome>::Detail>);

/// A search at each place of a table: each illuminance and interval.
pub trait Survey: Sync {
    /// The result at a place.
    type Entry: Outcome;
    /// A saved piece of unfinished work at a place, from which the search continues.
    type Piece: Serialize + DeserializeOwned;

    /// Ambient illuminances, lx, and normalised LED intervals.
    fn axes(&self) -> [&[f64]; 2];

    /// The settings that the result depends on.
    fn record(&self) -> <Self::Entry as Outcome>::Record;

    /// Searches a place, continued from the pieces that an earlier run finished there, in the order of their reports. `None` if the search
    /// was ended early.
    ///
    /// # Errors
    /// If the place cannot be searched.
    fn find(
        &self,
        scene: &Scene,
        place: [f64; 2],
        known: Vec<Self::Piece>,
        tell: impl FnMut(SurveyEvent<Self::Piece>) + Send,
    ) -> Result<Option<EntryAndDetails<Self::Entry>>, SurveyError>;
}

/// The progress of a survey.
#[derive(Clone, Copy, Debug)]
pub enum SurveyEvent<'a, Piece> {
    /// A piece is finished.
    Piece {
        /// The piece.
        piece: &'a Piece,
        /// Its work: frames, or ratios by reach.
        work: u64,
        /// Whether an earlier run has finished it.
        is_known: bool,
    },
    /// One of the settings of a place is finished.
    Setting,
}

/// Why a survey failed.
#[derive(Debug, thiserror::Error)]
pub enum SurveyError {
    /// A key has no values.
    #[error("no {key} to try: give at least one")]
    Empty {
        /// The key.
        key: &'static str,
    },
    /// A value is not allowed.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// The illuminances and intervals are not axes of a table.
    #[error(transparent)]
    Axes(#[from] TableError),
    /// The optimum at one setting cannot be found.
    #[error("at {setting}: {source}")]
    Optimum {
        /// The setting.
        setting: Condition,
        /// The cause.
        source: OptimumError,
    },
    /// The distances have too few ratios in common.
    #[error("the mean bit error rate at {illuminance_lx} lx, interval {interval} has no minimum: give more frames")]
    NoMean {
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
    },
    /// No ratio is within the bounds.
    #[error(
        "at {illuminance_lx} lx and interval {interval} no ratio from {low} to {high} gives {wanted}: they give a mean of {least_cd:.3} to \
         {most_cd:.3} cd; set other bounds, another --range, or leave this light out"
    )]
    Bounds {
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
        /// The lowest ratio.
        low: f64,
        /// The highest ratio.
        high: f64,
        /// The requirement, in words.
        wanted: String,
        /// The mean intensity at the lowest ratio, cd.
        least_cd: f64,
        /// The mean intensity at the highest ratio, cd.
        most_cd: f64,
    },
    /// The reach at one setting cannot be found.
    #[error("at {illuminance_lx} lx and interval {interval}: {source}")]
    Reach {
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
        /// The cause.
        source: ReachError,
    },
}

/// The result, or `None` if the search was ended early.
pub(super) fn unless_ended<T>(found: Result<T, SurveyError>) -> Result<Option<T>, SurveyError> {
    match found {
        Err(
            SurveyError::Optimum {
                source: OptimumError::Interrupted,
                ..
            }
            | SurveyError::Reach {
                source: ReachError::Interrupted,
                ..
            },
        ) => Ok(None),
        found => found.map(Some),
    }
}

/// Checks that illuminances in lx and intervals are valid axes of a transmitter's table.
///
/// # Errors
/// The first invalid value.
pub(super) fn check_axes(illuminance_lx: &[f64], interval: &[f64]) -> Result<(), TableError> {
    let single = |axis: &[f64]| axis.iter().map(|&value| value as f32).collect::<Vec<_>>();
    let ratios = vec![L2A_MIN; illuminance_lx.len() * interval.len()];
    L2aTable::new(&single(illuminance_lx), &single(interval), &ratios).map(drop)
}
