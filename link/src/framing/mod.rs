//! From a message to panels and back: segments, headers, repeats.
//!
//! # The format, version 1
//!
//! A message is 1 to 1024 bytes. It is cut into segments, and its segments are shown in order, again and
//! again:
//!
//! ```text
//!  repeat 0                            repeat 1 (the complement of repeat 0)
//! ┌───────────┬───────────┬───────────┬───────────┬───────────┬─── ···
//! │ segment 0 │ segment 1 │ segment 2 │ segment 0 │ segment 1 │
//! └───────────┴─────┬─────┴───────────┴───────────┴───────────┴─── ···
//!       ┌───────────┘
//! panel n=0      1          2           3        ···                    ··· last
//!   ┌─────────┬──────────┬──────────┬──────────┬─────┬──────────┬──────────┬─────┐
//!   │  SYNC   │  header  │  header  │ payload: │ ··· │ payload: │ payload: │ ··· │   64 LEDs each
//!   │         │   info   │  parity  │   info   │     │   info   │  parity  │     │
//!   └─────────┴──────────┴──────────┴──────────┴─────┴──────────┴──────────┴─────┘
//! ```
//!
//! **Sync panel.** [`SYNC`], 32 of its LEDs On: 4 in each row and column, never more than 2 alike in succession. It is a pilot too, and
//! shows the panel's orientation.
//!
//! **Header.** 64 bits, as 8 bytes in little-endian order, coded by TC128 into 2 panels:
//!
//! ```text
//!  bit 0    3      6             16         23     24                                    56       63
//!   ┌───────┬──────┬─────────────┬──────────┬──────┬─────────────────────────────────────┬─────────┐
//!   │version│ code │ length − 1  │ segment  │fresh │           CRC-32C                   │  CRC-8  │
//!   │   3   │  3   │     10      │    7     │  1   │             32                      │    8    │
//!   └───────┴──────┴─────────────┴──────────┴──────┴─────────────────────────────────────┴─────────┘
//!    byte 0 and 1 (to bit 15)     byte 2            bytes 3 to 6                          byte 7
//! ```
//!
//! * *version*: 1. The positions of version and CRC-8 hold for all future versions.
//! * *code*: the code of the payload, 0 to 4 as in [`Code`](crate::fec::Code); 7 is a **beacon**: sync and header alone, which an idle
//!   transmitter shows, with all fields after it zero. 6 is a **size**, also sync and header alone. A transmitter that knows its panel's
//!   size shows it after the first of every 16 repeats, which costs 3 panels in 16 repeats; every second one is in complement. Its fields
//!   are 20 bits (6 to 25) of an LED's diameter in µm, 16 bits (26 to 41) of the interval, the gap between LEDs over their diameter, in
//!   1/4096, then zeros. 5 is a **signature**, below.
//! * *length* of the message in bytes, *segment* number from 0.
//! * *fresh* toggles with each new message: the same text sent again differs from a repeat.
//! * *CRC-32C* (CRC-32/ISCSI) of the message's bytes and then its length as 2 bytes, little-endian: the message's identity and its check.
//! * *CRC-8* (CRC-8/AUTOSAR) of bytes 0 to 6.
//!
//! **Payload.** A segment carries as many bytes of the message as its code has information, the last segment the remaining ones. They are
//! coded and shortened as [`fec`](crate::fec) defines: ⌈bytes/8⌉ panels of information, then 1, 2, 4, 4 or 8 panels of parity. There is
//! nothing else in a panel.
//!
//! **Signature.** A transmitter that signs shows one after each repeat of its message. Sync, header, and 72 bytes under the code for that
//! length: [`SIGNATURE_PANELS`] in all, with the polarity of the repeat.
//!
//! ```text
//!  bit 0    3      6             16         23     24                                    56       63
//!   ┌───────┬──────┬─────────────┬──────────┬──────┬─────────────────────────────────────┬─────────┐
//!   │version│  5   │    check    │  scheme  │fresh │     CRC-32C of the message          │  CRC-8  │
//!   └───────┴──────┴─────────────┴──────────┴──────┴─────────────────────────────────────┴─────────┘
//!   payload:  key, 4 bytes │ counter, 4 bytes, little-endian │ Ed25519 signature (RFC 8032), 64 bytes
//! ```
//!
//! * *check*: the low 10 bits of the CRC-32C of the payload; *scheme*: 0, others are reserved for future formats.
//! * *fresh* and *CRC-32C* are those of the message, and identify it.
//! * *key*: the first 4 bytes of the public key; *counter* rises with each signature of a key.
//!
//! The message comes first: it is delivered once it is whole, and proven once its signature is. `link::signing` defines the signed bytes
//! and the trusted keys. Receivers of releases before signatures report an unknown header, and read the message.
//!
//! **Bits to LEDs.** Byte r of the 8 of a panel is row r; its bit c, from the least significant, is column c.
//!
//! **Scrambling.** Panel n of a segment is XORed with [`scramble::word`](crate::scramble::word)`(n)`; the
//! sync panel is not.
//!
//! **Polarity.** If segment + repeat is odd, the whole segment, sync included, is shown in complement. The sign of the sync panel's
//! correlation gives the polarity to the receiver.
//!
//! # Flicker
//!
//! Each repeat is the complement of the one before, so each LED is On in *exactly* half of the panels of any two repeats, and never stays
//! the same for longer than one repeat. These two hold for all messages and are tested. Typical values, of English text over 40 repeats, by
//! `cargo run --release -p vocc-link --example flicker`:
//!
//! | bytes | code | panels a repeat | mean On | spread a panel (standard deviation) | LEDs On, least to most | longest run of one LED, panels |
//! |---|---|---|---|---|---|---|
//! | 8 | TC128 | 5 | 0.5000 | 0.0479 | 26 to 38 | 5 |
//! | 16 | TC256 | 7 | 0.5000 | 0.0334 | 27 to 37 | 7 |
//! | 32 | TC512 | 11 | 0.5000 | 0.0403 | 26 to 38 | 8 |
//! | 128 | TM1536 | 27 | 0.5000 | 0.0513 | 24 to 40 | 11 |
//! | 1024 | TM1536 | 216 | 0.5000 | 0.0629 | 20 to 44 | 12 |
//!
//! `docs/flicker.md` shows how visible this is.
//!
//! # Sending and receiving
//!
//! [`Framer`] makes the panels, [`Deframer`] reads them; the [crate] opens with an example.
//! [`Code::for_length`](crate::fec::Code::for_length) chooses the code.

mod assembly;
mod code_choice;
mod header;
mod layout;
mod receive;
mod signature;
mod transmit;

pub use header::{Announcement, HEADER_BYTES, Header, HeaderError, SignatureHeader, VERSION, message_crc};
pub use layout::{Layout, OVERHEAD_PANELS};
pub use receive::{Deframer, Delivery, Event, Rejection, SYNC_SEEN, SegmentOutcome, SignedPayload};
pub use signature::{KeyId, SIGNATURE_BYTES, SIGNATURE_PANELS, Signature, SignedFramer};
pub use transmit::Framer;

use crate::panel::PanelFrame;

/// The most bytes of a message.
pub const MESSAGE_MAX: usize = 1024;

/// The panel that begins each segment.
///
/// ```text
/// ##··#··#
/// ·##··##·
/// #·##··#·
/// ·#··##·#
/// ··##·##·
/// #··#··##
/// ·##·##··
/// #··##··#
/// ```
///
/// It agrees with its own rotations and mirror images, and with their complements, in at most 40 LEDs of 64. So it reveals a picture's
/// orientation, mirrored or not.
pub const SYNC: PanelFrame = PanelFrame::from_bits(0x9936_c96c_b24d_6693);

/// Why a message cannot be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FramingError {
    /// No bytes at all.
    #[error("the message is empty: give 1 to {MESSAGE_MAX} bytes, or send a beacon")]
    Empty,
    /// Too many bytes.
    #[error("the message has {length} bytes, at most {MESSAGE_MAX} are allowed: split it into several messages")]
    TooLong {
        /// Its bytes.
        length: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orientation::Orientation;
    use crate::panel::{LEDS, SIDE};

    #[test]
    fn the_sync_panel_is_balanced_and_has_no_long_runs() {
        for quarter_turns in [0, 1] {
            let image = SYNC.seen(Orientation::new(quarter_turns, false));
            for row in 0..SIDE {
                let leds: Vec<bool> = (0..SIDE).map(|column| image.is_on(row, column)).collect();
                assert_eq!(leds.iter().filter(|&&on| on).count(), SIDE / 2);
                assert!(leds.chunk_by(|a, b| a == b).all(|run| run.len() <= 2));
            }
        }
    }

    #[test]
    fn the_sync_panel_is_unlike_its_turned_and_mirrored_images() {
        for orientation in &Orientation::ALL[1..] {
            let alike = LEDS as u32 - SYNC.distance(SYNC.seen(*orientation));
            assert!((24..=40).contains(&alike), "{orientation}: {alike}");
        }
    }
}
