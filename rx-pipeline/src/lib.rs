//! The receiver of an optical camera link: camera frames to messages.
//!
//! A panel of 8×8 LEDs shows 64 bits at a time; a camera films it. This crate reads the bits from the frames and puts the
//! messages together again. It is `no_std`, takes no heap, and panics on no input.
//!
//! # Layers
//!
//! Each does one step and can be used alone; [`receiver`] runs them in a row.
//!
//! | module | from | to |
//! |---|---|---|
//! | [`frame`] | bytes | a view of 8-bit grey pixels |
//! | [`locate`] | a frame, and earlier ones if there are | the panel's four corner LEDs, to a fraction of a pixel |
//! | [`track`] | a panel that was read | where it will be in the next frame, or why it is lost |
//! | [`corners`] | four points | a checked pose, and the homography it fixes |
//! | [`cells`] | a pose | for each pixel its LED's cell and the direction to the LED: once for a pose |
//! | [`features`] | a frame and the cells | AGR, GRI and NGR of each LED: for each frame |
//! | [`detect`] | features | 64 bits, and how sure each is |
//! | [`likelihood`] | a frame and a pose | the same, better: the bits that make the pixels likeliest |
//! | [`symbols`] | readings of frames | symbols, each once, numbered |
//! | `link::framing` | symbols | messages |
//!
//! [`approximate`] holds the roots and losses that loops over pixels compute quickly, with their bounds.
//!
//! All positions are in pixels; (0, 0) is the *centre* of the top-left pixel, x points right and y down. LED 8·row + column is
//! bit 8·row + column, with row 0 at the top as the camera sees it.
//!
//! # Choosing
//!
//! - **From a camera to messages:** [`receiver::Receiver`], of one panel or several. Its [memory](receiver::ReceiverMemory) is sized by the largest panel
//!   to be read, in pixels: `4096` for up to 64×64, `16384` for 128×128.
//! - **Single frames, or a panel whose place is known:** [`corners::Corners`], [`cells::CellMap`],
//!   [`features::Features`] and [`detect::Detector`], as below.
//! - **A detector:** [`likelihood`] errs least by far and is the default; k-means is the fastest; [`detect`] compares them.
//! - **The locator** finds a panel that stands out in one frame, and before clutter one that blinks in two or three: give it the
//!   earlier frames ([`receiver::FrameSearch::with_history`]). Where the place is known, [`receiver::Receiver::place`] goes without it.
//! - **On a microcontroller, or in a part of the frame:** [`receiver::Receiver::region`] reads a panel whose place is known once; [`board`] has
//!   the messages for asking a board to.
//! - **How long does a stage take?** Ask with a [`profile::Profile`].
//!
//! ```
//! use rx_pipeline::{cells::CellMap, corners::Corners, detect::Detector, features::Features, frame::Frame};
//!
//! // A frame with a spot at the first LED, and its panel's corner LEDs: top left, top right, bottom right, bottom left.
//! let mut pixels = [118; 40 * 40];
//! pixels[40 * 5 + 5] = 220;
//! let corners = Corners::new([[5.0, 5.0], [33.0, 5.0], [33.0, 33.0], [5.0, 33.0]])?;
//!
//! let map = CellMap::<2048>::new(&corners, 40, 40)?;
//! let features = Features::measure(&Frame::new(&pixels, 40, 40)?, &map)?;
//! let detection = Detector::KMeans.detect(&features)?;
//! assert_eq!(detection.bits.bits(), 1);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # Speed
//!
//! `cargo bench -p vocc-rx-pipeline` measures cells, features, detectors and the search in a frame of 1920×1080 pixels. The features of a
//! panel of 35×35 pixels are meant to take no more than 5 µs on one core of a computer.
//!
//! The source of the features, and of the numbers of the camera that are defaults here: Do & Yoo, "The Necessity of LED to Ambient Light
//! Ratio Optimization for Vehicular Optical Camera Communication", Sensors 2020, 20(1), 292.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod approximate;
pub mod board;
pub mod cells;
pub mod corners;
pub mod detect;
pub mod features;
mod fit;
pub mod frame;
mod lattice;
mod light;
pub mod likelihood;
pub mod locate;
pub mod profile;
pub mod receiver;
mod spots;
pub mod symbols;
pub mod track;

#[cfg(test)]
mod synthetic;
