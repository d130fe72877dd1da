//! A session with the flashed application, without a board.

use super::*;
use crate::device::DeviceError;
use rx_pipeline::hm01b0::Mode;
use rx_pipeline::receiver::{BlinkSearch, IntegerReceiver};
use rx_pipeline::standalone::{
    Application, Camera, CameraError, CameraMode, Clock, Exposure, Fault, Machine, Settings, Trouble, WireReading,
};
use std::collections::VecDeque;
use std::io::ErrorKind;
use std::time::Duration;

mod watch;

const MODE: CameraMode = Mode::BINNED.camera_mode();

#[derive(Default)]
struct Board {
    now_us: u64,
    input: VecDeque<u8>,
    output: VecDeque<u8>,
}

impl Camera for Board {
    fn start(&mut self, _: Exposure) -> Result<(), CameraError> {
        Ok(())
    }

    fn expose(&mut self, _: Exposure) -> Result<(), CameraError> {
        Ok(())
    }
}

impl Clock for Board {
    fn micros(&self) -> u64 {
        self.now_us
    }
}

impl standalone::Port for Board {
    fn read(&mut self) -> Option<u8> {
        self.input.pop_front()
    }

    fn write(&mut self, bytes: &[u8]) {
        self.output.extend(bytes);
    }
}

impl Machine for Board {
    const BOARD: &'static str = "receiver-test";
    const FIRMWARE: &'static str = "1.2";

    fn alive(&mut self) {}

    fn lamp(&mut self, _: bool) {}

    fn stack_bytes(&self) -> u32 {
        77
    }

    fn cut_short(&self) -> u32 {
        0
    }
}

/// The application's port: requests are served at once, and a frame arrives before each answer.
struct Line {
    board: Board,
    application: Application<&'static mut IntegerReceiver<Vec<u8>>>,
    frames: u8,
}

impl Line {
    fn new() -> Self {
        let room = vec![0; BlinkSearch::bytes(MODE.width, MODE.height)];
        let receiver = IntegerReceiver::new(1.0, room).unwrap();
        let settings = Settings {
            mode: MODE,
            symbol_millihertz: 9_000,
            was_reset: true,
        };
        Self {
            board: Board::default(),
            application: Application::new(Box::leak(Box::new(receiver)), settings).unwrap(),
            frames: 0,
        }
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.board.input.extend(bytes);
        self.board.now_us += 75_000;
        self.frames += 1;
        let pixels: Vec<u8> = (0..162 * 122).map(|i| (i % 162) as u8 + self.frames).collect();
        let now_us = self.board.now_us;
        self.application.frame(&pixels, now_us, &mut self.board);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Read for Line {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        if self.board.output.is_empty() {
            return Err(ErrorKind::TimedOut.into());
        }
        self.board.output.read(bytes)
    }
}

fn client() -> Client<Line> {
    Client::greet(Line::new(), Duration::from_secs(1), 5).unwrap()
}

#[test]
fn a_receiver_is_known_by_its_board_and_is_no_transmitter() {
    let client = client();
    assert!(client.identity().is_receiver());
    assert_eq!(client.identity().schema, standalone::SCHEMA);
    let board = "receiver-test".to_owned();
    let refused = Client::greet(Line::new(), Duration::from_secs(1), 5)
        .and_then(Client::transmitter)
        .err();
    assert_eq!(refused, Some(DeviceError::IsReceiver { board }));
}

#[test]
fn status_and_message_are_told() {
    let mut client = client();
    let status = asked_status(&mut client, "p").unwrap();
    assert_eq!((status.is_following, status.stack_bytes, status.was_reset), (false, 77, true));
    assert_eq!(as_json(&status)["symbol_rate_hz"], 9.0);
    assert!(short(&status).contains("searching"));
    assert_eq!(as_json(&status)["state"], "searching");
    assert_eq!(as_json(&status)["fault"], Value::Null);
    let ill = Status {
        is_following: true,
        trouble: Some(Trouble {
            fault: Fault::NoWholeFrames,
            since_ms: 1500,
        }),
        ..status
    };
    assert!(short(&ill).contains("following") && short(&ill).contains("fault: the camera's"));
    let values = as_json(&ill);
    assert_eq!((&values["state"], &values["fault_since_s"]), (&json!("following"), &json!(1.5)));
    assert!(values["fault"].as_str().unwrap().contains("cut short"));
    let message = asked_message(&mut client, "p").unwrap();
    assert_eq!(message_as_json(&message), Value::Null);
}

/// All parts of a picture belong to one frame, although frames arrive in between.
#[test]
fn a_picture_comes_whole_and_of_one_frame() {
    let picture = fetch(&mut client(), "p").unwrap();
    assert_eq!((picture.size, picture.step, picture.origin), ([81, 61], 2, [0, 0]));
    let first = picture.grey[0];
    let even = |i: usize| first.wrapping_add(2 * (i % 81) as u8);
    assert!(picture.grey.iter().enumerate().all(|(i, &grey)| grey == even(i)));
}

/// No panel is seen here. Any other reading is printed with its soft values and its range, in pitches or, if the pitch is known, in metres.
#[test]
fn readings_are_told() {
    assert_eq!(asked_reading(&mut client(), "p").unwrap(), None);
    assert_eq!(reading_as_json(None), Value::Null);
    let reading = WireReading {
        frame: 7,
        bits: 0x8000_0000_0000_0001,
        soft: [[-4; 8]; 8],
        is_mixed: false,
        corners: [[0.0; 2]; 4],
        confidence: 0.75,
        range_pitches: 50.0,
        pitch_m: None,
    };
    let told = reading_as_json(Some(&reading));
    assert_eq!(
        (&told["bits"], &told["soft"][63], &told["range_m"]),
        (&"8000000000000001".into(), &(-1.0).into(), &Value::Null)
    );
    let of_size = WireReading {
        pitch_m: Some(0.06),
        ..reading
    };
    assert!(reading_in_short(&reading).contains("50.0 times the distance between LEDs"));
    assert!(reading_in_short(&of_size).contains("3.00 m away"));
}

#[test]
fn refusals_are_told() {
    let mut client = client();
    let request = Request::SetSymbolRate { millihertz: 50_000 };
    let refused = ask(&mut client, "p", &request, |answer| {
        (answer == standalone::Answer::Done).then_some(())
    });
    assert!(format!("{:#}", refused.unwrap_err()).contains("at most 13231"));
}

#[test]
fn text_is_shown_as_it_is_and_other_bytes_are_escaped() {
    assert_eq!(text("Glätte".as_bytes()), "Glätte");
    assert_eq!(text(b"a\nb\xff"), "a\\nb\\xff");
}

/// A receiver reports its rate and accepts another one. It rejects a rate that is too high for its camera, and an invalid one.
#[test]
fn a_rate_is_told_set_and_refused() {
    let mut client = client();
    let mut rate = |wanted| set_rate(&mut client, "p", wanted).map_err(|error| format!("{error:#}"));
    assert_eq!(rate(None), Ok(9.0));
    assert_eq!(rate(Some(7.5)), Ok(7.5));
    assert_eq!(rate(None), Ok(7.5));
    assert!(rate(Some(13.3)).unwrap_err().contains("at most 13231"));
    for wrong in [0.0, -1.0, 0.0004, f64::NAN, f64::INFINITY, 1e7] {
        let refused = rate(Some(wrong)).unwrap_err();
        assert!(refused.contains("give at least 0.001"), "{refused}");
    }
    assert_eq!(rate(None), Ok(7.5));
}
