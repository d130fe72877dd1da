//! Size and time of the image on the emulated Cortex-M0+: the numbers in the table of `docs/hardware/reference.md`.

use std::io::Write as _;
use std::os::unix::net::UnixStream;
use std::path::Path;

use link::framing::MESSAGE_MAX;
use link::serial::{Kind, REQUEST_FRAME_MAX, Request, encode, wire_length};

use crate::emulator::{Emulator, Event, Fault};
use crate::image::Programs;
use crate::panel::{FULL_CD_M2, REFLECTANCE, Record, l2a};
use vocc_tests::firmware::{Size, say, size};

const FLASH_MAX: u32 = 64 * 1024;
/// With signatures, and their verification for the lock.
const SIGNING_FLASH_MAX: u32 = 104 * 1024;
const RAM_MAX: u32 = 24 * 1024;

/// Time after which the board listens to its serial port.
const STARTED_MS: u32 = 100;
/// Number of symbols over which the latch is timed.
const SYMBOLS: u32 = 10_000;
/// Maximum deviation of the symbol clock, in ns.
pub const JITTER_MAX_NS: f64 = 1_000.0;
const SYMBOL_RATE_HZ: f64 = 90.0;
/// Maximum time with interrupts off, in cycles: a tenth of the 2.8 ms in which UART 0 fills its buffer.
const INTERRUPTS_OFF_MAX: u64 = 35_000;
/// Maximum relative error of the symbol rate, without the crystal's.
const RATE_ERROR_MAX: f64 = 1e-5;

/// Time within which a panel must be dim after the light has gone, in ms.
const DIMMED_MS: u64 = 1_000;

/// Flash and static RAM are within their limits.
pub fn it_is_small(programs: &Programs, _: &Path) {
    for (image, flash_max, name) in [
        (&programs.image, SIGNING_FLASH_MAX, "as it is flashed"),
        (&programs.unsigned, FLASH_MAX, "without `signing`"),
    ] {
        let elf = std::fs::read(image).expect("the image is built");
        let Size { flash, ram } = size(&elf);
        say(&format!(
            "{name}: flash {flash} bytes of {flash_max}, static RAM {ram} bytes of {RAM_MAX}"
        ));
        assert!(flash <= flash_max && ram <= RAM_MAX);
    }
}

/// The latch keeps its time whatever arrives over the serial port. The durations of interrupts and functions are printed.
pub fn the_latch_keeps_time_under_serial_load(programs: &Programs, folder: &Path) {
    let names = ["irq12", "take_reading", "3fecNtB5_5Block6encode", "interrupts off"];
    let options: Vec<&str> = names.iter().flat_map(|name| ["--time", name]).collect();
    let mut board = Emulator::power_up_still(programs, folder, &options);
    let mut port = UnixStream::connect(board.socket()).expect("the emulator listens");
    drain(port.try_clone().expect("the socket can be shared"));
    let mut record = Record::default();
    record.extend(&board.run_ms(STARTED_MS));
    port.write_all(&message()).expect("the board takes it");
    let mut last = Event::default();
    let mut sequence = 1;
    let mut lux = 60.0;
    while record.symbols.len() <= SYMBOLS as usize {
        // As much as the line can carry in the time.
        for _ in 0..20 {
            port.write_all(&requests(&mut sequence)).expect("the board takes it");
        }
        board.light(lux, Fault::None);
        lux = if lux > 10_000.0 { 60.0 } else { lux * 1.7 };
        let events = board.run_ms(1_000);
        record.extend(&events);
        last = events.into_iter().next_back().unwrap_or_default();
    }
    let symbols = &record.symbols;
    let (first, last_one) = (symbols[0].ns as f64, symbols[symbols.len() - 1].ns as f64);
    let symbol_ns = (last_one - first) / (symbols.len() - 1) as f64;
    let strays = symbols.iter().zip(0..).map(|(symbol, index)| {
        let due = first + f64::from(index) * symbol_ns;
        (symbol.ns as f64 - due).abs()
    });
    let jitter_ns = strays.fold(0.0, f64::max);
    let rate_error = 1e9 / symbol_ns / SYMBOL_RATE_HZ - 1.0;
    say(&format!(
        "latch: at most {jitter_ns:.0} ns early or late in {} symbols, at 90 a second {:+.1} ppm",
        symbols.len(),
        1e6 * rate_error
    ));
    assert!(jitter_ns <= JITTER_MAX_NS && rate_error.abs() <= RATE_ERROR_MAX);
    let cycles = last.cycles.expect("cycles were counted");
    for (name, what) in names.into_iter().zip([
        "symbol interrupt",
        "dimming update, sensor reading to duty",
        "LDPC-encoded block",
        "interrupts off",
    ]) {
        let tally = |key: &str| cycles[name][key].as_u64().expect("it ran");
        say(&format!(
            "{what}: {} to {} cycles, {} on average",
            tally("least"),
            tally("most"),
            tally("mean")
        ));
    }
    assert!(cycles["interrupts off"]["most"].as_u64() <= Some(INTERRUPTS_OFF_MAX));
}

/// The duty follows a step of the light: under a bridge within a second. The delay is printed.
pub fn the_duty_follows_a_step_of_the_light(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up(programs, folder, &[]);
    let mut record = Record::default();
    board.light(10_000.0, Fault::None);
    record.extend(&board.run_ms(1_000));
    for (from, to, within_ms) in [(10_000.0, 100.0, DIMMED_MS), (100.0, 10_000.0, 10_000)] {
        board.light(to, Fault::None);
        let started = record.symbols.last().expect("symbols are shown").ns;
        record.extend(&board.run_ms(12_000));
        let wanted = (l2a(to) * to * REFLECTANCE).min(FULL_CD_M2);
        let after_ms = |tolerance: f64| {
            let settled = record
                .pulses
                .iter()
                .rev()
                .take_while(|(ns, pulses)| *ns > started && (pulses.luminance_cd_m2() / wanted).ln().abs() <= tolerance.ln());
            settled.last().map_or(u64::MAX, |(ns, _)| (ns - started) / 1_000_000)
        };
        let first = record
            .pulses
            .iter()
            .find(|(ns, _)| *ns > started)
            .map_or(u64::MAX, |(ns, _)| (ns - started) / 1_000_000);
        let (half, near) = (after_ms(2.0), after_ms(1.1));
        say(&format!(
            "{from} to {to} lx: first change of the duty after {first} ms, within a factor of 2 after {half} ms, within 10 % \
             after {near} ms"
        ));
        assert!(half <= within_ms);
    }
}

/// A message of the maximum length, shown indefinitely.
fn message() -> Vec<u8> {
    let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
    let message = &[b'm'; MESSAGE_MAX];
    let request = Request::Send { repeats: None, message };
    encode(Kind::Request, 0, &request, &mut wire).expect("it fits").to_vec()
}

/// Valid requests, garbage and half a frame.
fn requests(sequence: &mut u32) -> Vec<u8> {
    let mut bytes = vec![];
    let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
    for request in [Request::Status, Request::Hello, Request::ReadTable { offset: 0 }] {
        *sequence += 1;
        let request = encode(Kind::Request, *sequence, &request, &mut wire).expect("it fits");
        bytes.extend_from_slice(request);
    }
    bytes.extend_from_slice(&[0x55, 0xaa, 0x17, 0, 0, 3]);
    bytes
}

/// Answers are read and dropped.
fn drain(mut port: UnixStream) {
    std::thread::spawn(move || std::io::copy(&mut port, &mut std::io::sink()));
}
