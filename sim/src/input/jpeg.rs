//! JPEG files (ITU-T T.81) as cameras and telephones write them: with a film after the picture, without an end marker, or without the
//! Huffman tables that all webcams share.

use std::borrow::Cow;

/// The layout of a file by its markers.
pub struct Layout {
    /// The position of the first scan's marker.
    first_scan: usize,
    /// The position after the end marker.
    end: Option<usize>,
    /// Whether its tables are missing, and its kind allows that.
    lacks_tables: bool,
}

/// Start of a frame: baseline and extended sequential, with Huffman codes.
const SEQUENTIAL: [u8; 2] = [0xc0, 0xc1];
const HUFFMAN_TABLES: u8 = 0xc4;
const END: u8 = 0xd9;
const SCAN: u8 = 0xda;
/// Markers without a length: the start, and a temporary one.
const BARE: [u8; 2] = [0xd8, 0x01];
/// Bytes after a scan's data; more than a decoder reads ahead.
const TAIL: usize = 64;
/// Equal bytes that data may end in (count). More could fill a block of the picture, about 24 bytes.
const FILLER_MAX: usize = 16;

impl Layout {
    /// Follows the markers from the first one on; `None` without a scan.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let (mut first_scan, mut is_sequential, mut has_tables) = (None, false, false);
        let (mut at, mut end) = (0, None);
        while let Some((marker, behind)) = next_marker(bytes, at) {
            at = behind;
            match marker {
                END => {
                    end = Some(behind);
                    break;
                }
                SCAN => _ = first_scan.get_or_insert(behind - 2),
                HUFFMAN_TABLES => has_tables |= first_scan.is_none(),
                marker => is_sequential |= SEQUENTIAL.contains(&marker),
            }
            if !BARE.contains(&marker) {
                at += bytes
                    .get(at..at + 2)
                    .map_or(0, |length| usize::from(length[0]) << 8 | usize::from(length[1]));
            }
        }
        first_scan.map(|first_scan| Self {
            first_scan,
            end,
            lacks_tables: is_sequential && !has_tables,
        })
    }

    /// Whether a file ends in equal bytes that a recorder reserved and never wrote: they would look like missing data.
    pub fn ends_in_filler(bytes: &[u8]) -> bool {
        let last = bytes.last().filter(|&&byte| byte != 0xff);
        last.is_some_and(|last| bytes.iter().rev().take_while(|&byte| byte == last).count() > FILLER_MAX)
    }

    /// The picture alone, in a form for decoders; `None` without an end marker.
    pub fn picture<'a>(&self, bytes: &'a [u8]) -> Option<Cow<'a, [u8]>> {
        Some(self.with_tables(&bytes[..self.end?]))
    }

    /// A picture without an end, completed in two ways that differ in each bit after its data. If both decode to the same, no data are
    /// missing.
    pub fn ended(&self, bytes: &[u8]) -> [Vec<u8>; 2] {
        let fill = bytes.iter().rev().take_while(|&&byte| byte == 0xff).count();
        let data = self.with_tables(&bytes[..bytes.len() - fill]);
        // No byte is 0xff, nor is its complement.
        [0x00, 0xff].map(|flip| {
            let tail = (0..TAIL as u8).map(|k| (k.wrapping_mul(89) & 0x7e | 0x01) ^ flip);
            data.iter().copied().chain(tail).chain([0xff, END]).collect()
        })
    }

    fn with_tables<'a>(&self, bytes: &'a [u8]) -> Cow<'a, [u8]> {
        if !self.lacks_tables {
            return bytes.into();
        }
        let (head, scans) = bytes.split_at(self.first_scan);
        [head, &usual_tables(), scans].concat().into()
    }
}

/// The next marker from a position on, and the position after it. Other bytes are skipped: the data of scans, and garbage.
fn next_marker(bytes: &[u8], from: usize) -> Option<(u8, usize)> {
    let mut at = from;
    loop {
        at += bytes.get(at..)?.iter().position(|&byte| byte == 0xff)? + 1;
        match bytes.get(at)? {
            // A byte of data, or a restart.
            0x00 | 0xd0..=0xd7 => at += 1,
            // A fill byte.
            0xff => {}
            &marker => return Some((marker, at + 1)),
        }
    }
}

/// The tables that MJPEG omits: K.3 to K.6 of annex K, luminance first, as one segment.
fn usual_tables() -> Vec<u8> {
    let tables: [(u8, &[u8; 16], &[u8]); 4] = [
        (0x00, &[0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0], &DC),
        (0x10, &[0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7d], &AC_LUMINANCE),
        (0x01, &[0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0], &DC),
        (0x11, &[0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 0x77], &AC_CHROMINANCE),
    ];
    let body: Vec<u8> = tables
        .iter()
        .flat_map(|(place, counts, values)| [&[*place], &counts[..], values].concat())
        .collect();
    let length = (body.len() + 2) as u16;
    [&[0xff, HUFFMAN_TABLES], &length.to_be_bytes()[..], &body].concat()
}

/// Values of tables K.3 and K.4.
const DC: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
/// Values of table K.5.
#[rustfmt::skip]
const AC_LUMINANCE: [u8; 162] = [
    0x01, 0x02, 0x03, 0x00, 0x04, 0x11, 0x05, 0x12, 0x21, 0x31, 0x41, 0x06, 0x13, 0x51, 0x61, 0x07, 0x22, 0x71, 0x14, 0x32,
    0x81, 0x91, 0xa1, 0x08, 0x23, 0x42, 0xb1, 0xc1, 0x15, 0x52, 0xd1, 0xf0, 0x24, 0x33, 0x62, 0x72, 0x82, 0x09, 0x0a, 0x16,
    0x17, 0x18, 0x19, 0x1a, 0x25, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x43, 0x44, 0x45,
    0x46, 0x47, 0x48, 0x49, 0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69,
    0x6a, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8a, 0x92, 0x93, 0x94,
    0x95, 0x96, 0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5, 0xb6,
    0xb7, 0xb8, 0xb9, 0xba, 0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8,
    0xd9, 0xda, 0xe1, 0xe2, 0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf1, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8,
    0xf9, 0xfa,
];
/// Values of table K.6.
#[rustfmt::skip]
const AC_CHROMINANCE: [u8; 162] = [
    0x00, 0x01, 0x02, 0x03, 0x11, 0x04, 0x05, 0x21, 0x31, 0x06, 0x12, 0x41, 0x51, 0x07, 0x61, 0x71, 0x13, 0x22, 0x32, 0x81,
    0x08, 0x14, 0x42, 0x91, 0xa1, 0xb1, 0xc1, 0x09, 0x23, 0x33, 0x52, 0xf0, 0x15, 0x62, 0x72, 0xd1, 0x0a, 0x16, 0x24, 0x34,
    0xe1, 0x25, 0xf1, 0x17, 0x18, 0x19, 0x1a, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x35, 0x36, 0x37, 0x38, 0x39, 0x3a, 0x43, 0x44,
    0x45, 0x46, 0x47, 0x48, 0x49, 0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68,
    0x69, 0x6a, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8a, 0x92,
    0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4,
    0xb5, 0xb6, 0xb7, 0xb8, 0xb9, 0xba, 0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6,
    0xd7, 0xd8, 0xd9, 0xda, 0xe2, 0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8,
    0xf9, 0xfa,
];
