//! What a survey finds: the best ratio at each setting, and what the settings together say.

use serde::{Deserialize, Serialize, Serializer};

use super::condition::Condition;
use crate::optimum::{Criterion, Optimum};

/// How one ratio is made of those that are best at each distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Their mean (Do & Yoo 2020, section 4.4.3).
    #[default]
    Mean,
    /// That of the least bit error rate of all distances' frames together.
    LeastBer,
}

/// The best ratio at one setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// Distance, m.
    pub distance_m: f64,
    /// Turn about the vertical, degrees.
    pub yaw_deg: f64,
    /// The best ratio.
    #[serde(serialize_with = "short")]
    pub l2a: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub l2a_95: [f64; 2],
    /// Whether it is the end of the range.
    pub at_border: bool,
    /// The ratios that are not significantly worse.
    #[serde(serialize_with = "short_pair")]
    pub not_worse: [f64; 2],
    /// B2W next to the best ratio, where it is defined.
    #[serde(default, serialize_with = "short_if_any", skip_serializing_if = "Option::is_none")]
    pub b2w: Option<f64>,
    /// Fisher's criterion there, where it is defined.
    #[serde(default, serialize_with = "short_if_any", skip_serializing_if = "Option::is_none")]
    pub fisher: Option<f64>,
    /// Bit error rate there.
    #[serde(serialize_with = "short")]
    pub ber: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub ber_95: [f64; 2],
    /// Frames that these are of.
    pub frames: u64,
    /// By which factor the criterion is worse (of the bit error rate: its odds) where the panel is driven to the ratio
    /// that the table holds.
    #[serde(serialize_with = "short")]
    pub table_loss: f64,
}

/// What the distances together say for one illuminance and interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// The mean of the best ratios over the distances.
    #[serde(serialize_with = "short")]
    pub mean_l2a: f64,
    /// Its 95 % interval: the mean of theirs. All distances have the same frames, so that their errors need not cancel.
    #[serde(serialize_with = "short_pair")]
    pub mean_l2a_95: [f64; 2],
    /// The least and the greatest of the best ratios.
    #[serde(serialize_with = "short_pair")]
    pub range_l2a: [f64; 2],
    /// Whether one of them is the end of the range, so that the mean may be too low (or too high).
    pub at_border: bool,
    /// The ratio of the least mean bit error rate.
    #[serde(serialize_with = "short")]
    pub least_ber_l2a: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub least_ber_l2a_95: [f64; 2],
    /// The ratios whose mean bit error rate is not significantly higher.
    #[serde(serialize_with = "short_pair")]
    pub least_ber_not_worse: [f64; 2],
    /// The least mean bit error rate, by the fit.
    #[serde(serialize_with = "short")]
    pub least_ber: f64,
}

impl Entry {
    /// The ratio that the transmitter carries by a rule.
    pub fn l2a(&self, rule: Rule) -> f64 {
        match rule {
            Rule::Mean => self.mean_l2a,
            Rule::LeastBer => self.least_ber_l2a,
        }
    }

    /// The 95 % interval of [`Entry::l2a`].
    pub fn l2a_95(&self, rule: Rule) -> [f64; 2] {
        match rule {
            Rule::Mean => self.mean_l2a_95,
            Rule::LeastBer => self.least_ber_l2a_95,
        }
    }
}

/// A number as it is written: five digits, which is more than chance leaves of it.
pub(super) fn short<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    five_digits(*value).serialize(serializer)
}

/// The same, if there is one.
fn short_if_any<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    value.map(five_digits).serialize(serializer)
}

/// The same of two.
pub(super) fn short_pair<S: Serializer>(values: &[f64; 2], serializer: S) -> Result<S::Ok, S::Error> {
    values.map(five_digits).serialize(serializer)
}

/// The same of many.
pub(super) fn short_list<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(values.iter().map(|&value| five_digits(value)))
}

fn five_digits(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

impl Cell {
    pub(super) fn of(setting: Condition, optimum: &Optimum) -> Self {
        let variances = optimum.evaluation.distinguishability();
        Self {
            illuminance_lx: setting.illuminance_lx,
            interval: setting.interval,
            distance_m: setting.distance_m,
            yaw_deg: setting.yaw_deg,
            l2a: optimum.l2a,
            l2a_95: optimum.l2a_95,
            at_border: optimum.at_border,
            not_worse: optimum.not_worse,
            b2w: variances.b2w,
            fisher: variances.fisher,
            ber: optimum.evaluation.errors.rate(),
            ber_95: optimum.evaluation.errors.interval_95(),
            frames: optimum.frames,
            table_loss: 1.0,
        }
    }

    pub(super) fn with_loss(self, optimum: &Optimum, criterion: Criterion, carried: f64) -> Self {
        Self {
            table_loss: optimum.loss_at(criterion, carried).unwrap_or(1.0),
            ..self
        }
    }
}
