//! Frames of every kind, good and bad, and an independent judgement of which are good.

use link::l2a_table::L2aTable;
use link::serial::{CHUNK_MAX, Kind, Measured, REQUEST_FRAME_MAX, Request, Seed, encode, wire_length};
use tx_firmware::calibration::BENCH;

/// Numbers that the seed decides (splitmix64).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// A number below `end`.
    pub fn below(&mut self, end: usize) -> usize {
        (self.number() % end.max(1) as u64) as usize
    }
}

/// Appends one frame, or what is left of one.
pub fn next(random: &mut Random, wire: &mut Vec<u8>) {
    match random.below(8) {
        0 => noise(random, 40, wire),
        1 if random.below(200) == 0 => noise(random, 3000, wire),
        1 => whole(random, wire),
        2 | 3 => framed(random, wire),
        _ => {
            let start = wire.len();
            whole(random, wire);
            for _ in 0..=random.below(3) {
                mutate(random, start, wire);
            }
        }
    }
}

/// Bytes of any kind, zeros oftener than others.
fn noise(random: &mut Random, most: usize, wire: &mut Vec<u8>) {
    for _ in 0..random.below(most) {
        let number = random.number();
        wire.push(if number >> 60 == 0 { 0 } else { number as u8 });
    }
}

/// A frame with the right CRC around any body.
fn framed(random: &mut Random, wire: &mut Vec<u8>) {
    let version = if random.below(8) == 0 { random.number() as u8 } else { 1 };
    let kind = if random.below(8) == 0 { random.number() as u8 } else { 1 };
    let mut frame = vec![version, kind];
    frame.extend((random.number() as u32).to_le_bytes());
    frame.push(random.below(32) as u8);
    for _ in 0..random.below(12) {
        // Small numbers are oftener lengths and numbers of variants.
        let number = random.number();
        frame.push(if number >> 63 == 0 { number as u8 % 8 } else { number as u8 });
    }
    frame.extend(crc32c(&frame).to_le_bytes());
    wire.push(0);
    stuff(&frame, wire);
    wire.push(0);
}

/// A good request.
fn whole(random: &mut Random, wire: &mut Vec<u8>) {
    let table = L2aTable::default();
    let image = table.image();
    let crc = if random.below(4) == 0 {
        random.number() as u32
    } else {
        L2aTable::default().crc()
    };
    let mut bytes = [0; 200];
    bytes.iter_mut().for_each(|byte| *byte = random.number() as u8);
    let some = &bytes[..random.below(40)];
    let request = match random.below(32) {
        0 => Request::Hello,
        1 => Request::Status,
        2 => Request::ReadTable {
            offset: random.below(500) as u16,
        },
        3 => Request::BeginTable {
            length: random.below(400) as u16,
            crc,
        },
        4 => Request::WriteTable {
            offset: random.below(400) as u16,
            bytes: some,
        },
        5 => Request::WriteTable {
            offset: 0,
            bytes: &bytes[..CHUNK_MAX],
        },
        6 => Request::RollBackTable,
        7 => Request::ReadCalibration,
        8 => Request::WriteCalibration(Measured {
            shortest_pulse_ns: random.below(70_000) as u32,
            ..BENCH
        }),
        9 => Request::Send {
            repeats: None,
            message: some,
        },
        10 => Request::Send {
            repeats: Some(random.number() as u32),
            message: &bytes,
        },
        11 => Request::StopSending,
        12 => Request::ResetCounters,
        // The three steps of an update, so that some of them meet in the right order.
        13 => Request::BeginTable {
            length: image.len() as u16,
            crc,
        },
        14 => Request::WriteTable { offset: 0, bytes: image },
        15 => Request::ReadSymbolRate,
        16 => Request::WriteSymbolRate {
            millihertz: random.below(350_000) as u32,
        },
        17 => Request::ReadIntensityLimit,
        18 => Request::WriteIntensityLimit {
            most_mcd: random.below(3) as u32 * 500_000_001,
            led_diameter_um: random.below(3) as u32 * 500_001,
        },
        19 => Request::ReadCarrier,
        20 => Request::WriteCarrier {
            millihertz: random.below(350_000) as u32,
            cycles: random.below(40) as u16,
        },
        21 => Request::TestPanel {
            bits: random.number() & random.number(),
            share: random.number() as u8,
            time_ms: random.below(3) as u16,
        },
        22 => Request::ReadSensor,
        23 => Request::ReadLock,
        24 => Request::WriteLock {
            key: &bytes[..32 - random.below(2)],
            salt: random.number(),
        },
        25 => Request::RemoveLock,
        26 => Request::Permit {
            challenge: random.below(3) as u32,
            signature: &bytes[..64 - random.below(2)],
        },
        27 => Request::ReadKey,
        28 => Request::WriteKey {
            seed: Seed(&bytes[..32 - random.below(2)]),
            counter: random.number() as u32,
        },
        29 => Request::EraseKey,
        30 => Request::ReadProgramHash,
        _ => Request::CommitTable { crc },
    };
    let sequence = random.number() as u32;
    let mut place = [0; wire_length(REQUEST_FRAME_MAX)];
    wire.extend_from_slice(encode(Kind::Request, sequence, &request, &mut place).expect("it fits"));
}

/// Changes, drops, doubles or cuts bytes from `start` on.
fn mutate(random: &mut Random, start: usize, wire: &mut Vec<u8>) {
    let length = wire.len() - start;
    if length == 0 {
        return;
    }
    let place = start + random.below(length);
    match random.below(6) {
        0 | 1 => wire[place] ^= 1 << random.below(8),
        2 => wire[place] = random.number() as u8,
        3 => {
            wire.remove(place);
        }
        4 => {
            let byte = wire[place];
            wire.insert(place, byte);
        }
        _ => wire.truncate(place),
    }
}

/// The bytes between two zeros, when `byte` is the second of them and there are any.
pub fn contents(pending: &mut Vec<u8>, byte: u8) -> Option<Vec<u8>> {
    if byte != 0 {
        pending.push(byte);
        return None;
    }
    (!pending.is_empty()).then(|| core::mem::take(pending))
}

/// Whether these bytes are a request, whatever its version and body: by the description of the format alone.
pub fn is_whole_request(stuffed: &[u8]) -> bool {
    let Some(frame) = unstuff(stuffed) else {
        return false;
    };
    if frame.len() < 10 || frame.len() > REQUEST_FRAME_MAX {
        return false;
    }
    let (content, crc) = frame.split_at(frame.len() - 4);
    crc == crc32c(content).to_le_bytes() && content[1] == 1
}

/// COBS: each code byte is the distance to the next zero, or 255 for 254 bytes without one.
fn stuff(bytes: &[u8], out: &mut Vec<u8>) {
    let mut rest = bytes;
    loop {
        let run = rest.iter().take(254).take_while(|&&byte| byte != 0).count();
        out.push(run as u8 + 1);
        out.extend_from_slice(&rest[..run]);
        match rest.get(run) {
            None => return,
            Some(_) if run == 254 => rest = &rest[run..],
            Some(_) => rest = &rest[run + 1..],
        }
    }
}

fn unstuff(stuffed: &[u8]) -> Option<Vec<u8>> {
    let mut frame = Vec::with_capacity(stuffed.len());
    let mut rest = stuffed;
    while let Some((&code, after)) = rest.split_first() {
        let run = usize::from(code) - 1;
        frame.extend_from_slice(after.get(..run)?);
        rest = &after[run..];
        if code != 255 && !rest.is_empty() {
            frame.push(0);
        }
    }
    Some(frame)
}

/// CRC-32C, a bit at a time.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc: u32, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            crc >> 1 ^ if crc & 1 == 1 { 0x82f6_3b78 } else { 0 }
        })
    })
}
