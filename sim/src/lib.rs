//! The road between the two ends of an optical camera link: scenes to camera frames, and a message from end to end.
//!
//! # Layers
//!
//! ```text
//! scene ── view ── effects ── plan ── formation    what there is · worked out · what matters · how it becomes an image
//!                                         │
//! accuracy ── disc ──────────────────── renderer   how exactly · the image of one LED · all of it drawn
//!                                         │
//! camera, air ──────────────────────────┘ │        exposure, projection, noise
//!                                        road      the transmitter's code, the frames, the receiver's code
//! ```
//!
//! - [`scene`]: the user's description, from TOML, checked. [`view`]: exposure, [`air`], projections, the range of linear values.
//! - [`effects`], [`plan`]: each effect bounds what leaving it out would change; the plan includes those that matter, and each
//!   writes its part of the image [`formation`].
//! - [`renderer`]: draws the linear image of each LED's [`disc`], then has the [`camera`] read it out as grey levels with noise.
//! - [`road`]: a message from end to end. [`l2a`]: which LED-to-ambient ratio a panel is driven to.
//!
//! What is learnt with frames (error rates, the best ratio, what accuracy costs) is in the crate `studies`.
//!
//! # Which to choose
//!
//! For pictures: [`renderer::Renderer`]. For the question whether a message arrives: [`road::Road`]. [`accuracy`] says how exact a
//! picture has to be for what.
//!
//! ```
//! use link::panel::PanelFrame;
//! use sim::{accuracy::Level, renderer::Renderer, renderer::canvas::Canvas, scene::Scene};
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
pub mod camera;
pub mod cost;
pub mod disc;
pub mod effects;
pub mod formation;
pub mod l2a;
mod load;
pub mod plan;
pub mod random;
pub mod renderer;
pub mod road;
pub mod scene;
pub mod timing;
pub mod view;
