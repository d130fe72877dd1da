//! Studies of an optical camera link with its simulator: error rates, the best LED-to-ambient ratio (L2A), tables, figures, accuracy
//! against time.
//!
//! A bit error rate with its interval, and the best ratio of a scene:
//!
//! ```
//! use sim::scene::Scene;
//! use studies::detectors::DetectorChoice;
//! use studies::monte_carlo::{Evaluator, Settings};
//! use studies::optimum::{Search, optimum};
//!
//! // 70 m away, LEDs half a diameter apart, in the noise of 1000 lx.
//! let overrides = ["pose.distance_m=70", "panel.interval=0.5", "ambient.illuminance_lx=1000", "effects.noise=on"];
//! let scene = Scene::load("paper", &overrides.map(String::from))?;
//! let settings = Settings::fast(512, 1, DetectorChoice::KMeans);
//! let errors = Evaluator::new(&scene, settings)?.run(|_frames_done| true)?.errors;
//! let [low, high] = errors.interval_95();
//! println!("bit error rate {:.4} ({low:.4} to {high:.4})", errors.rate());
//! assert!(low <= errors.rate() && errors.rate() <= high);
//!
//! let best = optimum(&scene, &Search { frames: 512, ..Search::default() })?;
//! println!("best L2A {:.2} ({:.2} to {:.2})", best.l2a, best.l2a_95[0], best.l2a_95[1]);
//! assert!(best.l2a_95[0] <= best.l2a && best.l2a <= best.l2a_95[1]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Layers
//!
//! Each module uses only those above it.
//!
//! ```text
//! statistics    detectors            moments, error rates and their intervals; the detectors by name, and a genie
//! stop          checksum             interruption; integrity of saved results
//! monte_carlo                        many random frames at one setting, in chunks that add up
//! splitting     optimum, reach       error rates too small to count; the best LED-to-ambient ratio, by features or by reach
//! sweep         table                grids of settings, in shards that add up to one run; tables of the best ratios
//! reproduction                       the figures of Do & Yoo 2020, and a verdict on each claim
//! work_precision                     error against computing time
//!   baselines   random_scenes        for comparison: raster renderers; panels anywhere in their range
//! random_cameras                     reception through cameras that are not configured
//! photometry                         a panel's calibration from pictures beside a grey card
//! signalling                         the symbol rate and code of the highest net rate through a camera
//! flicker                            the modulation of a panel's light, and its visibility
//! ```
//!
//! # Which to choose
//!
//! | to compute | use | feature |
//! |---|---|---|
//! | variances and bit error rate at one setting | [`monte_carlo::Evaluator`] | |
//! | the same at many settings, divided among machines | [`sweep::Sweep`] | `sweep` |
//! | bit error rates down to 1e-8 and less | [`splitting::SplittingEvaluator`] | `sweep` |
//! | the best ratio of one scene | [`optimum::optimum`] | |
//! | the same by reach | [`reach::reach`] | `table` |
//! | a transmitter's table of best ratios | [`table::Survey`] | `table` |
//! | the paper's figures and claims, point by point | [`reproduction::Study`] | `reproduction` |
//! | the best symbol rate and code for a camera | [`signalling::Search`] | |
//! | a panel's flicker, by IEEE Std 1789 | [`flicker::Flicker`] | |
//! | error against time of the alternatives at each step | [`work_precision::PARTS`] | `work-precision` |
//! | a panel's calibration from pictures | [`photometry::calibrate`] | `photometry` |
//! | how cameras that are not configured receive | [`random_cameras::receive`] | `random-scenes` |
//!
//! All features are defaults. Without a feature, its modules are not compiled.
//!
//! Random numbers are counter-based ([`sim::random`]): frame k of seed s is the same alone, in any run, on any number of threads.

// Internals of modules that are left out, and links to these.
#![cfg_attr(
    not(all(feature = "photometry", feature = "sweep", feature = "work-precision")),
    allow(dead_code, unused_imports, rustdoc::broken_intra_doc_links)
)]

pub mod baselines;
#[cfg(any(feature = "sweep", feature = "table"))]
pub mod checksum;
pub mod detectors;
pub mod flicker;
#[cfg(any(feature = "reproduction", feature = "table"))]
mod interpolation;
pub mod monte_carlo;
pub mod optimum;
mod parallel;
#[cfg(feature = "photometry")]
pub mod photometry;
#[cfg(feature = "random-scenes")]
pub mod random_cameras;
#[cfg(feature = "random-scenes")]
pub mod random_scenes;
#[cfg(feature = "table")]
pub mod reach;
#[cfg(feature = "reproduction")]
pub mod reproduction;
pub mod signalling;
#[cfg(feature = "sweep")]
pub mod splitting;
pub mod statistics;
pub mod stop;
#[cfg(feature = "sweep")]
pub mod sweep;
#[cfg(feature = "table")]
pub mod table;
#[cfg(feature = "work-precision")]
pub mod work_precision;
