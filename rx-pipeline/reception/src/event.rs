//! Events of a panel other than its readings.

use link::fec::Undecodable;
use link::framing::{Event, Rejection, SegmentOutcome, Signature};
use link::geometry::Geometry;
use link::orientation::Orientation;

/// A complete message whose checksum is right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Its bytes.
    pub data: Vec<u8>,
    /// The number of the first frame that showed part of it.
    pub first_frame: u64,
    /// The number of the last such frame.
    pub last_frame: u64,
    /// Number of corrected bits.
    pub corrected_bits: u32,
}

/// A message and the signature that was shown with it. The signature is not verified yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignedMessage {
    /// The message's bytes.
    pub data: Vec<u8>,
    /// The signature as read.
    pub signature: Signature,
}

/// An event decoded from a panel's symbols.
#[derive(Clone, Debug, PartialEq)]
pub enum PanelEvent {
    /// A message is complete.
    Message(Message),
    /// The signature of a message is complete. Reported once, and again if the message is delivered or signed again.
    Signed(SignedMessage),
    /// The last message is shown without a signature. Reported once, when the message begins again.
    Unsigned,
    /// Something was decoded and rejected.
    Rejected(Rejection),
    /// A transmitter uses an unsupported format version.
    UnsupportedVersion(u8),
    /// A segment could not be decoded; the receiver waits for its repetition.
    SegmentFailed {
        /// The segment's number.
        segment: u8,
        /// The reason.
        why: Undecodable,
    },
    /// The panel announces its size.
    Geometry(Geometry),
    /// The panel's orientation in the picture. Reported if it is not upright, and if it has changed.
    Orientation(Orientation),
    /// The panel shows this many symbols a second, which differs from the assumed rate.
    RateFound(f32),
}

impl PanelEvent {
    /// The event to report for an event of the deframer, if any.
    pub(crate) fn of(event: &Event<'_>) -> Option<Self> {
        Some(match event {
            Event::Delivered(delivery) => Self::Message(Message {
                data: delivery.message.to_vec(),
                first_frame: delivery.first_stamp,
                last_frame: delivery.last_stamp,
                corrected_bits: delivery.corrected_bits,
            }),
            Event::Signed(signed) => Self::Signed(SignedMessage {
                data: signed.message.to_vec(),
                signature: signed.signature,
            }),
            Event::Header { unsigned: true, .. } => Self::Unsigned,
            Event::Rejected(why) => Self::Rejected(*why),
            Event::UnsupportedVersion(version) => Self::UnsupportedVersion(*version),
            Event::Geometry(geometry) => Self::Geometry(*geometry),
            Event::Segment {
                header,
                outcome: SegmentOutcome::Failed(why),
                ..
            } => Self::SegmentFailed {
                segment: header.segment,
                why: *why,
            },
            Event::Nothing | Event::Header { .. } | Event::Segment { .. } | Event::Beacon { .. } => return None,
        })
    }

    /// Whether the event adds information about the signer to `last`, the last such event that was reported since the message.
    pub(crate) fn adds_to(&self, last: Option<&Self>) -> bool {
        match (last, self) {
            (Some(_), Self::Unsigned) => false,
            (last, _) => last != Some(self),
        }
    }
}
