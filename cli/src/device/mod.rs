//! The computer's side of the serial protocol in `docs/serial.md`.
//!
//! [`port`] opens and lists ports, [`client`] repeats requests until answered, [`table`] transfers tables,
//! [`program_file`] reads programs to compare.

pub mod client;
pub mod error;
#[cfg(test)]
#[path = "../../tests/fake/mod.rs"]
mod fake;
pub mod port;
pub mod program_file;
pub mod table;
#[cfg(test)]
mod unsteady;

pub use client::Client;
pub use error::DeviceError;
