//! The header of a segment: 64 bits that identify the segment and its message.

use super::{Layout, MESSAGE_MAX};
use crate::checksum::crc32c;
use crate::fec::{Block, Code};
use crate::geometry::{Geometry, GeometryError};
use crate::panel::PanelFrame;
use crc::{CRC_8_AUTOSAR, Crc, NoTable};

/// The format version of this crate.
pub const VERSION: u8 = 1;
/// Bytes of a header.
pub const HEADER_BYTES: usize = 8;
/// The code word of a header.
pub const HEADER_BLOCK: Block = Block::new(Code::Tc128, HEADER_BYTES);

/// The code field's value in a beacon.
const BEACON: u8 = 7;
/// The code field's value in a panel's size.
const GEOMETRY: u8 = 6;
/// The code field's value before a signature.
const SIGNATURE: u8 = 5;

// A table of 256 bytes is not justified for seven bytes a segment.
const CRC_8: Crc<u8, NoTable> = Crc::<u8, NoTable>::new(&CRC_8_AUTOSAR);

/// Identifies a segment and its message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// The code of the payload.
    pub code: Code,
    /// Bytes of the whole message: 1 to [`MESSAGE_MAX`].
    pub length: u16,
    /// The segment's number: 0 to 127.
    pub segment: u8,
    /// Toggles with each new message, so that the same text sent again differs from a repeat.
    pub fresh: bool,
    /// [`message_crc`] of the whole message: its identity and its check in one.
    pub crc: u32,
}

impl Header {
    /// The layout of the message in segments.
    pub const fn layout(self) -> Layout {
        Layout::new(self.code, self.length as usize)
    }

    /// The code word of this segment's payload.
    pub const fn block(self) -> Block {
        self.layout().block(self.segment as usize)
    }

    /// Whether both headers are of the same message, of any of its segments.
    pub fn same_message(self, other: Self) -> bool {
        self.of_segment(0) == other.of_segment(0)
    }

    /// The header of another segment of the same message.
    pub const fn of_segment(self, segment: u8) -> Self {
        Self { segment, ..self }
    }
}

/// Identifies a signature and its message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SignatureHeader {
    /// [`Signature::check`](super::Signature::check) of the signature: 10 bits that distinguish it from another, and from a wrong reading
    /// of it.
    pub check: u16,
    /// As in the headers of the message.
    pub fresh: bool,
    /// As in the headers of the message.
    pub crc: u32,
}

impl SignatureHeader {
    /// Whether the signature belongs to the message of `header`.
    pub fn is_of(self, header: Header) -> bool {
        (self.fresh, self.crc) == (header.fresh, header.crc)
    }
}

/// The content that a header announces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Announcement {
    /// A segment of a message follows.
    Segment(Header),
    /// The signature of the message before it follows.
    Signature(SignatureHeader),
    /// The transmitter is idle; nothing follows.
    Beacon,
    /// The size of the transmitter's panel; nothing follows.
    Geometry(Geometry),
}

/// Why 64 decoded bits are not a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HeaderError {
    /// The CRC-8 does not match.
    #[error("the header's CRC-8 is {found:#04x} instead of {computed:#04x}: it was read wrongly, or was not a header")]
    Checksum {
        /// The value in the header.
        found: u8,
        /// The value for the rest of the header.
        computed: u8,
    },
    /// A format of another version.
    #[error("the header is of version {0}, this receiver reads version {VERSION}: use the same release at both ends")]
    Version(u8),
    /// A signature of a kind that this version does not define.
    #[error("the header has signature scheme {0}, and only 0 (Ed25519) is known: it was read wrongly, or the transmitter is newer")]
    SignatureScheme(u8),
    /// A segment beyond the message's end.
    #[error("the header has segment {segment} of a message of {segments}: it was read wrongly")]
    Segment {
        /// The number in the header.
        segment: u8,
        /// The number of segments by the message's length and code.
        segments: usize,
    },
    /// A beacon whose other fields are not all zero.
    #[error("the header is a beacon with fields that are not zero: it was read wrongly, or the transmitter is newer")]
    Beacon,
    /// A size that is out of range.
    #[error("the header has an impossible size: {0}")]
    Geometry(GeometryError),
    /// A size with fields after it that are not all zero.
    #[error("the header has a size with extra fields: it was read wrongly, or the transmitter is newer")]
    MoreThanGeometry,
}

/// The CRC-32C of the message's bytes followed by its length (2 bytes, little-endian).
///
/// The length is part of it, so that messages which differ only in zeros at the end, which the shortened codes cannot distinguish, have
/// different CRCs.
pub fn message_crc(message: &[u8]) -> u32 {
    crc32c(&[message, &(message.len() as u16).to_le_bytes()])
}

impl Announcement {
    /// The 8 bytes of the header.
    pub fn to_bytes(self) -> [u8; HEADER_BYTES] {
        let fields = match self {
            Self::Beacon => u64::from(VERSION) | u64::from(BEACON) << 3,
            Self::Geometry(geometry) => u64::from(VERSION) | u64::from(GEOMETRY) << 3 | geometry.to_bits() << 6,
            Self::Signature(header) => {
                u64::from(VERSION)
                    | u64::from(SIGNATURE) << 3
                    | u64::from(header.check & 0x3ff) << 6
                    | u64::from(header.fresh) << 23
                    | u64::from(header.crc) << 24
            }
            Self::Segment(header) => {
                u64::from(VERSION)
                    | (header.code as u64) << 3
                    | u64::from(header.length.clamp(1, MESSAGE_MAX as u16) - 1) << 6
                    | u64::from(header.segment & 0x7f) << 16
                    | u64::from(header.fresh) << 23
                    | u64::from(header.crc) << 24
            }
        };
        let [checked @ .., _] = fields.to_le_bytes();
        (fields | u64::from(CRC_8.checksum(&checked)) << 56).to_le_bytes()
    }

    /// Reads the 8 bytes of a header.
    ///
    /// # Errors
    ///
    /// [`HeaderError`]: wrong CRC-8, another version, or fields out of their ranges, in this order.
    pub fn from_bytes(bytes: [u8; HEADER_BYTES]) -> Result<Self, HeaderError> {
        let [checked @ .., found] = bytes;
        let computed = CRC_8.checksum(&checked);
        if found != computed {
            return Err(HeaderError::Checksum { found, computed });
        }
        let fields = u64::from_le_bytes(bytes);
        let field = |first_bit: u32, bits: u32| fields >> first_bit & ((1 << bits) - 1);
        let version = field(0, 3) as u8;
        if version != VERSION {
            return Err(HeaderError::Version(version));
        }
        let code_value = field(3, 3) as u8;
        let Some(code) = Code::from_value(code_value) else {
            return match code_value {
                BEACON if field(6, 50) == 0 => Ok(Self::Beacon),
                BEACON => Err(HeaderError::Beacon),
                GEOMETRY if field(42, 14) != 0 => Err(HeaderError::MoreThanGeometry),
                GEOMETRY => Geometry::from_bits(field(6, 36)).map(Self::Geometry).map_err(HeaderError::Geometry),
                // The remaining value: a signature.
                _ => match field(16, 7) as u8 {
                    0 => Ok(Self::Signature(SignatureHeader {
                        check: field(6, 10) as u16,
                        fresh: field(23, 1) == 1,
                        crc: field(24, 32) as u32,
                    })),
                    scheme => Err(HeaderError::SignatureScheme(scheme)),
                },
            };
        };
        let header = Header {
            code,
            length: field(6, 10) as u16 + 1,
            segment: field(16, 7) as u8,
            fresh: field(23, 1) == 1,
            crc: field(24, 32) as u32,
        };
        let segments = header.layout().segments();
        if usize::from(header.segment) < segments {
            Ok(Self::Segment(header))
        } else {
            Err(HeaderError::Segment {
                segment: header.segment,
                segments,
            })
        }
    }

    /// The two panels of the header, coded, before scrambling.
    pub fn to_panels(self) -> impl Iterator<Item = PanelFrame> {
        HEADER_BLOCK.encode(&self.to_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::l2a_table::Interval;
    use properties::prelude::*;

    /// A header with other `fields` in bits 0 to 55 and the matching CRC-8.
    fn with_fields(fields: u64) -> [u8; HEADER_BYTES] {
        let mut bytes = fields.to_le_bytes();
        bytes[7] = CRC_8.checksum(&bytes[..7]);
        bytes
    }

    properties! {
        #[test]
        fn a_header_comes_back(code in 0_u8..5, length in 1_u16..=1024, segment: u8, fresh: bool, crc: u32) {
            let code = Code::from_value(code).unwrap();
            let segment = (usize::from(segment) % Layout::new(code, length.into()).segments()) as u8;
            let header = Announcement::Segment(Header { code, length, segment, fresh, crc });
            prop_assert_eq!(Announcement::from_bytes(header.to_bytes()), Ok(header));
        }

        #[test]
        fn one_to_three_wrong_bits_are_noticed(crc: u32, first in 0_u32..64, second in 0_u32..64, third in 0_u32..64) {
            let header = Header { code: Code::Tc512, length: 90, segment: 1, fresh: true, crc };
            let bits = u64::from_le_bytes(Announcement::Segment(header).to_bytes());
            let wrong = bits ^ (1 << first | 1 << second | 1 << third);
            let refused = matches!(Announcement::from_bytes(wrong.to_le_bytes()), Err(HeaderError::Checksum { .. }));
            prop_assert!(refused);
        }

        #[test]
        fn any_bytes_are_read_or_refused_without_panic(fields in 0_u64..1 << 56) {
            if let Ok(read) = Announcement::from_bytes(with_fields(fields)) {
                prop_assert_eq!(read.to_bytes(), with_fields(fields));
            }
        }
    }

    #[test]
    fn a_beacon_comes_back_and_is_refused_with_other_fields() {
        assert_eq!(Announcement::from_bytes(Announcement::Beacon.to_bytes()), Ok(Announcement::Beacon));
        assert_eq!(Announcement::from_bytes(with_fields(0x39 | 1 << 30)), Err(HeaderError::Beacon));
    }

    properties! {
        #[test]
        fn a_size_comes_back(diameter_um in Geometry::LED_DIAMETER_UM, interval: u16) {
            let geometry = Geometry::new(diameter_um, Interval::from_bits(interval)).expect("a size");
            let told = Announcement::Geometry(geometry);
            prop_assert_eq!(Announcement::from_bytes(told.to_bytes()), Ok(told));
        }
    }

    properties! {
        #[test]
        fn the_header_of_a_signature_comes_back(check in 0_u16..1024, fresh: bool, crc: u32) {
            let told = Announcement::Signature(SignatureHeader { check, fresh, crc });
            prop_assert_eq!(Announcement::from_bytes(told.to_bytes()), Ok(told));
        }
    }

    #[test]
    fn a_size_that_cannot_be_is_refused() {
        for diameter_um in [0, 99, 1_000_001, 0xf_ffff] {
            let refused = Announcement::from_bytes(with_fields(1 | 6 << 3 | diameter_um << 6));
            assert!(matches!(refused, Err(HeaderError::Geometry(_))), "{refused:?}");
        }
        let more = Announcement::from_bytes(with_fields(1 | 6 << 3 | 30_000 << 6 | 1 << 42));
        assert_eq!(more, Err(HeaderError::MoreThanGeometry));
    }

    #[test]
    fn what_this_version_does_not_define_is_refused_by_name() {
        assert_eq!(Announcement::from_bytes(with_fields(2)), Err(HeaderError::Version(2)));
        assert_eq!(
            Announcement::from_bytes(with_fields(1 | 5 << 3 | 1 << 16)),
            Err(HeaderError::SignatureScheme(1))
        );
        let beyond = Announcement::from_bytes(with_fields(1 | 1 << 16));
        assert_eq!(beyond, Err(HeaderError::Segment { segment: 1, segments: 1 }));
    }

    #[test]
    fn zeros_at_the_end_change_the_crc() {
        assert_ne!(message_crc(b"a"), message_crc(b"a\0"));
        assert_ne!(message_crc(b"\0"), message_crc(b"\0\0"));
    }
}
