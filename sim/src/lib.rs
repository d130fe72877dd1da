//! The simulator of an optical camera link: from the description of a scene to the frames that a camera would take, and a message from end
//! to end.
//!
//! A frame of a scene, as the camera records it:
//!
//! ```
//! use link::panel::PanelFrame;
//! use sim::{accuracy::Level, renderer::Renderer, renderer::canvas::Canvas, scene::Scene};
//!
//! let night = Scene::load("night", &["pose.distance_m=40".into()])?;
//! let renderer = Renderer::new(&night, Level::Fast)?;
//! let sensor = renderer.sensor();
//! let mut canvas = Canvas::new(renderer.lit_region());
//! let mut grey = vec![0; sensor.width * sensor.height];
//! let shown = [renderer.steady(0, PanelFrame::from_bits(0x8142_2418_1824_4281))];
//! renderer.frame(1, &renderer.moment(1, 0), &shown, &mut canvas, &mut grey);
//! // The top left LED is on; the street beside the panel is a middle grey.
//! let [x, y] = renderer.corner_leds_px(0)[0].map(|place| place.round() as usize);
//! assert!(grey[y * sensor.width + x] > grey[0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A message from end to end, with the real code of transmitter and receiver:
//!
//! ```
//! use sim::{road::{LinkSettings, Road}, scene::Scene};
//!
//! let small = ["camera.width_px=320".into(), "camera.height_px=240".into()];
//! let settings = LinkSettings::new(b"Ice".to_vec(), Default::default(), 1);
//! let mut road = Road::new(&Scene::load("paper", &small)?, &settings)?;
//! let mut received = None;
//! for frame in 0..60 {
//!     received = received.or(road.frame(frame)?.delivered);
//! }
//! assert_eq!(received.unwrap().message, b"Ice");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Layers
//!
//! ```text
//! scene ── view ── effects ── plan ── formation    description · geometry · which effects matter · image formation
//!                                         │
//! accuracy ── disc ──────────────────── renderer   error bounds · the image of one LED · the whole image
//!                                         │
//! camera, air ──────────────────────────┘ │        exposure, projection, noise
//!                                  cost, road      time of each effect · transmitter, frames, receiver
//! ```
//!
//! - [`scene`]: the user's description, from TOML, checked. [`view`]: exposure, [`air`], projections, backgrounds.
//! - [`effects`], [`plan`]: each effect has a bound on the change from leaving it out. The plan includes the effects that matter, and each
//!   of them writes its part of the image formation. [`cost`]: the time of each effect, measured by [`timing`].
//! - [`renderer`]: draws the linear image of each LED's [`disc`], then has the [`camera`] read it out as grey levels with noise.
//! - [`keys`]: the names of a scene's keys, and the nearest key to a wrong name.
//! - [`road`]: a message from end to end. [`l2a`]: a panel's LED-to-ambient ratio. [`input`]: ordinary files of bounded size.
//!
//! The crate `studies` computes error rates, the best ratio and the cost of accuracy from these frames.
//!
//! # Which to choose
//!
//! - **Frames:** [`renderer::Renderer`], at a level of [`accuracy`]: `fast` for statistics, `fine` for pictures, `reference` for tests.
//! - **Does a message arrive?** [`road::Road`].
//! - **Which effects does a frame contain, and why?** [`plan::Plan`].
//!
//! Random numbers are counter-based ([`random`]): frame k of seed s is the same alone, in any run, on any number of threads.

pub mod accuracy;
pub mod air;
pub mod camera;
pub mod cost;
pub mod disc;
pub mod effects;
mod formation;
pub mod input;
pub mod keys;
pub mod l2a;
mod load;
pub mod plan;
pub mod random;
pub mod renderer;
pub mod road;
pub mod scene;
pub mod timing;
pub mod view;
