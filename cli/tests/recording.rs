//! `vocc receive --mcap`, read back.

mod common;

use common::{folder, name, refused, says, text, vocc};
use mcap::MessageStream;
use serde_json::Value;

/// A pose as it stands in the file: its header, place, quaternion and covariance.
type Pose = (((i32, u32), String), [f64; 3], [f64; 4], [[f64; 6]; 6]);

/// What a calibration begins with: header, height and width, model and coefficients of the distortion.
type CameraInfo = (((i32, u32), String), [u32; 2], String, Vec<f64>);

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
    assert_eq!((&format[..], &png[1..4]), ("png", &b"PNG"[..]));
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
        &vocc(&[&receive[..], &["--start", "1800000000.5", "--frame-id", "front"]].concat()),
        1,
        &[],
    );
    let bytes = std::fs::read(&recording).expect("a recording");
    let messages = MessageStream::new(&bytes).expect("an MCAP file");
    let messages: Vec<_> = messages.collect::<Result<_, _>>().expect("whole messages");
    let images = of_topic(&messages, "/camera/image");
    let (header, _, _): (((i32, u32), String), String, Vec<u8>) = cdr::deserialize(images[0].1).expect("an image");
    assert_eq!(images[0].0, 1_800_000_000_500_000_000);
    assert_eq!(header, ((1_800_000_000, 500_000_000), "front".into()));
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
        (name(&frame), "is read, and would be overwritten"),
        (name(&folder), "it is a folder"),
        ("/nowhere/film.mcap", "cannot write"),
    ] {
        refused(&["receive", name(&frame), "--mcap", to], &[why]);
    }
    assert_eq!(std::fs::read(&frame).expect("a frame"), before);
}
