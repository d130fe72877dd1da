//! Code that the transmitter's programs on embassy share, on any chip.
#![no_std]
#![deny(unsafe_code)]

pub mod light;
pub mod port;
pub mod program;
pub mod shared;
