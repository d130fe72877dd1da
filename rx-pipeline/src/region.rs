//! Reading a panel from a part of the camera's frames: what a microcontroller does, and what is said to it.
//!
//! A camera's frame does not fit into a microcontroller; the panel's surroundings do. Somebody who sees the whole frame, or the user, says once
//! where the panel is. From then on each frame's *region* around the panel is enough: the [`RegionReceiver`] follows the panel from region to
//! region, wherever each begins, reads its bits and puts the messages together. What it takes beside is a [`RegionMemory`].
//!
//! | part | what it is |
//! |---|---|
//! | [`RegionReceiver`] | regions in, bits and messages out: [`Receiver`](crate::receiver::Receiver) without the search through whole frames |
//! | [`Request`], [`Answer`] | what a computer says to a board that has one, and what the board says |
//! | [`Service`] | a board's end of that: bytes in, bytes out |
//!
//! The messages travel in the frames of [`link::serial`], with its COBS, CRC-32C, sequence numbers and rules: the board answers each request once; who
//! gets no answer asks again, in the very same frame, and gets the answer that was lost.

mod message;
mod receiver;
mod service;
#[cfg(test)]
mod tests;

pub use message::{
    Answer, Hello, Memory, Message, MethodChoice, PROTOCOL, REGION_ANSWER_MAX, REGION_REQUEST_MAX,
    REGION_SIDE_MAX, Refusal, Region, Report, Request, STAGE_COUNT, Settings, Sight, Unread,
};
pub use receiver::{RegionMemory, RegionReceiver};
pub use service::{ANSWER_WIRE_MAX, Machine, Service};
