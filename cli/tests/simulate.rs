//! `vocc device simulate` with all operations on a transmitter.

mod common;

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Output, Stdio};
use std::time::{Duration, Instant};

use common::grey_card::{PLACES, SCENE};
use common::{command, folder, json, name, refused, says, text, vocc, write_key};
use link::fec::Code;
use link::framing::Framer;
use serde_json::Value;

/// A long timeout: the firmware smooths light for seconds, and the processor may be shared.
const SOON: Duration = Duration::from_secs(300);

/// A running board.
struct Simulator {
    child: Child,
    printed: BufReader<ChildStdout>,
    port: String,
}

impl Simulator {
    fn start(arguments: &[&str]) -> Self {
        let mut child = command(&["device", "simulate"])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("vocc runs");
        let mut printed = BufReader::new(child.stdout.take().expect("piped"));
        let mut port = String::new();
        printed.read_line(&mut port).expect("a line");
        let port = port.trim().to_owned();
        assert!(!port.is_empty(), "it ended: {}", {
            let mut said = String::new();
            let _ = child.stderr.take().expect("piped").read_to_string(&mut said);
            said
        });
        Self { child, printed, port }
    }

    fn tell(&mut self, order: &str) {
        let input = self.child.stdin.as_mut().expect("piped");
        writeln!(input, "{order}").expect("it listens");
    }

    fn vocc(&self, arguments: &[&str]) -> Output {
        vocc(&[arguments, &["--port", &self.port]].concat())
    }

    fn status(&self) -> Value {
        json(&self.vocc(&["device", "status", "--json"]))
    }

    /// Waits until the status meets a condition.
    fn wait_for(&self, what: &str, is_there: impl Fn(&Value) -> bool) {
        let begun = Instant::now();
        loop {
            let status = self.status();
            if is_there(&status) {
                return;
            }
            assert!(begun.elapsed() < SOON, "no {what}: {status}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Ends the board by closing its input; returns the remaining standard output, and standard error.
    fn end(mut self) -> (String, String) {
        drop(self.child.stdin.take());
        let mut printed = String::new();
        self.printed.read_to_string(&mut printed).expect("text");
        let output = self.child.wait_with_output().expect("it ends");
        says(&output, 0, &[]);
        (printed, text(&output.stderr))
    }
}

const TABLE: &str = "format = 1
illuminance_lx = [50.0, 1000.0]
interval = [1.0]
l2a = [
  [1.5],
  [2.5],
]
";

#[test]
fn a_table_a_calibration_and_a_message_are_tried_without_hardware() {
    let place = folder("simulated");
    let board = Simulator::start(&["--light-lx", "1000"]);
    let status = board.status();
    assert_eq!(status["board"], "simulated");
    assert_eq!(status["faults"], serde_json::json!(["no_table", "no_calibration"]));
    board.wait_for("light", |status| {
        (status["illuminance_lx"].as_f64().unwrap_or(0.0) - 1000.0).abs() < 0.01
    });

    let table = place.join("table.toml");
    std::fs::write(&table, TABLE).expect("written");
    says(&board.vocc(&["table", "verify", name(&table)]), 1, &[]);
    says(&board.vocc(&["table", "push", name(&table)]), 0, &[]);
    says(&board.vocc(&["table", "verify", name(&table)]), 0, &[]);
    assert_eq!(text(&board.vocc(&["table", "pull"]).stdout), TABLE);
    // L* = 2.5·1000·0.4, of the default panel's 26 000 cd/m².
    board.wait_for("the table's light", |status| {
        (status["luminance_cd_m2"].as_f64().unwrap_or(0.0) - 1000.0).abs() < 1.0
    });

    let calibration = place.join("calibration.toml");
    let measured = text(&board.vocc(&["device", "calibration"]).stdout);
    assert!(measured.contains("luminance_full_cd_m2 = 26000.0"), "{measured}");
    let own = measured.replace("26000.0", "20000.0");
    std::fs::write(&calibration, &own).expect("written");
    let written = board.vocc(&["device", "calibration", name(&calibration)]);
    assert_eq!(text(&written.stdout), own);
    board.wait_for("the calibration's duty", |status| {
        (status["duty"].as_f64().unwrap_or(0.0) - 0.05).abs() < 1e-4
    });
    assert_eq!(board.status()["faults"], serde_json::json!([]));

    says(&board.vocc(&["device", "send", "--message", "ice"]), 0, &[]);
    assert_eq!(board.status()["sending"], true);
    let watched = board.vocc(&["device", "watch", "--count", "3", "--interval", "0.05"]);
    assert_eq!(text(&watched.stdout).lines().count(), 3);
    says(&board.vocc(&["device", "send", "--stop"]), 0, &[]);
    let before = board.status()["symbols"].as_u64().expect("a number");
    board.wait_for("90 symbols more", |status| status["symbols"].as_u64() >= Some(before + 90));
    board.end();
}

/// A template with the luminance of the default panel.
fn measured(template: &str) -> String {
    template.replace("luminance_full_cd_m2 = 0.0", "luminance_full_cd_m2 = 26000.0")
}

#[test]
fn a_calibration_to_fill_in_is_refused_until_its_luminance_is_there() {
    let place = folder("calibration-template");
    let file = place.join("mine.toml");
    let template = ["device", "calibration", "--template"];
    let printed = vocc(&template);
    says(&printed, 0, &[]);
    let written = vocc(&[&template[..], &[name(&file)]].concat());
    says(&written, 0, &[]);
    let text_of = |path: &Path| std::fs::read_to_string(path).expect("there");
    assert_eq!(text_of(&file), text(&printed.stdout));
    for words in ["cd/m², 1 to 1000000", "0.05 to 1", "0.5 to 3", "0.01 to 1000"] {
        assert!(text_of(&file).contains(words), "{words:?} is missing");
    }

    // This panel has no calibration yet.
    let board = Simulator::start(&[]);
    says(&board.vocc(&["device", "calibration", name(&file)]), 2, &["full luminance 0"]);
    assert_eq!(board.status()["faults"], serde_json::json!(["no_table", "no_calibration"]));

    // The template's values are the defaults of a new board.
    let before = board.vocc(&["device", "calibration", "--json"]);
    std::fs::write(&file, measured(&text(&printed.stdout))).expect("written");
    let after = board.vocc(&["device", "calibration", name(&file), "--json"]);
    says(&after, 0, &[]);
    assert_eq!(text(&before.stdout), text(&after.stdout));
    assert_eq!(board.status()["faults"], serde_json::json!(["no_table"]));
    board.end();

    let own = text_of(&file).replace("26000.0", "12345.0");
    std::fs::write(&file, &own).expect("written");
    refused(&[&template[..], &[name(&file)]].concat(), &["exists"]);
    assert_eq!(text_of(&file), own);
    refused(&["device", "calibration"], &["--port <P>"]);
}

#[test]
fn light_is_turned_up_and_down_and_the_sensor_taken_away() {
    let mut board = Simulator::start(&["--light-lx", "20000"]);
    let luminance = |status: &Value| status["luminance_cd_m2"].as_f64().unwrap_or(0.0);
    board.wait_for("daylight", |status| luminance(status) > 5000.0);
    board.tell("light 500");
    board.wait_for("dusk", |status| {
        (status["illuminance_lx"].as_f64().unwrap_or(0.0) - 500.0).abs() < 10.0
    });
    board.tell("light 100000");
    board.wait_for("more light than it can read", |status| status["light"] == "daylight");
    for (light, known, order, fault) in [
        ("light 500", "measured", "sensor missing", "sensor_missing"),
        ("light 500", "measured", "sensor stuck", "sensor_stuck"),
        ("light 100000", "daylight", "sensor stuck", "sensor_stuck"),
    ] {
        board.tell(light);
        board.tell("sensor works");
        board.wait_for("a sensor that works", |status| status["light"] == known);
        board.tell(order);
        board.wait_for(fault, |status| status["light"] == "lost" && status["faults"][0] == fault);
        // The night limit, 200·R.
        assert!(luminance(&board.status()) <= 80.1);
    }
    board.tell("dim");
    let (_, said) = board.end();
    assert!(said.contains("\"dim\" is not a command"), "{said}");
}

#[test]
fn the_flash_survives_and_is_one_boards_at_a_time() {
    let place = folder("simulated-flash");
    let (flash, table) = (place.join("flash"), place.join("table.toml"));
    std::fs::write(&table, TABLE).expect("written");
    let flash = name(&flash);
    let mut board = Simulator::start(&["--flash", flash]);
    says(&board.vocc(&["table", "push", name(&table)]), 0, &[]);
    says(&board.vocc(&["device", "rate", "27"]), 0, &[]);
    refused(
        &["device", "simulate", "--flash", flash],
        &["another simulated board", "give another file"],
    );
    board.tell("restart");
    let faults = serde_json::json!(["no_calibration"]);
    board.wait_for("a restart", |status| status["frames"].as_u64() < Some(5));
    assert_eq!(board.status()["faults"], faults);
    board.end();

    let board = Simulator::start(&["--flash", flash]);
    says(&board.vocc(&["table", "verify", name(&table)]), 0, &[]);
    let before = board.status();
    assert_eq!(before["faults"], faults);
    assert_eq!(before["symbol_rate_hz"], 27.0);
    let symbols = |status: &Value| status["symbols"].as_f64().unwrap_or(0.0);
    let uptime_s = |status: &Value| status["uptime_s"].as_f64().unwrap_or(0.0);
    board.wait_for("three seconds", |status| uptime_s(status) >= 3.0);
    let status = board.status();
    let rate_hz = symbols(&status) / (uptime_s(&status) + 0.5);
    assert!((15.0..40.0).contains(&rate_hz), "{rate_hz} symbols a second");
    board.end();
    refused(
        &["device", "simulate", "--flash", name(&table)],
        &["not a board's flash memory", "65536"],
    );
    assert_eq!(std::fs::read_to_string(&table).expect("there"), TABLE);
}

#[test]
fn a_limit_of_the_intensity_is_kept_to_whatever_the_light_and_without_power_too() {
    let place = folder("simulated-limit");
    let (flash, limited) = (place.join("flash"), place.join("limited.toml"));
    // The low current's shortest pulse, by which the limit is approached, is a sixth of the full one's.
    let plain = measured(&text(&vocc(&["device", "calibration", "--template"]).stdout))
        .replace("low_current_share = 1.0", "low_current_share = 0.164");
    let limit = "max_cd = 10.0\nled_diameter_m = 0.03\n";
    std::fs::write(&limited, format!("{plain}{limit}")).expect("written");
    // 10 cd are 442 cd/m².
    let most_cd_m2 = 10.0 / (8.0 * std::f64::consts::PI * 0.03 * 0.03);
    let luminance = |status: &Value| status["luminance_cd_m2"].as_f64().unwrap_or(f64::NAN);

    let mut board = Simulator::start(&["--flash", name(&flash), "--light-lx", "10000"]);
    board.wait_for("daylight", |status| luminance(status) > 2.0 * most_cd_m2);
    says(&board.vocc(&["device", "calibration", name(&limited)]), 0, &[]);
    let is_limited = |status: &Value| status["limited"] == "intensity";
    board.wait_for("the limit", is_limited);
    for order in ["light 60000", "restart"] {
        board.tell(order);
        board.wait_for(order, is_limited);
        let given = luminance(&board.status());
        assert!(given <= most_cd_m2 && given > 0.9 * most_cd_m2, "{given}");
    }
    board.end();
}

#[test]
fn the_port_has_a_name_of_ones_own_for_as_long_as_it_is_there() {
    let place = folder("simulated-link");
    let link = place.join("tx");
    // A link of a board that was killed.
    std::os::unix::fs::symlink("/dev/pts/no-more", &link).expect("a link");
    let mut board = Simulator::start(&["--link", name(&link), "--json"]);
    let told: Value = serde_json::from_str(&board.port).expect("JSON");
    assert_eq!(
        std::fs::read_link(&link).expect("a link"),
        Path::new(told["port"].as_str().expect("a name"))
    );
    board.port = name(&link).into();
    assert_eq!(board.status()["board"], "simulated");
    refused(&["device", "simulate", "--link", name(&link)], &["exists", "another name"]);
    assert!(link.exists());
    common::bounded::signal("-TERM", board.child.id());
    assert!(board.child.wait().expect("it ends").success());
    assert!(!link.is_symlink());

    let mine = place.join("mine");
    std::fs::write(&mine, "mine").expect("written");
    refused(&["device", "simulate", "--link", name(&mine)], &["exists"]);
    assert_eq!(std::fs::read_to_string(&mine).expect("there"), "mine");
}

#[test]
fn a_job_in_the_background_that_has_no_input_goes_on() {
    let mut child = command(&["device", "simulate"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("vocc runs");
    let mut port = String::new();
    let mut printed = BufReader::new(child.stdout.take().expect("piped"));
    printed.read_line(&mut port).expect("a line");
    // Each computer that opens the port alone leaves it usable for the next.
    for _ in 0..2 {
        std::thread::sleep(Duration::from_millis(300));
        says(&vocc(&["device", "status", "--port", port.trim()]), 0, &[]);
    }
    assert!(child.try_wait().expect("a child").is_none());
    child.kill().expect("it runs");
    child.wait().expect("it ends");
}

#[test]
fn what_the_leds_show_is_what_the_message_makes() {
    let place = folder("simulated-symbols");
    let shown = place.join("shown.txt");
    let board = Simulator::start(&["--symbols", name(&shown)]);
    says(&board.vocc(&["device", "send", "--message", "ice ahead"]), 0, &[]);
    let before = board.status()["symbols"].as_u64().expect("a number");
    board.wait_for("a repeat", |status| status["symbols"].as_u64() > Some(before + 60));
    board.end();
    let shown = std::fs::read_to_string(&shown).expect("written at the end");
    let bits: Vec<&str> = shown.lines().map(|line| line.split(' ').next().expect("a word")).collect();
    let code = Code::for_length("ice ahead".len());
    let mut framer = Framer::new(b"ice ahead", code, true).expect("a message");
    let panels: Vec<String> = (0..framer.panels_per_repeat()).map(|_| framer.next_panel().to_string()).collect();
    assert!(
        bits.windows(panels.len()).any(|window| window == panels),
        "{panels:?} are not among {bits:?}"
    );
    // The light that 10 000 lx require.
    let light: f64 = shown.trim().rsplit(' ').next().expect("a word").parse().expect("a number");
    assert!((0.05..1.0).contains(&light), "{light}");

    let mut board = Simulator::start(&["--symbols", "-", "--json"]);
    let mut first = String::new();
    board.printed.read_line(&mut first).expect("a line");
    board.end();
    let first: Value = serde_json::from_str(&first).expect("JSON");
    assert_eq!(first["bits"].as_str().expect("bits").len(), 16);
}

#[test]
fn what_is_sent_is_filmed_and_received() {
    let place = folder("simulated-film");
    let frames = place.join("frames");
    let small = ["--set", "camera.width_px=320", "--set", "camera.height_px=240"];
    let film = ["--frames", name(&frames), "--count", "200"];
    let mut board = Simulator::start(&[&small[..], &film].concat());
    says(&board.vocc(&["device", "send", "--message", "ice ahead"]), 0, &[]);
    // The board ends with the film.
    assert!(board.child.wait().expect("it ends").success());
    assert_eq!(std::fs::read_dir(&frames).expect("a folder").count(), 200);
    let received = vocc(&["receive", name(&frames)]);
    says(&received, 0, &[]);
    assert!(text(&received.stdout).contains("ice ahead"), "{}", text(&received.stdout));
    refused(&[&["device", "simulate"], &film[..]].concat(), &["already holds frames"]);

    // The same film through a pipe, while it is shown.
    let pipe = place.join("pipe");
    common::bounded::pipe(&pipe);
    let film = std::fs::OpenOptions::new().read(true).write(true).open(&pipe);
    let film = film.expect("a pipe");
    let board = Simulator::start(&[&small[..], &["--film", name(&pipe), "--count", "200"]].concat());
    let receiver = command(&["receive", "-"])
        .stdin(std::fs::File::open(&pipe).expect("a pipe"))
        .stdout(Stdio::piped())
        .spawn()
        .expect("vocc runs");
    drop(film);
    says(&board.vocc(&["device", "send", "--message", "ice ahead"]), 0, &[]);
    let received = receiver.wait_with_output().expect("it ends");
    assert!(text(&received.stdout).contains("ice ahead"), "{}", text(&received.stdout));
}

/// The key is read from its file and never reported by the board; counters continue after a restart.
#[test]
fn a_board_with_a_key_signs_what_it_is_sent_and_is_proven() {
    let place = folder("simulated-key");
    let [key, trusted, flash] = ["key.toml", "keys.toml", "flash"].map(|file| place.join(file));
    let (key, trusted, flash) = (name(&key), name(&trusted), name(&flash));
    write_key(key, trusted);
    let shown = vocc(&["keys", "show", key, "--json"]);
    let signer = json(&shown)["signer"].clone();

    let board = Simulator::start(&["--flash", flash]);
    assert!(text(&board.vocc(&["device", "key"]).stdout).contains("has no key"));
    assert_eq!(
        (&board.status()["signer"], &board.status()["signer_counter"]),
        (&Value::Null, &Value::Null)
    );
    let given = board.vocc(&["device", "key", "--key", key, "--counter", "100", "--json"]);
    assert_eq!((&json(&given)["signer"], &json(&given)["signer_counter"]), (&signer, &100.into()));
    assert_eq!(
        (&board.status()["signer"], &board.status()["signer_counter"]),
        (&signer, &100.into())
    );
    board.end();

    for counter in [100, 164] {
        let frames = place.join(format!("frames-{counter}"));
        let small = ["--set", "camera.width_px=320", "--set", "camera.height_px=240"];
        let film = ["--frames", name(&frames), "--count", "200", "--flash", flash];
        let mut board = Simulator::start(&[&small[..], &film].concat());
        says(&board.vocc(&["device", "send", "--message", "ice ahead"]), 0, &[]);
        assert!(board.child.wait().expect("it ends").success());
        let received = vocc(&["receive", name(&frames), "--trust", trusted, "--only-trusted", "--json"]);
        says(&received, 0, &[]);
        let lines = text(&received.stdout);
        let proven = lines.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        let proven: Vec<_> = proven.filter(|line| line["message"] == "ice ahead").collect();
        assert!(!proven.is_empty(), "{lines}");
        assert_eq!((&proven[0]["verdict"], &proven[0]["signer"]), (&"proven".into(), &signer));
        assert_eq!(proven[0]["counter"], counter);
    }

    let secret = std::fs::read_to_string(key).expect("a key");
    let secret = secret.lines().find_map(|line| line.strip_prefix("secret = \"")).expect("a secret");
    let secret: Vec<u8> = (0..32)
        .map(|byte| u8::from_str_radix(&secret[2 * byte..2 * byte + 2], 16).expect("digits"))
        .collect();
    let holds_it = || std::fs::read(flash).expect("a flash").windows(32).any(|window| window == secret);
    assert!(holds_it());
    #[cfg(unix)]
    {
        let mode = std::os::unix::fs::MetadataExt::mode(&std::fs::metadata(flash).expect("a flash"));
        assert_eq!(mode & 0o077, 0, "others can read the key in the flash memory's file");
    }
    let board = Simulator::start(&["--flash", flash]);
    assert!(text(&board.vocc(&["device", "key", "--erase"]).stdout).contains("has no key"));
    board.end();
    assert!(!holds_it());
}

#[test]
fn what_is_sent_by_a_carrier_is_filmed_and_received() {
    let place = folder("simulated-carrier");
    let flash = place.join("flash");
    let board = Simulator::start(&["--flash", name(&flash)]);
    says(&board.vocc(&["device", "rate", "90", "--carrier-cycles", "16"]), 0, &[]);
    board.end();

    // An exposure of a whole cycle does not see the carrier.
    for (exposure_s, is_received) in [("0.00025", true), ("0.00069444", false)] {
        let frames = place.join(exposure_s);
        let exposure = format!("camera.exposure_max_s={exposure_s}");
        let sets = ["camera.width_px=320", "camera.height_px=240", &exposure];
        let small: Vec<&str> = sets.iter().flat_map(|&set| ["--set", set]).collect();
        let film = ["--flash", name(&flash), "--frames", name(&frames), "--count", "200"];
        let mut board = Simulator::start(&[&small[..], &film].concat());
        assert_eq!(board.status()["carrier_cycles"], 16);
        says(&board.vocc(&["device", "send", "--message", "ice ahead"]), 0, &[]);
        assert!(board.child.wait().expect("it ends").success());
        let received = text(&vocc(&["receive", name(&frames)]).stdout);
        assert_eq!(received.contains("ice ahead"), is_received, "{exposure_s} s: {received}");
    }
}

#[test]
fn a_panel_is_calibrated_from_pictures_by_what_a_transmitter_can_do() {
    let place = folder("simulated-calibration");
    let pictures = place.join("pictures");
    std::fs::create_dir(&pictures).expect("a folder");
    let trial =
        measured(&text(&vocc(&["device", "calibration", "--template"]).stdout)).replace("shortest_pulse_ns = 100", "shortest_pulse_ns = 0");
    let light = ["camera.frame_rate_hz=4", "ambient.illuminance_lx=10000", "panel.reflectance=0.4"];
    let sets = SCENE.iter().chain(&light);
    let bench: Vec<&str> = sets.flat_map(|&set| ["--set", set]).collect();
    let (file, frames) = (place.join("trial.toml"), place.join("frames"));
    let board = Simulator::start(&[&bench[..], &["--frames", name(&frames)]].concat());
    says(&board.vocc(&["device", "rate", "9"]), 0, &[]);
    // The measured light approaches 10 000 lx for some seconds; a busy computer gives the board less time.
    let settled = |key: &str, is_there: &dyn Fn(f64) -> bool| {
        let begun = Instant::now();
        let (mut before, mut looked_at) = (f64::INFINITY, 0);
        loop {
            let status = board.status();
            let (now, symbol) = (
                status[key].as_f64().expect("a number"),
                status["symbols"].as_u64().expect("a number"),
            );
            // Half a second of the board's time.
            if symbol >= looked_at + 5 {
                if (now / before - 1.0).abs() < 1e-4 && is_there(now) {
                    return now;
                }
                (before, looked_at) = (now, symbol);
            }
            assert!(begun.elapsed() < SOON, "{key} goes on changing: {now}");
            std::thread::sleep(Duration::from_millis(100));
        }
    };
    settled("illuminance_lx", &|light| light > 9000.0);
    for turn in 0..10 {
        let full = 4000.0 * 2f64.powi(turn);
        let full = trial.replace("= 26000.0", &format!("= {:?}", full.min(1e6)));
        std::fs::write(&file, full).expect("written");
        says(&board.vocc(&["device", "calibration", name(&file)]), 0, &[]);
        let duty = settled("duty", &|_| true);
        let taken = || std::fs::read_dir(&frames).expect("a folder").count();
        // The film lags by some symbols, and its last frame may not be written yet. Four frames take nine symbols, so each phase occurs.
        let next = taken() + 5;
        let begun = Instant::now();
        while taken() < next + 5 {
            assert!(begun.elapsed() < SOON, "no frames");
            std::thread::sleep(Duration::from_millis(50));
        }
        for frame in next..next + 4 {
            let picture = pictures.join(format!("duty-{duty:.5}-{frame}.png"));
            let frame = frames.join(format!("frame-{frame:06}.png"));
            std::fs::copy(frame, picture).expect("a picture");
        }
    }
    board.end();
    let out = place.join("panel.toml");
    let wanted = [
        &["device", "calibrate", "--frames", name(&pictures), "--encoding", "2.2", "--json"][..],
        &PLACES,
        &["--illuminance-lx", "10000", "--out", name(&out)],
    ];
    let found = vocc(&wanted.concat());
    says(&found, 0, &[]);
    let found = json(&found);
    let holds = |key: &str, truth: f64| {
        let ends = [0, 1].map(|end| found[key][end].as_f64().expect("a number"));
        assert!((ends[0]..=ends[1]).contains(&truth), "{key}: {found}");
        assert!(ends[1] - ends[0] < 0.1 * truth, "{key}: {found}");
    };
    holds("reflectance_95", 0.4);
    holds("luminance_full_cd_m2_95", 26_000.0);
    // The pulses of the simulated driver are clean from 100 ns on.
    let number = |key: &str| found[key].as_f64().expect("a number");
    assert!(number("unclean_pulse_ns") < 90.0 && number("shortest_pulse_ns") > 90.0, "{found}");
    let board = Simulator::start(&[]);
    says(&board.vocc(&["device", "calibration", name(&out)]), 0, &[]);
    board.end();
    refused(&wanted.concat(), &["exists"]);
}

/// A file of a PIN that nobody else can read.
fn pin_file(place: &Path, pin: &str) -> String {
    use std::os::unix::fs::PermissionsExt;
    let path = place.join(format!("{pin}.pin"));
    std::fs::write(&path, format!("{pin}\n")).expect("written");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("it is ours");
    name(&path).to_owned()
}

/// Asserts success, and a word on standard output.
fn prints(output: &Output, word: &str) {
    says(output, 0, &[]);
    let printed = text(&output.stdout);
    assert!(printed.contains(word), "{word:?} is not in: {printed}");
}

#[test]
fn a_locked_board_changes_nothing_without_its_pin() {
    let place = folder("locked");
    let flash = place.join("flash.bin");
    let board = Simulator::start(&["--flash", name(&flash)]);
    let [first, second] = ["123456", "correct horse"].map(|pin| pin_file(&place, pin));
    assert_eq!(board.status()["locked"], false);
    prints(&board.vocc(&["device", "lock", "--new-pin-file", &first]), "locked");
    assert_eq!(board.status()["locked"], true);

    let table = place.join("table.toml");
    std::fs::write(&table, TABLE).expect("written");
    let changes: [&[&str]; 7] = [
        &["table", "push", name(&table)],
        &["device", "rate", "27"],
        &["device", "send", "--message", "ice"],
        &["device", "send", "--stop"],
        &["device", "key", "--erase"],
        &["device", "lock", "--new-pin-file", &second],
        &["device", "unlock"],
    ];
    for change in changes {
        refused(&[change, &["--port", &board.port]].concat(), &["the PIN is needed", "--pin-file"]);
    }
    let wrong = ["device", "rate", "27", "--pin-file", &second, "--port", &board.port];
    refused(&wrong, &["the PIN is wrong"]);
    prints(&board.vocc(&["device", "rate"]), "90");
    let opened = |words: &[&str]| board.vocc(&[words, &["--pin-file", &first]].concat());
    for change in &changes[..5] {
        says(&opened(change), 0, &[]);
    }
    says(&board.vocc(&["table", "verify", name(&table)]), 0, &[]);
    prints(&board.vocc(&["device", "rate"]), "27");
    says(&opened(&["device", "test", "--camera", "--kit", "desk", "--step", "0.4"]), 0, &[]);

    prints(&opened(changes[5]), "locked");
    board.end();
    let board = Simulator::start(&["--flash", name(&flash)]);
    assert_eq!(board.status()["locked"], true);
    refused(
        &["device", "unlock", "--pin-file", &first, "--port", &board.port],
        &["the PIN is wrong"],
    );
    prints(&board.vocc(&["device", "unlock", "--pin-file", &second]), "not locked");
    prints(&board.vocc(&["device", "rate", "30"]), "30");
}

#[test]
fn a_pin_comes_from_standard_input_or_a_file_that_is_ones_own() {
    use std::os::unix::fs::PermissionsExt;
    let place = folder("pins");
    let board = Simulator::start(&[]);
    let piped = |words: &[&str], text: &str| {
        let mut child = command(&[words, &["--port", &board.port]].concat())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("vocc runs");
        child.stdin.take().expect("piped").write_all(text.as_bytes()).expect("it reads");
        child.wait_with_output().expect("it ends")
    };
    says(&piped(&["device", "lock", "--new-pin-file", "-"], "123456\nmore"), 0, &[]);
    prints(&piped(&["device", "rate", "27", "--pin-file", "-"], "123456"), "27");
    says(
        &piped(&["device", "rate", "27", "--pin-file", "-"], "12345"),
        2,
        &["the PIN has 5 bytes", "6 to 128"],
    );

    let open = pin_file(&place, "123456");
    std::fs::set_permissions(&open, std::fs::Permissions::from_mode(0o644)).expect("it is ours");
    let unlock = ["device", "unlock", "--port", &board.port];
    refused(&[&unlock[..], &["--pin-file", &open]].concat(), &["can be read by other users"]);
    refused(&[&unlock[..], &["--pin-file", "none"]].concat(), &["cannot read the PIN"]);
    let both = ["device", "lock", "--pin-file", "-", "--new-pin-file", "-", "--port", &board.port];
    refused(&both, &["standard input is one PIN"]);
}
