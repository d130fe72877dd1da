//! `vocc table push`, `pull` and `verify`: the L2A table of a transmitter.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use link::l2a_table::L2aTable;
use link::serial::{Answer, Request};
use link::waveform::Waveform;
use serde_json::json;
use sim::input;
use sim::l2a::{OtherWaveform, SHIPPED_FOR, read_table, table_file};
use studies::table::TableFile;

use super::checked;
use crate::commands::device::rate;
use crate::device::table::{pull, push};
use crate::files;
use crate::options::{Connection, Port, SharedOptions};
use crate::output::{self, Verdict, line};
use crate::progress::Progress;

/// A table and a transmitter.
#[derive(clap::Args)]
pub struct Transfer {
    /// The table's TOML file. Default: the table in the firmware; for pull, standard output.
    file: Option<PathBuf>,
    #[command(flatten)]
    port: Port,
}

impl Transfer {
    /// Writes the table, which the transmitter stores and uses.
    pub fn push(&self, shared: &SharedOptions) -> anyhow::Result<Verdict> {
        let (table, made_for) = self.table(checked)?;
        let mut client = self.port.greet_transmitter()?;
        let mut progress = Progress::new(table.image().len() as u64, "bytes");
        push(&mut client, &table, |bytes| progress.done(bytes as u64)).with_context(|| self.port.name())?;
        drop(progress);
        for outside in outside(&table, &mut client) {
            output::tell(format_args!("vocc: {}: {outside}", self.port.name()));
        }
        self.warn(made_for, &mut client);
        self.report(&table, shared, "is stored and in use")
    }

    /// Reads the transmitter's current table.
    pub fn pull(&self, shared: &SharedOptions) -> anyhow::Result<Verdict> {
        if let Some(path) = &self.file {
            ensure!(
                !path.is_file() || is_pulled(path),
                "{} holds more than a pulled table, which would be lost: give another file",
                path.display()
            );
            files::check(path)?;
        }
        let mut client = self.port.greet_transmitter()?;
        let table = pull(&mut client).with_context(|| self.port.name())?;
        let text = table_file(&table);
        match &self.file {
            Some(path) => {
                files::write(path, &text)?;
                self.report(&table, shared, &format!("is in {}", path.display()))
            }
            None if shared.json => self.report(&table, shared, ""),
            None => {
                output::lines(&text)?;
                Ok(Verdict::Yes)
            }
        }
    }

    /// Checks that the transmitter uses this table.
    pub fn verify(&self, shared: &SharedOptions) -> anyhow::Result<Verdict> {
        let (wanted, made_for) = self.table(|path| Ok(TableFile::read_with_table(path)?))?;
        let mut client = self.port.greet_transmitter()?;
        let found = pull(&mut client).with_context(|| self.port.name())?;
        let same = found == wanted;
        if shared.json {
            output::json(&json!({
                "port": self.port.name(),
                "same": same,
                "table_crc": crc(&found),
                "file_crc": crc(&wanted),
            }))?;
        } else if same {
            self.report(&found, shared, "is this one")?;
        } else {
            line(&format!(
                "{}: the transmitter uses another table, {}, and this is {}",
                self.port.name(),
                crc(&found),
                crc(&wanted)
            ))?;
            for difference in differences(&wanted, &found) {
                line(&format!("  {difference}"))?;
            }
        }
        if !same {
            return Ok(Verdict::No);
        }
        self.warn(made_for, &mut client);
        Ok(Verdict::Yes)
    }

    /// The file's table and the waveform that it is made for, or the firmware's default, which is for still panels.
    fn table(&self, read: impl Fn(&Path) -> anyhow::Result<(TableFile, L2aTable)>) -> anyhow::Result<(L2aTable, Waveform)> {
        let Some(path) = &self.file else {
            return Ok((L2aTable::default(), SHIPPED_FOR));
        };
        let (file, table) = read(path)?;
        Ok((table, file.ratios.waveform))
    }

    /// Warns if the transmitter shows another waveform than that of the table; not if it does not report one.
    fn warn(&self, made_for: Waveform, client: &mut Connection) {
        let shown = rate::in_use(client).ok().and_then(|told| told.waveform());
        if let Some(other) = shown.and_then(|shown| OtherWaveform::if_any(made_for, shown)) {
            output::tell(format_args!("vocc: {}: {other}", self.port.name()));
        }
    }

    fn report(&self, table: &L2aTable, shared: &SharedOptions, what: &str) -> anyhow::Result<Verdict> {
        let (rows, columns) = (table.illuminances_lx().len(), table.intervals().len());
        if shared.json {
            output::json(&json!({
                "port": self.port.name(),
                "table_crc": crc(table),
                "illuminances": rows,
                "intervals": columns,
            }))?;
        } else {
            line(&format!(
                "{}: table {} of {rows} illuminances and {columns} intervals {what}",
                self.port.name(),
                crc(table)
            ))?;
        }
        Ok(Verdict::Yes)
    }
}

/// Warnings if the transmitter's illuminance or LED interval is outside the table: it then uses the nearest entry.
fn outside(table: &L2aTable, client: &mut Connection) -> Vec<String> {
    let light = client.ask(&Request::Status, |answer| match answer {
        Answer::Status(status) => Some(status.illuminance_lx.map(|lux| lux.to_num())),
        _ => None,
    });
    let interval = client.ask(&Request::ReadCalibration, |answer| match answer {
        Answer::Calibration(measured) => Some(measured.interval.to_num()),
        _ => None,
    });
    let lights: Vec<f64> = table.illuminances_lx().iter().map(|lux| lux.to_num()).collect();
    let intervals: Vec<f64> = table.intervals().iter().map(|interval| interval.to_num()).collect();
    // Skip values that the transmitter does not report.
    let light = light.ok().flatten().and_then(|lux| beyond("light, in lx,", lux, &lights));
    let interval = interval.ok().and_then(|own| beyond("LED interval", own, &intervals));
    light.into_iter().chain(interval).collect()
}

/// A warning if a value is outside a table's axis.
fn beyond(what: &str, own: f64, axis: &[f64]) -> Option<String> {
    let (first, last) = (*axis.first()?, *axis.last()?);
    let made_for = if first == last {
        first.to_string()
    } else {
        format!("{first} to {last}")
    };
    (!(first..=last).contains(&own)).then(|| {
        format!("its {what} is {own:.4}, and the table is made for {made_for}: it uses the nearest entry, which may be far from the best")
    })
}

/// Whether a file is empty or a pulled table, so that overwriting it loses no search results.
fn is_pulled(path: &Path) -> bool {
    let text = input::read_text(path, input::TABLE_MAX);
    let again = || Some(table_file(&read_table(path).ok()?));
    text.is_ok_and(|text| text.is_empty() || again() == Some(text))
}

fn crc(table: &L2aTable) -> String {
    format!("{:08x}", table.crc())
}

/// Describes the differences between two tables.
fn differences(wanted: &L2aTable, found: &L2aTable) -> Vec<String> {
    let mut differences = Vec::new();
    if wanted.illuminances_lx() != found.illuminances_lx() {
        differences.push("the illuminances differ".to_owned());
    }
    if wanted.intervals() != found.intervals() {
        differences.push("the intervals differ".to_owned());
    }
    if !differences.is_empty() {
        return differences;
    }
    let columns = wanted.intervals().len();
    for (index, (wanted_l2a, found_l2a)) in wanted.values().into_iter().zip(found.values()).enumerate() {
        if wanted_l2a != found_l2a {
            differences.push(format!(
                "{} lx, interval {}: {wanted_l2a} here, {found_l2a} there",
                wanted.illuminances_lx()[index / columns],
                wanted.intervals()[index % columns]
            ));
        }
    }
    differences
}
