//! The figures of Do & Yoo 2020 (Sensors 20, 292, section 4.4) computed again, with a verdict on each of their claims.
//!
//! A [`Study`] of a scene lists the tasks behind the figures and the claims; each is done once and stored.
//!
//! | figures | source |
//! |---|---|
//! | 8, 12, 15, 18: pictures; 13, 16, 19: features of single frames | [`panel_picture`], [`pair_picture`], [`scatter`] |
//! | 14, 17, 20: Bvar, Wvar and B2W over L2A, interval and distance | [`Batches`] |
//! | 21: the best L2A over interval and distance | [`BestRatio`], by [`crate::optimum`] |
//! | 22: bit error rates with the best L2A and with a random one | [`Task::Errors`] |
//!
//! [`judge`] compares each claim with its number and interval. [`INTERPRETATIONS`] lists the interpretations of its contradictions and
//! gaps. The paper also draws the ambient light at random; exposure and dimming follow it, so that its frames do not depend on it.
//!
//! ```
//! use studies::reproduction::{Extent, Findings, Study, Task, judge};
//! use sim::scene::Scene;
//!
//! let study = Study::new(Scene::load("paper", &[])?, Extent::Claims, 1000, 1);
//! let mut findings = Findings::default();
//! for setting in study.over_distance() {
//!     let task = Task::Point(setting);
//!     if let Some(found) = study.perform(&task, &findings)? {
//!         findings.keep(task, found);
//!     }
//! }
//! let claims = judge(&study, &findings);
//! let falls = claims.iter().find(|claim| claim.name == "b2w-falls-with-distance");
//! assert!(falls.is_some_and(|claim| claim.holds == Some(true)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axes;
mod batches;
mod claims;
mod errors;
mod findings;
mod frames;
mod interpretation;
mod operating_point;
mod optima;
pub mod paper;
mod pieces;
mod study;
mod sums;

pub use axes::{Axes, Extent, PAPERS_DETECTOR};
pub use batches::Batches;
pub(crate) use batches::estimate_of;
pub use claims::{Claim, judge};
pub use errors::Dimming;
pub use findings::{Finding, Findings, Task};
pub use frames::{DAYLIGHT, Feature, PAIR_LUMINANCE_CD_M2, Picture, pair_picture, panel_picture, scatter};
pub use interpretation::{INTERPRETATIONS, Interpretation};
pub use operating_point::OperatingPoint;
pub use optima::BestRatio;
pub use pieces::Pieces;
pub use study::{ERRORS_ENOUGH, Study, StudyError};
pub use sums::Sums;
