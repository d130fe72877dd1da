//! The layout and the examples in `docs/serial.md` and `docs/serial-vectors.txt` must equal those of the code, byte for byte.

mod layout;

use fixed::types::{U0F32, U1F31, U12F20, U32F32};
use link::l2a_table::{Illuminance, Interval, L2a, L2aTable};
use link::serial::{
    Answer, Counters, Faults, Hello, Kind, Light, Limit, Measured, REQUEST_FRAME_MAX, Refusal, Request, SCHEMA, Seed, SensorReading,
    Status, TablePart, encode, wire_length,
};

const DOCUMENT: &str = include_str!("../../../docs/serial.md");
/// All examples.
const VECTORS: &str = include_str!("../../../docs/serial-vectors.txt");
/// The number of examples that the document itself shows, from the first on.
const SHOWN: usize = 4;

const MEASURED: Measured = Measured {
    luminance_full_cd_m2: U32F32::lit("8000"),
    shortest_pulse_ns: 100,
    pwm_period_ns: 20_000,
    reflectance: U1F31::lit("0.4"),
    interval: Interval::lit("1"),
    sensor_gain: U12F20::lit("1"),
    low_current_share: U1F31::lit("1"),
};

const STATUS: Status = Status {
    uptime_s: 3600,
    light: Light::Measured,
    illuminance_lx: Some(Illuminance::lit("2000")),
    l2a: L2a::lit("2.05"),
    luminance_cd_m2: U32F32::lit("1640"),
    duty: U0F32::lit("0.205"),
    limited: Some(Limit::Floor),
    faults: Faults::NO_CALIBRATION,
    table_crc: 0x0123_4567,
    sending: true,
    counters: Counters {
        frames: 300,
        bad_frames: 2,
        refusals: 1,
        symbols: 324_000,
        lost_symbols: 0,
        readings: 36_000,
        missed_readings: 5,
    },
};

/// SHA-256 of "abc" (FIPS 180-4).
const ABC_SHA256: [u8; 32] = [
    0xba, 0x78, 0x16, 0xbf, 0x8f, 0x01, 0xcf, 0xea, 0x41, 0x41, 0x40, 0xde, 0x5d, 0xae, 0x22, 0x23, 0xb0, 0x03, 0x61, 0xa3, 0x96, 0x17,
    0x7a, 0x9c, 0xb4, 0x10, 0xff, 0x61, 0xf2, 0x00, 0x15, 0xad,
];

fn hex(bytes: &[u8]) -> String {
    let lines: Vec<String> = bytes
        .chunks(24)
        .map(|line| line.iter().map(|byte| format!(" {byte:02x}")).collect())
        .collect();
    lines.join("\n        ")
}

/// Decodes COBS according to its description.
fn unstuffed(wire: &[u8]) -> Vec<u8> {
    let mut frame = Vec::new();
    let mut rest = &wire[1..wire.len() - 1];
    while let Some((&code, after)) = rest.split_first() {
        let (run, next) = after.split_at(usize::from(code) - 1);
        frame.extend(run);
        if code != 255 && !next.is_empty() {
            frame.push(0);
        }
        rest = next;
    }
    frame
}

/// An example in the document's format.
fn example(kind: Kind, sequence: u32, name: &str, message: &impl serde::Serialize) -> String {
    let mut place = [0; wire_length(REQUEST_FRAME_MAX)];
    let wire = encode(kind, sequence, message, &mut place).expect("it fits");
    let way = match kind {
        Kind::Request => "request",
        Kind::Answer => "answer",
    };
    format!(
        "{way} {sequence}: {name}\n  frame {}\n  wire  {}\n",
        hex(&unstuffed(wire)),
        hex(wire)
    )
}

fn examples() -> Vec<String> {
    let table = L2aTable::new(&[1000.0], &[0.5, 1.0, 1.5, 2.0], &[1.35, 2.05, 2.95, 3.9]).expect("a table");
    let (image, crc) = (table.image(), table.crc());
    let length = image.len() as u16;
    let asked = |sequence, name: &str, request: Request<'_>| example(Kind::Request, sequence, name, &request);
    let told = |sequence, name: &str, answer: Answer<'_>| example(Kind::Answer, sequence, name, &answer);
    vec![
        asked(1, "hello", Request::Hello),
        told(
            1,
            "hello, firmware 1.0.0, board pico, chunks of 128, messages of 1024",
            Answer::Hello(Hello {
                schema: SCHEMA,
                firmware: "1.0.0",
                board: "pico",
                chunk_max: 128,
                message_max: 1024,
            }),
        ),
        asked(2, "status", Request::Status),
        told(
            2,
            "status, 3600 s, 2000 lx, L2A 2.05, 1640 cd/m2, duty 0.205, at the floor, no calibration",
            Answer::Status(STATUS),
        ),
        asked(3, "begin table, 24 bytes", Request::BeginTable { length, crc }),
        told(3, "staged, 0 bytes", Answer::Staged { received: 0 }),
        asked(4, "write table, from byte 0", Request::WriteTable { offset: 0, bytes: image }),
        told(4, "staged, 24 bytes", Answer::Staged { received: length }),
        asked(5, "commit table", Request::CommitTable { crc }),
        told(5, "committed", Answer::Committed { crc }),
        asked(6, "read table, from byte 0", Request::ReadTable { offset: 0 }),
        told(
            6,
            "table, all of it",
            Answer::Table(TablePart {
                length,
                crc,
                offset: 0,
                bytes: image,
            }),
        ),
        asked(7, "roll back table", Request::RollBackTable),
        told(7, "done", Answer::Done),
        asked(8, "read calibration", Request::ReadCalibration),
        told(
            8,
            "calibration, 8000 cd/m2, 100 ns, 20000 ns, R 0.4, interval 1, gain 1, low current 1",
            Answer::Calibration(MEASURED),
        ),
        asked(9, "write calibration, the same", Request::WriteCalibration(MEASURED)),
        asked(
            10,
            "send \"ice ahead\" for ever",
            Request::Send {
                repeats: None,
                message: b"ice ahead",
            },
        ),
        asked(
            11,
            "send \"ice ahead\" 300 times",
            Request::Send {
                repeats: Some(300),
                message: b"ice ahead",
            },
        ),
        asked(12, "stop sending", Request::StopSending),
        asked(13, "reset counters", Request::ResetCounters),
        told(14, "refused, not begun", Answer::Refused(Refusal::NotBegun)),
        told(
            15,
            "refused, offset, expected 128",
            Answer::Refused(Refusal::Offset { expected: 128 }),
        ),
        asked(16, "read symbol rate", Request::ReadSymbolRate),
        told(16, "symbol rate, 90 a second", Answer::SymbolRate { millihertz: 90_000 }),
        asked(
            17,
            "write symbol rate, 22.5 a second",
            Request::WriteSymbolRate { millihertz: 22_500 },
        ),
        told(17, "symbol rate, 22.5 a second", Answer::SymbolRate { millihertz: 22_500 }),
        asked(18, "read intensity limit", Request::ReadIntensityLimit),
        told(
            18,
            "intensity limit, none",
            Answer::IntensityLimit {
                most_mcd: 0,
                led_diameter_um: 0,
            },
        ),
        asked(
            19,
            "write intensity limit, 100 cd from LEDs of 30 mm",
            Request::WriteIntensityLimit {
                most_mcd: 100_000,
                led_diameter_um: 30_000,
            },
        ),
        told(
            19,
            "intensity limit, 100 cd from LEDs of 30 mm",
            Answer::IntensityLimit {
                most_mcd: 100_000,
                led_diameter_um: 30_000,
            },
        ),
        asked(20, "read carrier", Request::ReadCarrier),
        told(
            20,
            "carrier, none at 90 symbols a second",
            Answer::Carrier {
                millihertz: 90_000,
                cycles: 0,
            },
        ),
        asked(
            21,
            "write carrier, 16 cycles a symbol at 90 symbols a second",
            Request::WriteCarrier {
                millihertz: 90_000,
                cycles: 16,
            },
        ),
        told(
            21,
            "carrier, 16 cycles a symbol at 90 symbols a second",
            Answer::Carrier {
                millihertz: 90_000,
                cycles: 16,
            },
        ),
        told(
            22,
            "refused, carrier of 34 cycles at 90 symbols a second",
            Answer::Refused(Refusal::Carrier {
                millihertz: 90_000,
                cycles: 34,
            }),
        ),
        asked(
            23,
            "write key, a seed of 32 bytes that are 1 to 32, counter 1760000000",
            Request::WriteKey {
                seed: Seed(&core::array::from_fn::<u8, 32, _>(|byte| byte as u8 + 1)),
                counter: 1_760_000_000,
            },
        ),
        told(
            23,
            "key 79b5562e, counter 1760000000",
            Answer::Key {
                id: Some(0x79b5_562e),
                counter: 1_760_000_000,
            },
        ),
        asked(24, "read key", Request::ReadKey),
        asked(25, "erase key", Request::EraseKey),
        told(25, "key, none", Answer::Key { id: None, counter: 0 }),
        told(26, "refused, no signing", Answer::Refused(Refusal::NoSigning)),
        asked(
            27,
            "test panel, the top row at half of the light for 1.5 s",
            Request::TestPanel {
                bits: 0xff,
                share: 128,
                time_ms: 1500,
            },
        ),
        told(27, "done", Answer::Done),
        asked(28, "read sensor", Request::ReadSensor),
        told(
            28,
            "sensor, 2000 lx, saturated in the other range",
            Answer::Sensor {
                operating: SensorReading::Light(Illuminance::lit("2000")),
                cross_check: SensorReading::Saturated,
            },
        ),
        told(
            29,
            "refused, test panel with 33 LEDs On",
            Answer::Refused(Refusal::TestPanel { on: 33, most: 32 }),
        ),
        asked(30, "read lock", Request::ReadLock),
        told(
            30,
            "lock, salt 1, challenge 7, no wait",
            Answer::Lock {
                salt: Some(1),
                challenge: 7,
                wait_s: 0,
            },
        ),
        told(31, "refused, locked", Answer::Refused(Refusal::Locked)),
        told(32, "refused, wait 600 s", Answer::Refused(Refusal::Wait { wait_s: 600 })),
        asked(33, "read program hash", Request::ReadProgramHash),
        told(
            33,
            "program hash, 3 bytes, \"abc\"",
            Answer::ProgramHash {
                length: 3,
                sha256: &ABC_SHA256,
            },
        ),
    ]
}

#[test]
fn the_document_shows_what_is_sent() {
    let examples = examples();
    assert_eq!(
        VECTORS,
        examples.concat(),
        "docs/serial-vectors.txt on the left, the code on the right"
    );
    for example in &examples[..SHOWN] {
        assert!(DOCUMENT.contains(example), "docs/serial.md lacks this example:\n\n{example}");
    }
}

#[test]
fn the_document_shows_the_layout_of_the_messages() {
    let meant = [layout::by_the_types(), layout::added_by_the_types()];
    for (shown, meant) in layout::shown(DOCUMENT).map(layout::words).iter().zip(&meant) {
        for (shown, meant) in shown.iter().zip(meant) {
            assert_eq!(shown, meant, "docs/serial.md on the left, the types on the right");
        }
        assert_eq!(shown.len(), meant.len());
    }
}

#[test]
fn the_schema_is_the_checksum_of_the_layout_shown() {
    let schema = link::checksum::crc32c(&[layout::shown(DOCUMENT)[0].as_bytes()]);
    assert_eq!(
        SCHEMA, schema,
        "messages that every program knows have changed: older ones could no longer be talked to"
    );
    assert!(
        DOCUMENT.contains(&format!("{SCHEMA:08x}")),
        "docs/serial.md names another schema than {SCHEMA:08x}"
    );
}
