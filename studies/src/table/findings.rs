//! The results of a criterion for a table: an entry for each illuminance and interval, its details, and the settings.

use std::cmp::Ordering;
use std::fmt::Debug;

use serde::{Serialize, Serializer};

/// Ratios that differ by no more than this share are the same, because files have five digits.
pub(super) const SAME: f64 = 1e-4;

/// A record of a table's place.
pub trait AtPlace: Clone + Debug + PartialEq + Serialize {
    /// Ambient illuminance, lx, and normalised LED interval.
    fn place(&self) -> [f64; 2];
}

/// Implements the place from the fields for illuminance and interval.
macro_rules! at_place {
    ($($kind:ty),+) => {
        $(impl $crate::table::AtPlace for $kind {
            fn place(&self) -> [f64; 2] {
                [self.illuminance_lx, self.interval]
            }
        })+
    };
}
pub(super) use at_place;

/// Implements the results of a search whose ratio is the field `l2a`, and which does not decide between those of another field.
macro_rules! outcome {
    ($entry:ty, $detail:ty, $record:ty, $undecided:ident, $keys:expr) => {
        $crate::table::findings::at_place!($entry, $detail);

        impl $crate::table::Outcome for $entry {
            type Record = $record;
            type Detail = $detail;
            const KEYS: [[&str; 2]; 2] = $keys;

            fn carried(&self, _: &$record) -> f64 {
                self.l2a
            }

            fn carried_95(&self, _: &$record) -> [f64; 2] {
                self.l2a_95
            }

            fn undecided(&self, _: &$record) -> [f64; 2] {
                self.$undecided
            }

            fn range(record: &$record) -> [f64; 2] {
                record.range
            }
        }
    };
}
pub(super) use outcome;

/// The result of a criterion at one place.
pub trait Outcome: AtPlace {
    /// The settings of the search.
    type Record: Clone + Debug + PartialEq;
    /// Its details, several for a place.
    type Detail: AtPlace;
    /// The keys of the results and of the details in a table file, each with the comment above it.
    const KEYS: [[&str; 2]; 2];

    /// The transmitter's ratio.
    fn carried(&self, record: &Self::Record) -> f64;

    /// Its 95 % interval.
    fn carried_95(&self, record: &Self::Record) -> [f64; 2];

    /// The lowest and the highest of the ratios between which the search does not decide.
    fn undecided(&self, record: &Self::Record) -> [f64; 2];

    /// The range of ratios.
    fn range(record: &Self::Record) -> [f64; 2];
}

/// All results of a criterion.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings<E: Outcome> {
    /// The settings of the search, if there was one.
    pub record: Option<E::Record>,
    /// The result for each illuminance and interval.
    pub entries: Vec<E>,
    /// The details of the results.
    pub details: Vec<E::Detail>,
}

impl<E: Outcome> Default for Findings<E> {
    fn default() -> Self {
        Self {
            record: None,
            entries: Vec::new(),
            details: Vec::new(),
        }
    }
}

impl<E: Outcome> Findings<E> {
    /// The entry of a place, if present.
    pub fn entry(&self, place: [f64; 2]) -> Option<&E> {
        self.entries.iter().find(|entry| entry.place() == place)
    }

    /// The details of a place.
    pub fn details_at(&self, place: [f64; 2]) -> impl Iterator<Item = &E::Detail> {
        self.details.iter().filter(move |detail| detail.place() == place)
    }

    /// The 95 % interval of the ratio of a place, if known.
    pub(super) fn carried_95(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        let record = self.record.as_ref()?;
        Some(self.entry(place)?.carried_95(record))
    }

    /// The entries that the search does not decide.
    pub(super) fn unknown(&self) -> impl Iterator<Item = Unknown> {
        self.record.iter().flat_map(|record| {
            let range = E::range(record);
            let entries = self.entries.iter();
            entries.filter_map(move |entry| Unknown::of(entry.place(), entry.undecided(record), range))
        })
    }

    /// Adds others, and sorts all by the axes.
    pub(super) fn extend(&mut self, entries: impl IntoIterator<Item = E>, details: impl IntoIterator<Item = E::Detail>) {
        self.entries.extend(entries);
        self.details.extend(details);
        self.entries.sort_by(in_order);
        self.details.sort_by(in_order);
    }

    /// The lines of a table file.
    pub(super) fn lines(&self) -> Result<String, toml::ser::Error> {
        let [entries, details] = E::KEYS;
        Ok(lines(entries, &self.entries)? + &lines(details, &self.details)?)
    }
}

fn in_order<T: AtPlace>(one: &T, other: &T) -> Ordering {
    one.place().partial_cmp(&other.place()).unwrap_or(Ordering::Equal)
}

/// A list of tables, one a line; nothing for an empty one.
fn lines([key, comment]: [&str; 2], values: &[impl Serialize]) -> Result<String, toml::ser::Error> {
    if values.is_empty() {
        return Ok(String::new());
    }
    let mut text = format!("\n# {comment}.\n{key} = [\n");
    for value in values {
        let mut line = String::new();
        value.serialize(toml::ser::ValueSerializer::new(&mut line))?;
        text += &format!("  {line},\n");
    }
    Ok(text + "]\n")
}

/// A search that does not decide on a ratio.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "at {illuminance_lx} lx and interval {interval} any ratio from {low} to {high} will do, for all that the search has found, which is \
     all it looked among: make this entry with `vocc optimize --criterion reach`, farther away, or with more frames"
)]
pub struct Unknown {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// The lowest ratio.
    pub low: f64,
    /// The highest ratio.
    pub high: f64,
}

impl Unknown {
    /// The undecided ratios of a place, if these are the search's whole range.
    fn of([illuminance_lx, interval]: [f64; 2], undecided: [f64; 2], [low, high]: [f64; 2]) -> Option<Self> {
        let is_all = undecided[0] <= low * (1.0 + SAME) && undecided[1] >= high * (1.0 - SAME);
        is_all.then_some(Self {
            illuminance_lx,
            interval,
            low,
            high,
        })
    }
}

/// A number with five digits, which is more than its uncertainty.
pub(super) fn short<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    five_digits(*value).serialize(serializer)
}

/// The same, if there is one.
pub(super) fn short_if_any<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    value.map(five_digits).serialize(serializer)
}

/// The same for two.
pub(super) fn short_pair<S: Serializer>(values: &[f64; 2], serializer: S) -> Result<S::Ok, S::Error> {
    values.map(five_digits).serialize(serializer)
}

/// The same for two, if there are any.
pub(super) fn short_pair_if_any<S: Serializer>(values: &Option<[f64; 2]>, serializer: S) -> Result<S::Ok, S::Error> {
    values.map(|values| values.map(five_digits)).serialize(serializer)
}

/// The same for many.
pub(super) fn short_list<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(values.iter().map(|&value| five_digits(value)))
}

fn five_digits(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}
