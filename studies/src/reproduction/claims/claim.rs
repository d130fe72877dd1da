//! A claim, its test, and the verdict.

use serde::Serialize;

use crate::statistics::Estimate;

/// A claim and its verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// A short name.
    pub name: String,
    /// Its figure.
    pub figure: &'static str,
    /// The paper's statement.
    pub claim: String,
    /// The measured quantity that decides it, with its unit.
    pub quantity: String,
    /// The number.
    pub measured: f64,
    /// Its 95 % interval.
    pub measured_95: [f64; 2],
    /// Whether the claim holds; `None` if the interval does not decide.
    pub holds: Option<bool>,
}

/// The test of a claim.
pub(super) enum Test {
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
pub(super) struct Words {
    pub name: &'static str,
    pub figure: &'static str,
    pub claim: &'static str,
    pub quantity: &'static str,
}

impl Words {
    pub(super) fn decided(&self, number: Estimate, test: Test) -> Claim {
        Claim {
            name: self.name.into(),
            figure: self.figure,
            claim: self.claim.into(),
            quantity: self.quantity.into(),
            measured: number.value,
            measured_95: [number.low, number.high],
            holds: test.holds(&number),
        }
    }
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
            [near(1.6, 2.4), near(1.4, 2.4), near(1.0, 1.4), near(2.6, 3.0)],
            [Some(true), None, Some(false), Some(false)]
        );
    }
}
