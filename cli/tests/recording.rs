//! `vocc receive --mcap`, read back.

mod common;

use common::{folder, name, refused, says, text, vocc};
use mcap::MessageStream;
use serde_json::Value;

/// A pose as it stands in the file: its header, place, quaternion and covariance.
type Pose = (((i32, u32), String), [f64; 3], [f64; 4], [[f64; 6]; 6]);

/// What a calibration begins with: header, height and width, model and coefficients of the distortion.
type CameraInfo = (((i32, u32), String), [u32; 2], String, Vec<f64>);

/// A status of diagnostics: level, name, message, hardware, and keys with values.
type Status = (u8, String, String, String, Vec<(String, String)>);

/// Diagnostics: a header and statuses.
type Report = (((i32, u32), String), Vec<Status>);

/// The messages of a topic, each with its time in nanoseconds.
fn of_topic<'a>(messages: &'a [mcap::Message], topic: &str) -> Vec<(u64, &'a [u8])> {
    let messages = messages.iter().filter(|message| message.channel.topic == topic);
    messages.map(|message| (message.log_time, &message.data[..])).collect()
}

#[test]
fn what_is_received_is_recorded() {
    let folder = folder("recording");
    let path = |file: &str| name(&folder.join(file)).to_owned();
    let (film, recording, camera) = (path("film"), path("film.mcap"), path("camera.toml"));
    let link = ["link", "day", "--message", "ice", "--save", &film];
    let size = ["--set=camera.width_px=480", "--set=camera.height_px=320"];
    says(&vocc(&[&link[..], &size, &["--seed", "1"]].concat()), 0, &[]);
    std::fs::write(&camera, "focal_px = 3636.4\n").expect("a file");
    let receive = ["receive", &film, "--bits", "--json", "--mcap", &recording];
    let panel = ["--interval", "1", "--led-diameter", "0.03", "--camera", &camera];
    let received = vocc(&[&receive[..], &panel].concat());
    says(&received, 0, &[]);
    let printed = text(&received.stdout);
    let told = printed.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let (readings, others): (Vec<_>, Vec<_>) = told.partition(|line| line["bits"].is_string());

    let bytes = std::fs::read(&recording).expect("a recording");
    let messages = MessageStream::new(&bytes).expect("an MCAP file");
    let messages: Vec<_> = messages.collect::<Result<_, _>>().expect("whole messages");
    let images = of_topic(&messages, "/camera/image");
    let frames = std::fs::read_dir(&film).expect("a folder").count();
    assert_eq!(images.len(), frames);
    assert_eq!(images[1].0, 10_000_000);
    let (_, format, png): (((i32, u32), String), String, Vec<u8>) = cdr::deserialize(images[0].1).expect("an image");
    assert_eq!((&format[..], &png[1..4]), ("mono8; png compressed", &b"PNG"[..]));
    assert_eq!(of_topic(&messages, "/panel_0/outline").len(), readings.len());

    let known = readings.iter().filter(|reading| reading["pose"]["known"] == true);
    let poses = of_topic(&messages, "/panel_0/pose");
    assert_eq!(poses.len(), known.clone().count());
    for (reading, (time_ns, pose)) in known.zip(poses) {
        assert_eq!(Some(time_ns / 10_000_000), reading["frame"].as_u64());
        let (header, place, quaternion, covariance): Pose = cdr::deserialize(pose).expect("a pose");
        assert_eq!(header.1, "camera");
        let told = &reading["pose"];
        assert_eq!(serde_json::json!(place), told["translation_m"]);
        assert_eq!(serde_json::json!(covariance), told["covariance"]);
        let [x, y, z, w] = quaternion;
        let middle = told["rotation"][1][1].as_f64().expect("a number");
        assert!((1.0 - 2.0 * (x * x + z * z) - middle).abs() < 1e-9);
        assert!((x * x + y * y + z * z + w * w - 1.0).abs() < 1e-12);
    }

    let infos = of_topic(&messages, "/camera/camera_info");
    assert_eq!(infos.len(), frames);
    let ((_, frame_id), [height, width], model, d): CameraInfo = cdr::deserialize(infos[0].1).expect("a calibration");
    assert_eq!((&frame_id[..], width, height, &model[..]), ("camera", 480, 320, "plumb_bob"));
    assert_eq!(d, [0.0; 5]);

    let reports = of_topic(&messages, "/diagnostics");
    let status = |(_, report): &(u64, &[u8])| -> Report { cdr::deserialize(report).expect("a report") };
    let (first, last) = (reports.first().expect("a report"), reports.last().expect("a report"));
    assert_eq!((first.0, status(first).0), (0, ((0, 0), "camera".into())));
    let [camera, panel] = &status(last).1[..] else {
        panic!("{:?}", status(last));
    };
    assert_eq!((camera.0, &camera.1[..], &camera.3[..]), (0, "vocc: camera", "camera"));
    assert_eq!((&panel.1[..], &panel.3[..]), ("vocc: panel 0", "panel_0"));
    let frames = frames.to_string();
    assert!(camera.4.contains(&("frames".into(), frames)), "{camera:?}");
    assert!(panel.4.contains(&("frames_read".into(), readings.len().to_string())), "{panel:?}");

    let texts = of_topic(&messages, "/panel_0/message");
    let texts: Vec<String> = texts.iter().map(|(_, text)| cdr::deserialize(text).expect("a text")).collect();
    let told: Vec<&str> = others.iter().filter_map(|line| line["message"].as_str()).collect();
    assert_eq!(texts, told);
    assert_eq!(texts[0], "ice");
}

#[test]
fn a_films_start_and_its_frame_of_reference_may_be_told() {
    let folder = folder("recording-start");
    let (frame, recording) = (folder.join("frame.png"), folder.join("film.mcap"));
    says(&vocc(&["render", "day", "--out", name(&frame)]), 0, &[]);
    let receive = ["receive", name(&frame), "--mcap", name(&recording)];
    says(
        &vocc(&[&receive[..], &["--start", "1800000000.123456789", "--frame-id", "front"]].concat()),
        1,
        &[],
    );
    let bytes = std::fs::read(&recording).expect("a recording");
    let messages = MessageStream::new(&bytes).expect("an MCAP file");
    let messages: Vec<_> = messages.collect::<Result<_, _>>().expect("whole messages");
    let images = of_topic(&messages, "/camera/image");
    let (header, _, _): (((i32, u32), String), String, Vec<u8>) = cdr::deserialize(images[0].1).expect("an image");
    assert_eq!(images[0].0, 1_800_000_000_123_456_789);
    assert_eq!(header, ((1_800_000_000, 123_456_789), "front".into()));
    // Nobody calibrated the camera.
    assert!(of_topic(&messages, "/camera/camera_info").is_empty());
    refused(&[&receive[..], &["--start", "soon"]].concat(), &["give 0 to 2147483647 seconds"]);
}

#[test]
fn a_recording_goes_nowhere_else() {
    let folder = folder("recording-refused");
    let frame = folder.join("frame.png");
    says(&vocc(&["render", "day", "--out", name(&frame)]), 0, &[]);
    let before = std::fs::read(&frame).expect("a frame");
    for (to, why) in [
        (name(&frame), "is an input, and would be overwritten"),
        (name(&folder), "it is a folder"),
        ("/nowhere/film.mcap", "cannot write"),
    ] {
        refused(&["receive", name(&frame), "--mcap", to], &[why]);
    }
    assert_eq!(std::fs::read(&frame).expect("a frame"), before);
}

/// Each file of a recording, read by itself: its images' times, and whether each has a calibration beside it.
#[track_caller]
fn part(path: &std::path::Path, max_bytes: u64) -> Vec<u64> {
    let bytes = std::fs::read(path).expect("a recording");
    assert!(bytes.len() as u64 <= max_bytes, "{} has {} bytes", path.display(), bytes.len());
    let messages = MessageStream::new(&bytes).expect("an MCAP file");
    let messages: Vec<_> = messages.collect::<Result<_, _>>().expect("whole messages");
    let schemas = messages.iter().filter_map(|message| message.channel.schema.as_ref());
    assert_eq!(schemas.count(), messages.len());
    let times = |topic| of_topic(&messages, topic).iter().map(|(time_ns, _)| *time_ns).collect::<Vec<_>>();
    assert_eq!(times("/camera/camera_info"), times("/camera/image"), "{}", path.display());
    let summary = mcap::Summary::read(&bytes).expect("a file").expect("a summary");
    let count = summary.stats.as_ref().expect("statistics").message_count;
    assert_eq!((count, summary.channels.len()), (messages.len() as u64, 7));
    // What belongs to a frame is in the frame's file.
    let images = times("/camera/image");
    for topic in ["/panel_0/outline", "/panel_0/message", "/panel_0/message_bytes"] {
        assert!(times(topic).iter().all(|time_ns| images.contains(time_ns)), "{topic}");
    }
    images
}

#[test]
fn a_recording_is_divided_without_a_loss() {
    let folder = folder("recording-parts");
    let path = |file: &str| name(&folder.join(file)).to_owned();
    let (film, camera) = (path("film"), path("camera.toml"));
    let link = ["link", "day", "--message", "ice", "--frames", "40", "--save", &film];
    let size = ["--set=camera.width_px=480", "--set=camera.height_px=320"];
    says(&vocc(&[&link[..], &size, &["--seed", "1"]].concat()), 0, &[]);
    std::fs::write(&camera, "focal_px = 3636.4\n").expect("a file");
    let receive = ["receive", &film, "--camera", &camera, "--mcap"];
    says(&vocc(&[&receive[..], &[&path("whole.mcap")]].concat()), 0, &[]);
    let max_bytes = 250_000;
    let drive = path("drive.mcap");
    let divided = [&receive[..], &[&drive, "--max-size", "250k"]].concat();
    says(&vocc(&divided), 0, &[]);

    let whole = part(&folder.join("whole.mcap"), u64::MAX);
    assert_eq!(whole.len(), 40);
    let mut parts: Vec<_> = std::fs::read_dir(&folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a plain name"))
        .filter(|file| file.starts_with("drive"))
        .collect();
    parts.sort_by_key(|file| (file.len(), file.clone()));
    let names = (0..parts.len()).map(|number| match number {
        0 => "drive.mcap".to_owned(),
        number => format!("drive-{number:04}.mcap"),
    });
    assert_eq!(parts, names.collect::<Vec<_>>());
    assert!(parts.len() > 3, "{parts:?}");
    let divided_times: Vec<u64> = parts.iter().flat_map(|file| part(&folder.join(file), max_bytes)).collect();
    assert_eq!(divided_times, whole);
    // All topics, times and contents, in order.
    let contents = |file: &str| {
        let bytes = std::fs::read(folder.join(file)).expect("a recording");
        let messages = MessageStream::new(&bytes)
            .expect("an MCAP file")
            .map(|message| message.expect("whole"));
        let content = |message: mcap::Message| (message.channel.topic.clone(), message.log_time, message.data.to_vec());
        messages.map(content).collect::<Vec<_>>()
    };
    let divided_contents: Vec<_> = parts.iter().flat_map(|file| contents(file)).collect();
    assert!(divided_contents == contents("whole.mcap"));

    // No file of a recording is overwritten, finished or not.
    let refused = |taken: &str| says(&vocc(&divided), 2, &[taken, "exists and is not overwritten"]);
    refused("drive-0001.mcap");
    for file in &parts[..parts.len() - 1] {
        std::fs::remove_file(folder.join(file)).expect("a file");
    }
    let last = parts.last().expect("a file");
    let before = std::fs::read(folder.join(last)).expect("a file");
    refused(last);
    assert!(std::fs::read(folder.join(last)).expect("a file") == before);
    std::fs::rename(folder.join(last), folder.join("drive-0007.mcap.active")).expect("moved");
    refused("drive-0007.mcap.active");
}

#[test]
fn a_maximum_size_is_of_files_and_no_small_one() {
    let folder = folder("recording-size");
    let frame = folder.join("frame.png");
    says(&vocc(&["render", "day", "--out", name(&frame)]), 0, &[]);
    let receive = ["receive", name(&frame)];
    refused(&[&receive[..], &["--max-size", "1M"]].concat(), &["--mcap"]);
    let mcap = ["--mcap", "/dev/null", "--max-size"];
    refused(&[&receive[..], &mcap, &["1M"]].concat(), &["/dev/null is a device or a pipe"]);
    refused(&[&receive[..], &mcap, &["2"]].concat(), &["give at least 100000 bytes"]);
    // A frame that is larger than a file may be has a file of its own.
    let recording = folder.join("drive.mcap");
    let large = ["--mcap", name(&recording), "--max-size", "100k"];
    says(&vocc(&[&receive[..], &[name(&frame), name(&frame)], &large].concat()), 1, &[]);
    for file in ["drive.mcap", "drive-0001.mcap", "drive-0002.mcap"] {
        let bytes = std::fs::read(folder.join(file)).expect("a recording");
        assert!(bytes.len() > 100_000);
        let messages = MessageStream::new(&bytes).expect("an MCAP file");
        let messages: Vec<_> = messages.collect::<Result<_, _>>().expect("whole messages");
        assert_eq!(of_topic(&messages, "/camera/image").len(), 1, "{file}");
    }
    assert!(!folder.join("drive-0003.mcap").exists());
}

/// The file system refuses bytes beyond a limit, as a full disk does.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_the_recording_and_not_the_reception() {
    use common::bounded::run;
    use common::recording::{MESSAGE, filmed, y4m};
    let film = filmed("recording-full-frames", 40);
    let folder = folder("recording-full");
    std::fs::write(folder.join("film.y4m"), y4m(&film)).expect("a film");
    common::bounded::pipe(&folder.join("camera.y4m"));
    let limited = |options: &str| {
        let program = env!("CARGO_BIN_EXE_vocc");
        let script = format!("trap '' XFSZ; ulimit -f 400; exec {program} receive {options}");
        run(std::process::Command::new("sh").args(["-c", &script]).current_dir(&folder))
    };
    let files = |start: &str| {
        let entries = std::fs::read_dir(&folder).expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"));
        names.filter(|name| name.starts_with(start)).count()
    };
    let words = ["cannot write drive.mcap: File too large", "continuing without a recording"];
    // Of a film, nothing is left.
    let received = limited("film.y4m --mcap drive.mcap");
    says(&received, 2, &words);
    assert!(text(&received.stdout).contains(MESSAGE), "{received:?}");
    assert_eq!(files("drive"), 0);
    // Of a live source, what was kept each second may stay.
    let mut camera = std::process::Command::new("sh")
        .args(["-c", "cat film.y4m > camera.y4m"])
        .current_dir(&folder)
        .spawn()
        .expect("sh runs");
    let received = limited("camera.y4m --mcap drive.mcap");
    camera.wait().expect("an end");
    says(&received, 2, &words);
    assert!(text(&received.stdout).contains(MESSAGE), "{received:?}");
    assert!(!folder.join("drive.mcap").exists());
    // Files within the limit are all written.
    let received = limited("film.y4m --mcap small.mcap --max-size 190k");
    says(&received, 0, &[]);
    assert!(files("small") > 2);
}
