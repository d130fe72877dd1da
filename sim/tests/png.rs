//! PNG files with descriptive chunks.

use image::{DynamicImage, GrayImage};
use sim::input;

/// A chunk with its checksum, which the decoder verifies.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut chunk = [&(data.len() as u32).to_be_bytes()[..], kind, data].concat();
    let crc = chunk[4..].iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 }
        })
    });
    chunk.extend((!crc).to_be_bytes());
    chunk
}

/// A picture, and its file with chunks after its header.
fn with(chunks: &[u8]) -> (DynamicImage, Vec<u8>) {
    let shown = DynamicImage::from(GrayImage::from_fn(7, 5, |x, y| image::Luma([(30 * x + y) as u8])));
    let mut png = std::io::Cursor::new(Vec::new());
    shown.write_to(&mut png, image::ImageFormat::Png).expect("encoded");
    let mut png = png.into_inner();
    // The signature has 8 bytes, the header's chunk 25.
    png.splice(33..33, chunks.iter().copied());
    (shown, png)
}

#[test]
fn chunks_that_change_no_pixel_are_passed_over() {
    // Neither a zlib stream nor a valid checksum: a decoder that unpacks such chunks rejects the picture.
    let profile = [chunk(b"iCCP", b"profile\0\0no stream"), chunk(b"zTXt", b"text\0\0no stream")].concat();
    let mut damaged = chunk(b"gAMA", &45_455u32.to_be_bytes());
    *damaged.last_mut().expect("a checksum") ^= 1;
    let (shown, png) = with(&[profile, damaged].concat());
    assert_eq!(input::picture_of(&png).expect("a picture").image, shown);
}

/// A zlib stream (RFC 1950, 1951) of zeros: one literal, then copies of 258 bytes at a distance of one byte, with the fixed codes.
fn zeros(count: usize) -> Vec<u8> {
    let bits = |word: &'static str| word.bytes().map(|bit| bit == b'1');
    // The last block, of fixed codes; the literal 0.
    let head = bits("11000110000");
    let copies = std::iter::repeat_n("1100010100000", count / 258).flat_map(bits);
    let mut stream = vec![0x78, 0x9c];
    let mut place = 0;
    for bit in head.chain(copies).chain(bits("0000000")) {
        if place == 0 {
            stream.push(0);
        }
        if let Some(last) = stream.last_mut() {
            *last |= u8::from(bit) << place;
        }
        place = (place + 1) % 8;
    }
    stream
}

/// The peak memory of this process, in bytes.
#[cfg(target_os = "linux")]
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a peak");
    1024 * line.trim().trim_end_matches(" kB").parse::<usize>().expect("a number")
}

#[cfg(target_os = "linux")]
#[test]
fn a_profile_is_not_unpacked() {
    const UNPACKED: usize = 300 << 20;
    let profile = [&b"profile\0\0"[..], &zeros(UNPACKED)].concat();
    let (shown, png) = with(&chunk(b"iCCP", &profile));
    assert!(png.len() < UNPACKED / 100);
    assert_eq!(input::picture_of(&png).expect("a picture").image, shown);
    assert!(peak() < UNPACKED / 3, "{} bytes", peak());
}

#[test]
fn a_file_that_ends_in_a_chunk_is_refused() {
    let (_, png) = with(&chunk(b"tEXt", b"Comment\0none"));
    for length in [8, 20, 33, 40, png.len() - 13] {
        assert!(input::picture_of(&png[..length]).is_err(), "{length}");
    }
}
