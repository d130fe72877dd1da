//! Quantities along a curve, and their steps.

use super::super::batches::{Batches, estimate_of};
use super::super::findings::Findings;
use super::super::operating_point::OperatingPoint;
use super::super::sums::Sums;
use crate::statistics::Estimate;

/// The points of a curve, if all are available.
pub(super) fn curve<'a>(settings: &[OperatingPoint], findings: &'a Findings) -> Option<Vec<&'a Batches>> {
    settings.iter().map(|&setting| findings.point(setting)).collect()
}

/// The changes, in percent, of a quantity from one point of a curve to the next.
pub(super) fn steps(sums: &[Sums], of: impl Fn(&Sums) -> f64) -> Vec<f64> {
    let values: Vec<f64> = sums.iter().map(of).collect();
    let change = |pair: &[f64]| percent(pair[0], pair[1]);
    values.windows(2).map(change).collect()
}

/// The least of those changes.
pub(super) fn least_rise(points: &[&Batches], of: impl Fn(&Sums) -> f64) -> Estimate {
    estimate_of(points, |sums| steps(sums, &of).into_iter().fold(f64::INFINITY, f64::min))
}

/// The greatest of those changes.
pub(super) fn greatest_rise(points: &[&Batches], of: impl Fn(&Sums) -> f64) -> Estimate {
    estimate_of(points, |sums| steps(sums, &of).into_iter().fold(f64::NEG_INFINITY, f64::max))
}

/// The change from one number to another, in percent of the first.
pub(super) fn percent(from: f64, to: f64) -> f64 {
    100.0 * (to / from - 1.0)
}

pub(super) fn bvar(sums: &Sums) -> f64 {
    sums.distinguishability().bvar
}

pub(super) fn wvar(sums: &Sums) -> f64 {
    sums.distinguishability().wvar
}

/// 0 if it is undefined, so that no claim holds by it.
pub(super) fn b2w(sums: &Sums) -> f64 {
    sums.distinguishability().b2w.unwrap_or(0.0)
}
