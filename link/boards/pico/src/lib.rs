//! Code that the transmitter's and the receiver's programs for a Raspberry Pi Pico share.
#![no_std]
#![deny(unsafe_code)]

pub mod bus;
pub mod usb;
