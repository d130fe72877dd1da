//! A board that reads panels, and the computer beside it: what they say to each other.
//!
//! A camera's frame does not fit into a microcontroller; the panel's surroundings do. Somebody who sees the whole frame, or the user,
//! says once where the panel is. From then on each frame's *region* around the panel is enough for a
//! [`Receiver`](crate::receiver::Receiver) [without a search](crate::receiver::NoSearch).
//!
//! | part | what it is |
//! |---|---|
//! | [`Request`], [`Answer`] | what a computer says to a board that has such a receiver, and what the board says |
//! | [`Service`] | a board's end of that: bytes in, bytes out |
//!
//! The messages travel in the frames of [`link::serial`], with its COBS, CRC-32C, sequence numbers and rules: the board answers each
//! request once; who gets no answer asks again, in the very same frame, and gets the answer that was lost.
//!
//! This module knows the pipeline, and nothing of the pipeline knows this module. It is not in `link`, since its messages carry
//! detectors, stages and losses, which a transmitter has none of.

mod message;
mod service;
#[cfg(test)]
mod tests;

pub use message::{
    Answer, Hello, Memory, Message, MethodChoice, PROTOCOL, REGION_ANSWER_MAX, REGION_REQUEST_MAX, REGION_SIDE_MAX, Refusal, Region,
    Report, Request, STAGE_COUNT, Settings, Unread, WireReading,
};
pub use service::{ANSWER_WIRE_MAX, Machine, Service};
