//! Entry by entry through a table: what is there is skipped, what is found is kept at once.

use serde::de::DeserializeOwned;
use studies::sweep::Shard;
use studies::table::TableFile;

use super::rounds::{About, Rounds};
use super::{Arguments, as_toml, verdict};
use crate::output::Answer;
use crate::plot::{self, Drawing};
use crate::{report, results};

/// A way to find entries.
pub trait Finder {
    /// What an entry is found from, piece by piece.
    type Piece: DeserializeOwned;
    /// What is found.
    type Entry;

    /// Whether a table has the entry of an illuminance and an interval: of a place.
    fn is_in(file: &TableFile, place: [f64; 2]) -> bool;

    /// Whether somebody reads what is told.
    fn is_read(&self) -> bool;

    /// Finds an entry, going on from the pieces that are known, and keeps the new ones; none where it was interrupted.
    fn find(
        &mut self,
        illuminance_lx: f64,
        interval: f64,
        known: Vec<Self::Piece>,
        rounds: &mut Rounds,
    ) -> anyhow::Result<Option<Self::Entry>>;

    /// Adds an entry to the table, and tells of it.
    fn add(&mut self, entry: Self::Entry, file: &mut TableFile) -> anyhow::Result<()>;

    /// The plot beside the table.
    fn draw(&self, file: &TableFile) -> anyhow::Result<Drawing>;
}

/// Finds what is missing of a shard's entries in a table, and writes table and plot. The finder is made for a table as it is begun and the
/// number of entries to find.
pub fn find_all<F: Finder>(
    arguments: &Arguments,
    empty: TableFile,
    finder: impl FnOnce(&TableFile, usize) -> anyhow::Result<F>,
) -> anyhow::Result<Answer> {
    let settings = as_toml(&empty)?;
    let mut file = arguments.begun(empty)?;
    let own = arguments.shard.unwrap_or(Shard::WHOLE);
    let of_shard = file.ratios.places().zip((0..own.count()).cycle());
    let missing: Vec<[f64; 2]> = of_shard
        .filter(|&(place, shard)| shard == own.index() && !F::is_in(&file, place))
        .map(|(place, _)| place)
        .collect();
    let mut finder = finder(&file, missing.len())?;
    let out = arguments.out.as_deref();
    for [illuminance_lx, interval] in missing {
        // What is kept may be read later.
        if out.is_none() && !finder.is_read() {
            return Ok(Answer::Yes);
        }
        let about = About {
            table: &settings,
            illuminance_lx,
            interval,
        };
        let (mut rounds, known) = Rounds::begin(out, &about)?;
        let found = finder.find(illuminance_lx, interval, known, &mut rounds)?;
        let Some(entry) = found else {
            report::optimum::interrupted(out);
            return Ok(Answer::No);
        };
        let told = finder.add(entry, &mut file);
        arguments.keep(&file)?;
        rounds.finish()?;
        told?;
    }
    if let Some(path) = out {
        plot::save(&results::stem(path, "toml"), &finder.draw(&file)?)?;
    }
    Ok(verdict(&file))
}
