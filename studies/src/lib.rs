//! What is learnt with the simulator of an optical camera link.
//!
//! How often is a bit read wrongly, and how sure is that? Which LED-to-ambient ratio (L2A) tells On from Off best?
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
//! Each knows those above it, and none below.
//!
//! ```text
//! statistics    detectors            moments, error rates and their intervals; the receivers by name, and a genie
//! stop          checksum             may work go on? was what is kept changed?
//! monte_carlo                        many random frames at one setting, in chunks that add up
//! splitting     optimum              error rates too small to count; the best LED-to-ambient ratio
//! sweep         table                grids of settings, in shards that add up to one run; tables of the best ratios
//! reproduction                       the figures of Do & Yoo 2020, and what becomes of their claims
//! work_precision                     what accuracy costs in time
//!   baselines   random_scenes        what it compares with: renderers by rasters; panels anywhere in their range
//! random_cameras                     what a receiver makes of cameras that it is told nothing of
//! photometry                         a panel's calibration from pictures beside a grey card
//! signalling                         the symbol rate and the code that bring most through a camera
//! flicker                            how much a panel's light goes up and down, and what people see of it
//! ```
//!
//! # Which to choose
//!
//! | wanted | take |
//! |---|---|
//! | variances and bit error rate at one setting | [`monte_carlo::Evaluator`] |
//! | the same at many settings, divided among machines | [`sweep::Sweep`] |
//! | bit error rates down to 1e-8 and less | [`splitting::SplittingEvaluator`] |
//! | the ratio that tells On from Off best | [`optimum::optimum`] |
//! | what a transmitter carries of it | [`table::Survey`] |
//! | the paper's figures and claims, point by point | [`reproduction::Study`] |
//! | what to show a camera: symbol rate, code, net rate | [`signalling::Search`] |
//! | how much a panel flickers, against IEEE Std 1789 | [`flicker::Flicker`] |
//! | error against time of all that has more than one way to be done | [`work_precision::PARTS`] |
//!
//! Random numbers are counter-based ([`sim::random`]): frame k of seed s is the same alone, in any run, on any number of threads.

pub mod baselines;
pub mod checksum;
pub mod detectors;
pub mod flicker;
mod interpolation;
pub mod monte_carlo;
pub mod optimum;
mod parallel;
pub mod photometry;
pub mod random_cameras;
pub mod random_scenes;
pub mod reach;
pub mod reproduction;
pub mod signalling;
pub mod splitting;
pub mod statistics;
pub mod stop;
pub mod sweep;
pub mod table;
pub mod work_precision;
