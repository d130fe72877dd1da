//! The serial port's service, request by request, in the right order and in every wrong one.

mod bench;
mod flash;

use bench::Bench;
use fixed::types::{U1F31, U32F32};
use flash::Flash;
use link::framing::MESSAGE_MAX;
use link::intensity::IntensityLimit;
use link::l2a_table::L2aTable;
use link::l2a_table::image::IMAGE_MAX;
use link::panel::PanelFrame;
use link::serial::{
    ANSWER_FRAME_MAX, Answer, CHUNK_MAX, Faults, FrameReader, Kind, Measured, Refusal, Request, SCHEMA, SensorReading, VERSION, encode,
};
use link::symbol_rate::SymbolRate;
use link::waveform::{SymbolTiming, Waveform};
use tx_firmware::calibration::{BENCH, Calibration};
use tx_firmware::matrix::{Duty, LedMatrix, RecordingMatrix};
use tx_firmware::program::ProgramHash;
use tx_firmware::store::{Memory, Store};
use tx_firmware::transmitter::Transmitter;

fn table() -> L2aTable {
    let illuminances: Vec<f32> = (0..16).map(|n| 2_f32.powi(n)).collect();
    let intervals: Vec<f32> = (1..=8).map(|n| 0.25 * n as f32).collect();
    let values: Vec<f32> = (0..128).map(|n| 0.2 + 0.025 * n as f32).collect();
    L2aTable::new(&illuminances, &intervals, &values).expect("a table")
}

#[test]
fn it_says_who_it_is() {
    let hello = Bench::new().ask(&Request::Hello, |answer| match answer {
        Answer::Hello(hello) => (
            hello.schema,
            hello.firmware.to_owned(),
            hello.board.to_owned(),
            hello.chunk_max,
            hello.message_max,
        ),
        other => panic!("{other:?}"),
    });
    let (chunk_max, message_max) = (CHUNK_MAX as u16, MESSAGE_MAX as u16);
    assert_eq!(hello, (SCHEMA, "1.2.3".into(), "bench".into(), chunk_max, message_max));
}

/// What the board answers about its program.
fn program_hash(bench: &mut Bench) -> Result<ProgramHash, Refusal> {
    bench.ask(&Request::ReadProgramHash, |answer| match answer {
        Answer::ProgramHash { length, sha256 } => Ok(ProgramHash {
            length,
            sha256: sha256.try_into().expect("32 bytes"),
        }),
        Answer::Refused(refusal) => Err(refusal),
        other => panic!("{other:?}"),
    })
}

#[test]
fn it_says_which_program_it_runs() {
    // Of one block, of a block and a part of one, of whole blocks.
    for length in [1, 64, 1000, 1024] {
        let program: Vec<u8> = (0..length).map(|at: u32| ((at * at) >> 3) as u8).collect();
        let board_with = |program: &[u8]| {
            let mut flash = Flash::new();
            flash.bytes[8192..8192 + program.len()].copy_from_slice(program);
            let mut bench = Bench::new();
            let store = Store::new(flash, 0..8192).expect("a store");
            bench.store = store.beside_program(8192..8192 + program.len() as u32);
            bench
        };
        let mut bench = board_with(&program);
        let hash = ProgramHash::of(&program);
        for _ in 0..2 {
            assert_eq!(program_hash(&mut bench), Ok(hash), "{length} bytes");
        }
        assert_eq!(hash.length, length);
        // A save does not change the program.
        let crc = table().crc();
        bench.stage(table().image(), crc);
        bench.expect(&Request::CommitTable { crc }, &Answer::Committed { crc });
        assert_eq!(program_hash(&mut bench), Ok(hash), "{length} bytes");
        for at in [0, program.len() / 2, program.len() - 1] {
            let mut other = program.clone();
            other[at] ^= 1;
            assert_ne!(program_hash(&mut board_with(&other)), Ok(hash), "byte {at} of {length}");
        }
    }
}

#[test]
fn firmware_that_cannot_read_its_program_does_not_know_the_request() {
    assert_eq!(program_hash(&mut Bench::new()), Err(Refusal::Unknown));
    let mut bench = Bench::new();
    let beyond = flash::CAPACITY as u32;
    let store = Store::new(Flash::new(), 0..8192).expect("a store");
    bench.store = store.beside_program(beyond..beyond + 100);
    assert_eq!(program_hash(&mut bench), Err(Refusal::Unknown));
}

#[test]
fn a_table_that_is_written_and_committed_runs_is_stored_and_reads_back() {
    let mut bench = Bench::new();
    let table = table();
    let (image, crc) = (table.image(), table.crc());
    bench.stage(image, crc);
    assert_eq!(bench.transmitter.table(), &L2aTable::default());
    assert_eq!(bench.store.table(), Ok(None));

    bench.expect(&Request::CommitTable { crc }, &Answer::Committed { crc });
    assert_eq!(bench.transmitter.table(), &table);
    assert_eq!(bench.store.table(), Ok(Some(table.clone())));

    let mut read = Vec::new();
    loop {
        let offset = read.len() as u16;
        let part = bench.ask(&Request::ReadTable { offset }, |answer| match answer {
            Answer::Table(part) => {
                assert_eq!((part.length, part.crc, part.offset), (image.len() as u16, crc, offset));
                part.bytes.to_vec()
            }
            other => panic!("{other:?}"),
        });
        if part.is_empty() {
            break;
        }
        read.extend(part);
    }
    assert_eq!(read, image);
}

#[test]
fn every_request_may_be_repeated() {
    let mut bench = Bench::new();
    let table = table();
    let (image, crc) = (table.image(), table.crc());
    let length = image.len() as u16;
    for _ in 0..2 {
        bench.expect(&Request::BeginTable { length, crc }, &Answer::Staged { received: 0 });
    }
    for (index, bytes) in image.chunks(CHUNK_MAX).enumerate() {
        let offset = (index * CHUNK_MAX) as u16;
        let received = offset + bytes.len() as u16;
        for _ in 0..2 {
            bench.expect(&Request::WriteTable { offset, bytes }, &Answer::Staged { received });
        }
    }
    for _ in 0..3 {
        bench.expect(&Request::CommitTable { crc }, &Answer::Committed { crc });
    }
    for _ in 0..2 {
        bench.expect(&Request::RollBackTable, &Answer::Done);
    }
    assert_eq!(bench.transmitter.table(), &table);
}

#[test]
fn a_commit_that_is_repeated_says_whether_its_table_is_in_use_whatever_the_other_port_did() {
    let mut bench = Bench::new();
    let [first, second] = [2.0, 3.0].map(|l2a| L2aTable::new(&[1.0], &[1.0], &[l2a]).expect("a table"));
    let commit = |table: &L2aTable| Request::CommitTable { crc: table.crc() };
    let committed = |table: &L2aTable| Answer::Committed { crc: table.crc() };
    bench.stage(first.image(), first.crc());
    bench.expect(&commit(&first), &committed(&first));

    let port = std::mem::replace(&mut bench.service, Bench::<RecordingMatrix>::another_port());
    bench.expect(&commit(&first), &committed(&first));
    bench.stage(second.image(), second.crc());
    bench.expect(&commit(&second), &committed(&second));

    bench.service = port;
    bench.expect(&commit(&first), &Answer::Refused(Refusal::NotBegun));
    assert_eq!(bench.transmitter.table(), &second);
}

#[test]
fn a_table_out_of_order_is_refused_and_changes_nothing() {
    let mut bench = Bench::new();
    let table = table();
    let (image, crc) = (table.image(), table.crc());
    let length = image.len() as u16;
    let refused = Answer::Refused;
    let first = Request::WriteTable {
        offset: 0,
        bytes: &image[..100],
    };

    bench.expect(&first, &refused(Refusal::NotBegun));
    bench.expect(&Request::CommitTable { crc }, &refused(Refusal::NotBegun));
    for length in [0, IMAGE_MAX as u16 + 1, u16::MAX] {
        let most = IMAGE_MAX as u16;
        bench.expect(
            &Request::BeginTable { length, crc },
            &refused(Refusal::TableLength { length, most }),
        );
    }

    bench.expect(&Request::BeginTable { length, crc }, &Answer::Staged { received: 0 });
    bench.expect(&first, &Answer::Staged { received: 100 });
    for (offset, bytes) in [(101, &image[101..200]), (u16::MAX, &image[..100]), (100, image)] {
        bench.expect(&Request::WriteTable { offset, bytes }, &refused(Refusal::Offset { expected: 100 }));
    }
    bench.expect(
        &Request::CommitTable { crc },
        &refused(Refusal::Incomplete { received: 100, length }),
    );
    bench.expect(&Request::RollBackTable, &Answer::Done);
    bench.expect(&Request::CommitTable { crc }, &refused(Refusal::NotBegun));
    assert_eq!(bench.transmitter.table(), &L2aTable::default());
    assert_eq!(bench.store.table(), Ok(None));
}

#[test]
fn a_table_that_came_wrong_or_is_none_is_refused_whole() {
    let mut bench = Bench::new();
    let (mut image, crc) = (table().image().to_vec(), table().crc());
    image[200] ^= 1;
    bench.stage(&image, crc);
    let found = link::checksum::crc32c(&[&image]);
    let refusal = Refusal::TableCrc { found, expected: crc };
    bench.expect(&Request::CommitTable { crc }, &Answer::Refused(refusal));
    // Announced as it came, but committed as another one.
    bench.stage(&image, found);
    bench.expect(&Request::CommitTable { crc }, &Answer::Refused(refusal));

    // The last L2A becomes 5.
    let mut image = table().image().to_vec();
    let last = image.len() - 1;
    image[last] = 0xa0;
    let crc = link::checksum::crc32c(&[&image]);
    bench.stage(&image, crc);
    bench.expect(&Request::CommitTable { crc }, &Answer::Refused(Refusal::TableInvalid));
    assert_eq!(bench.transmitter.table(), &L2aTable::default());
    assert_eq!(bench.store.table(), Ok(None));
}

#[test]
fn what_was_missing_is_no_fault_any_more_once_it_is_written() {
    let mut bench = Bench::new();
    let missing = Faults::NO_TABLE.union(Faults::NO_CALIBRATION);
    bench.transmitter.set_faults(missing, true);
    let crc = table().crc();
    bench.stage(table().image(), crc);
    bench.expect(&Request::CommitTable { crc }, &Answer::Committed { crc });
    assert_eq!(bench.transmitter.faults(), Faults::NO_CALIBRATION);
    bench.expect(&Request::WriteCalibration(BENCH), &Answer::Done);
    assert_eq!(bench.transmitter.faults(), Faults::empty());
}

#[test]
fn a_table_that_cannot_be_stored_does_not_run() {
    let mut bench = Bench::new();
    let dead = flash::Flash {
        power: flash::Power::For(0),
        ..flash::Flash::new()
    };
    bench.store = tx_firmware::store::Store::new(dead, 0..8192).expect("a store");
    let crc = table().crc();
    bench.stage(table().image(), crc);
    bench.expect(&Request::CommitTable { crc }, &Answer::Refused(Refusal::Store));
    assert_eq!(bench.transmitter.table(), &L2aTable::default());
    bench.expect(&Request::WriteCalibration(BENCH), &Answer::Refused(Refusal::Store));
    let millihertz = 27_000;
    bench.expect(&Request::WriteSymbolRate { millihertz }, &Answer::Refused(Refusal::Store));
    let cycles = 54;
    bench.expect(&Request::WriteCarrier { millihertz, cycles }, &Answer::Refused(Refusal::Store));
    assert_eq!(bench.transmitter.timing(), SymbolTiming::default());
}

/// It may be locked.
#[cfg(feature = "signing")]
#[test]
fn a_store_that_cannot_be_read_permits_no_change() {
    let mut bench = Bench::new();
    let dead = flash::Flash {
        power: flash::Power::Gone,
        ..flash::Flash::new()
    };
    bench.store = tx_firmware::store::Store::new(dead, 0..8192).expect("a store");
    for request in [Request::StopSending, Request::ResetCounters, Request::ReadLock] {
        bench.expect(&request, &Answer::Refused(Refusal::Store));
    }
    assert!(!bench.ask(&Request::Status, |answer| matches!(answer, Answer::Refused(_))));
}

#[test]
fn a_test_panel_is_shown_if_it_is_no_brighter_than_a_message() {
    let mut bench = Bench::new();
    let test = |bits, time_ms| Request::TestPanel { bits, share: 255, time_ms };
    for (bits, on) in [(u64::MAX, 64), (0x1_ffff_ffff, 33)] {
        bench.expect(&test(bits, 1000), &Answer::Refused(Refusal::TestPanel { on, most: 32 }));
        assert_ne!(bench.transmitter.tick(), Ok(PanelFrame::from_bits(bits)));
    }
    for bits in [0, 1 << 63, 0xffff_ffff, 0xaa55_aa55_aa55_aa55] {
        bench.expect(&test(bits, 1000), &Answer::Done);
        assert_eq!(bench.transmitter.tick(), Ok(PanelFrame::from_bits(bits)));
    }
    bench.expect(&test(0, 0), &Answer::Done);
    assert_ne!(bench.transmitter.tick(), Ok(PanelFrame::default()));
    let none = SensorReading::None;
    let sensor = Answer::Sensor {
        operating: none,
        cross_check: none,
    };
    bench.expect(&Request::ReadSensor, &sensor);
}

#[test]
fn a_symbol_rate_is_checked_stored_and_read_back() {
    let mut bench = Bench::new();
    let rate = |millihertz| Answer::SymbolRate { millihertz };
    bench.expect(&Request::ReadSymbolRate, &rate(90_000));
    assert_eq!(bench.store.timing(), Ok(None));
    for millihertz in [27_000, 22_500, 9_000, 300_000, 300_000] {
        bench.expect(&Request::WriteSymbolRate { millihertz }, &rate(millihertz));
        bench.expect(&Request::ReadSymbolRate, &rate(millihertz));
        let stored = bench.store.timing().expect("readable");
        assert_eq!(stored, Some(bench.transmitter.timing()));
    }
    let (least, most) = (9_000, 300_000);
    for millihertz in [0, 8_999, 300_001, u32::MAX] {
        let refusal = Refusal::SymbolRate { millihertz, least, most };
        bench.expect(&Request::WriteSymbolRate { millihertz }, &Answer::Refused(refusal));
    }
    bench.expect(&Request::ReadSymbolRate, &rate(300_000));
}

#[test]
fn a_carrier_is_checked_stored_with_its_rate_and_read_back() {
    let mut bench = Bench::new();
    let carrier = |millihertz, cycles| Answer::Carrier { millihertz, cycles };
    let write = |millihertz, cycles| Request::WriteCarrier { millihertz, cycles };
    bench.expect(&Request::ReadCarrier, &carrier(90_000, 0));
    for (millihertz, cycles) in [
        (90_000, 16),
        (27_000, 54),
        (9_000, 333),
        (100_000, 2),
        (300_000, 0),
        (300_000, 10),
        (90_000, 16),
    ] {
        bench.expect(&write(millihertz, cycles), &carrier(millihertz, cycles));
        bench.expect(&Request::ReadCarrier, &carrier(millihertz, cycles));
        bench.expect(&Request::ReadSymbolRate, &Answer::SymbolRate { millihertz });
        let stored = bench.store.timing().expect("readable");
        assert_eq!(stored, Some(bench.transmitter.timing()));
    }
    for (millihertz, cycles) in [
        (90_000, 1),
        (90_000, 34),
        (90_000, 2),
        (9_000, 334),
        (300_000, 11),
        (90_000, u16::MAX),
    ] {
        let refusal = Refusal::Carrier { millihertz, cycles };
        bench.expect(&write(millihertz, cycles), &Answer::Refused(refusal));
    }
    let (least, most) = (9_000, 300_000);
    let refusal = Refusal::SymbolRate {
        millihertz: 8_999,
        least,
        most,
    };
    bench.expect(&write(8_999, 16), &Answer::Refused(refusal));
    // Another rate alone keeps the carrier, and has to fit it.
    let (least, most) = (12_500, 187_500);
    for millihertz in [12_499, 187_501] {
        let refusal = Refusal::SymbolRate { millihertz, least, most };
        bench.expect(&Request::WriteSymbolRate { millihertz }, &Answer::Refused(refusal));
        assert!(refusal.to_string().contains("outside 12.5 to 187.5"), "{refusal}");
    }
    bench.expect(&Request::ReadCarrier, &carrier(90_000, 16));
    let millihertz = 187_500;
    bench.expect(&Request::WriteSymbolRate { millihertz }, &Answer::SymbolRate { millihertz });
    bench.expect(&Request::ReadCarrier, &carrier(187_500, 16));
    assert_eq!(bench.store.timing(), Ok(Some(bench.transmitter.timing())));
}

/// LEDs that are lit row by row.
#[derive(Default)]
struct Scanned(RecordingMatrix);

impl LedMatrix for Scanned {
    type Error = <RecordingMatrix as LedMatrix>::Error;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Self::Error> {
        self.0.show(panel)
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Self::Error> {
        self.0.set_duty(duty)
    }
}

#[test]
fn leds_without_a_latch_show_no_carrier() {
    let mut bench = Bench::of(Scanned::default());
    let still = Answer::Carrier {
        millihertz: 27_000,
        cycles: 0,
    };
    let write = |cycles| Request::WriteCarrier {
        millihertz: 27_000,
        cycles,
    };
    bench.expect(&write(0), &still);
    bench.expect(&write(54), &Answer::Refused(Refusal::NoLatch));
    bench.expect(&Request::ReadCarrier, &still);
    assert_eq!(bench.store.timing(), Ok(Some(bench.transmitter.timing())));
    assert!(Refusal::NoLatch.to_string().contains("MAX7219"));
}

#[test]
fn a_board_that_stored_no_timing_begins_with_a_carrier_if_its_leds_show_one() {
    let mut bench = Bench::new();
    let typical = Calibration::new(BENCH).expect("possible values");
    let mut begins = |stored: Option<SymbolTiming>| {
        if let Some(timing) = stored {
            bench.store.save_timing(timing).expect("room");
        }
        let start = bench.store.remembered::<RecordingMatrix>(typical);
        bench.transmitter = Transmitter::from_store(RecordingMatrix::default(), start);
        let timing = bench.transmitter.timing();
        let (millihertz, cycles) = (timing.rate().millihertz(), timing.waveform().cycles());
        bench.expect(&Request::ReadCarrier, &Answer::Carrier { millihertz, cycles });
        [timing, bench.store.remembered::<Scanned>(typical).timing]
    };
    let still = SymbolTiming::still(SymbolRate::DEFAULT);
    assert_eq!(begins(None), [SymbolTiming::CARRIER, still]);
    // What is stored applies, even if it is another driver's default.
    assert_eq!(begins(Some(still)), [still; 2]);
    let slow = SymbolRate::from_millihertz(27_000).expect("a rate");
    let carrier = SymbolTiming::new(slow, Waveform::new(54).expect("a carrier")).expect("a carrier");
    assert_eq!(begins(Some(carrier)), [carrier, SymbolTiming::still(slow)]);
}

#[test]
fn an_intensity_limit_is_checked_stored_read_back_and_outlives_calibrations() {
    let mut bench = Bench::new();
    let limit = |most_mcd, led_diameter_um| Answer::IntensityLimit { most_mcd, led_diameter_um };
    let write = |most_mcd, led_diameter_um| Request::WriteIntensityLimit { most_mcd, led_diameter_um };
    bench.expect(&Request::ReadIntensityLimit, &limit(0, 0));
    bench.expect(&write(100_000, 30_000), &limit(100_000, 30_000));
    bench.expect(&Request::WriteCalibration(BENCH), &Answer::Done);
    bench.expect(&Request::ReadIntensityLimit, &limit(100_000, 30_000));
    let kept = IntensityLimit::new(Some(100_000), 30_000);
    assert_eq!(bench.store.intensity_limit(), Ok(kept.ok()));
    for (most_mcd, led_diameter_um) in [(0, 30_000), (1000, 0), (u32::MAX, 30_000)] {
        let refusal = Refusal::IntensityLimit { most_mcd, led_diameter_um };
        bench.expect(&write(most_mcd, led_diameter_um), &Answer::Refused(refusal));
    }
    bench.expect(&Request::ReadIntensityLimit, &limit(100_000, 30_000));
    bench.expect(&write(0, 0), &limit(0, 0));
    assert_eq!(bench.store.intensity_limit(), Ok(None));
}

#[test]
fn a_calibration_is_checked_stored_and_read_back() {
    let mut bench = Bench::new();
    bench.expect(&Request::ReadCalibration, &Answer::Calibration(BENCH));
    let brighter = Measured {
        luminance_full_cd_m2: U32F32::from_num(12_000),
        ..BENCH
    };
    bench.expect(&Request::WriteCalibration(brighter), &Answer::Done);
    bench.expect(&Request::ReadCalibration, &Answer::Calibration(brighter));
    let stored = bench.store.calibration().expect("readable").expect("stored");
    assert_eq!(stored.measured(), &brighter);

    let impossible = [
        Measured {
            luminance_full_cd_m2: U32F32::ZERO,
            ..BENCH
        },
        Measured {
            shortest_pulse_ns: BENCH.pwm_period_ns + 1,
            ..BENCH
        },
        Measured { pwm_period_ns: 1, ..BENCH },
        Measured {
            reflectance: U1F31::ZERO,
            ..BENCH
        },
        Measured {
            interval: link::l2a_table::Interval::ZERO,
            ..BENCH
        },
        Measured {
            sensor_gain: fixed::types::U12F20::ZERO,
            ..BENCH
        },
        Measured {
            low_current_share: U1F31::ZERO,
            ..BENCH
        },
    ];
    for (value, measured) in (0..).zip(impossible) {
        let refusal = Refusal::Calibration { value };
        bench.expect(&Request::WriteCalibration(measured), &Answer::Refused(refusal));
    }
    bench.expect(&Request::ReadCalibration, &Answer::Calibration(brighter));
}

#[test]
fn a_message_is_shown_once_however_often_its_request_is_repeated() {
    let mut bench = Bench::new();
    let send = Request::Send {
        repeats: Some(1),
        message: b"ice",
    };
    bench.expect(&send, &Answer::Done);
    let mut shown = 0;
    while bench.transmitter.is_sending() {
        bench.transmitter.tick().expect("no matrix fails here");
        shown += 1;
    }
    assert_eq!(shown, 5);
    assert!(bench.repeat(&send, |answer| answer == Answer::Done));
    assert!(!bench.transmitter.is_sending());
    bench.expect(&send, &Answer::Done);
    assert!(bench.transmitter.is_sending());
    bench.expect(&Request::StopSending, &Answer::Done);
    assert!(!bench.transmitter.is_sending());
}

#[test]
fn impossible_messages_are_refused_and_the_last_one_goes_on() {
    let mut bench = Bench::new();
    bench.expect(
        &Request::Send {
            repeats: None,
            message: b"goes on",
        },
        &Answer::Done,
    );
    let (length, most) = (0, MESSAGE_MAX as u16);
    bench.expect(
        &Request::Send {
            repeats: None,
            message: b"",
        },
        &Answer::Refused(Refusal::MessageLength { length, most }),
    );
    assert!(bench.transmitter.is_sending());
    let longest = [0x55; MESSAGE_MAX];
    bench.expect(
        &Request::Send {
            repeats: Some(u32::MAX),
            message: &longest,
        },
        &Answer::Done,
    );
}

#[test]
fn another_version_is_told_which_one_is_spoken_here() {
    let mut bench = Bench::new();
    // A frame of version 9 whose body is unknown: only its ends are as in every version.
    let content = [9, Kind::Request as u8, 4, 3, 2, 1, 0xee, 0xef];
    let mut frame = content.to_vec();
    frame.extend(link::checksum::crc32c(&[&content]).to_le_bytes());
    // No byte of it is 0, so COBS puts its length + 1 before it.
    assert!(!frame.contains(&0));
    let mut wire = vec![0, frame.len() as u8 + 1];
    wire.extend(frame);
    wire.push(0);
    let answer = bench.exchange(&wire);
    assert!(<Bench>::answer(&answer, 0x0102_0304, |answer| {
        answer == Answer::Refused(Refusal::Version { speaks: VERSION })
    }));
}

#[test]
fn echoes_garbage_and_cut_frames_get_no_answer() {
    let mut bench = Bench::new();
    let mut wire = [0; 64];
    let echo = encode(Kind::Answer, 1, &Answer::Done, &mut wire).expect("it fits");
    assert!(bench.exchange(echo).is_empty());
    assert!(bench.exchange(b"\0AT+GMM\r\n\0").is_empty());
    assert!(bench.exchange(&vec![0x41; 100_000]).is_empty());
    assert!(bench.exchange(&[0]).is_empty());
    let mut wire = [0; 64];
    let hello = encode(Kind::Request, 1, &Request::Hello, &mut wire).expect("it fits").to_vec();
    for cut in 0..hello.len() - 1 {
        assert!(bench.exchange(&hello[..cut]).is_empty());
    }
    let (bad, frames) = bench.ask(&Request::Status, |answer| match answer {
        Answer::Status(status) => (status.counters.bad_frames, status.counters.frames),
        other => panic!("{other:?}"),
    });
    assert!(bad >= 2 && frames == 2, "{bad} bad frames, {frames} good ones");
    bench.expect(&Request::ResetCounters, &Answer::Done);
}

#[test]
fn no_answer_is_longer_than_its_buffer() {
    let mut bench = Bench::new();
    let crc = table().crc();
    bench.stage(table().image(), crc);
    bench.expect(&Request::CommitTable { crc }, &Answer::Committed { crc });
    bench.sequence = u32::MAX - 5;
    for request in [
        Request::ReadTable { offset: 128 },
        Request::Status,
        Request::ReadCalibration,
        Request::ReadSymbolRate,
        Request::ReadIntensityLimit,
    ] {
        assert!(bench.ask(&request, |answer| !matches!(answer, Answer::Refused(_))));
    }
    let mut reader = FrameReader::<ANSWER_FRAME_MAX>::new();
    assert!(reader.push(0).is_none());
}
