//! `vocc scene`: presets as templates for scene files.

use sim::scene::{PRESETS, preset_toml};

use crate::output::{self, Verdict, line};

/// Arguments of `vocc scene`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The preset; without it, all are listed.
    name: Option<String>,
}

/// Prints a preset, or the list of presets.
pub fn run(arguments: &Arguments) -> anyhow::Result<Verdict> {
    match &arguments.name {
        Some(name) => {
            let known = || PRESETS.map(|preset| preset.name).join(", ");
            let text = preset_toml(name).ok_or_else(|| anyhow::anyhow!("no preset {name:?}: choose one of {}", known()))?;
            output::lines(&text)?;
        }
        None => {
            for preset in PRESETS {
                line(&format!("{:<14} {}", preset.name, preset.summary))?;
            }
        }
    }
    Ok(Verdict::Yes)
}
