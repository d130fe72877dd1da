//! The receiver of an optical camera link: camera frames in, messages out.
//!
//! A panel of 8×8 LEDs shows 64 bits at a time; a camera films it. This crate finds the panel in the frames, follows it, reads its bits and
//! assembles the messages. It is `no_std`, uses no heap, and panics on no input.
//!
//! ```
//! use link::fec::Code;
//! use link::framing::{Event, Framer};
//! use rx_pipeline::corners::Corners;
//! use rx_pipeline::{Frame, FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};
//!
//! // A synthetic camera: 96×96 pixels of a panel, a spot of light for each LED that is On.
//! let message = b"ice ahead";
//! let mut framer = Framer::new(message, Code::for_length(message.len()), false)?;
//! let panel = Corners::new([[32.0, 30.0], [63.5, 30.0], [63.5, 61.5], [32.0, 61.5]])?.homography();
//! let mut film = || -> Vec<u8> {
//!     let bits = framer.next_panel().bits();
//!     let mut light = vec![1.0; 96 * 96];
//!     for led in (0..64).filter(|led| bits >> led & 1 == 1) {
//!         let [x, y] = panel.to_image([f64::from(led % 8), f64::from(led / 8)]);
//!         for (i, light) in light.iter_mut().enumerate() {
//!             let square = ((i % 96) as f64 - x).powi(2) + ((i / 96) as f64 - y).powi(2);
//!             *light += 2.0 * (-square / 5.0).exp();
//!         }
//!     }
//!     light.into_iter().map(|light: f64| (118.0 * light.powf(1.0 / 2.2)) as u8).collect()
//! };
//!
//! // The receiver does not know where the panel is.
//! let memory = Box::<ReceiverMemory<4096>>::default();
//! let search = FrameSearch::new(Box::<SearchMemory>::default());
//! let mut receiver = Receiver::new(ReceiverSettings::default(), memory, search)?;
//! let mut text = String::new();
//! for number in 0..30 {
//!     let pixels = film();
//!     let outcome = receiver.frame(number, &Frame::new(&pixels, 96, 96)?);
//!     if let Event::Delivered(delivery) = outcome.event {
//!         text = String::from_utf8(delivery.message.to_vec())?;
//!     }
//! }
//! assert_eq!(text, "ice ahead");
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # Layers
//!
//! Each module does one step and can be used alone; [`receiver`] runs them in sequence.
//!
//! | module | from | to |
//! |---|---|---|
//! | [`frame`] | bytes | a view of 8-bit grey pixels |
//! | [`locate`] | a frame, and earlier ones if there are | the panel's four corner LEDs, to a fraction of a pixel |
//! | [`corners`] | four points | a checked pose, and the homography it fixes |
//! | [`cells`] | a pose | for each pixel its LED's cell and the direction to the LED: once for a pose |
//! | [`features`] | a frame and the cells | AGR, GRI and NGR of each LED: for each frame |
//! | [`detect`] | features | 64 bits, and how sure each is |
//! | [`likelihood`] | a frame and a pose | the same with fewer errors: the bits that make the pixels likeliest |
//! | [`pose`] | a frame, its corners and bits, and the camera's focal length | where the panel is, in metres and with covariance |
//! | [`symbols`] | readings of frames | symbols, each once, numbered |
//! | `link::framing` | symbols | messages |
//!
//! [`standalone`] is the application of a board without a computer, [`hm01b0`] drives one camera for it, and [`camera`] is the learnt camera.
//! [`settings`] has the user's settings, [`profile`] measures the time of each stage, and [`approximate`] has the fast roots and losses of
//! loops over pixels, with bounds of their errors.
//!
//! All positions are in pixels; (0, 0) is the *centre* of the top-left pixel, x points right and y down. LED 8·row + column is
//! bit 8·row + column, with row 0 at the top as the camera sees it.
//!
//! # Choosing
//!
//! - **From a camera to messages:** [`receiver::Receiver`], for one panel or several. Its [memory](receiver::ReceiverMemory) is sized by
//!   the pixels that a panel is read in. `9216`, 96×96, suits panels of any size, because near ones are read in larger pixels.
//! - **A panel in clutter** is found by its blinking in two or three frames: give the search memory for the earlier ones
//!   ([`receiver::FrameSearch::with_history`]). With a little more memory it also finds panels that fill the picture
//!   ([`receiver::FrameSearch::bytes`]).
//! - **A panel at a known place:** [`receiver::Receiver::place`], and [`receiver::NoSearch`] if the place is always known. On a
//!   microcontroller, or if a part of the frame is enough, [`receiver::Receiver::region`].
//! - **A detector:** [`likelihood`] makes by far the fewest errors and is the default; k-means is the fastest; [`detect`] compares them.
//! - **Search effort and patience:** [`settings`].
//! - **The learnt camera and broken LEDs:** [`receiver::Receiver::learnt`].
//! - **Single frames:** [`corners::Corners`], [`cells::CellMap`], [`features::Features`] and [`detect::Detector`], as in the latter's
//!   example.
//!
//! # Speed
//!
//! `cargo bench -p vocc-rx-pipeline` measures cells, features, detectors and the search in a frame of 1920×1080 pixels. The features of a
//! panel of 35×35 pixels should take at most 5 µs on one core of a computer.
//!
//! Source of the features and of the default camera: Do & Yoo, "The Necessity of LED to Ambient Light
//! Ratio Optimization for Vehicular Optical Camera Communication", Sensors 2020, 20(1), 292.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod approximate;
pub mod camera;
#[cfg_attr(not(feature = "carrier"), path = "no_carrier.rs")]
mod carrier;
pub mod cells;
mod coarse;
pub mod corners;
pub mod detect;
pub mod features;
mod fit;
pub mod frame;
pub mod hm01b0;
mod lattice;
pub mod likelihood;
pub mod locate;
pub mod pose;
pub mod profile;
pub mod receiver;
pub mod settings;
mod spots;
pub mod standalone;
#[cfg_attr(not(feature = "surroundings"), path = "no_surroundings.rs")]
mod surroundings;
pub mod symbols;
mod track;

#[cfg(feature = "carrier")]
pub use carrier::BLIND as BLIND_CONTRAST;
pub use frame::Frame;
pub use receiver::{FrameSearch, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings, SearchMemory};

#[cfg(test)]
mod synthetic;
