//! `vocc` from a user's view: results, and errors on bad input.

mod common;

use common::{command, folder, json, json_lines, paths, refused, text, vocc, words};

#[test]
fn bad_scenes_are_refused() {
    refused(&["plan", "--set", "pose.distance_m=0"], &["pose.distance_m", "0.5 to 2000"]);
    refused(&["plan", "--set", "pose.distance_m=nan"], &["pose.distance_m", "NaN"]);
    refused(&["plan", "--set", "pose.distance_m=inf"], &["pose.distance_m"]);
    refused(&["plan", "--set", "pose.distance_cm=5000"], &["distance_cm", "distance_m"]);
    refused(&["plan", "--set", "pose.distance_m=50m"], &["50m"]);
    refused(&["plan", "--set", "pose.distance_cm=none"], &["distance_cm", "distance_m"]);
    refused(
        &["plan", "--set", "pose.x_m=1", "--set", "effects.noise=yes", "--set", "pose.y_m=1"],
        &["--set effects.noise=yes", "auto"],
    );
    refused(&["plan", "--set", "camera.width_px=-1"], &["-1"]);
    refused(&["plan", "--set", "pose.distance_m=-3"], &["pose.distance_m"]);
    refused(
        &words("render --out x.png --set panel.led_diameter_m=1 --set pose.distance_m=0.5"),
        &["sensor"],
    );
    refused(
        &words("plan --set pose.distance_m=0.5 --set pose.yaw_deg=80 --set panel.led_diameter_m=0.5"),
        &["in front"],
    );
    refused(&["plan", "--set", "pose.x_m=500"], &["1920"]);
    refused(&["plan", "--set", "pose.distance_m=2000"], &["px apart"]);
    refused(&["plan", "no-such-scene"], &["paper-18mm"]);
    refused(&["plan", "--set", "ambient.background_image=none.png"], &["none.png"]);
    refused(
        &["plan", "--set", "link.l2a=table", "--set", "link.table=none.toml"],
        &["none.toml"],
    );
    refused(&["evaluate", "--frames", "0"], &["--frames"]);
    refused(&["evaluate", "--frames", "18446744073709551615"], &["--frames"]);
    refused(&["plan", "--threads", "1000000"], &["1..=1024"]);
    refused(&["plan", "--set", "link.symbol_rate_hz=10000"], &["link.symbol_rate_hz"]);
    refused(&["link", "--set", "link.l2a=10"], &["link.l2a = 10", "0.2 to 4"]);
    refused(&["evaluate", "--detector", "wizard"], &["kmeans-raw"]);
    let scene = folder("scenes").join("broken.toml");
    std::fs::write(&scene, "[pose]\ndistance_m = fifty\n").expect("a file");
    refused(&["plan", common::name(&scene)], &["line 2"]);
    std::fs::write(&scene, "[pose]\ndistance_ft = 50\n").expect("a file");
    refused(&["plan", common::name(&scene)], &["distance_ft", "line 2"]);
}

#[test]
fn studies_of_single_frames_refuse_a_carrier() {
    let carrier = "--set=link.carrier_cycles=16";
    for command in [
        &["evaluate", "day", "--frames", "8"][..],
        &["optimize", "day", "--criterion", "b2w", "--frames", "64", "--intervals", "1"],
    ] {
        refused(&[command, &[carrier]].concat(), &["link.carrier_cycles = 16", "vocc link"]);
    }
}

#[test]
fn a_table_for_another_waveform_than_the_symbols_is_warned_of() {
    let folder = folder("waveforms");
    let path = folder.join("table.toml");
    let table = common::name(&path);
    std::fs::write(&path, "illuminance_lx = [50]\ninterval = [1]\nl2a = [[2]]\ncarrier_cycles = 16\n").expect("a file");
    let is_warned = |of: &[&str]| {
        let output = vocc(of);
        assert_ne!(output.status.code(), Some(2), "{of:?}: {}", text(&output.stderr));
        text(&output.stderr).contains("the table is made for")
    };
    for action in ["check", "show"] {
        let of = |cycles| is_warned(&["table", action, table, "--carrier-cycles", cycles]);
        assert_eq!(["0", "16", "17"].map(of), [true, false, true], "{action}");
        assert!(!is_warned(&["table", action, table]));
        assert_eq!(json(&vocc(&["table", action, table, "--json"]))["carrier_cycles"], 16);
        let said = text(&vocc(&["table", action, table]).stdout);
        assert!(said.contains("made for a carrier of 16 cycles a symbol"), "{said}");
    }
    refused(&["table", "check", table, "--carrier-cycles", "1"], &["1 cycles", "2 to 333"]);
    assert!(text(&vocc(&["table", "show"]).stdout).contains("made for still panels"));
    let link = |set: &[&str]| {
        let small = words("link day --frames 1 --set camera.width_px=160 --set camera.height_px=120");
        is_warned(&[&small[..], set].concat())
    };
    let own = format!("--set=link.table={table}");
    assert!(!link(&[]) && link(&["--set=link.carrier_cycles=16"]) && link(&[&own]));
    assert!(!link(&[&own, "--set=link.carrier_cycles=16"]));
    assert!(!link(&["--set=link.l2a=1", "--set=link.carrier_cycles=16"]));
}

/// A camera of 30 frames a second, with short messages.
const ADVICE: &str = "plan --camera phone --bytes 4 --runs 1 --set camera.width_px=160 --set=camera.height_px=120";

#[test]
fn a_camera_is_told_what_to_be_shown() {
    let advised = vocc(&[&words(ADVICE)[..], &["--set=panel.pwm_hz=2050", "--json"]].concat());
    let lines = json_lines(&advised);
    let (last, all) = lines.split_last().expect("lines");
    let (tried, carried): (Vec<_>, Vec<_>) = all.iter().partition(|row| row["carrier_cycles"] == 0);
    let net = |row: &serde_json::Value| row["net_bit_s"].as_f64().expect("a net rate");
    let most = tried.iter().map(|row| net(row)).fold(0.0, f64::max);
    assert_eq!(net(&last["best"]), most);
    // Every code once, and one of them with another rate.
    let codes: std::collections::HashSet<_> = tried.iter().map(|row| row["code"].to_string()).collect();
    assert!(codes.len() == 5 && tried.len() > 5, "{lines:?}");
    assert!(most > 0.0, "{lines:?}");
    // Carriers were tried, and one is recommended or refused with a reason.
    assert!(tried.iter().all(|row| row["ber"].is_f64()) && carried.iter().all(|row| row["ber"].is_null()));
    assert!(
        !carried.is_empty() && last["carrier"].is_null() != last["no_carrier"].is_null(),
        "{last}"
    );
    // An exposure contains fewer than two such slow pulses.
    assert_eq!(last["dimming"][0]["beats"], true);
    assert_eq!(last["dimming"][0]["beat_hz"], 10.0);
    let said = text(&vocc(&words(ADVICE)).stdout);
    assert!(said.contains("device rate") && said.contains("symbols/s"), "{said}");
}

/// The arguments of the printed `vocc link` command.
fn printed_link(said: &str) -> Vec<&str> {
    let command = said.lines().find(|line| line.starts_with("vocc link ")).expect("a command");
    // No word holds a space.
    command.split_whitespace().skip(1).map(|word| word.trim_matches('\'')).collect()
}

#[test]
fn a_recommended_carrier_delivers_as_printed() {
    // One camera exposes line by line. It is put into a scene with another camera, whose exposure is fixed.
    let other = common::folder("other-camera").join("other.toml");
    std::fs::write(&other, "[camera]\nexposure_s = 0.0001\njpeg_quality = 5\n").expect("room");
    for camera in [
        &["day", "--camera", "day"][..],
        &[
            common::name(&other),
            "--camera",
            "phone",
            "--set=camera.frame_rate_hz=60",
            "--set=camera.exposure_max_s=0.01",
            "--set=camera.readout_s=0.012",
        ],
    ] {
        let own = words("--set=camera.exposure_s=0.00025 --set camera.width_px=320 --set camera.height_px=240 --set link.l2a=2");
        let plan = vocc(&[&words("plan --bytes 8 --runs 1")[..], camera, &own].concat());
        let said = text(&plan.stdout);
        let link = printed_link(&said);
        assert_eq!(link.contains(&"camera.jpeg_quality=none"), camera[0] != "day", "{said}");
        let sent = vocc(&link);
        assert_eq!(sent.status.code(), Some(0), "{said}{}", text(&sent.stdout));
    }
    // An exposure of several cycles hides them.
    let long = vocc(&[&words(ADVICE)[..], &["--set=camera.exposure_s=0.002"]].concat());
    let said = text(&long.stdout);
    assert!(
        said.contains("no carrier to recommend") && said.contains("expose for 0.0003"),
        "{said}"
    );
    assert!(!said.contains("--carrier-cycles"), "{said}");
}

#[test]
fn advice_for_no_camera_is_refused() {
    refused(&["plan", "--camera", "fone"], &["--camera", "phone"]);
    refused(&["plan", "--bytes", "48"], &["--camera"]);
    let with = |option: &'static str| [&words(ADVICE)[..3], &[option]].concat();
    refused(&with("--bytes=0"), &["1..=1024"]);
    refused(&with("--runs=0"), &["from 1 to 10000"]);
    refused(&with("--set=camera.frame_rate_hz=8"), &["8 frames a second", "9 to 300"]);
    refused(&with("--set=camera.readout_s=-1"), &["readout_s"]);
}

#[test]
fn bad_messages_are_refused() {
    refused(&["link", "--message", ""], &["1", "1024"]);
    refused(&["link", "--message", &"x".repeat(1025)], &["1025", "1024"]);
    refused(&["transmit"], &["--message"]);
    refused(&["transmit", "--message-file", "none.txt"], &["none.txt"]);
    refused(
        &["transmit", "--message", "hi", "--count", "16777217"],
        &["16777217", "0..=16777216"],
    );
}

#[test]
fn flicker_is_told_at_each_symbol_rate() {
    let output = vocc(&["transmit", "--flicker", "--json", "--symbol-rate", "27,9000"]);
    let report = json(&output);
    assert!(report["message_bytes"].is_null());
    let [slow, fast] = [0, 1].map(|k| &report["rates"][k]);
    assert_eq!(slow["symbols_hz"], 27.0);
    assert_eq!(slow["worst_led"]["seen"], "flickers");
    // A beacon is 6 symbols long, so nothing is slower than 4.5 Hz.
    assert_eq!(slow["worst_led"]["hz"], 4.5);
    let over = |light: &serde_json::Value| light["times_limit"].as_f64().unwrap_or(0.0) > 1.0;
    assert!(over(&slow["worst_led"]) && over(&slow["panel"]));
    assert!(!over(&fast["worst_led"]) && !over(&fast["panel"]));
    let lowest_hz = report["lowest"][0]["low_risk_hz"].as_f64().expect("a rate");
    assert!((300.0..9000.0).contains(&lowest_hz), "{lowest_hz}");

    let folder = folder("flicker");
    let plot = folder.join("flicker.png");
    let plot = common::name(&plot);
    let told = vocc(&["transmit", "--flicker", "--message", "Ice", "--plot", plot]);
    assert_eq!(told.status.code(), Some(0), "{}", text(&told.stderr));
    for word in ["10 symbols", "flickers", "Manchester", "9 to 300"] {
        assert!(text(&told.stdout).contains(word), "{}", text(&told.stdout));
    }
    image::open(plot).expect("a picture");
    assert!(folder.join("flicker.svg").exists());
}

#[test]
fn with_a_carrier_a_panel_is_told_by_all_standards() {
    let told = vocc(&["transmit", "--flicker", "--json", "--carrier-cycles", "16"]);
    let report = json(&told);
    assert_eq!(report["carrier_cycles"], 16);
    let rates = report["rates"].as_array().expect("rates");
    let hz: Vec<f64> = rates.iter().filter_map(|rate| rate["symbols_hz"].as_f64()).collect();
    assert_eq!(hz, [27.0, 45.0, 90.0]);
    for standards in rates[2]["by_standards"].as_array().expect("two lights") {
        let of = |key: &str| standards[key].as_f64().expect("a number");
        assert!(
            of("low_risk_times") < 1.0 && of("pst_lm") < 1.0 && of("longest_period_s") < 0.005,
            "{standards}"
        );
        assert!(of("svm") > 0.0);
    }
    // Still panels for comparison.
    let still = json(&vocc(&words("transmit --flicker --json --carrier-cycles 0 --symbol-rate 90")));
    assert!(still["rates"][0]["by_standards"][0]["pst_lm"].as_f64() > Some(10.0), "{still}");
    let plain = json(&vocc(&["transmit", "--flicker", "--json", "--symbol-rate", "90"]));
    assert!(plain.get("carrier_cycles").is_none() && plain["rates"][0].get("by_standards").is_none());
    let text_told = vocc(&["transmit", "--flicker", "--carrier-cycles", "16"]);
    for word in ["1440", "PstLM", "SVM", "802.15.7", "61547-1"] {
        assert!(text(&text_told.stdout).contains(word), "{}", text(&text_told.stdout));
    }
}

#[test]
fn panels_are_told_with_how_they_are_shown() {
    let first = |arguments: &[&str]| -> serde_json::Value {
        let output = vocc(&[&["transmit", "--json", "--message", "Ice", "--count", "1"], arguments].concat());
        serde_json::from_slice(&output.stdout).expect("a line of JSON")
    };
    let still = first(&[]);
    assert_eq!((&still["carrier_cycles"], &still["symbol_s"]), (&0.into(), &(1.0 / 90.0).into()));
    let carried = first(&["--carrier-cycles", "54", "--symbol-rate", "27"]);
    assert_eq!(
        (&carried["carrier_cycles"], &carried["symbol_s"]),
        (&54.into(), &(1.0 / 27.0).into())
    );
    assert_eq!(carried["panel"], still["panel"]);
    let plain = vocc(&["transmit", "--message", "Ice", "--count", "1"]);
    assert_eq!(carried["bits"], text(&plain.stdout).trim());
}

#[test]
fn flicker_that_cannot_be_told_is_refused() {
    let refused_rate = |rate| refused(&["transmit", "--flicker", "--symbol-rate", rate], &[rate, "0.1 to 1000000"]);
    for rate in ["0", "-5", "NaN", "inf", "1e9", "fast"] {
        refused_rate(rate);
    }
    let long = "x".repeat(1025);
    refused(&["transmit", "--flicker", "--message", &long], &["1025", "1024"]);
    refused(&["transmit", "--flicker", "--message", ""], &["1 to 1024"]);
    refused(&["transmit", "--flicker", "--raw"], &["--raw"]);
    refused(&["transmit", "--message", "Ice", "--symbol-rate", "27,90"], &["--flicker"]);
    for (cycles, words) in [("1", "2 to 333"), ("334", "2 to 333"), ("40", "3600 Hz, outside 200 to 3000")] {
        for command in [&["transmit", "--flicker"][..], &["transmit", "--message", "Ice"]] {
            refused(&[command, &["--symbol-rate", "90", "--carrier-cycles", cycles]].concat(), &[words]);
        }
    }
}

#[test]
fn bad_images_are_refused() {
    let path = paths("images");
    image::RgbImage::from_pixel(64, 64, image::Rgb([1, 2, 3]))
        .save(path("colour.png"))
        .expect("a file");
    image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([(x * y) as u8; 3]))
        .save(path("whole.jpg"))
        .expect("a file");
    let photograph = std::fs::read(path("whole.jpg")).expect("a file");
    std::fs::write(path("truncated.jpg"), &photograph[..photograph.len() * 3 / 4]).expect("a file");
    image::GrayImage::from_pixel(63, 64, image::Luma([7]))
        .save(path("odd.png"))
        .expect("a file");
    std::fs::write(path("nonsense.toml"), "blur_sigma_px = \"wide\"").expect("a file");
    std::fs::write(path("impossible.toml"), "encoding = { gamma = 9 }").expect("a file");
    image::GrayImage::from_pixel(64, 64, image::Luma([7]))
        .save(path("black.png"))
        .expect("a file");
    let whole = std::fs::read(path("black.png")).expect("a file");
    std::fs::write(path("truncated.png"), &whole[..whole.len() / 2]).expect("a file");
    std::fs::write(path("empty.png"), b"").expect("a file");
    std::fs::write(path("none.pgm"), b"P5\n0 0\n255\n").expect("a file");
    refused(&["decode", &path("colour.png"), "--bayer", "RGGB"], &["colour.png", "omit --bayer"]);
    refused(&["decode", &path("odd.png"), "--bayer", "rggb"], &["odd.png", "63 × 64", "even"]);
    refused(&["decode", &path("odd.png"), "--bayer", "RGBG"], &["GRBG"]);
    refused(&["decode", &path("truncated.jpg")], &["truncated.jpg", "ends too soon"]);
    for command in ["decode", "receive"] {
        for (file, words) in [
            ("nonsense.toml", "blur_sigma_px"),
            ("impossible.toml", "gamma of 9"),
            ("missing.toml", "missing.toml"),
        ] {
            refused(&[command, &path("black.png"), "--camera", &path(file)], &[file, words]);
        }
    }
    refused(&["evaluate", "--camera", &path("impossible.toml")], &["gamma of 9"]);
    refused(&["link", "--camera", &path("impossible.toml")], &["gamma of 9"]);
    let film = [&path("black.png"), &path("odd.png")];
    refused(&["receive", film[0], film[1]], &["63 × 64", "64 × 64", "one size"]);
    refused(&["decode", &path("truncated.png")], &["truncated.png"]);
    refused(&["decode", &path("empty.png")], &["empty.png"]);
    refused(&["decode", &path("none.pgm")], &["none.pgm"]);
    refused(&["decode", &path("missing.png")], &["missing.png"]);
    refused(&["receive", &path("missing.png")], &["missing.png"]);
    refused(&["receive", "road.mp4"], &["cannot read road.mp4"]);
    let two = ["receive", "road.mp4", "road.mp4"];
    refused(&two, &["is a film", "ffmpeg -i road.mp4"]);
    refused(&["receive", "-"], &["--raw"]);
    refused(&["receive", "-", "--raw", "0x10"], &["WIDTHxHEIGHT"]);
    let crossed = "10,10,50,50,50,10,10,50";
    refused(&["decode", &path("black.png"), "--corners", crossed], &["corner"]);
    refused(&["decode", &path("black.png"), "--corners", "10,10,50,10,50,50"], &["--corners"]);
    refused(&["decode", &path("black.png"), "--corners", "1,1,nan,1,9,9,1,9"], &[]);
    refused(
        &["decode", &path("black.png"), "--corners", "10,10,90,10,90,90,10,90"],
        &["black.png"],
    );
    let near = "10,10,17,10,17,17,10,17";
    refused(
        &["decode", &path("black.png"), "--corners", near],
        &["--corners", "1.00 px apart", "show the panel larger"],
    );
    refused(&["decode", &path("black.png"), "--detector", "fisher"], &["fisher"]);
    // A valid image without a panel is not bad input: the answer is no.
    let answer = vocc(&["decode", "--json", &path("black.png")]);
    assert_eq!(answer.status.code(), Some(1));
    assert_eq!(json(&answer)["found"], false);
    // A bad image does not affect the results of good ones.
    let answer = vocc(&["decode", &path("empty.png"), &path("black.png")]);
    assert_eq!(answer.status.code(), Some(2));
    assert!(text(&answer.stdout).contains("black.png"));
}

#[test]
fn what_is_sent_is_received() {
    let frames = folder("frames");
    let frames = common::name(&frames);
    let link = vocc(&["link", "--json", "--message", "Ice on the bridge", "--save", frames]);
    assert_eq!(link.status.code(), Some(0), "{}", text(&link.stderr));
    let link = json(&link);
    assert_eq!((&link["delivered"], &link["bit_errors"]), (&true.into(), &0.into()));
    assert!(
        link["plan"]
            .as_array()
            .is_some_and(|plan| { plan.iter().any(|effect| effect["effect"] == "blur" && effect["included"] == true) })
    );
    let receive = vocc(&["receive", "--json", frames]);
    assert_eq!(
        (receive.status.code(), &json_lines(&receive)[0]["message"]),
        (Some(0), &"Ice on the bridge".into())
    );
    let transmit = vocc(&["transmit", "--message", "Ice on the bridge", "--count", "1"]);
    let decode = vocc(&["decode", "--json", &format!("{frames}/frame-000000.png")]);
    assert_eq!(json(&decode)["bits"], text(&transmit.stdout).trim());
}

#[test]
fn without_a_command_a_message_is_sent_and_nothing_is_written() {
    let place = folder("demonstration");
    let run = command(&[]).current_dir(&place).output().expect("vocc runs");
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    assert!(text(&run.stdout).contains("received"), "{}", text(&run.stdout));
    assert_eq!(std::fs::read_dir(&place).expect("a folder").count(), 0);
}

#[test]
fn raw_frames_come_in_on_standard_input() {
    let folder = folder("raw");
    let frames = common::name(&folder);
    assert_eq!(vocc(&["link", "--message", "hi", "--save", frames]).status.code(), Some(0));
    let mut names: Vec<_> = std::fs::read_dir(&folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    names.sort();
    let bytes: Vec<u8> = names
        .iter()
        .flat_map(|name| image::open(name).expect("a frame").into_luma8().into_raw())
        .collect();
    let raw = folder.join("frames.gray");
    let receive = |bytes: &[u8]| {
        std::fs::write(&raw, bytes).expect("a file");
        let input = std::fs::File::open(&raw).expect("the file");
        command(&["receive", "-", "--raw", "1920x1080"])
            .stdin(input)
            .output()
            .expect("vocc runs")
    };
    let whole = receive(&bytes);
    assert_eq!(whole.status.code(), Some(0));
    assert!(text(&whole.stdout).contains("\"hi\""));
    let cut = receive(&bytes[..bytes.len() - 1000]);
    assert_eq!(cut.status.code(), Some(2));
    assert!(text(&cut.stdout).contains("\"hi\""), "what came whole is not lost");
    assert!(text(&cut.stderr).contains("inside a frame"));
}

#[test]
fn renders_are_what_they_are_asked_to_be() {
    let folder = folder("render");
    let path = |name: &str| folder.join(name).to_str().expect("a name").to_string();
    let bits = "8040201008040201";
    for level in ["reference", "fine", "fast"] {
        let output = vocc(&[
            "render",
            "--json",
            "--crop",
            "--bits",
            bits,
            "--level",
            level,
            "--out",
            &path("crop.png"),
            "--linear",
            &path("crop.npy"),
        ]);
        let report = json(&output);
        assert_eq!((&report["bits"], &report["level"]), (&bits.into(), &level.into()));
        let corners: Vec<String> = report["corners_px"]
            .as_array()
            .expect("corners")
            .iter()
            .flat_map(|c| [c[0].to_string(), c[1].to_string()])
            .collect();
        let decoded = vocc(&["decode", "--json", &path("crop.png"), "--corners", &corners.join(",")]);
        assert_eq!(json(&decoded)["bits"], bits, "{level}");
    }
    let first = std::fs::read(path("crop.png")).expect("a picture");
    vocc(&[
        "render",
        "--crop",
        "--bits",
        bits,
        "--level",
        "fast",
        "--threads",
        "1",
        "--out",
        &path("crop.png"),
    ]);
    assert_eq!(first, std::fs::read(path("crop.png")).expect("a picture"));
    refused(&["render", "--out", &path("x.png"), "--bits", "12"], &["16 hexadecimal digits"]);
    refused(&["render", "--out", &path("no/such/folder.png")], &["no/such"]);
}

#[test]
fn a_panel_that_is_white_nearly_all_over_is_not_read_at_given_corners() {
    let folder = folder("white");
    let file = folder.join("panel.png");
    let file = common::name(&file);
    let decoded = |dark_rows: u32| {
        // LEDs 10 px apart with grey top rows.
        let grey = |_, y| image::Luma([if y < 10 + 10 * dark_rows { 90 } else { 255 }]);
        let picture = image::GrayImage::from_fn(100, 100, grey);
        picture.save(file).expect("a file");
        let corners = "14.5,14.5,84.5,14.5,84.5,84.5,14.5,84.5";
        let arguments = ["decode", "--json", "--detector", "otsu", "--corners"];
        vocc(&[&arguments[..], &[corners, file]].concat())
    };
    let white = decoded(1);
    assert_eq!(white.status.code(), Some(1), "{}", text(&white.stderr));
    let report = json(&white);
    assert_eq!(report["found"], false);
    let why = report["why"].as_str().expect("a reason");
    assert!(why.contains("56 of the 64 cells are white"), "{why}");
    let read = decoded(2);
    assert_eq!(read.status.code(), Some(0), "{}", text(&read.stdout));
    assert_eq!(json(&read)["bits"], "ffffffffffff0000");
}

/// The plan of a scene line by line, without the costs measured in this run.
fn plan_without_costs(scene: &str) -> Vec<serde_json::Value> {
    let plan = text(&vocc(&["plan", "--json", scene]).stdout);
    let decision = |line: &str| {
        let mut decision: serde_json::Value = serde_json::from_str(line).expect("JSON");
        let keys = decision.as_object_mut().expect("an object");
        for measured in ["cost_ns", "cost_frames"] {
            let cost = keys.remove(measured).and_then(|cost| cost.as_f64());
            assert!(cost.is_some_and(f64::is_finite), "{measured} of {line}");
        }
        decision
    };
    plan.lines().map(decision).collect()
}

#[test]
fn every_preset_can_be_printed_and_planned() {
    for preset in [
        "paper",
        "paper-18mm",
        "paper-iso3200",
        "day",
        "dusk",
        "night",
        "day-driving",
        "dusk-driving",
        "night-driving",
        "fog",
        "phone",
        "dashcam",
        "hm01b0",
    ] {
        let printed = vocc(&["scene", preset]);
        let file = folder(&format!("preset-{preset}")).join("scene.toml");
        std::fs::write(&file, &printed.stdout).expect("a file");
        let plan = plan_without_costs(common::name(&file));
        assert!(plan.len() >= 14, "{preset}");
        // All names are looked up alike: one is enough.
        if preset == "night-driving" {
            assert_eq!(plan, plan_without_costs(preset));
        }
    }
    refused(&["scene", "noon"], &["night"]);
}

#[test]
fn a_bad_frame_is_a_lost_frame_and_not_the_end() {
    let folder = folder("lossy");
    let frames = common::name(&folder);
    assert_eq!(
        vocc(&["link", "--message", "hi there, road", "--frames", "30", "--save", frames])
            .status
            .code(),
        Some(0)
    );
    std::fs::write(folder.join("frame-000002.png"), b"junk").expect("a file");
    let receive = vocc(&["receive", frames]);
    assert_eq!(receive.status.code(), Some(2));
    assert!(text(&receive.stdout).contains("hi there, road"), "{}", text(&receive.stderr));
    assert!(text(&receive.stderr).contains("frame-000002.png"));
}

#[test]
fn a_panel_that_drives_out_of_view_ends_the_run_and_loses_nothing() {
    let settings = ["--set", "pose.velocity_m_s=[60,0,0]", "--set", "pose.x_m=10"];
    let link = vocc(&[&["link", "--json", "--frames", "400"], settings.as_slice()].concat());
    let frames = json(&link)["frames"].as_u64();
    assert!(frames.is_some_and(|frames| frames > 1 && frames < 60), "{frames:?}");
    assert!(text(&link.stderr).contains("ended early"));
}

#[test]
fn a_plan_ends_with_two_lines_of_notes() {
    let plan = text(&vocc(&["plan", "day"]).stdout);
    let notes: Vec<&str> = plan.lines().rev().take(2).collect();
    assert!(notes[1].starts_with("cost: ") && notes[0].starts_with("a frame is "), "{plan}");
}

#[test]
fn figures_refuse_bad_input() {
    let folder = folder("figures");
    let out = common::name(&folder);
    refused(&["figures"], &["--out"]);
    refused(&["figures", "--out", out, "--frames", "10"], &["--frames", "1000"]);
    refused(&["figures", "no-such-scene", "--out", out], &["paper-18mm"]);
    // The panel must be on the sensor at 30 m, and its LEDs must be distinguishable at 70 m.
    refused(
        &[
            "figures",
            "--quick",
            "--frames",
            "1000",
            "--out",
            out,
            "--set",
            "camera.focal_length_mm=2",
        ],
        &["interval", "px apart"],
    );
    let file = folder.join("file");
    std::fs::write(&file, "in the way").expect("a file");
    refused(&["figures", "--out", common::name(&file)], &["folder"]);
    std::fs::write(folder.join("findings.json"), "{}").expect("a file");
    refused(&["figures", "--out", out, "--resume"], &["findings.json", "--resume"]);
}
