//! The claims of section 4.4 of Do & Yoo 2020, each with a number that decides it.
//!
//! The weakest step decides on a claim of a trend ("increases all the way"), so that the claim holds only if every step does. A claim holds
//! or fails if the whole 95 % interval of its number agrees, and is open otherwise.

mod claim;
mod distance;
mod errors;
mod interval;
mod l2a;
mod optimum;
mod trend;

pub use claim::Claim;

use super::findings::Findings;
use super::study::Study;

/// All claims with available data, in the paper's order.
pub fn judge(study: &Study, findings: &Findings) -> Vec<Claim> {
    let families = [
        l2a::claims(study, findings),
        interval::claims(study, findings),
        distance::claims(study, findings),
        optimum::claims(study, findings),
        errors::claims(study, findings),
    ];
    families.into_iter().flatten().collect()
}
