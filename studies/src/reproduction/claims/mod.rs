//! What section 4.4 of Do & Yoo 2020 claims, each claim with a number that decides it.
//!
//! A claim of a trend ("increases all the way") is decided by its weakest step, so that it holds only if every step does. A
//! claim holds or fails if the whole 95 % interval of its number says so, and is open otherwise.

mod distance;
mod errors;
mod interval;
mod l2a;
mod optimum;

use serde::Serialize;

use super::estimate::Estimate;
use super::findings::Findings;
use super::point::{Point, Sums, estimate_of};
use super::setting::Setting;
use super::study::Study;

/// A claim and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// A short name.
    pub name: String,
    /// The figure it is about.
    pub figure: &'static str,
    /// What the paper says.
    pub claim: String,
    /// What was measured to decide it, with its unit.
    pub quantity: String,
    /// The number.
    pub measured: f64,
    /// Its 95 % interval.
    pub measured_95: [f64; 2],
    /// Whether the claim holds; `None` where the interval leaves it open.
    pub holds: Option<bool>,
    /// What the outcome depends on.
    pub depends_on: &'static str,
}

/// What decides a claim.
enum Test {
    /// The number is above this.
    Above(f64),
    /// The number is below this.
    Below(f64),
    /// The number is within the second of the first.
    Near(f64, f64),
}

impl Test {
    fn holds(&self, number: &Estimate) -> Option<bool> {
        match *self {
            Self::Above(bound) => number.exceeds(bound),
            Self::Below(bound) => number.exceeds(bound).map(|above| !above),
            Self::Near(middle, within) => {
                let [below, above] = [middle - within, middle + within];
                match (number.exceeds(below), number.exceeds(above)) {
                    (Some(true), Some(false)) => Some(true),
                    (Some(false), _) | (_, Some(true)) => Some(false),
                    _ => None,
                }
            }
        }
    }
}

/// The words of a claim.
struct Words {
    name: &'static str,
    figure: &'static str,
    claim: &'static str,
    quantity: &'static str,
    depends_on: &'static str,
}

impl Words {
    fn decided(&self, number: Estimate, test: Test) -> Claim {
        Claim {
            name: self.name.into(),
            figure: self.figure,
            claim: self.claim.into(),
            quantity: self.quantity.into(),
            measured: number.value,
            measured_95: [number.low, number.high],
            holds: test.holds(&number),
            depends_on: self.depends_on,
        }
    }
}

/// All claims whose data are there, in the paper's order.
pub fn all(study: &Study, findings: &Findings) -> Vec<Claim> {
    let families = [
        l2a::claims(study, findings),
        interval::claims(study, findings),
        distance::claims(study, findings),
        optimum::claims(study, findings),
        errors::claims(study, findings),
    ];
    families.into_iter().flatten().collect()
}

/// The points of a curve, if all are there.
fn curve<'a>(settings: &[Setting], findings: &'a Findings) -> Option<Vec<&'a Point>> {
    settings
        .iter()
        .map(|&setting| findings.point(setting))
        .collect()
}

/// The changes, in percent, of a quantity from one point of a curve to the next.
fn steps(sums: &[Sums], of: impl Fn(&Sums) -> f64) -> Vec<f64> {
    let values: Vec<f64> = sums.iter().map(of).collect();
    let change = |pair: &[f64]| percent(pair[0], pair[1]);
    values.windows(2).map(change).collect()
}

/// The least of those changes.
fn least_rise(points: &[&Point], of: impl Fn(&Sums) -> f64) -> Estimate {
    estimate_of(points, |sums| {
        steps(sums, &of).into_iter().fold(f64::INFINITY, f64::min)
    })
}

/// The greatest of those changes.
fn greatest_rise(points: &[&Point], of: impl Fn(&Sums) -> f64) -> Estimate {
    estimate_of(points, |sums| {
        steps(sums, &of)
            .into_iter()
            .fold(f64::NEG_INFINITY, f64::max)
    })
}

/// The change from one number to another, in percent of the first.
fn percent(from: f64, to: f64) -> f64 {
    100.0 * (to / from - 1.0)
}

fn bvar(sums: &Sums) -> f64 {
    sums.distinguishability().bvar
}

fn wvar(sums: &Sums) -> f64 {
    sums.distinguishability().wvar
}

/// 0 where it is undefined: no claim is to hold by that.
fn b2w(sums: &Sums) -> f64 {
    sums.distinguishability().b2w.unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_across_the_bound_leaves_a_claim_open() {
        let number = |low, high| Estimate {
            value: (low + high) / 2.0,
            low,
            high,
        };
        let holds = |test: Test| move |low, high| test.holds(&number(low, high));
        let above = holds(Test::Above(0.0));
        assert_eq!(
            [above(0.1, 0.2), above(-0.1, 0.2), above(-0.2, -0.1)],
            [Some(true), None, Some(false)]
        );
        let near = holds(Test::Near(2.0, 0.5));
        assert_eq!(
            [
                near(1.6, 2.4),
                near(1.4, 2.4),
                near(1.0, 1.4),
                near(2.6, 3.0)
            ],
            [Some(true), None, Some(false), Some(false)]
        );
    }
}
