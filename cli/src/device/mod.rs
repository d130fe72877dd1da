//! A transmitter at the other end of a serial port: what `docs/serial.md` describes, from the computer's side.
//!
//! [`port`] opens and lists ports, [`client`] asks until there is an answer, [`table`] moves tables.

pub mod client;
pub mod error;
#[cfg(test)]
#[path = "../../tests/fake/mod.rs"]
mod fake;
pub mod port;
pub mod table;
#[cfg(test)]
mod unsteady;

pub use client::Client;
pub use error::DeviceError;
