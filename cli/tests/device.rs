//! `vocc` and a transmitter, which is the firmware's own service, at the two ends of a pseudo-terminal.
#![cfg(unix)]

mod common;
mod fake;

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use common::{json, text, vocc};
use fake::Fake;
use link::intensity::IntensityLimit;
use link::serial::{Answer, FrameReader, Kind, REQUEST_FRAME_MAX, Refusal, Request, encode};
use link::symbol_rate::SymbolRate;
use link::waveform::SymbolTiming;
use serde_json::{Value, json};
use serialport::{SerialPort, TTYPort};
use tx_firmware::program::ProgramHash;
use tx_firmware::store::StoreError;

/// A transmitter at a pseudo-terminal, running until it is dropped.
struct Board {
    port: String,
    going: Arc<AtomicBool>,
    thread: Option<JoinHandle<Fake>>,
}

impl Board {
    /// A board that answers received bytes with the result of `answer`.
    fn start(mut answer: impl FnMut(&mut Fake, &[u8]) -> Vec<u8> + Send + 'static) -> Self {
        let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let port = slave.name().expect("a name");
        drop(slave);
        let going = Arc::new(AtomicBool::new(true));
        let flag = Arc::clone(&going);
        master.set_timeout(Duration::from_millis(10)).expect("a timeout");
        let thread = std::thread::spawn(move || {
            let mut fake = Fake::new();
            let mut bytes = [0; 512];
            while flag.load(Ordering::Relaxed) {
                match master.read(&mut bytes) {
                    Ok(count) => {
                        let back = answer(&mut fake, &bytes[..count]);
                        let _ = master.write_all(&back);
                    }
                    // The other end is not open.
                    Err(_) => std::thread::sleep(Duration::from_millis(2)),
                }
            }
            fake
        });
        Self {
            port,
            going,
            thread: Some(thread),
        }
    }

    fn honest() -> Self {
        Self::start(Fake::exchange)
    }

    /// Stops the transmitter and returns its state.
    fn stop(mut self) -> Fake {
        self.going.store(false, Ordering::Relaxed);
        let thread = self.thread.take().expect("it runs");
        thread.join().expect("it did not panic")
    }

    /// Runs `vocc` with this port.
    fn vocc(&self, arguments: &[&str]) -> Output {
        vocc(&[arguments, &["--port", &self.port]].concat())
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.going.store(false, Ordering::Relaxed);
    }
}

/// Asserts an exit status and words on either output.
fn ends(output: &Output, status: i32, words: &[&str]) {
    let printed = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{printed}");
    assert!(!printed.contains("panicked"), "{printed}");
    for word in words {
        assert!(printed.contains(word), "{word:?} is not in: {printed}");
    }
}

/// A file of this test.
fn file(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

const TABLE: &str = "format = 1
illuminance_lx = [50.0, 1000.5, 20000.0]
interval = [0.5, 1.0]
l2a = [
  [1.35, 2.05],
  [1.2, 1.9],
  [1.111, 3.999],
]
";

#[test]
fn a_table_is_pushed_verified_and_pulled_back_the_same() {
    let board = Board::honest();
    let (table, back) = (file("pushed.toml", TABLE), file("pulled.toml", ""));
    let (table, back) = (table.to_str().unwrap(), back.to_str().unwrap());
    ends(
        &board.vocc(&["table", "verify", table]),
        1,
        &["another table", "the illuminances differ"],
    );
    ends(&board.vocc(&["table", "push", table]), 0, &["stored and in use"]);
    ends(&board.vocc(&["table", "verify", table]), 0, &["is this one"]);
    ends(&board.vocc(&["table", "pull", back]), 0, &["3 illuminances"]);
    assert_eq!(std::fs::read_to_string(back).unwrap(), TABLE);
    // A table may be pulled twice.
    ends(&board.vocc(&["table", "pull", back]), 0, &[]);
    let pulled = board.vocc(&["table", "pull"]);
    assert_eq!(String::from_utf8_lossy(&pulled.stdout), TABLE);

    let crc = json(&board.vocc(&["table", "verify", table, "--json"]))["table_crc"].clone();
    let status = json(&board.vocc(&["device", "status", "--json"]));
    assert_eq!(status["table_crc"], crc);
    let fake = board.stop();
    assert_eq!(format!("{:08x}", fake.transmitter.table().crc()), crc.as_str().unwrap());
    assert_eq!(fake.memory.table.as_ref(), Some(fake.transmitter.table()));
}

#[test]
fn a_table_for_another_place_is_stored_with_a_warning() {
    let board = Board::honest();
    let table = file("elsewhere.toml", "illuminance_lx = [50]\ninterval = [2]\nl2a = [[3]]\n");
    let elsewhere = board.vocc(&["table", "push", table.to_str().unwrap()]);
    let told = [
        "light, in lx, is 2000",
        "made for 50",
        "LED interval is 1",
        "made for 2",
        "stored and in use",
    ];
    ends(&elsewhere, 0, &told);
    let here = file("here.toml", TABLE);
    let here = board.vocc(&["table", "push", here.to_str().unwrap()]);
    assert!(here.stderr.is_empty(), "{}", String::from_utf8_lossy(&here.stderr));
}

#[test]
fn a_table_for_another_waveform_than_the_panel_shows_is_warned_of() {
    let board = Board::honest();
    let still = file(
        "still.toml",
        "illuminance_lx = [50, 50000]\ninterval = [0.5, 2]\nl2a = [[3, 3], [2, 2]]\n",
    );
    let carried = format!("carrier_cycles = 16\n{}", std::fs::read_to_string(&still).expect("the table"));
    let carried = file("carried.toml", &carried);
    let [still, carried] = [&still, &carried].map(|path| path.to_str().unwrap());
    let says = |of: &[&str], words: &[&str]| {
        let output = board.vocc(of);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(words.is_empty(), !said.contains("made for"), "{of:?}: {said}");
        words
            .iter()
            .for_each(|word| assert!(said.contains(word), "{of:?}: {word} is not in {said}"));
    };
    let for_carrier = ["made for a carrier of 16 cycles a symbol", "shows still panels"];
    says(&["table", "push", carried], &for_carrier);
    says(&["table", "verify", carried], &for_carrier);
    // The same ratios are the same table.
    says(&["table", "verify", still], &[]);
    says(
        &["device", "rate", "90", "--carrier-cycles", "16"],
        &["no note of the waveform", "table verify"],
    );
    says(&["table", "verify", carried], &[]);
    says(&["table", "push", carried], &[]);
    let for_still = ["made for still panels", "a carrier of 16 cycles", "link.carrier_cycles=16"];
    says(&["table", "push", still], &for_still);
    // The shipped table is known.
    says(&["table", "push"], &for_still);
    says(
        &["device", "rate", "45", "--carrier-cycles", "32"],
        &["made for still panels", "a carrier of 32 cycles"],
    );
    says(&["device", "rate", "90"], &[]);
    says(&["device", "rate", "90", "--carrier-cycles", "0"], &[]);
}

#[test]
fn a_table_that_contradicts_its_own_search_is_not_stored() {
    let board = Board::honest();
    let searched = include_str!("../../docs/optimum/kmeans.toml");
    let edited = searched.replacen("[2.17, 3.753", "[3.95, 3.753", 1);
    let own = &edited[..edited.rfind("# checksum").expect("a last line")];
    let [changed, edited] = [("changed.toml", &edited[..]), ("edited.toml", own)].map(|(name, text)| file(name, text));
    let stored = || json(&board.vocc(&["table", "verify", "--json"]))["table_crc"].clone();
    let before = stored();
    let pushed = |table: &std::path::Path| board.vocc(&["table", "push", table.to_str().unwrap()]);
    ends(&pushed(&changed), 2, &["changed after it was written"]);
    ends(&pushed(&edited), 2, &["50 lx and interval 0.5 is 3.95", "found 2.170"]);
    assert_eq!(stored(), before);
}

#[test]
fn a_symbol_rate_that_is_not_kept_is_told() {
    // Whatever the request, the board reports the old rate.
    let board = Board::start(|fake, bytes| {
        let stubborn = Answer::SymbolRate { millihertz: 90_000 };
        instead(bytes, &stubborn, |request| matches!(request, Request::WriteSymbolRate { .. })).unwrap_or_else(|| fake.exchange(bytes))
    });
    ends(
        &board.vocc(&["device", "rate", "30"]),
        1,
        &["30 symbols a second were asked for", "90"],
    );
}

#[test]
fn a_transmitter_tells_how_it_is() {
    let board = Board::honest();
    let status = json(&board.vocc(&["device", "status", "--json"]));
    assert!((status["illuminance_lx"].as_f64().unwrap() - 2000.0).abs() < 0.01);
    // L* = 2·2000·0.4 of 26 000 cd/m².
    assert!((status["luminance_cd_m2"].as_f64().unwrap() - 1600.0).abs() < 0.5);
    assert!((status["duty"].as_f64().unwrap() - 1600.0 / 26_000.0).abs() < 1e-4);
    assert_eq!(status["faults"], serde_json::json!([]));
    assert_eq!(status["uptime_s"], 1);
    ends(&board.vocc(&["device", "status"]), 0, &["illuminance_lx", "board            fake"]);

    let watched = board.vocc(&["device", "watch", "--count", "3", "--interval", "0.05", "--json"]);
    ends(&watched, 0, &[]);
    assert_eq!(watched.stdout.iter().filter(|&&byte| byte == b'\n').count(), 3);
}

#[test]
fn a_message_is_given_and_taken_back() {
    let board = Board::honest();
    ends(&board.vocc(&["device", "send", "--message", "ice ahead"]), 0, &["done"]);
    assert_eq!(json(&board.vocc(&["device", "status", "--json"]))["sending"], true);
    ends(&board.vocc(&["device", "send", "--stop"]), 0, &["done"]);
    assert_eq!(json(&board.vocc(&["device", "status", "--json"]))["sending"], false);
    ends(&board.vocc(&["device", "send"]), 2, &["--message"]);
    ends(&board.vocc(&["device", "send", "--message", ""]), 2, &["1 to 1024"]);
    ends(
        &board.vocc(&["device", "send", "--message", "twice", "--repeats", "2"]),
        0,
        &["done"],
    );
    assert!(board.stop().transmitter.is_sending());
}

#[test]
fn a_calibration_is_read_written_and_refused() {
    let board = Board::honest();
    let printed = board.vocc(&["device", "calibration"]);
    ends(&printed, 0, &["luminance_full_cd_m2 = 26000.0", "reflectance = 0.4"]);
    let text = String::from_utf8_lossy(&printed.stdout).replace("26000.0", "12000.5");
    let brighter = file("brighter.toml", &text);
    let brighter = brighter.to_str().unwrap();
    let written = board.vocc(&["device", "calibration", brighter]);
    ends(&written, 0, &["luminance_full_cd_m2 = 12000.5"]);
    assert_eq!(String::from_utf8_lossy(&written.stdout), text);

    for (wrong, words) in [
        (text.replace("12000.5", "0.5"), ["full luminance 0.5", "1 to 1000000"]),
        (text.replace("= 0.4", "= -0.4"), ["reflectance", "not a number"]),
        (text.replace("reflectance", "reflection"), ["reflection", "not a calibration"]),
    ] {
        let wrong = file("wrong.toml", &wrong);
        let refused = board.vocc(&["device", "calibration", wrong.to_str().unwrap()]);
        ends(&refused, 2, &words);
    }
    let measured = *board.stop().transmitter.calibration().measured();
    assert_eq!(measured.luminance_full_cd_m2, 12000.5);
}

#[test]
fn a_symbol_rate_is_told_set_kept_and_refused() {
    let board = Board::honest();
    ends(&board.vocc(&["device", "rate"]), 0, &["90 symbols a second"]);
    let told = json(&board.vocc(&["device", "rate", "22.5", "--json"]));
    assert_eq!(told["symbol_rate_hz"], 22.5);
    assert_eq!(told["port"], board.port.as_str());
    for (camera, rate_hz) in [
        (&["--camera-fps", "30"][..], 27.0),
        (&["--camera-fps", "29.97"], 26.973),
        (&["--camera-fps", "30", "--exposure", "0.02"], 18.75),
        (&["--camera-fps", "1000"], 300.0),
    ] {
        let told = json(&board.vocc(&[&["device", "rate", "--json"], camera].concat()));
        assert_eq!(told["symbol_rate_hz"], rate_hz, "{camera:?}");
        let status = json(&board.vocc(&["device", "status", "--json"]));
        assert_eq!(status["symbol_rate_hz"], rate_hz);
    }
    ends(&board.vocc(&["device", "status"]), 0, &["symbol_rate_hz   300"]);
    for (wrong, words) in [
        (
            &["8.9"][..],
            &["8.9 symbols a second", "9 to 300", "a little below the camera's"][..],
        ),
        (&["301"], &["301 symbols", "9 to 300"]),
        (&["-27"], &["9 to 300"]),
        (&["NaN"], &["9 to 300"]),
        (&["ninety"], &["ninety"]),
        (&["--camera-fps", "5"], &["camera of 5 frames", "9 to 300"]),
        (&["27", "--camera-fps", "30"], &["--camera-fps"]),
        (&["--exposure", "0.01"], &["--camera-fps"]),
    ] {
        ends(&board.vocc(&[&["device", "rate"], wrong].concat()), 2, words);
    }
    let fake = board.stop();
    let fastest = SymbolRate::MAX;
    assert_eq!(fake.transmitter.symbol_rate(), fastest);
    assert_eq!(fake.memory.timing, Some(SymbolTiming::still(fastest)));
}

/// This answer, if one of the requests is of the intended kind.
fn instead(bytes: &[u8], answer: &Answer<'_>, is_meant: impl Fn(&Request<'_>) -> bool) -> Option<Vec<u8>> {
    let mut reader = FrameReader::<REQUEST_FRAME_MAX>::new();
    for &byte in bytes {
        if let Some(Ok(frame)) = reader.push(byte)
            && frame.request().is_ok_and(|request| is_meant(&request))
        {
            let (sequence, mut wire) = (frame.sequence(), [0; 32]);
            let answer = encode(Kind::Answer, sequence, answer, &mut wire);
            return Some(answer.expect("it fits").to_vec());
        }
    }
    None
}

/// The bytes from a transmitter whose firmware knows only the first twelve requests.
fn first_firmware(fake: &mut Fake, bytes: &[u8]) -> Vec<u8> {
    let unknown = Answer::Refused(Refusal::Unknown);
    let is_later = |request: &Request<'_>| {
        matches!(
            request,
            Request::ReadSymbolRate
                | Request::WriteSymbolRate { .. }
                | Request::ReadIntensityLimit
                | Request::WriteIntensityLimit { .. }
                | Request::ReadCarrier
                | Request::WriteCarrier { .. }
                | Request::ReadKey
                | Request::WriteKey { .. }
                | Request::EraseKey
                | Request::TestPanel { .. }
                | Request::ReadSensor
                | Request::ReadLock
                | Request::WriteLock { .. }
                | Request::RemoveLock
                | Request::Permit { .. }
                | Request::ReadProgramHash
        )
    };
    instead(bytes, &unknown, is_later).unwrap_or_else(|| fake.exchange(bytes))
}

#[test]
fn firmware_that_knows_no_symbol_rates_is_told_from_other_refusals() {
    let board = Board::start(first_firmware);
    for rate in [&["device", "rate"][..], &["device", "rate", "27"]] {
        ends(&board.vocc(rate), 2, &["firmware 1.2.3", "too old", "90 a second", "flash"]);
    }
    let status = json(&board.vocc(&["device", "status", "--json"]));
    assert_eq!(status["symbol_rate_hz"], serde_json::Value::Null);
    assert_eq!(status["uptime_s"], 1);
    assert_eq!(board.stop().memory.timing, None);
}

#[test]
fn firmware_that_shows_no_test_panels_says_so_and_keeps_what_it_has() {
    let board = Board::start(first_firmware);
    let test = ["device", "test"];
    ends(
        &board.vocc(&test),
        2,
        &["too old to show test panels", "nothing was changed", "flash"],
    );
    assert_eq!(board.stop().memory.timing, None);
}

#[test]
fn firmware_that_signs_no_messages_takes_no_key() {
    let key = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-signing-key.toml");
    let _ = std::fs::remove_file(&key);
    let key = key.to_str().unwrap();
    ends(&vocc(&["keys", "new", key]), 0, &[]);
    let boards = [
        (Board::honest(), "built with the feature `signing`"),
        (Board::start(first_firmware), "too old"),
    ];
    for (board, why) in boards {
        for command in [
            &["device", "key"][..],
            &["device", "key", "--key", key],
            &["device", "key", "--erase"],
        ] {
            ends(&board.vocc(command), 2, &[why, "flash"]);
        }
        assert_eq!(json(&board.vocc(&["device", "status", "--json"]))["signer"], Value::Null);
    }
}

/// An ELF file for ARM with these segments: address in the flash and bytes.
fn elf(segments: &[(u32, &[u8])]) -> Vec<u8> {
    const HEADER: usize = 52;
    const ENTRY: usize = 32;
    let mut file = b"\x7fELF\x01\x01\x01".to_vec();
    file.resize(16, 0);
    for half in [2_u16, 40] {
        file.extend(half.to_le_bytes());
    }
    // Version, entry, program headers, section headers, flags.
    for word in [1, 0, HEADER as u32, 0, 0] {
        file.extend(word.to_le_bytes());
    }
    for half in [HEADER, ENTRY, segments.len(), 0, 0, 0] {
        file.extend((half as u16).to_le_bytes());
    }
    let mut offset = (HEADER + ENTRY * segments.len()) as u32;
    for (address, bytes) in segments {
        let length = bytes.len() as u32;
        for word in [1, offset, 0x2000_0000, *address, length, length, 4, 4] {
            file.extend(word.to_le_bytes());
        }
        offset += length;
    }
    file.extend(segments.iter().flat_map(|(_, bytes)| *bytes));
    file
}

#[test]
fn a_board_says_whether_it_runs_the_program_in_a_file() {
    let path = |name: &str, bytes: &[u8]| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, bytes).expect("a file");
        path.to_str().expect("a name").to_owned()
    };
    // As linkers write them, in any order, and memory without contents.
    let same = path(
        "same.elf",
        &elf(&[(0x1000_0004, b"ram!"), (0x1000_0000, b"prog"), (0x3000_0000, b"")]),
    );
    let other = path("other.elf", &elf(&[(0x1000_0000, b"prog"), (0x1000_0004, b"grim")]));
    const SHA256: &str = "af3b6cc54ae33c77a48886c4671e5d906132c6c095b7f1a7905e1136fedd01d2";
    let reporting = Board::start({
        let hash = ProgramHash::of(b"program!");
        move |fake: &mut Fake, bytes: &[u8]| {
            fake.memory.program_hash = Some(hash);
            fake.exchange(bytes)
        }
    });
    let words = ["fake", "firmware 1.2.3", "8 bytes", SHA256];
    ends(&reporting.vocc(&["device", "hello"]), 0, &words);
    ends(&reporting.vocc(&["device", "hello", "--image", &same]), 0, &["runs this program"]);
    ends(
        &reporting.vocc(&["device", "hello", "--image", &other]),
        1,
        &["another program", SHA256],
    );
    let told = json(&reporting.vocc(&["device", "hello", "--json", "--image", &same]));
    assert_eq!((&told["program_sha256"], &told["same"]), (&json!(SHA256), &json!(true)));
    assert_eq!((&told["program_bytes"], &told["file_sha256"]), (&json!(8), &json!(SHA256)));
    ends(&vocc(&["device", "hello", "--no-board", "--image", &same]), 0, &["8 bytes", SHA256]);

    for old in [Board::start(first_firmware), Board::honest()] {
        ends(&old.vocc(&["device", "hello"]), 0, &["firmware 1.2.3", "not reported"]);
        let told = json(&old.vocc(&["device", "hello", "--json"]));
        assert_eq!((&told["program_sha256"], &told["same"]), (&Value::Null, &Value::Null));
        ends(&old.vocc(&["device", "hello", "--image", &same]), 2, &["does not report", "flash"]);
    }

    let whole = elf(&[(0x1000_0000, b"program!")]);
    let gap = elf(&[(0x1000_0000, b"prog"), (0x1000_0008, b"gram")]);
    let over = elf(&[(0x1000_0000, b"prog"), (0x1000_0002, b"gram")]);
    for (bytes, why) in [
        (&b""[..], "not an ELF file"),
        (b"UF2\nWQ]\x9e", "not an ELF file"),
        (b"\x7fELF\x02\x01\x01 of 64 bits", "not an ELF file"),
        (&whole[..whole.len() - 1], "damaged or cut short"),
        (&whole[..60], "damaged or cut short"),
        (&elf(&[]), "without a program"),
        (&gap, "0x10000008"),
        (&over, "0x10000002"),
    ] {
        let bad = path("bad.elf", bytes);
        ends(&vocc(&["device", "hello", "--no-board", "--image", &bad]), 2, &["bad.elf", why]);
    }
    ends(&vocc(&["device", "hello", "--no-board", "--image", "none.elf"]), 2, &["none.elf"]);
    ends(&vocc(&["device", "hello"]), 2, &["--port"]);
    ends(&vocc(&["device", "hello", "--no-board"]), 2, &["--image"]);
}

#[test]
fn firmware_that_has_no_lock_says_so_and_stays_open() {
    use std::os::unix::fs::PermissionsExt;
    let pin = file("new.pin", "123456");
    std::fs::set_permissions(&pin, std::fs::Permissions::from_mode(0o600)).expect("it is ours");
    let lock = ["device", "lock", "--new-pin-file", pin.to_str().unwrap()];
    let old = Board::start(first_firmware);
    ends(&old.vocc(&lock), 2, &["too old to be locked", "nothing was changed"]);
    assert_eq!(json(&old.vocc(&["device", "status", "--json"]))["locked"], Value::Null);
    let other = Board::honest();
    ends(&other.vocc(&lock), 2, &["its firmware has no lock"]);
    assert_eq!(json(&other.vocc(&["device", "status", "--json"]))["locked"], Value::Null);
    // A PIN that is not needed does no harm.
    ends(
        &other.vocc(&["device", "rate", "27", "--pin-file", pin.to_str().unwrap()]),
        0,
        &["27"],
    );
}

#[test]
fn a_carrier_is_told_set_kept_and_refused() {
    let board = Board::honest();
    let told = json(&board.vocc(&["device", "rate", "--json"]));
    assert_eq!((&told["symbol_rate_hz"], &told["carrier_cycles"]), (&json!(90.0), &json!(0)));
    let all = "90 symbols a second, each of 16 cycles of a carrier of 1440 Hz";
    let apart = board.vocc(&["device", "rate", "90.2", "--carrier-cycles", "16"]);
    for words in ["change slowly", "low risk"] {
        assert!(!text(&apart.stderr).contains(words), "{}", text(&apart.stderr));
    }
    let set = board.vocc(&["device", "rate", "90", "--carrier-cycles", "16"]);
    ends(&set, 0, &[all]);
    let warned = text(&set.stderr);
    assert!(
        warned.contains("cameras of 30, 60, 120 frames a second see the phase of 1440 Hz change slowly"),
        "{warned}"
    );
    ends(&board.vocc(&["device", "rate"]), 0, &[all]);
    // Setting one of them keeps the other.
    let slower = board.vocc(&["device", "rate", "27", "--json"]);
    let told = json(&slower);
    assert_eq!((&told["symbol_rate_hz"], &told["carrier_cycles"]), (&json!(27.0), &json!(16)));
    let warned = text(&slower.stderr);
    for words in [
        "432 Hz may flicker at more than low risk",
        "from 1403 Hz on",
        "--carrier-cycles 52 makes it 1404 Hz",
    ] {
        assert!(warned.contains(words), "{warned}");
    }
    let told = json(&board.vocc(&["device", "rate", "45", "--json"]));
    assert_eq!((&told["symbol_rate_hz"], &told["carrier_cycles"]), (&json!(45.0), &json!(16)));
    let told = json(&board.vocc(&["device", "rate", "--carrier-cycles", "32", "--json"]));
    assert_eq!((&told["symbol_rate_hz"], &told["carrier_cycles"]), (&json!(45.0), &json!(32)));
    ends(
        &board.vocc(&["device", "rate", "--camera-fps", "30", "--carrier-cycles", "54"]),
        0,
        &["1458 Hz"],
    );
    ends(
        &board.vocc(&["device", "status"]),
        0,
        &["symbol_rate_hz   27", "carrier_cycles   54"],
    );
    for (wrong, words) in [
        (
            &["90", "--carrier-cycles", "1"][..],
            &["1 cycles", "2 to 333", "0 for still panels"][..],
        ),
        (&["--carrier-cycles", "334"], &["334 cycles", "2 to 333"]),
        (
            &["90", "--carrier-cycles", "34"],
            &["34 cycles", "3060 Hz", "200 to 3000 Hz", "another rate"],
        ),
        (&["--carrier-cycles", "7"], &["7 cycles", "27 symbols", "189 Hz", "200 to 3000 Hz"]),
        (
            &["90"],
            &["90 symbols a second", "9 to 55.555", "carrier", "rate and cycles together"],
        ),
    ] {
        ends(&board.vocc(&[&["device", "rate"], wrong].concat()), 2, words);
    }
    let fake = board.stop();
    let timing = fake.transmitter.timing();
    assert_eq!((timing.rate().hz(), timing.waveform().cycles()), (27.0, 54));
    assert_eq!(fake.memory.timing, Some(timing));
}

/// The bytes from a transmitter whose firmware does not know carriers.
fn before_carriers(fake: &mut Fake, bytes: &[u8]) -> Vec<u8> {
    let is_of_carriers = |request: &Request<'_>| matches!(request, Request::ReadCarrier | Request::WriteCarrier { .. });
    instead(bytes, &Answer::Refused(Refusal::Unknown), is_of_carriers).unwrap_or_else(|| fake.exchange(bytes))
}

#[test]
fn firmware_that_knows_no_carrier_says_so_and_changes_nothing() {
    let board = Board::start(before_carriers);
    for wrong in [&["27", "--carrier-cycles", "54"][..], &["--carrier-cycles", "16"]] {
        let words = ["firmware 1.2.3", "too old to show a carrier", "nothing was changed", "flash"];
        ends(&board.vocc(&[&["device", "rate"], wrong].concat()), 2, &words);
    }
    let told = json(&board.vocc(&["device", "rate", "27", "--json"]));
    assert_eq!(told, json!({ "port": board.port, "symbol_rate_hz": 27.0 }));
    let status = json(&board.vocc(&["device", "status", "--json"]));
    assert_eq!((&status["symbol_rate_hz"], &status["carrier_cycles"]), (&json!(27.0), &Value::Null));
    let timing = SymbolTiming::still(SymbolRate::from_hz(27.0).expect("a rate"));
    assert_eq!(board.stop().memory.timing, Some(timing));
}

#[test]
fn a_calibration_may_limit_the_intensity() {
    let board = Board::honest();
    let printed = board.vocc(&["device", "calibration"]);
    let plain = String::from_utf8_lossy(&printed.stdout).into_owned();
    assert!(!plain.contains("max_cd"), "{plain}");
    // 2 cd from discs of 30 mm are 88 cd/m², but 2000 lx require 1600.
    let limited = file("limited.toml", &format!("{plain}max_cd = 2.0\nled_diameter_m = 0.03\n"));
    let written = board.vocc(&["device", "calibration", limited.to_str().unwrap()]);
    ends(&written, 0, &["max_cd = 2.0", "led_diameter_m = 0.03"]);
    for (wrong, words) in [
        ("max_cd = 2.0\n", &["max_cd", "led_diameter_m", "both"][..]),
        ("led_diameter_m = 0.0\n", &["diameter", "0.0001 to 1 m"]),
        ("max_cd = 0.0\nled_diameter_m = 0.03\n", &["0 cd", "0.001 to 1000000"]),
        ("max_cd = 2.0\nled_diameter_m = 30.0\n", &["diameter", "0.0001 to 1 m"]),
        ("max_cd = nan\nled_diameter_m = 0.03\n", &["0.001 to 1000000"]),
    ] {
        let wrong = file("wrong-limit.toml", &format!("{plain}{wrong}"));
        let refused = board.vocc(&["device", "calibration", wrong.to_str().unwrap()]);
        ends(&refused, 2, words);
    }
    let fake = board.stop();
    let limit = IntensityLimit::from_cd(Some(2.0), 0.03).ok();
    assert_eq!(fake.transmitter.calibration().limit(), limit);
    assert_eq!(fake.memory.limit, limit);
}

#[test]
fn a_file_without_a_limit_takes_it_back() {
    let board = Board::honest();
    let printed = board.vocc(&["device", "calibration"]);
    let plain = String::from_utf8_lossy(&printed.stdout).into_owned();
    for text in [
        format!("{plain}max_cd = 2.0\nled_diameter_m = 0.03\n"),
        // No limit: the panel only announces its size.
        format!("{plain}led_diameter_m = 0.025\n"),
        plain,
    ] {
        let path = file("limit-and-none.toml", &text);
        let written = board.vocc(&["device", "calibration", path.to_str().unwrap()]);
        ends(&written, 0, &[]);
        assert_eq!(String::from_utf8_lossy(&written.stdout), text);
    }
    assert_eq!(board.stop().transmitter.calibration().limit(), None);
}

#[test]
fn firmware_that_knows_no_limit_is_calibrated_without_one_alone() {
    let board = Board::start(first_firmware);
    let printed = board.vocc(&["device", "calibration"]);
    let plain = String::from_utf8_lossy(&printed.stdout).into_owned();
    let path = file("old-plain.toml", &plain);
    let written = board.vocc(&["device", "calibration", path.to_str().unwrap()]);
    ends(&written, 0, &["reflectance"]);
    let path = file("old-limited.toml", &format!("{plain}max_cd = 2.0\nled_diameter_m = 0.03\n"));
    let refused = board.vocc(&["device", "calibration", path.to_str().unwrap()]);
    ends(&refused, 2, &["too old", "max_cd", "flash"]);
    assert_eq!(board.stop().memory.limit, None);
}

#[test]
fn a_bad_line_is_asked_again() {
    let mut count = 0;
    let board = Board::start(move |fake, bytes| {
        // Every third answer is lost, and every fourth follows garbage.
        count += 1;
        let mut back = fake.exchange(bytes);
        if count % 3 == 0 {
            back.clear();
        }
        if count % 4 == 0 {
            back.splice(..0, *b"\xff\xfe\0garbage\0");
        }
        back
    });
    let table = file("bad_line.toml", TABLE);
    let push = ["table", "push", table.to_str().unwrap(), "--timeout", "2"];
    ends(&board.vocc(&push), 0, &["stored and in use"]);
    assert_eq!(board.stop().transmitter.table().values().len(), 6);
}

#[test]
fn bad_tables_stay_here() {
    let board = Board::honest();
    let bad = file("bad.toml", &TABLE.replace("3.999", "4.5"));
    let push = board.vocc(&["table", "push", bad.to_str().unwrap()]);
    ends(&push, 2, &["4.5", "0.2", "4"]);
    ends(&board.vocc(&["table", "push", "/no/such/table.toml"]), 2, &["/no/such/table.toml"]);
    assert!(board.stop().memory.table.is_none());
}

#[test]
fn ports_that_cannot_be_used_are_named() {
    let commands: [&[&str]; 4] = [
        &["device", "status"],
        &["device", "send", "--message", "x"],
        &["table", "push"],
        &["table", "pull"],
    ];
    for command in commands {
        let with = |port| vocc(&[command, &["--port", port]].concat());
        ends(&with("/dev/no-such-port"), 2, &["no port /dev/no-such-port", "vocc device list"]);
        ends(&with("/dev/null"), 2, &["/dev/null", "serial port"]);
    }
    ends(&vocc(&["device", "status"]), 2, &["--port"]);
}

#[test]
fn a_port_that_another_program_has_is_busy() {
    let (_master, slave) = TTYPort::pair().expect("a pseudo-terminal");
    let port = slave.name().expect("a name");
    drop(slave);
    let holder = serialport::new(&port, 115_200).open_native().expect("the first to open it");
    assert!(holder.exclusive());
    ends(&vocc(&["device", "status", "--port", &port]), 2, &["busy", &port]);
}

#[test]
fn whatever_is_no_transmitter_is_told() {
    let silent = Board::start(|_, _| Vec::new());
    ends(&silent.vocc(&["device", "status", "--timeout", "0.05"]), 2, &["nothing answers"]);
    let modem = Board::start(|_, _| b"ERROR\r\n".to_vec());
    ends(&modem.vocc(&["device", "status", "--timeout", "1"]), 2, &["not a transmitter"]);
    let echo = Board::start(|_, bytes| bytes.to_vec());
    ends(&echo.vocc(&["device", "status", "--timeout", "1"]), 2, &["not a transmitter"]);
}

/// The answer of a transmitter of another version: the same frame with bytes changed, and the right CRC.
fn changed(answer: &[u8], change: impl Fn(&mut [u8])) -> Vec<u8> {
    let whole: Vec<u8> = answer.iter().copied().filter(|&byte| byte != 0).collect();
    let mut frame = cobs_decoded(&whole);
    change(&mut frame);
    let length = frame.len() - 4;
    let crc = link::checksum::crc32c(&[&frame[..length]]);
    frame[length..].copy_from_slice(&crc.to_le_bytes());
    let mut wire = vec![0];
    let mut rest = &frame[..];
    loop {
        let run = rest.iter().take_while(|&&byte| byte != 0).count();
        wire.push(run as u8 + 1);
        wire.extend(&rest[..run]);
        if run == rest.len() {
            break;
        }
        rest = &rest[run + 1..];
    }
    wire.push(0);
    wire
}

/// Decodes the COBS of a short frame.
fn cobs_decoded(stuffed: &[u8]) -> Vec<u8> {
    let mut frame = Vec::new();
    let mut rest = stuffed;
    while let Some((&code, after)) = rest.split_first() {
        let (run, next) = after.split_at(usize::from(code) - 1);
        frame.extend(run);
        if !next.is_empty() {
            frame.push(0);
        }
        rest = next;
    }
    frame
}

#[test]
fn another_protocol_is_told_and_which_side_is_older() {
    for (version, older) in [(0, "update the transmitter's firmware"), (2, "update the program")] {
        let board = Board::start(move |fake, bytes| {
            let answer = fake.exchange(bytes);
            if answer.is_empty() {
                return answer;
            }
            changed(&answer, |frame| frame[0] = version)
        });
        let speaks = format!("uses protocol {version}, this program 1");
        ends(&board.vocc(&["device", "status"]), 2, &[&speaks, older]);
    }
}

/// To a client from before locks, *locked* is such a refusal.
#[test]
fn a_refusal_that_only_newer_firmware_knows_changes_nothing_and_says_which_side_to_update() {
    let board = Board::start(|fake, bytes| {
        let locked = Answer::Refused(Refusal::Locked);
        match instead(bytes, &locked, |request| request.changes()) {
            // After the version, the kind, the number and *refused*.
            Some(answer) => changed(&answer, |frame| frame[7] = 100),
            None => fake.exchange(bytes),
        }
    });
    let table = file("newer.toml", TABLE);
    for command in [
        &["table", "push", common::name(&table)][..],
        &["device", "rate", "27"],
        &["device", "send", "--message", "ice"],
    ] {
        ends(&board.vocc(command), 2, &["update the older side"]);
    }
    ends(&board.vocc(&["device", "status"]), 0, &[]);
    let fake = board.stop();
    assert_eq!(*fake.transmitter.table(), Fake::first_table());
    assert_eq!((fake.memory.table, fake.memory.timing), (None, None));
}

/// Pushes [`TABLE`] to a board whose answers `hurt` changes. Returns whether the board then has the new table; otherwise it must have the
/// old one.
fn pushed(mut hurt: impl FnMut(usize, Vec<u8>) -> Vec<u8> + Send + 'static) -> (Output, bool) {
    let mut answers = 0;
    let board = Board::start(move |fake, bytes| {
        let answer = fake.exchange(bytes);
        if answer.is_empty() {
            return answer;
        }
        answers += 1;
        hurt(answers, answer)
    });
    let table = file("breaks.toml", TABLE);
    let table = common::name(&table);
    let output = board.vocc(&["table", "push", table, "--timeout", "0.05"]);
    let fake = board.stop();
    let used = fake.transmitter.table();
    let is_new = *used != Fake::first_table();
    assert_eq!(fake.memory.table.as_ref().is_some_and(|kept| kept == used), is_new);
    assert!(!is_new || used.illuminances_lx().len() == 3, "half a table is in use");
    (output, is_new)
}

#[test]
fn a_conversation_that_breaks_after_the_hello_leaves_the_old_table_or_the_new() {
    for (said, breaks) in [
        ("silent", &(|_: Vec<u8>| Vec::new()) as &'static (dyn Fn(Vec<u8>) -> Vec<u8> + Sync)),
        ("half an answer", &|answer: Vec<u8>| answer[..answer.len() / 2].to_vec()),
        ("another version", &|answer: Vec<u8>| changed(&answer, |frame| frame[0] = 2)),
        ("the noise of a restart", &|answer: Vec<u8>| vec![0xff; answer.len()]),
    ] {
        for after in 1.. {
            let (output, is_new) = pushed(move |number, answer| if number > after { breaks(answer) } else { answer });
            if output.status.success() {
                assert!(is_new && after > 1, "{said}");
                break;
            }
            ends(&output, 2, &[]);
            assert!(!output.stderr.is_empty(), "{said} after {after}");
        }
    }
}

#[test]
fn a_flash_that_is_full_or_broken_leaves_the_old_table() {
    for fault in [StoreError::Damaged, StoreError::Flash] {
        let mut is_told = false;
        let board = Board::start(move |fake, bytes| {
            if !std::mem::replace(&mut is_told, true) {
                fake.memory.fault = Some(fault);
            }
            fake.exchange(bytes)
        });
        let table = file("full.toml", TABLE);
        let push = ["table", "push", common::name(&table)];
        ends(&board.vocc(&push), 2, &["flash"]);
        let fake = board.stop();
        assert_eq!(*fake.transmitter.table(), Fake::first_table());
        assert!(fake.memory.table.is_none());
    }
}

#[test]
fn a_flash_that_is_broken_leaves_the_old_symbol_rate() {
    let board = Board::start(|fake, bytes| {
        fake.memory.fault = Some(StoreError::Flash);
        fake.exchange(bytes)
    });
    ends(&board.vocc(&["device", "rate", "27"]), 2, &["flash"]);
    ends(&board.vocc(&["device", "rate"]), 0, &["90 symbols"]);
}

#[test]
fn ports_are_listed() {
    let output = vocc(&["device", "list", "--json"]);
    let none = output.stdout.is_empty();
    assert_eq!(output.status.code(), Some(i32::from(none)));
    for listed in String::from_utf8_lossy(&output.stdout).lines() {
        let listed: serde_json::Value = serde_json::from_str(listed).expect("JSON");
        // Cameras are listed, too.
        assert!(listed["port"].is_string() || listed["camera"].is_string(), "{listed}");
    }
}
