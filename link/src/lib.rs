//! The parts of an optical camera link that both ends share: panels, framing, error correction, tables and serial messages.
//!
//! A camera on one vehicle reads an 8×8 LED panel on another. The transmitter shows one [`PanelFrame`](panel::PanelFrame) at a time, 64
//! bits; from each the receiver gets a [`SoftPanel`](panel::SoftPanel), 64 log-likelihood ratios. This crate encodes messages as panels and
//! decodes panels to messages. It needs neither `std` nor a heap, and panics on no input.
//!
//! ```
//! use link::fec::Code;
//! use link::framing::{Deframer, Event, Framer};
//! use link::panel::{PanelFrame, SoftPanel};
//!
//! let message = b"Road works in 200 m";
//! let mut framer = Framer::new(message, Code::for_length(message.len()), false)?;
//! let mut deframer = Deframer::new();
//! let delivered = (0..framer.panels_per_repeat()).any(|index| {
//!     let shown = framer.next_panel();
//!     // The camera misreads one LED of each panel.
//!     let seen = PanelFrame::from_bits(shown.bits() ^ 1 << (7 * index % 64));
//!     match deframer.push(index, u64::from(index), &SoftPanel::certain(seen, 12)) {
//!         Event::Delivered(delivery) => delivery.message == message,
//!         _ => false,
//!     }
//! });
//! assert!(delivered);
//! # Ok::<(), link::framing::FramingError>(())
//! ```
//!
//! # The layers
//!
//! ```text
//!   transmitter                                                     receiver
//!
//!   message, 1 to 1024 bytes                         message, delivered once, CRC-32 checked
//!      │                                                                  ▲
//!   framing::Framer      segments, headers, repeats, polarity      framing::Deframer
//!      │                                                                  │
//!   fec::Block           CCSDS LDPC codes, shortened to panels      fec::Decoder
//!      │                                                                  │
//!   scramble             each panel unlike the one before              scramble
//!      │                                                                  │
//!   panel::PanelFrame    64 LEDs, On or Off                        panel::SoftPanel
//!      │                                                                  ▲
//!      └──────────────────────  LEDs ─ light ─ camera  ───────────────────┘
//! ```
//!
//! The other modules:
//!
//! | module | has |
//! |---|---|
//! | [`l2a_table`] | the best ratio of LED to ambient light, by light and LED interval: computed on the host, looked up by transmitters |
//! | [`serial`] | the messages between a computer and a transmitter over a cable |
//! | [`symbol_rate`] | the panel's symbol rate, and the highest that a camera follows |
//! | [`waveform`] | the LEDs' waveform within a symbol: still, or a carrier |
//! | [`camera`] | a camera's description for receiver and simulator |
//! | [`exposure`] | a model of automatic exposure |
//! | [`geometry`] | the panel's size, as the panel transmits it |
//! | [`orientation`] | the eight ways in which a picture may show a panel |
//! | [`intensity`] | the limit of a panel's luminous intensity |
//!
//! # The frame format
//!
//! A message is a sequence of segments that repeats without end. Neighbouring segments have opposite polarity, and so have neighbouring
//! repeats:
//!
//! ```text
//!   panel      0         1          2           3                ···                last
//!         ┌─────────┬──────────┬──────────┬───────────┬─────┬───────────┬─────┬───────────┐
//!         │  sync,  │ header,  │ header,  │ payload,  │ ··· │ payload,  │ ··· │ payload,  │
//!         │  fixed  │   info   │  parity  │   info    │     │  parity   │     │  parity   │
//!         └─────────┴────┬─────┴──────────┴───────────┴─────┴───────────┴─────┴───────────┘
//!                        │                 ⌈bytes/8⌉ panels   1, 2, 4, 4 or 8 by the code
//!     version:3 code:3 length−1:10 segment:7 fresh:1 CRC-32C:32 CRC-8:8
//! ```
//!
//! [`framing`] defines it to the bit. It has no per-panel overhead: a payload panel is 64 coded bits.
//!
//! # Choosing
//!
//! * **To send messages**: [`framing::Framer`] with [`Code::for_length`](fec::Code::for_length), and
//!   [`framing::Deframer`] at the other end. A text of up to 8 bytes takes 5 panels, 1024 bytes take 216.
//! * **To choose another code**, if you know the channel: [`fec::Code::Tm1280`] at error rates well below 1 % (1024 bytes in 184 panels),
//!   [`fec::Code::Tc512`] if one repeat must suffice at 4 % and more. `cargo run --release -p vocc-link --example code_choice` compares all
//!   codes at all lengths.
//! * **To sign messages and verify them**: [`framing::SignedFramer`], and the module `signing` of the feature of that name.
//! * **To measure bit error rates**, or to compare with Do & Yoo 2020: [`raw`], 64 message bits a panel and
//!   nothing else.
//! * **To report losses and their reasons**: the variants of [`framing::Event`].

#![cfg_attr(not(test), no_std)]

pub mod camera;
pub mod checksum;
pub mod exposure;
pub mod fec;
pub mod framing;
pub mod geometry;
pub mod intensity;
pub mod l2a_table;
#[cfg(feature = "signing")]
pub mod lock;
pub mod orientation;
pub mod panel;
pub mod raw;
pub mod scramble;
pub mod serial;
mod shipped_table;
#[cfg(feature = "signing")]
pub mod signing;
pub mod symbol_rate;
pub mod waveform;
