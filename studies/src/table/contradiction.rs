//! Detects a table file that contradicts itself, for example after a change by hand.

use toml::Value;

use super::file::TableFile;
use super::findings::{AtPlace, Findings, Outcome};

/// A row has three digits after the point, and its entry five in all.
const ROUNDED: f64 = 6e-4;
/// Numbers that may be negative: angles, and gains by chance.
const SIGNED: [&str; 2] = ["yaw_deg", "most_lost"];

/// A contradiction in a table file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Contradiction {
    /// A ratio differs from that of the search.
    #[error(
        "the ratio for {illuminance_lx} lx and interval {interval} is {ratio}, and the search found {found:.3}, as {key} has it: the file was \
         changed since. Put it back, or take that entry out of {key}"
    )]
    Ratio {
        /// The list of results.
        key: &'static str,
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
        /// The ratio of the table.
        ratio: f64,
        /// The ratio of its entry.
        found: f64,
    },
    /// Two entries, or one without a row and column.
    #[error(
        "{key} has {count} entries at {illuminance_lx} lx and interval {interval}: there can be one where the table has a ratio, else none"
    )]
    Place {
        /// The list of results.
        key: &'static str,
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
        /// Number of entries.
        count: usize,
    },
    /// Another waveform than the scene's.
    #[error(
        "carrier_cycles = {noted}, and the scene of the search has link.carrier_cycles = {of_scene}: the file was changed since. Put \
         carrier_cycles = {of_scene}, or search again"
    )]
    Waveform {
        /// The cycles a symbol that the table notes, 0 for still panels.
        noted: u16,
        /// Those of the scene.
        of_scene: u16,
    },
    /// An impossible number.
    #[error("{key} at {illuminance_lx} lx and interval {interval} has {name} = {value}: {must}")]
    Number {
        /// The list of results.
        key: &'static str,
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
        /// Its name.
        name: String,
        /// The value.
        value: String,
        /// The requirement.
        must: &'static str,
    },
}

impl TableFile {
    /// Checks that all parts of the file agree.
    ///
    /// # Errors
    /// The first contradiction.
    pub fn check(&self) -> Result<(), Contradiction> {
        if let Some(scene) = &self.scene {
            let (noted, of_scene) = (self.ratios.waveform.cycles(), scene.link.carrier_cycles.unwrap_or(0));
            if noted != of_scene {
                return Err(Contradiction::Waveform { noted, of_scene });
            }
        }
        self.check_findings(&self.search)?;
        self.check_findings(&self.reach)?;
        self.check_findings(&self.regret)
    }

    fn check_findings<E: Outcome>(&self, findings: &Findings<E>) -> Result<(), Contradiction> {
        let [[key, _], [details, _]] = E::KEYS;
        findings.entries.iter().try_for_each(|entry| check_numbers(key, entry))?;
        findings.details.iter().try_for_each(|detail| check_numbers(details, detail))?;
        let unknown: Vec<[f64; 2]> = findings
            .unknown()
            .map(|unknown| [unknown.illuminance_lx, unknown.interval])
            .collect();
        for entry in &findings.entries {
            let place @ [illuminance_lx, interval] = entry.place();
            let count = findings.entries.iter().filter(|other| other.place() == place).count();
            let Some(ratio) = self.ratio(place).filter(|_| count == 1) else {
                return Err(Contradiction::Place {
                    key,
                    illuminance_lx,
                    interval,
                    count,
                });
            };
            // Ratios that no search decides may be filled in.
            let Some(record) = findings.record.as_ref().filter(|_| !unknown.contains(&place)) else {
                continue;
            };
            let found = entry.carried(record);
            if (ratio - found).abs().is_nan() || (ratio - found).abs() > ROUNDED {
                return Err(Contradiction::Ratio {
                    key,
                    illuminance_lx,
                    interval,
                    ratio,
                    found,
                });
            }
        }
        Ok(())
    }
}

fn check_numbers(key: &'static str, of: &impl AtPlace) -> Result<(), Contradiction> {
    let [illuminance_lx, interval] = of.place();
    let fault = |name: &str, value: &Value, must| Contradiction::Number {
        key,
        illuminance_lx,
        interval,
        name: name.into(),
        value: value.to_string(),
        must,
    };
    let Ok(Value::Table(values)) = Value::try_from(of) else {
        return Ok(());
    };
    for (name, value) in &values {
        let numbers = numbers(value);
        let is_rate = name.contains("ber") && !name.contains("l2a") && !name.contains("not_worse");
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(fault(name, value, "it must be a number, and not without end"));
        }
        if !SIGNED.contains(&&**name) && numbers.iter().any(|&number| number < 0.0) {
            return Err(fault(name, value, "it cannot be below 0"));
        }
        if is_rate && numbers.iter().any(|&number| number > 1.0) {
            return Err(fault(name, value, "a rate is 0 to 1"));
        }
        // Reaches in several scenes, and losses of two ratios, are not an interval.
        if !["reach_m", "not_worse_loss"].contains(&&**name) && !numbers.is_sorted() {
            return Err(fault(name, value, "its lower end must come first"));
        }
    }
    Ok(())
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Float(number) => vec![*number],
        Value::Integer(number) => vec![*number as f64],
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}
