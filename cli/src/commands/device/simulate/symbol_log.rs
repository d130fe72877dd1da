//! The log of the LEDs' states, symbol by symbol.

use std::fs::File;
use std::io::{BufWriter, IntoInnerError, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::json;

use super::board::Symbol;
use crate::files::{self, Growing, Pipe};
use crate::output;

/// The destination of the log.
pub enum SymbolLog {
    /// On standard output, at once.
    Output,
    /// To a pipe or a device, at once.
    Pipe(Pipe),
    /// In a file, which is there at the end.
    File(PathBuf, BufWriter<Growing>),
}

impl SymbolLog {
    /// A log there; `-` is standard output.
    pub fn to(path: &Path) -> anyhow::Result<Self> {
        if path == Path::new("-") {
            return Ok(Self::Output);
        }
        if files::check(path)? {
            return Ok(Self::File(path.into(), BufWriter::new(Growing::create(path)?)));
        }
        let pipe = File::options().append(true).open(path);
        let pipe = pipe.with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self::Pipe(Pipe(pipe)))
    }

    /// Writes one symbol: its bits and the light of an On LED as a share of full light. JSON also has the cycles of its carrier, if it has
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
            Self::File(path, file) => writeln!(file, "{entry}").with_context(|| cannot_write(path)),
        }
    }

    /// Ends the log, and renames a file into place.
    pub fn finish(self) -> anyhow::Result<()> {
        let Self::File(path, file) = self else { return Ok(()) };
        let growing = file.into_inner().map_err(IntoInnerError::into_error);
        growing.and_then(Growing::keep).with_context(|| cannot_write(&path))
    }
}

fn cannot_write(path: &Path) -> String {
    format!("cannot write {}", path.display())
}
