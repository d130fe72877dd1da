//! The whole application with a simulated camera: a linear sensor that follows its exposure.

use super::*;
use crate::corners::Corners;
use crate::detect::Detector;
use crate::receiver::{BlinkSearch, IntegerReceiver, NoSearch, Proof, Receiver, ReceiverMemory, ReceiverSettings};
use link::camera::{Camera as Lens, Encoding};
use link::fec::Code;
use link::framing::Framer;
use link::geometry::Geometry;
use link::serial::{FrameReader, Kind, encode, wire_length};
use properties::prelude::*;
use std::boxed::Box;
use std::collections::VecDeque;
use std::string::String;
use std::vec::Vec;

mod faults;
mod other_camera;
mod others;
mod places;
mod serial;
mod signed;

/// Not a simple fraction of the frame rate, so that exposures do not repeatedly catch changes of symbols.
const SYMBOL_MILLIHERTZ: u32 = 20_400;

/// A camera of 324×244 pixels, 29.995 frames a second.
pub(crate) const QVGA: CameraMode = CameraMode {
    width: 324,
    height: 244,
    focal_length_px: 870.0 / 3.6,
    black_grey: 8,
    line_clocks: 376,
    pixel_clock_hz: 3_000_000,
    frame_lines: 266,
    least_lines: 2,
    most_lines: 264,
    most_gain_log2: 3,
};

/// The same camera with pixels of 2×2, 13.232 frames a second.
pub(crate) const BINNED: CameraMode = CameraMode {
    width: 162,
    height: 122,
    focal_length_px: 870.0 / 7.2,
    frame_lines: 603,
    most_lines: 601,
    ..QVGA
};

/// A camera of another size, with other lines, another black level and other limits: 256×200 pixels, 25 frames a second.
pub(crate) const OTHER: CameraMode = CameraMode {
    width: 256,
    height: 200,
    focal_length_px: 310.0,
    black_grey: 16,
    line_clocks: 1000,
    pixel_clock_hz: 16_000_000,
    frame_lines: 640,
    least_lines: 4,
    most_lines: 620,
    most_gain_log2: 2,
};

/// A board whose parts can be observed and broken.
#[derive(Default)]
struct Bench {
    now_us: u64,
    exposure: Option<Exposure>,
    fault: Option<CameraError>,
    starts: u32,
    input: VecDeque<u8>,
    output: Vec<u8>,
    pulses: u32,
    lamp: bool,
    cut_short: u32,
    /// Whether writing the exposure fails, though the camera can be set up.
    is_deaf: bool,
}

impl Camera for Bench {
    fn start(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        self.starts += 1;
        match self.fault {
            None => {
                self.exposure = Some(exposure);
                Ok(())
            }
            Some(fault) => Err(fault),
        }
    }

    fn expose(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        match self.fault {
            None if self.is_deaf => Err(CameraError::Silent),
            None => {
                self.exposure = Some(exposure);
                Ok(())
            }
            Some(fault) => Err(fault),
        }
    }
}

impl Clock for Bench {
    fn micros(&self) -> u64 {
        self.now_us
    }
}

impl Port for Bench {
    fn read(&mut self) -> Option<u8> {
        self.input.pop_front()
    }

    fn write(&mut self, bytes: &[u8]) {
        self.output.extend_from_slice(bytes);
    }
}

impl Machine for Bench {
    const BOARD: &'static str = "receiver-bench";
    const FIRMWARE: &'static str = "0";

    fn alive(&mut self) {
        self.pulses += 1;
    }

    fn lamp(&mut self, is_on: bool) {
        self.lamp = is_on;
    }

    fn stack_bytes(&self) -> u32 {
        1234
    }

    fn cut_short(&self) -> u32 {
        self.cut_short
    }
}

impl Bench {
    fn text(&self) -> String {
        String::from_utf8_lossy(&self.output).into_owned()
    }
}

type Follower = &'static mut PanelReceiver<4096, Box<ReceiverMemory<4096>>, Vec<u8>>;

fn follower(mode: CameraMode) -> Follower {
    let settings = ReceiverSettings {
        camera: Lens {
            encoding: Encoding::LINEAR,
            black_grey: mode.black_grey.into(),
            blur_sigma_px: 0.7,
            ..Lens::default()
        },
        method: Detector::KMeans.into(),
        symbols_per_frame: 1.0,
        ..ReceiverSettings::default()
    };
    let memory = Box::<ReceiverMemory<4096>>::default();
    Box::leak(Box::new(PanelReceiver {
        receiver: Receiver::new(settings, memory, NoSearch).unwrap(),
        settings,
        search: BlinkSearch::new(room(mode)),
        proof: Proof::new(1.0),
    }))
}

fn room(mode: CameraMode) -> Vec<u8> {
    std::vec![0; BlinkSearch::bytes(mode.width, mode.height)]
}

/// The application with a receiver in integer arithmetic.
fn in_integers(mode: CameraMode, symbol_millihertz: u32) -> Application<&'static mut IntegerReceiver<Vec<u8>>> {
    let receiver = IntegerReceiver::new(1.0, room(mode)).unwrap();
    let settings = Settings {
        mode,
        symbol_millihertz,
        was_reset: false,
    };
    Application::new(Box::leak(Box::new(receiver)), settings).unwrap()
}

fn application(mode: CameraMode, symbol_millihertz: u32) -> Application<Follower> {
    let settings = Settings {
        mode,
        symbol_millihertz,
        was_reset: false,
    };
    Application::new(follower(mode), settings).unwrap()
}

/// A panel before the camera: its position, its brightness relative to the ground, and its symbols.
struct Scene {
    mode: CameraMode,
    corners: Option<Corners>,
    /// Grey levels per line at gain 1.
    ground: f64,
    led: f64,
    symbol_s: f64,
    /// In symbols, at the start.
    phase: f64,
    symbols: Vec<u64>,
    seed: u32,
}

impl Scene {
    fn new(mode: CameraMode, symbol_millihertz: u32, message: &[u8]) -> Self {
        Self::of_size(None, mode, symbol_millihertz, message)
    }

    /// A panel that sends its size.
    fn of_size(size: Option<Geometry>, mode: CameraMode, symbol_millihertz: u32, message: &[u8]) -> Self {
        let mut framer = Framer::new(message, Code::for_length(message.len()), false).unwrap();
        let pitch = 4.3;
        let [x, y] = [0.41 * mode.width as f32, 0.36 * mode.height as f32];
        let [dx, dy] = [7.0 * pitch, 0.05 * 7.0 * pitch];
        let corners = [[x, y], [x + dx, y + dy], [x + dx - dy, y + dx + dy], [x - dy, y + dx]];
        Self {
            mode,
            corners: Some(Corners::new(corners).unwrap()),
            ground: 0.3,
            led: 4.0,
            symbol_s: 1e3 / f64::from(symbol_millihertz),
            phase: 0.0,
            symbols: (0..4000).map(|_| framer.next_panel_of(size).bits()).collect(),
            seed: 1,
        }
    }

    /// A frame whose exposure ends at that time.
    fn frame(&mut self, end_us: u64, exposure: Exposure) -> Vec<u8> {
        let (width, height) = (self.mode.width, self.mode.height);
        let gain = f64::from(exposure.sensitivity());
        let mut light = std::vec![self.ground; width * height];
        if let Some(corners) = &self.corners {
            let panel = corners.homography();
            let ends = [end_us.saturating_sub(self.mode.exposure_us(exposure).into()), end_us]
                .map(|us| us as f64 * 1e-6 / self.symbol_s + self.phase);
            // An exposure across a change shows both symbols in proportion to their times.
            let next = ((ends[1] - ends[1].floor()) / (ends[1] - ends[0])).min(1.0);
            let shown = ends.map(|symbol| self.symbols[symbol as usize % self.symbols.len()]);
            for led in 0..64 {
                let [before, after] = shown.map(|bits| (bits >> led & 1) as f64);
                let share = before + next * (after - before);
                if share == 0.0 {
                    continue;
                }
                let [x, y] = panel.to_image([f64::from(led % 8), f64::from(led / 8)]);
                for row in (y as usize).saturating_sub(4)..(y as usize + 5).min(height) {
                    for column in (x as usize).saturating_sub(4)..(x as usize + 5).min(width) {
                        let square = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                        light[row * width + column] += share * self.led * (-square / 2.0).exp();
                    }
                }
            }
        }
        light
            .into_iter()
            .map(|light| {
                self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let noise = f64::from(self.seed >> 16) / 65_536.0 * 3.0 - 1.0;
                (f64::from(self.mode.black_grey) + light * gain + noise).clamp(0.0, 255.0) as u8
            })
            .collect()
    }
}

/// Runs for at most `frames` frames, until a message arrives; returns the time, µs.
fn run(application: &mut Application<impl Follow>, bench: &mut Bench, scene: &mut Scene, frames: u32) -> u64 {
    let (began, messages) = (bench.now_us, application.counters().messages);
    for _ in 0..frames {
        bench.now_us += u64::from(scene.mode.period_us());
        let pixels = scene.frame(bench.now_us, bench.exposure.unwrap());
        application.frame(&pixels, bench.now_us, bench);
        if application.counters().messages > messages {
            break;
        }
    }
    bench.now_us - began
}

#[test]
fn a_message_comes_out_of_the_port() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"ice on the bridge");
    application.start(&mut bench);
    let took = run(&mut application, &mut bench, &mut scene, 400);
    let text = bench.text();
    assert!(text.contains("state: searching\r\nstate: following\r\n"), "{text}");
    assert!(
        text.contains("message: ice on the bridge\r\n"),
        "{text} {:?}",
        application.counters()
    );
    assert!(took < 8_000_000, "{took}");
    let levels = application.levels;
    assert!((120..250).contains(&levels.bright), "{levels:?}");
    assert!(bench.pulses > 10 && bench.starts == 1);
}

/// With half as many pixels, and slower symbols and frames, as on an RP2040.
#[test]
fn a_message_comes_out_at_half_the_resolution() {
    let (mut application, mut bench) = (application(BINNED, 9_000), Bench::default());
    let mut scene = Scene::new(BINNED, 9_000, b"fog");
    application.start(&mut bench);
    run(&mut application, &mut bench, &mut scene, 300);
    assert!(
        bench.text().contains("message: fog\r\n"),
        "{} {:?}",
        bench.text(),
        application.counters()
    );
}

/// From light that makes LEDs white, and from so little that they hardly show, the exposure reaches readable levels.
#[test]
fn the_exposure_follows_the_light() {
    for brighter in [0.15, 12.0] {
        let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
        let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"light");
        scene.ground *= brighter;
        scene.led *= brighter;
        application.start(&mut bench);
        run(&mut application, &mut bench, &mut scene, 500);
        assert_eq!(application.message(), b"light", "{brighter} {:?}", application.counters());
        run(&mut application, &mut bench, &mut scene, 60);
        let levels = application.levels;
        assert!((100..250).contains(&levels.bright), "{brighter} {levels:?}");
    }
}

/// A panel that jumps is lost and found again.
#[test]
fn a_moved_panel_is_found_again() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"moved");
    application.start(&mut bench);
    run(&mut application, &mut bench, &mut scene, 400);
    // A message that continues is reported once.
    scene.symbols = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"there").symbols;
    scene.corners = scene.corners.and_then(|corners| corners.shifted(90.0, 40.0).ok());
    run(&mut application, &mut bench, &mut scene, 400);
    let counters = application.counters();
    assert_eq!((counters.messages, counters.found), (2, 2), "{counters:?}");
    scene.corners = None;
    run(&mut application, &mut bench, &mut scene, 60);
    assert!(!application.is_following());
}

/// The same in integers, while the panel moves, grows and turns all the time.
#[test]
fn a_moving_panel_is_followed_in_integers() {
    let (mut application, mut bench) = (in_integers(BINNED, 9_000), Bench::default());
    let mut scene = Scene::new(BINNED, 9_000, b"on the move");
    application.start(&mut bench);
    run(&mut application, &mut bench, &mut scene, 40);
    for _ in 0..120 {
        scene.corners = scene.corners.and_then(|corners| {
            let [x, y] = corners.centre_px();
            let moved = corners.points().map(|[u, v]| {
                let [du, dv] = [u - x, v - y];
                [x + 0.3 + 1.001 * du - 0.001 * dv, y + 0.1 + 1.001 * dv + 0.001 * du]
            });
            Corners::new(moved).ok()
        });
        run(&mut application, &mut bench, &mut scene, 1);
    }
    let counters = application.counters();
    assert_eq!((counters.found, counters.lost), (1, 0), "{counters:?}");
    assert_eq!(application.message(), b"on the move");
    let seen = application.corners().unwrap().points();
    let truth = scene.corners.unwrap().points();
    for (seen, truth) in seen.iter().flatten().zip(truth.iter().flatten()) {
        assert!((seen - truth).abs() < 0.6, "{seen} instead of {truth}");
    }
}

/// Sends a request and passes the answer to `read`.
fn ask<R>(
    application: &mut Application<impl Follow>,
    bench: &mut Bench,
    sequence: u32,
    request: Request,
    read: impl Fn(Answer<'_>) -> R,
) -> R {
    let mut wire = [0; wire_length(REQUEST_MAX)];
    bench.input.extend(encode(Kind::Request, sequence, &request, &mut wire).unwrap());
    bench.output.clear();
    application.serve(bench);
    let mut reader = FrameReader::<ANSWER_MAX>::new();
    for &byte in &bench.output {
        if let Some(Ok(frame)) = reader.push(byte) {
            assert_eq!(frame.sequence(), sequence);
            return read(frame.message(Kind::Answer).unwrap());
        }
    }
    panic!("no answer to {request:?} in {:?}", bench.output);
}

#[test]
fn a_computer_is_told_what_it_asks() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    application.start(&mut bench);
    let no_picture = Answer::Refused(Refusal::NoPicture);
    ask(&mut application, &mut bench, 1, Request::Picture { offset: 0 }, |answer| {
        assert_eq!(answer, no_picture);
    });
    bench.cut_short = 5;
    // Text is held back while a computer sends requests.
    bench.now_us += 2 * QUIET_US;
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"asked for");
    run(&mut application, &mut bench, &mut scene, 400);
    ask(&mut application, &mut bench, 2, Request::Message, |answer| {
        let Answer::Message(message) = answer else { panic!("{answer:?}") };
        assert_eq!((message.count, message.bytes), (1, &b"asked for"[..]));
    });
    ask(&mut application, &mut bench, 3, Request::Status, |answer| {
        let Answer::Status(status) = answer else { panic!("{answer:?}") };
        assert_eq!((status.is_following, status.stack_bytes), (true, 1234));
        assert_eq!((status.counters.cut_short, status.counters.messages), (5, 1));
        assert!(status.corners.is_some() && status.confidence > 0.9);
    });
    ask(&mut application, &mut bench, 4, Request::Camera, |answer| {
        let Answer::Camera(camera) = answer else { panic!("{answer:?}") };
        assert_eq!((camera.size, camera.exposure()), ([324, 244], bench_exposure(&camera)));
    });
    let picture = fetch(&mut application, &mut bench, &mut scene);
    assert!(picture.iter().max() > Some(&100), "{:?}", picture.iter().max());
    let before = bench.output.len();
    run(&mut application, &mut bench, &mut scene, 60);
    assert_eq!(bench.output.len(), before, "text while a computer asks");
}

fn bench_exposure(camera: &CameraSettings) -> Exposure {
    Exposure {
        lines: camera.lines,
        gain_log2: camera.gain_log2,
    }
}

/// A whole picture, in parts, with frames in between.
fn fetch(application: &mut Application<Follower>, bench: &mut Bench, scene: &mut Scene) -> Vec<u8> {
    let (mut picture, mut number) = (Vec::new(), None);
    loop {
        let offset = picture.len() as u32;
        let (frame, size, bytes) = ask(application, bench, 50 + offset, Request::Picture { offset }, |answer| {
            let Answer::Picture(part) = answer else { panic!("{answer:?}") };
            assert_eq!(part.offset, offset);
            (part.frame, part.size, part.bytes.to_vec())
        });
        assert_eq!(*number.get_or_insert(frame), frame, "another frame's part");
        if bytes.is_empty() {
            assert_eq!(picture.len(), usize::from(size[0]) * usize::from(size[1]));
            return picture;
        }
        picture.extend(bytes);
        run(application, bench, scene, 2);
    }
}

/// The greeting is a transmitter's, so that a computer can identify the device.
#[test]
fn a_receiver_greets_as_a_transmitter_does() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut wire = [0; wire_length(REQUEST_MAX)];
    let greeting = encode(Kind::Request, 9, &link::serial::Request::Hello, &mut wire).unwrap();
    bench.input.extend(greeting);
    application.serve(&mut bench);
    let mut reader = FrameReader::<{ link::serial::ANSWER_FRAME_MAX }>::new();
    let frame = bench
        .output
        .iter()
        .find_map(|&byte| reader.push(byte)?.ok().map(|frame| frame.sequence()));
    assert_eq!(frame, Some(9));
    let mut reader = FrameReader::<{ link::serial::ANSWER_FRAME_MAX }>::new();
    for &byte in &bench.output {
        if let Some(Ok(frame)) = reader.push(byte) {
            let Ok(link::serial::Answer::Hello(hello)) = frame.answer() else {
                panic!()
            };
            assert_eq!((hello.schema, hello.board), (SCHEMA, "receiver-bench"));
            assert!(hello.board.starts_with(BOARD_PREFIX));
        }
    }
}

#[test]
fn symbol_rates_are_taken_or_refused() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut set = |sequence, millihertz| {
        ask(
            &mut application,
            &mut bench,
            sequence,
            Request::SetSymbolRate { millihertz },
            |answer| match answer {
                Answer::Done => true,
                Answer::Refused(Refusal::SymbolRate { most, .. }) => {
                    assert_eq!(most, 29_995);
                    false
                }
                other => panic!("{other:?}"),
            },
        )
    };
    let taken = [(1, 15_000), (2, 29_995), (3, 29_996), (4, 0), (5, u32::MAX)].map(|(i, rate)| set(i, rate));
    assert_eq!(taken, [true, true, false, false, false]);
    let none = Settings {
        mode: QVGA,
        symbol_millihertz: 40_000,
        was_reset: false,
    };
    let refused = Application::new(follower(QVGA), none).err().unwrap();
    assert_eq!(
        refused,
        ApplicationError::SymbolRate {
            millihertz: 40_000,
            most: 29_995
        }
    );
}

/// Invalid frames change nothing.
#[test]
fn frames_of_another_size_are_passed_over() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    application.start(&mut bench);
    application.frame(&[1, 2, 3], 10, &mut bench);
    application.frame(&[], 0, &mut bench);
    assert_eq!(application.counters().frames, 0);
}

/// A flood of bytes does not stop the reading of frames, and causes no panic.
#[test]
fn a_flood_is_survived() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"through it all");
    application.start(&mut bench);
    let mut seed = 7u32;
    for _ in 0..400 {
        bench.now_us += u64::from(scene.mode.period_us());
        // Twice as many as a serial port delivers in a frame's time.
        bench.input.extend((0..770).map(|_| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u8
        }));
        bench.input.truncate(4096);
        let pixels = scene.frame(bench.now_us, bench.exposure.unwrap());
        application.frame(&pixels, bench.now_us, &mut bench);
    }
    assert_eq!(application.message(), b"through it all");
    assert!(application.service.bad_frames > 100);
}

/// A million requests, most of them corrupted: each whole one is answered once, and no other.
#[test]
fn a_million_requests_are_survived() {
    let (mut application, mut bench) = (application(QVGA, SYMBOL_MILLIHERTZ), Bench::default());
    let (mut seed, mut whole) = (3u32, 0);
    let mut random = || {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        seed
    };
    for sequence in 0..1_000_000 {
        let request = match random() % 6 {
            0 => Request::Hello,
            1 => Request::Status,
            2 => Request::Message,
            3 => Request::Camera,
            4 => Request::Picture { offset: random() },
            // Refused rates, because another rate restarts the receiver, which takes time.
            _ => Request::SetSymbolRate {
                millihertz: random() | 1 << 30,
            },
        };
        let mut wire = [0; wire_length(REQUEST_MAX)];
        let length = encode(Kind::Request, sequence, &request, &mut wire).unwrap().len();
        let spoilt = random() % 8;
        if spoilt > 0 {
            let place = random() as usize % length;
            wire[place] ^= 1 << (random() % 8);
        } else {
            whole += 1;
        }
        bench.input.extend(&wire[..length]);
        application.serve(&mut bench);
        bench.output.clear();
    }
    let requests = application.service.requests;
    // If the zero at the end was corrupted, the next frame's first one ends the request.
    assert!((whole..whole + 400_000).contains(&requests), "{requests} {whole}");
    assert!(application.service.bad_frames > 400_000);
}

properties! {
    /// Any received message is printed without a zero, a line break or an escape.
    #[test]
    fn messages_are_printed_as_one_line(message: Vec<u8>) {
        let mut bench = Bench::default();
        super::text::write_message(&message, &mut bench);
        let text = String::from_utf8(bench.output).unwrap();
        let line = text.strip_suffix("\r\n").unwrap();
        prop_assert!(line.starts_with("message: ") && !line.chars().any(char::is_control));
    }
}
/// At the rates for this camera, at any phase of the first frame.
#[test]
fn messages_come_at_any_phase() {
    for (mode, rate) in [(QVGA, SYMBOL_MILLIHERTZ), (BINNED, 9_000)] {
        for phase in 0..10 {
            let (mut application, mut bench) = (application(mode, rate), Bench::default());
            let mut scene = Scene::new(mode, rate, b"ice on the bridge");
            scene.phase = 0.1 * f64::from(phase);
            application.start(&mut bench);
            let took = run(&mut application, &mut bench, &mut scene, 120);
            assert_eq!(application.message(), b"ice on the bridge", "{} px {phase} {took}", mode.width);
            let (mut application, mut bench) = (in_integers(mode, rate), Bench::default());
            application.start(&mut bench);
            let took = run(&mut application, &mut bench, &mut scene, 120);
            assert_eq!(
                application.message(),
                b"ice on the bridge",
                "{} px {phase} {took}, in integers: {:?}",
                mode.width,
                application.counters()
            );
        }
    }
}
