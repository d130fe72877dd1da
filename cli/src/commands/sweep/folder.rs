//! The folder of a sweep: its plan, its shards and their sum, by name.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use sim::input;
use studies::sweep::{Division, PlanFile, Shard, Sweep};

use crate::files;

/// The sum of all shards, or what one run has done.
pub fn whole(folder: &Path) -> PathBuf {
    folder.join("sweep.json")
}

/// The plan, its scene written out and its division fixed.
pub fn plan(folder: &Path) -> PathBuf {
    folder.join("plan.toml")
}

/// What a shard has done.
pub fn shard(folder: &Path, shard: Shard) -> PathBuf {
    folder.join(format!("shard-{:06}-of-{:06}.json", shard.index(), shard.count()))
}

/// Why a shard failed.
pub fn failure(folder: &Path, of: Shard) -> PathBuf {
    shard(folder, of).with_extension("failed")
}

/// The files of all shards in a folder, in their order.
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

/// Makes the folder of a sweep with its number of shards, if it is not there, and puts the plan into it. Returns the plan that is there,
/// with its division.
pub fn begin(folder: &Path, plan: &PlanFile, shards: u64) -> anyhow::Result<PlanFile> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let path = self::plan(folder);
    if path.exists() {
        let kept = kept_plan(folder)?;
        ensure!(
            kept.sweep == plan.sweep,
            "{} is the folder of another plan: name another folder",
            folder.display()
        );
        let there = kept.division.as_ref().map_or(shards, |division| division.shards);
        ensure!(
            there == shards,
            "{} is the folder of {there} shards, not of {shards}: name another folder",
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

/// The plan that a folder holds.
pub fn kept_plan(folder: &Path) -> anyhow::Result<PlanFile> {
    let path = plan(folder);
    let text = input::read_text(&path, input::TABLE_MAX).with_context(|| {
        format!(
            "{} is no folder of a sweep's shards: cannot read {}",
            folder.display(),
            path.display()
        )
    })?;
    Ok(Sweep::from_toml(&path.display().to_string(), &text, &[])?)
}

/// Leaves word of why a shard failed, or takes it away where it did not.
pub fn note_failure(folder: &Path, shard: Shard, failed: Option<&anyhow::Error>) -> anyhow::Result<()> {
    let path = failure(folder, shard);
    match failed {
        // Where there is no room even for this, the shard is shown as missing.
        Some(error) => {
            let text = crate::output::explain(error);
            let _ = files::write(&path, text);
        }
        None if path.exists() => std::fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?,
        None => {}
    }
    Ok(())
}
