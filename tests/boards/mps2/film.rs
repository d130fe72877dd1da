//! The board's input: a panel that drives past a camera, in regions around the place where this computer's receiver saw it last.

use std::io::{self, Write};

use link::camera::Camera;
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::Detector;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{NoSearch, Receiver, ReceiverMemory};
use sim::road::{LinkSettings, Road};
use sim::scene::Scene;

use crate::format::{Head, MethodChoice, Region, RegionReading};

pub use crate::format::{BYTES, START};

/// Columns and rows of the frames.
pub const WIDTH: usize = 480;
pub const HEIGHT: usize = 320;
const SEED: u64 = 11;
/// The grey level of frames without the panel.
const BLANK: u8 = 118;

/// Frames with their ground truth.
pub struct Shots {
    frames: Vec<Vec<u8>>,
    /// The panel's corners in the first frame.
    corners: Corners,
    /// The bits that each frame shows; none if the exposure caught two symbols.
    sent: Vec<Option<u64>>,
}

impl Shots {
    /// `count` frames of 1/100 s of a panel that drives past at a distance of `distance_m` with 90 symbols a second, by day, with noise.
    /// The L2A is the paper's, so that counts do not depend on the built-in table.
    pub fn draw(distance_m: f64, count: u64) -> Self {
        let speed_m_s = 1.0;
        let scene = Scene::load(
            "day",
            &[
                format!("camera.width_px={WIDTH}"),
                format!("camera.height_px={HEIGHT}"),
                format!("pose.distance_m={distance_m}"),
                format!("pose.velocity_m_s=[{speed_m_s}, 0.4, -5.0]"),
                "link.l2a=2.08".into(),
                "pose.x_m=-0.3".into(),
                "pose.roll_deg=3".into(),
            ],
        )
        .expect("a valid scene");
        Self::of(&scene, count)
    }

    /// `count` frames of a scene.
    pub fn of(scene: &Scene, count: u64) -> Self {
        let settings = LinkSettings::new(b"lane closed after the bridge".to_vec(), Detector::KMeans.into(), SEED);
        let mut road = Road::new(scene, &settings).expect("a link");
        let sensor = road.renderer().sensor();
        let corners = road
            .renderer()
            .corners_in(sensor, &road.renderer().moment(SEED, 0))
            .expect("a panel in view");
        let (mut frames, mut sent) = (vec![], vec![]);
        for number in 0..count {
            let report = road.frame(number).expect("the panel stays in view");
            frames.push(report.grey.to_vec());
            sent.push((!report.straddled).then_some(report.sent.bits()));
        }
        Self { frames, corners, sent }
    }

    /// Appends this many frames without the panel.
    pub fn and_blank(mut self, count: usize) -> Self {
        self.frames.extend(vec![vec![BLANK; WIDTH * HEIGHT]; count]);
        self.sent.extend(vec![None; count]);
        self
    }

    /// Squares of `side` px around the panel, with the readings of this computer's receiver.
    pub fn cut(&self, side: u16, method: MethodChoice, camera: Camera, symbols_per_frame: f32) -> Film {
        let head = Head {
            method,
            camera,
            symbols_per_frame,
            corners: self.corners.points(),
            regions: self.frames.len() as u32,
        };
        let memory = Box::<ReceiverMemory<9216>>::default();
        let mut receiver = Receiver::new(head.settings(), memory, NoSearch).expect("settings in range");
        let size = [usize::from(side); 2];
        let mut centre = self.corners.centre_px();
        let (mut squares, mut readings) = (vec![], vec![]);
        for (number, pixels) in (0..).zip(&self.frames) {
            let square = Square::around(centre, side, pixels);
            if number == 0 {
                receiver
                    .place(self.corners, square.origin, size.into())
                    .expect("a panel in the region");
            }
            let frame = Frame::new(&square.pixels, size[0], size[1]).expect("a frame");
            let reading = receiver.region(number, square.origin, &frame, &mut ()).reading.ok();
            if let Some(reading) = &reading {
                let [x, y] = reading.corners.centre_px();
                centre = [x + f32::from(square.origin[0]), y + f32::from(square.origin[1])];
            }
            readings.push(reading.map(RegionReading::from));
            squares.push(square);
        }
        Film {
            head,
            side,
            squares,
            readings,
            sent: self.sent.clone(),
        }
    }
}

/// The board's input and this computer's readings.
pub struct Film {
    head: Head,
    side: u16,
    squares: Vec<Square>,
    pub readings: Vec<Option<RegionReading>>,
    /// The bits that each region shows; none if the exposure caught two symbols.
    pub sent: Vec<Option<u64>>,
}

impl Film {
    /// The number of regions.
    pub fn regions(&self) -> usize {
        self.squares.len()
    }

    /// Writes the film in the format of the board's program.
    pub fn write(&self, to: &mut impl Write) -> io::Result<()> {
        let mut bytes = vec![0; 1024 + self.squares.iter().map(|square| 64 + square.pixels.len()).sum::<usize>()];
        let mut length = postcard::to_slice(&self.head, &mut bytes).expect("there is room").len();
        for square in &self.squares {
            let region = Region {
                origin: square.origin,
                side: self.side,
                pixels: &square.pixels,
            };
            length += postcard::to_slice(&region, &mut bytes[length..]).expect("there is room").len();
        }
        assert!(length <= BYTES, "{length} bytes do not fit into the board's memory");
        to.write_all(&bytes[..length])
    }
}

/// A square cut out of a frame.
struct Square {
    origin: [u16; 2],
    pixels: Vec<u8>,
}

impl Square {
    /// The square of `side` px around a place, moved to be within the frame.
    fn around([x, y]: [f32; 2], side: u16, pixels: &[u8]) -> Self {
        let span = usize::from(side);
        let first = |centre: f32, length: usize| (centre.round() as usize).saturating_sub(span / 2).min(length - span);
        let (left, top) = (first(x, WIDTH), first(y, HEIGHT));
        let rows = pixels.chunks(WIDTH).skip(top).take(span);
        Self {
            origin: [left as u16, top as u16],
            pixels: rows.flat_map(|row| &row[left..left + span]).copied().collect(),
        }
    }
}
