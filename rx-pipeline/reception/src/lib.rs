//! The receiver on a computer: frames of any pixel format with their time stamps in; readings, poses and messages out.
//!
//! The command line, the Python package and the page are thin layers over [`Reception`]. It runs the receiver, finds a symbol rate that is
//! not configured, measures where panels are, and diagnoses why no message came. It depends neither on the simulator nor on the studies.
//!
//! ```
//! use reception::{PanelEvent, Reception, ReceptionSettings, Stamp};
//! use rx_pipeline::frame::Frame;
//! let mut reception = Reception::new(ReceptionSettings::default())?;
//! let no_lens = Err("the focal length is not known".to_owned());
//! for number in 0..3 {
//! // A grey frame has no panel.
//!     let frame = Frame::new(&[118; 64 * 48], 64, 48)?;
//!     for panel in reception.frame(Stamp::of(number), &frame, &no_lens, &mut ())? {
//!         assert!(panel.reading.is_err() && panel.events.is_empty());
//!     }
//! }
//! assert!(reception.finish().is_empty());
//! assert!(reception.advice(false)[0].starts_with("in 3 of 3 frames: no candidate"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | part | does |
//! |---|---|
//! | [`Reception`] | frame after frame, with up to [`PANELS_MAX`] panels; finds the symbol rate, diagnoses missing messages |
//! | [`panel_pose`] | where panels are, in metres |
//! | [`learnt`] | the learnt camera, in words |
//! | [`diagnostics`] | reports on frames and panels in the terms of ROS diagnostics |
//! | [`loss`] | why frames gave no reading, as one word per kind |
//! | [`still`] | single frames |
//! | [`bring_up`] | test panels, and the diagnosis of a panel from their pictures |
//! | [`picture`], [`colour`], [`deep`] | 8-bit grey from pictures, from colours, and from 9 to 16 bits |
//! | [`bytes`] | messages that are not text |
//! | `keys`, `signers` (feature `signing`) | trusted keys, and the signers of messages |
//! | [`stream`] | frames of uncompressed films: y4m, raw bytes |

pub mod bring_up;
pub mod bytes;
pub mod colour;
mod combing;
pub mod deep;
mod diagnosis;
pub mod diagnostics;
mod event;
#[cfg(feature = "signing")]
pub mod keys;
pub mod learnt;
pub mod loss;
pub mod panel_pose;
mod panels;
pub mod picture;
mod reception;
#[cfg(feature = "signing")]
pub mod signers;
pub mod still;
pub mod stream;
mod symbol_rate;

pub use event::{Message, PanelEvent, SignedMessage};
pub use reception::{PanelReport, Reception, ReceptionError, ReceptionSettings, Stamp};

/// Maximum number of panels that are followed at once.
pub const PANELS_MAX: usize = 4;
/// The assumed frames a second if none are configured.
pub const USUAL_FPS: f32 = 100.0;
