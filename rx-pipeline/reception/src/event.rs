//! Events of a panel beside its readings.

use link::fec::Undecodable;
use link::framing::{Event, Rejection, SegmentOutcome, Signature};
use link::geometry::Geometry;
use link::orientation::Orientation;

/// A whole message, checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Its bytes.
    pub data: Vec<u8>,
    /// The number of the first frame that showed a part of it.
    pub first_frame: u64,
    /// The number of the last one.
    pub last_frame: u64,
    /// Bits that were corrected.
    pub corrected_bits: u32,
}

/// A message, and the signature that was shown with it: not checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignedMessage {
    /// The message's bytes.
    pub data: Vec<u8>,
    /// The signature, as it was read.
    pub signature: Signature,
}

/// What a panel's symbols brought.
#[derive(Clone, Debug, PartialEq)]
pub enum PanelEvent {
    /// A message has become whole.
    Message(Message),
    /// The signature of a message has become whole, too: told once, and anew when the message comes or is signed anew.
    Signed(SignedMessage),
    /// The last message is shown without a signature: told once, when it begins anew.
    Unsigned,
    /// Something was seen and not used.
    Rejected(Rejection),
    /// A transmitter of a format version that is not read.
    UnsupportedVersion(u8),
    /// A segment could not be decoded; it is waited for.
    SegmentFailed {
        /// Its number.
        segment: u8,
        /// Why.
        why: Undecodable,
    },
    /// The panel says how large it is.
    Geometry(Geometry),
    /// Which way up the picture has the panel: told where that is not upright, and where it has changed.
    Orientation(Orientation),
    /// The panel shows that many symbols a second, which is not the rate that was assumed.
    RateFound(f32),
}

impl PanelEvent {
    /// The event to report for one of the deframer's, if any.
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

    /// Whether it is news of the signer, after the last report since the message.
    pub(crate) fn is_news_after(&self, told: Option<&Self>) -> bool {
        match (told, self) {
            (Some(_), Self::Unsigned) => false,
            (told, _) => told != Some(self),
        }
    }
}
