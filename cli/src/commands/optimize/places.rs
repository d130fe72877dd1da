//! Walks through a table's places: skips finished ones, and writes each result at once.

use sim::scene::Scene;
use studies::sweep::Shard;
use studies::table::{InFile, SurveyEvent, TableFile};

use super::rounds::{About, Rounds};
use super::{Arguments, as_toml, verdict};
use crate::output::{self, Verdict};
use crate::plot::{self, Drawing};
use crate::report::optimum::{Presentation, Report, interrupted};
use crate::{report, results};

/// Searches the missing places of a shard, prints them, and writes the table and its plot.
pub fn search<S: Presentation>(
    arguments: &Arguments,
    survey: &S,
    scene: &Scene,
    as_json: bool,
    draw: impl FnOnce(&TableFile) -> anyhow::Result<Drawing>,
) -> anyhow::Result<Verdict> {
    let empty = TableFile::of(survey, scene);
    let settings = as_toml(&empty)?;
    let mut file = arguments.begun(empty)?;
    let own = arguments.shard.unwrap_or(Shard::WHOLE);
    let of_shard = file.ratios.places().zip((0..own.count()).cycle());
    let missing: Vec<[f64; 2]> = of_shard
        .filter(|&(place, shard)| shard == own.index() && S::Entry::of(&file).entry(place).is_none())
        .map(|(place, _)| place)
        .collect();
    let mut report = Report::new(survey, S::Entry::of(&file), missing.len(), as_json)?;
    let out = arguments.out.as_deref();
    for place @ [illuminance_lx, interval] in missing {
        // A written file is useful later.
        if out.is_none() && output::is_unread() {
            return Ok(verdict(&file));
        }
        let about = About {
            table: &settings,
            illuminance_lx,
            interval,
        };
        let (mut rounds, known) = Rounds::begin(out, &about)?;
        let found = survey.find(scene, place, known, |news| {
            if let SurveyEvent::Piece {
                piece, is_known: false, ..
            } = news
            {
                rounds.add(piece);
            }
            report.progress(&news);
        })?;
        let Some((entry, details)) = found else {
            interrupted(out);
            return Ok(Verdict::No);
        };
        let printed = report.entry(&entry, &details);
        file.add(entry, details);
        arguments.write(&file)?;
        rounds.finish()?;
        printed?;
    }
    if !as_json && !file.reach.entries.is_empty() {
        output::line(&report::table::found_line(&file))?;
    }
    if let Some(path) = out {
        plot::save(&results::stem(path, "toml"), &draw(&file)?)?;
    }
    Ok(verdict(&file))
}
