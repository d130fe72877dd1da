//! What section 4.4 of Do & Yoo 2020 claims, each claim with a number that decides it.
//!
//! A claim of a trend ("increases all the way") is decided by its weakest step, so that it holds only if every step does. A
//! claim holds or fails if the whole 95 % interval of its number says so, and is open otherwise.

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

/// All claims whose data are there, in the paper's order.
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
