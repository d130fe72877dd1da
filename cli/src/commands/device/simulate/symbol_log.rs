//! The log of what the LEDs show, symbol by symbol.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::json;

use super::board::Symbol;
use crate::files::{self, Pipe};
use crate::output;

/// Where it is written.
pub enum SymbolLog {
    /// On standard output, at once.
    Output,
    /// To a pipe or a device, at once.
    Pipe(Pipe),
    /// In a file, at the end.
    File(PathBuf, String),
}

impl SymbolLog {
    /// A log there; `-` is standard output.
    pub fn to(path: &Path) -> anyhow::Result<Self> {
        if path == Path::new("-") {
            return Ok(Self::Output);
        }
        if files::check(path)? {
            return Ok(Self::File(path.into(), String::new()));
        }
        let pipe = File::options().append(true).open(path);
        let pipe = pipe.with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self::Pipe(Pipe(pipe)))
    }

    /// Writes one symbol: its bits and the part of its full light that an On LED gives; as JSON the cycles of its carrier, too, if it has
    /// one.
    pub fn write(&mut self, symbol: &Symbol, as_json: bool) -> anyhow::Result<()> {
        let Symbol { at, panel, light, timing } = symbol;
        let entry = if as_json {
            let bits = panel.to_string();
            let mut entry = json!({ "time_s": at.as_secs_f64(), "bits": bits, "light": light });
            if !timing.waveform().is_still() {
                entry["carrier_cycles"] = timing.waveform().cycles().into();
            }
            entry.to_string()
        } else {
            format!("{panel} {light:.6}")
        };
        match self {
            Self::Output => output::line(&entry),
            Self::Pipe(pipe) => Ok(writeln!(pipe, "{entry}")?),
            Self::File(_, text) => {
                text.push_str(&entry);
                text.push('\n');
                Ok(())
            }
        }
    }

    /// Ends: writes what is to be in a file.
    pub fn finish(self) -> anyhow::Result<()> {
        match self {
            Self::File(path, text) => files::write(&path, text),
            Self::Output | Self::Pipe(_) => Ok(()),
        }
    }
}
