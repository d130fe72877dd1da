//! The receiver on a computer: pixels of any kind and the times at which they were taken go in, readings, poses and messages come out.
//!
//! [`Reception`] is what the command line, the Python package and the page are skins of. It has the receiver, looks for the symbol rate
//! where nobody tells it, measures where panels are, and says why no message came. It knows neither the simulator nor what is studied with
//! it.
//!
//! ```
//! use reception::{PanelEvent, Reception, ReceptionSettings, Stamp};
//! use rx_pipeline::frame::Frame;
//! let mut reception = Reception::new(ReceptionSettings::default())?;
//! let no_lens = Err("the focal length is not known".to_owned());
//! for number in 0..3 {
//!     // Nothing but grey: no panel is found.
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
//! | [`Reception`] | frames one after another, of up to [`PANELS_MAX`] panels: the symbol rate, where nobody tells it; why no message came |
//! | [`whereabouts`] | where panels are, in metres |
//! | [`learnt`] | what was learnt of a camera, in words |
//! | [`still`] | single frames |
//! | [`picture`], [`colour`], [`deep`] | 8-bit grey of pictures, of colours, and of 9 to 16 bits |
//! | [`bytes`] | messages that are no text |
//! | [`stream`] | frames of films that are not compressed: y4m, raw bytes |

pub mod bytes;
pub mod colour;
pub mod deep;
mod diagnosis;
mod event;
pub mod learnt;
mod panels;
pub mod picture;
mod reception;
pub mod still;
pub mod stream;
mod symbol_rate;
pub mod whereabouts;

pub use event::{Message, PanelEvent, SignedMessage};
pub use reception::{PanelReport, Reception, ReceptionError, ReceptionSettings, Stamp};

/// The most panels followed at once.
pub const PANELS_MAX: usize = 4;
/// Frames a second where nobody tells.
pub const USUAL_FPS: f32 = 100.0;
