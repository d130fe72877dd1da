//! What is learnt with the simulator of an optical camera link.
//!
//! # Layers
//!
//! ```text
//! statistics ── tally ── evaluate   Monte Carlo at one setting
//! genie                             who is told everything but the bits: a bound
//! rare                              error rates too small to count: splitting towards errors
//! sweep                             the same at every setting of a grid, in shards that add up to one run
//! optimum ── table                  the best LED-to-ambient ratio of one setting, and tables of many
//! reproduction                      the figures of Do & Yoo 2020 and what becomes of their claims
//! precision ── raster               what accuracy costs in time, and renderers to hold the simulator's against
//! ```
//!
//! # Which to choose
//!
//! For numbers over many frames: [`evaluate::Evaluator`]; over many settings: [`sweep::Sweep`]; for bit error rates down to 1e-8
//! and less: [`rare`]. For the ratio that tells On from Off best: [`optimum`]; for what a transmitter carries of it: [`table`].
//! For the paper's figures and claims, point by point: [`reproduction`]. For error against time, of all that has more than one
//! way to be done: [`precision`]. [`detectors`] has the receivers by name, [`sightings`] panels anywhere in their range.
//!
//! Random numbers are counter-based ([`sim::random`]): frame k of seed s is the same alone, in any run, on any number of threads.

pub mod detectors;
pub mod evaluate;
pub mod genie;
pub mod optimum;
pub mod precision;
pub mod rare;
pub mod raster;
pub mod reproduction;
pub mod sightings;
pub mod statistics;
pub mod sweep;
pub mod table;
pub mod tally;
