//! What the transmitter's programs on embassy have in common, whatever the chip.
#![no_std]
#![deny(unsafe_code)]

pub mod light;
pub mod port;
pub mod program;
pub mod shared;
