//! The message in progress, from its segments over all repeats.

use super::header::{Header, SignatureHeader, message_crc};
use super::signature::{SIGNATURE_BLOCK, SIGNATURE_BYTES, Signature};
use super::{Layout, MESSAGE_MAX};
use crate::fec::{CODEWORD_PANELS_MAX, Code, Decoder, Undecodable, combine};
use crate::panel::SoftPanel;

/// Payload panels of the longest message: 1024 bytes at rate 1/2.
const PAYLOAD_PANELS_MAX: usize = 256;

/// The payload panels of one segment as read, upright and descrambled; lost ones erased.
pub type Payload = [SoftPanel; CODEWORD_PANELS_MAX];

/// A comparison of the LEDs as read with the decoded message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BitCount {
    /// LEDs read wrongly.
    pub corrected: u32,
    /// LEDs read.
    pub coded: u32,
}

/// The result of adding a segment to a message.
pub enum Addition {
    /// It had been decoded before.
    Known,
    /// It is decoded now; others are missing.
    Decoded(BitCount),
    /// It is kept, and added to its next repeat.
    Kept(Undecodable),
    /// It was the last one, and the message's CRC matches.
    Complete,
    /// It was the last one, and the message's CRC does not match.
    Corrupt {
        /// The CRC that the headers announced.
        announced: u32,
        /// The CRC of the decoded message.
        computed: u32,
    },
}

/// The result of adding a reading of a signature.
pub enum AddedSignature {
    /// The message is not whole yet, or the signature was read before.
    Unused,
    /// It is kept, and added to its next repeat.
    Kept(Undecodable),
    /// It was decoded, but is not the one announced by its header.
    Corrupt,
    /// It is the signature of the message.
    Read(Signature),
}

/// One message in progress.
///
/// Segments that did not decode are kept as sums of their log-likelihood ratios over the repeats; once the message is whole, its signature
/// is kept in the same way.
pub struct Assembly {
    header: Option<Header>,
    soft: [SoftPanel; PAYLOAD_PANELS_MAX],
    message: [u8; MESSAGE_MAX],
    /// One bit per segment: its ratios are in `soft`.
    kept: u128,
    /// One bit per segment: its bytes are in `message`.
    decoded: u128,
    complete: bool,
    /// The last signature with a reading, and whether it has decoded.
    signature: Option<(SignatureHeader, bool)>,
    first_stamp: u64,
    bits: BitCount,
}

impl Assembly {
    pub const fn new() -> Self {
        Self {
            header: None,
            soft: [SoftPanel::ERASED; PAYLOAD_PANELS_MAX],
            message: [0; MESSAGE_MAX],
            kept: 0,
            decoded: 0,
            complete: false,
            signature: None,
            first_stamp: 0,
            bits: BitCount { corrected: 0, coded: 0 },
        }
    }

    /// Resets it.
    pub fn clear(&mut self) {
        self.header = None;
    }

    /// Starts over with the message of `header`, first seen at `first_stamp`.
    pub fn begin(&mut self, header: Header, first_stamp: u64) {
        self.header = Some(header);
        (self.kept, self.decoded, self.complete, self.signature) = (0, 0, false, None);
        (self.first_stamp, self.bits) = (first_stamp, BitCount::default());
    }

    /// Whether no message is in progress.
    pub fn is_empty(&self) -> bool {
        self.header.is_none()
    }

    /// The header of the message in progress, if `signature` belongs to that message.
    pub fn signed_by(&self, signature: SignatureHeader) -> Option<Header> {
        self.header.filter(|&header| signature.is_of(header))
    }

    /// Whether the message is whole.
    pub fn is_complete(&self) -> bool {
        self.header.is_some() && self.complete
    }

    /// Whether `header` belongs to the message in progress.
    pub fn is_of(&self, header: Header) -> bool {
        self.header.is_some_and(|own| own.same_message(header))
    }

    /// Segments not decoded yet.
    pub fn missing(&self) -> u8 {
        let segments = self.header.map_or(0, |header| Layout::segments(header.layout()));
        (segments as u32).saturating_sub(self.decoded.count_ones()) as u8
    }

    pub fn first_stamp(&self) -> u64 {
        self.first_stamp
    }

    pub fn bits(&self) -> BitCount {
        self.bits
    }

    /// The message's bytes; zeros for missing segments.
    pub fn message(&self) -> &[u8] {
        let length = self.header.map_or(0, |header| usize::from(header.length));
        self.message.get(..length).unwrap_or(&self.message)
    }

    /// Decodes a segment of the message in progress: alone first, then together with its earlier repeats.
    ///
    /// Alone first, because an earlier repeat may have been read one panel off, and its sum would spoil a good reading.
    pub fn add(&mut self, header: Header, payload: &Payload, decoder: &mut Decoder) -> Addition {
        let bit = 1_u128 << (header.segment & 0x7f);
        if self.decoded & bit != 0 {
            return Addition::Known;
        }
        let block = header.block();
        let info = match decoder.decode(block, payload) {
            Ok(info) => info,
            Err(alone) => {
                let kept = self.kept & bit != 0;
                let sum = Self::keep(&mut self.soft, header, payload, kept);
                self.kept |= bit;
                match if kept { decoder.decode(block, sum) } else { Err(alone) } {
                    Ok(info) => info,
                    Err(undecodable) => return Addition::Kept(undecodable),
                }
            }
        };
        let bits = block.compare(info, payload);
        let bits = BitCount {
            corrected: bits.0,
            coded: bits.1,
        };
        let first_byte = header.layout().first_byte(header.segment.into());
        self.message
            .iter_mut()
            .skip(first_byte)
            .zip(info)
            .for_each(|(to, &from)| *to = from);
        self.decoded |= bit;
        self.bits.corrected = self.bits.corrected.saturating_add(bits.corrected);
        self.bits.coded = self.bits.coded.saturating_add(bits.coded);
        if self.missing() > 0 {
            Addition::Decoded(bits)
        } else {
            self.check(header.crc)
        }
    }

    /// Decodes the signature of the message in progress: alone first, then together with its earlier repeats.
    pub fn add_signature(&mut self, header: SignatureHeader, payload: &Payload, decoder: &mut Decoder) -> AddedSignature {
        let known = self.signature.filter(|(known, _)| *known == header);
        if !self.is_complete() || known.is_some_and(|(_, is_read)| is_read) {
            return AddedSignature::Unused;
        }
        let info = match decoder.decode(SIGNATURE_BLOCK, payload) {
            Ok(info) => info,
            Err(alone) => {
                self.signature = Some((header, false));
                // The message no longer needs this memory.
                let sum = Self::sum(&mut self.soft, payload, known.is_some());
                match if known.is_some() {
                    decoder.decode(SIGNATURE_BLOCK, sum)
                } else {
                    Err(alone)
                } {
                    Ok(info) => info,
                    Err(undecodable) => return AddedSignature::Kept(undecodable),
                }
            }
        };
        let mut bytes = [0; SIGNATURE_BYTES];
        bytes.iter_mut().zip(info).for_each(|(to, &from)| *to = from);
        let signature = Signature::from_bytes(&bytes);
        let is_announced = signature.check() == header.check;
        // The sum is no longer needed, either way.
        self.signature = is_announced.then_some((header, true));
        if is_announced {
            AddedSignature::Read(signature)
        } else {
            AddedSignature::Corrupt
        }
    }

    fn check(&mut self, announced: u32) -> Addition {
        let computed = message_crc(self.message());
        self.complete = computed == announced;
        if self.complete {
            Addition::Complete
        } else {
            Addition::Corrupt { announced, computed }
        }
    }

    /// Stores a segment at its position in `soft`, added to the sum there if `kept`; returns the sum.
    fn keep<'a>(soft: &'a mut [SoftPanel], header: Header, payload: &Payload, kept: bool) -> &'a [SoftPanel] {
        let first = usize::from(header.segment) * Code::panels(header.code);
        let panels = header.block().panels().min(payload.len());
        let Some(place) = soft.get_mut(first..first + panels) else {
            return &[];
        };
        Self::sum(place, payload, kept)
    }

    /// Stores a reading in `place`, added to the sum there if `kept`; returns the sum.
    fn sum<'a>(place: &'a mut [SoftPanel], payload: &Payload, kept: bool) -> &'a [SoftPanel] {
        for (sum, panel) in place.iter_mut().zip(payload) {
            if kept { combine(sum, panel) } else { *sum = *panel }
        }
        place
    }
}
