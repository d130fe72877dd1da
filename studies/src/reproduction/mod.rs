//! The figures of Do & Yoo 2020 (Sensors 20, 292, section 4.4) computed again, and what becomes of the claims they carry.
//!
//! A [`study::Study`] of a scene lists the tasks whose findings the figures and the claims need; each is done once and kept.
//!
//! | figures | from |
//! |---|---|
//! | 8, 12, 15, 18: pictures; 13, 16, 19: features of single frames | [`frames`] |
//! | 14, 17, 20: Bvar, Wvar and B2W over L2A, interval and distance | [`point`] |
//! | 21: the best L2A over interval and distance | [`optima`], by [`crate::optimum`] |
//! | 22: bit error rates with the best L2A and with a random one | [`errors`] |
//!
//! [`claims`] holds each claim against its number, with an interval of [`estimate`]. [`reading`] lists the ways to
//! read the paper where it contradicts itself. The paper's frames also draw the ambient light; exposure and dimming follow it, so that its
//! frames do not depend on it.
//!
//! ```
//! use studies::reproduction::{axes::Extent, claims, findings::{Findings, Task}, study::Study};
//! use sim::scene::Scene;
//!
//! let study = Study::new(Scene::load("paper", &[])?, Extent::Claims, 1000, 1);
//! let mut findings = Findings::default();
//! for setting in study.over_distance() {
//!     let task = Task::Point(setting);
//!     if let Some(found) = study.perform(&task, &findings, &|| true)? {
//!         findings.keep(task, found);
//!     }
//! }
//! let claims = claims::all(&study, &findings);
//! let falls = claims.iter().find(|claim| claim.name == "b2w-falls-with-distance");
//! assert!(falls.is_some_and(|claim| claim.holds == Some(true)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod axes;
pub mod claims;
pub mod errors;
pub mod estimate;
pub mod findings;
pub mod frames;
pub mod interpolation;
pub mod optima;
pub mod point;
pub mod reading;
pub mod setting;
pub mod study;
