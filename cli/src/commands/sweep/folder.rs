//! Paths in a sweep's folder: the plan, the shards and their merged results.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use sim::input;
use studies::sweep::{Division, PlanFile, Shard, Sweep};

use crate::files;

/// The merged results, or those of a single run.
pub fn whole(folder: &Path) -> PathBuf {
    folder.join("sweep.json")
}

/// The plan, with its scene and its number of shards.
pub fn plan(folder: &Path) -> PathBuf {
    folder.join("plan.toml")
}

/// A shard's results.
pub fn shard(folder: &Path, shard: Shard) -> PathBuf {
    folder.join(format!("shard-{:06}-of-{:06}.json", shard.index(), shard.count()))
}

/// A shard's failure.
pub fn failure(folder: &Path, of: Shard) -> PathBuf {
    shard(folder, of).with_extension("failed")
}

/// All shards' files in a folder, in order.
pub fn shards(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let unreadable = || format!("cannot read the folder {}", folder.display());
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let name = entry.with_context(unreadable)?.file_name();
        let name = name.to_string_lossy();
        if name.starts_with("shard-") && name.ends_with(".json") {
            found.push(folder.join(name.as_ref()));
        }
    }
    found.sort();
    Ok(found)
}

/// Creates the folder of a sweep with this number of shards if it does not exist, and writes the plan into it. Returns the folder's plan.
pub fn begin(folder: &Path, plan: &PlanFile, shards: u64) -> anyhow::Result<PlanFile> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let path = self::plan(folder);
    if path.exists() {
        let kept = kept_plan(folder)?;
        ensure!(
            kept.sweep == plan.sweep,
            "{} is the folder of another plan: give another folder",
            folder.display()
        );
        let there = kept.division.as_ref().map_or(shards, |division| division.shards);
        ensure!(
            there == shards,
            "{} is the folder of {there} shards, not of {shards}: give another folder",
            folder.display()
        );
        return Ok(kept);
    }
    let mut fixed = plan.clone();
    if fixed.division.is_none() {
        fixed.division = Some(Division {
            shards,
            expected_frames: plan.sweep.expected_frames()?,
        });
    }
    let text = fixed.to_toml().context("the plan cannot be written as TOML")?;
    files::write(&path, text)?;
    Ok(fixed)
}

/// The folder's plan.
pub fn kept_plan(folder: &Path) -> anyhow::Result<PlanFile> {
    let path = plan(folder);
    let text = input::read_text(&path, input::TABLE_MAX).with_context(|| {
        format!(
            "{} is not a folder of a sweep's shards: cannot read {}",
            folder.display(),
            path.display()
        )
    })?;
    Ok(Sweep::from_toml(&path.display().to_string(), &text, &[])?)
}

/// Records why a shard failed, or deletes the record if it did not.
pub fn note_failure(folder: &Path, shard: Shard, failed: Option<&anyhow::Error>) -> anyhow::Result<()> {
    let path = failure(folder, shard);
    match failed {
        // If this fails too, the shard counts as missing.
        Some(error) => {
            let text = crate::output::explain(error);
            let _ = files::write(&path, text);
        }
        None if path.exists() => std::fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?,
        None => {}
    }
    Ok(())
}
