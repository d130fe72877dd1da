//! Random damage to bytes.

use std::ops::Range;

use rand::{Rng, RngExt};
use studies::checksum;

/// Most changes to a file.
const CHANGES_MAX: u32 = 4;

/// Words that parsers, terminals and spreadsheets may stumble over.
const WORDS: [&[u8]; 30] = [
    b"nan",
    b"inf",
    b"-inf",
    b"-1",
    b"-0",
    b"0",
    b"1e308",
    b"1e-308",
    b"1e999",
    b"0.1e",
    b"9223372036854775808",
    b"18446744073709551615",
    b"18446744073709551616",
    b"99999999999999999999999999999999999999999",
    b"\"",
    b"'''",
    b"[",
    b"]]",
    b"{",
    b"}",
    b"=1+1",
    b"@",
    b"\xff\xfe",
    b"\0",
    b"\r\n",
    b"\x1b[2J\x1b]0;x\x07",
    b"\xc2\x9b2J\x7f",
    b"\xe2\x80\xae",
    b"&a *a",
    b"../../../../dev/null",
];

/// Bytes with one to [`CHANGES_MAX`] changes. Checksums of the formats are often made right, so that what is behind them is read.
pub fn damaged(whole: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    let is_whole_again = random.random_range(0..4u32) > 0;
    let checked = Checked::of(&bytes).filter(|_| is_whole_again);
    if let Some((_, end)) = checked {
        bytes.truncate(end);
    }
    for _ in 0..random.random_range(1..=CHANGES_MAX) {
        change(&mut bytes, random);
    }
    if let Some((checked, _)) = checked {
        checked.end(&mut bytes);
    }
    if is_whole_again && bytes.starts_with(PNG) {
        mend_png(&mut bytes);
    }
    bytes
}

/// A random part of `length` bytes.
fn part(length: usize, random: &mut impl Rng) -> Range<usize> {
    let from = random.random_range(0..=length);
    let most = [4, 64, length][random.random_range(0..3usize)].min(length - from);
    from..from + random.random_range(0..=most)
}

fn change(bytes: &mut Vec<u8>, random: &mut impl Rng) {
    let range = part(bytes.len(), random);
    match random.random_range(0..10u32) {
        0 => {
            if let Some(byte) = bytes.get_mut(range.start) {
                *byte ^= 1 << random.random_range(0..8u32);
            }
        }
        1 => bytes[range].iter_mut().for_each(|byte| *byte = random.random()),
        2 => {
            let value = [0, 0x7f, 0x80, 0xff][random.random_range(0..4usize)];
            bytes[range].fill(value);
        }
        3 => drop(bytes.drain(range)),
        4 => bytes.truncate(range.start),
        5 => {
            let copy = bytes[range.clone()].to_vec();
            let to = random.random_range(0..=bytes.len());
            drop(bytes.splice(to..to, copy));
        }
        6 => {
            let word = WORDS[random.random_range(0..WORDS.len())];
            drop(bytes.splice(range.start..range.start, word.iter().copied()));
        }
        7 => change_number(bytes, random),
        8 => change_line(bytes, random),
        _ => {
            let long = [u32::MAX, i32::MAX as u32, 1 << 31, 8192, 8193, 65536, 0][random.random_range(0..7usize)];
            let long = if random.random_range(0..2u32) == 0 {
                long.to_be_bytes()
            } else {
                long.to_le_bytes()
            };
            bytes.iter_mut().skip(range.start).zip(long).for_each(|(byte, other)| *byte = other);
        }
    }
}

/// Puts a word in the place of a number.
fn change_number(bytes: &mut Vec<u8>, random: &mut impl Rng) {
    let is_part = |byte: &u8| byte.is_ascii_digit() || b"+-.".contains(byte);
    let mut numbers = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let length = bytes[at..].iter().take_while(|byte| is_part(byte)).count();
        if length > 0 {
            numbers.push(at..at + length);
        }
        at += length + 1;
    }
    if !numbers.is_empty() {
        let number = numbers[random.random_range(0..numbers.len())].clone();
        let word = WORDS[random.random_range(0..WORDS.len())];
        drop(bytes.splice(number, word.iter().copied()));
    }
}

/// Removes a line, doubles it, or swaps it with another.
fn change_line(bytes: &mut Vec<u8>, random: &mut impl Rng) {
    let mut lines: Vec<Vec<u8>> = bytes.split_inclusive(|&byte| byte == b'\n').map(<[u8]>::to_vec).collect();
    if lines.is_empty() {
        return;
    }
    let [one, other] = [(); 2].map(|()| random.random_range(0..lines.len()));
    match random.random_range(0..3u32) {
        0 => drop(lines.remove(one)),
        1 => lines.insert(other, lines[one].clone()),
        _ => lines.swap(one, other),
    }
    *bytes = lines.concat();
}

/// A format that ends with a checksum of what is before it.
#[derive(Clone, Copy)]
enum Checked {
    /// A JSON object's last field.
    Json,
    /// A table's last line.
    Table,
}

impl Checked {
    /// The format, and where what the checksum is of ends: of an object without the bracket that closes it.
    fn of(bytes: &[u8]) -> Option<(Self, usize)> {
        [Self::Json, Self::Table].into_iter().find_map(|checked| {
            let mark = checked.mark();
            let at = bytes.windows(mark.len()).rposition(|window| window == mark)?;
            Some((checked, at))
        })
    }

    fn mark(self) -> &'static [u8] {
        match self {
            Self::Json => b",\"checksum\":\"",
            Self::Table => b"# checksum ",
        }
    }

    /// Ends it with the checksum that fits.
    fn end(self, bytes: &mut Vec<u8>) {
        let (sum, after) = match self {
            Self::Json => (checksum::of(&[bytes, &b"}"[..]].concat()), &b"\"}"[..]),
            Self::Table => (checksum::of(bytes), &b"\n"[..]),
        };
        bytes.extend([self.mark(), sum.as_bytes(), after].concat());
    }
}

const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Makes the checksums of a PNG's chunks right, as far as they follow one another.
fn mend_png(bytes: &mut [u8]) {
    let mut at = PNG.len();
    while let Some(head) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes(head.try_into().expect("four bytes")) as usize;
        let end = at.saturating_add(8).saturating_add(length);
        if end.saturating_add(4) > bytes.len() {
            return;
        }
        let sum = crc32fast::hash(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
}
