//! The road between the two ends of an optical camera link: scenes to camera frames, and what can be learnt from them.
//!
//! # Layers
//!
//! ```text
//! scene ── view ── plan ── recipe ─┐        what there is · worked out · which effects · what they ask for
//!                  effects ────────┘
//!                                  renderer ── canvas ── grey, noise     layouts of LEDs drawn · read out
//!                                           └─ backdrop                  what no panel lights, worked out once
//! accuracy ── kernel, chords ── stamp, polyphase ── layout ─┤   where a blur makes few chords enough
//! overlap, gauss ──────────────────────── outline ──┘   pixel by pixel where it does not
//!
//! evaluate ── tally ── statistics   Monte Carlo at one setting
//! rare                              error rates too small to count: splitting towards errors
//! sweep                             the same at every setting of a grid, in shards that add up to one run
//! optimum ── table                  the best LED-to-ambient ratio of one setting, and tables of many
//! reproduction                      the figures of Do & Yoo 2020 and what becomes of their claims
//! road                              the transmitter's code, the frames, the receiver's code
//! precision ── raster               what accuracy costs in time, and renderers to hold the own one against
//! ```
//!
//! - [`scene`]: the user's description, from TOML, checked. [`view`]: exposure, [`air`], projections, the range of linear values.
//! - [`effects`], [`plan`]: each effect bounds what leaving it out would change; the plan includes those that matter.
//! - [`renderer`]: draws the linear image by [`chords`] and a [`kernel`], or from the [`outline`] itself, then reads it out as [`grey`] levels with [`noise`].
//! - [`evaluate`]: variances and bit error rates of random frames. [`road`]: a message from end to end.
//! - [`rare`]: bit error rates down to 1e-8 and less, by splitting.
//! - [`sweep`]: a plan of many settings, its division into shards, the engine that does them, and the results that files keep.
//! - [`optimum`]: the ratio that tells On from Off best. [`table`]: what a transmitter carries of it.
//! - [`reproduction`]: the paper's figures and claims, point by point.
//! - [`precision`]: error against time, of all that has more than one way to be done.
//!
//! # Which to choose
//!
//! For one picture: [`renderer::Renderer`]. For numbers over many frames: [`evaluate::Evaluator`]; over many settings: [`sweep::Sweep`]. For the question
//! whether a message arrives: [`road::Road`]. [`accuracy`] says how exact a picture has to be for what.
//!
//! ```
//! use link::panel::PanelFrame;
//! use sim::{accuracy::Level, canvas::Canvas, renderer::Renderer, scene::Scene};
//!
//! let renderer = Renderer::new(&Scene::load("paper", &[])?, Level::Fine)?;
//! let mut canvas = Canvas::new(renderer.surroundings(0));
//! renderer.draw(&renderer.moment(0), &[renderer.steady(0, PanelFrame::from_bits(1))], &mut canvas);
//! let brightest = canvas.values().iter().fold(0.0f32, |a, &b| a.max(b));
//! // An On LED of 16 times the background, blurred to less than half of that.
//! assert!(brightest > 3.0 && brightest < 8.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Random numbers are counter-based ([`random`]): frame k of seed s is the same alone, in any run, on any number of threads.

pub mod accuracy;
pub mod air;
pub mod backdrop;
pub mod canvas;
pub mod chords;
pub mod clock;
pub mod detectors;
pub mod effects;
pub mod evaluate;
pub mod exposure;
pub mod gauss;
pub mod genie;
pub mod grey;
pub mod kernel;
pub mod l2a;
pub mod layout;
pub mod noise;
pub mod optimum;
pub mod outline;
pub mod overlap;
pub mod phases;
pub mod plan;
pub mod polyphase;
pub mod precision;
pub mod projection;
pub mod random;
pub mod rare;
pub mod raster;
pub mod recipe;
pub mod renderer;
pub mod reproduction;
pub mod road;
pub mod scene;
pub mod sightings;
pub mod stamp;
pub mod statistics;
pub mod sweep;
pub mod table;
pub mod tally;
pub mod view;
