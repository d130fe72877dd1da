//! What the board is shown: a panel that drives past a camera, and the regions around it.

use link::camera::Camera;
use rx_pipeline::board::{MethodChoice, Region, Settings};
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::Detector;
use sim::accuracy::Level;
use sim::road::{LinkSettings, Road};
use sim::scene::Scene;

pub const MESSAGE: &[u8] = b"lane closed after the bridge";
/// Columns and rows of its frames.
pub const WIDTH: usize = 480;
pub const HEIGHT: usize = 320;
const SEED: u64 = 11;

/// Frames, and what is known of them.
pub struct Film {
    /// Grey levels of each frame.
    pub frames: Vec<Vec<u8>>,
    /// Where the panel is in the first one.
    pub corners: Corners,
    /// The bits that each shows, but where the exposure caught two symbols.
    pub sent: Vec<Option<u64>>,
    /// The messages that the simulator's own receiver delivered, which found the panel by itself.
    pub delivered: Vec<Vec<u8>>,
}

impl Film {
    /// `count` frames of 1/100 s of a panel `distance_m` away that drives past, 90 symbols a second, by day, with noise. Its ratio is the
    /// paper's, so that what is counted does not go by the table that ships.
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

    /// `count` frames of a scene, whose own receiver reads by k-means.
    pub fn of(scene: &Scene, count: u64) -> Self {
        let settings = LinkSettings {
            message: MESSAGE.to_vec(),
            method: Detector::KMeans.into(),
            seed: SEED,
            level: Level::Fast,
            code: None,
            camera: Camera::default(),
            true_corners: false,
        };
        let mut road = Road::new(scene, &settings).expect("a link");
        let sensor = road.renderer().sensor();
        let corners = road.renderer().corners_in(sensor).expect("a panel in view");
        let (mut frames, mut sent, mut delivered) = (vec![], vec![], vec![]);
        for number in 0..count {
            let report = road.frame(number).expect("the panel stays in view");
            frames.push(report.grey.to_vec());
            sent.push((!report.straddled).then_some(report.sent.bits()));
            delivered.extend(report.delivered.map(|received| received.message));
        }
        delivered.extend(road.finish().map(|received| received.message));
        Self {
            frames,
            corners,
            sent,
            delivered,
        }
    }

    /// What the receiver has to know.
    pub fn settings(method: MethodChoice) -> Settings {
        Settings {
            method,
            symbols_per_frame: 0.9,
            ..Settings::default()
        }
    }
}

/// A square cut out of a frame.
pub struct Cut {
    frame: u64,
    pub origin: [u16; 2],
    side: u16,
    pub pixels: Vec<u8>,
}

impl Cut {
    /// The square of `side` px around a place in frame `number`, as far within the frame as it goes.
    pub fn around([x, y]: [f32; 2], side: u16, number: u64, pixels: &[u8]) -> Self {
        let span = usize::from(side);
        let first = |centre: f32, length: usize| (centre.round() as usize).saturating_sub(span / 2).min(length - span);
        let (left, top) = (first(x, WIDTH), first(y, HEIGHT));
        let rows = pixels.chunks(WIDTH).skip(top).take(span);
        Self {
            frame: number,
            origin: [left as u16, top as u16],
            side,
            pixels: rows.flat_map(|row| &row[left..left + span]).copied().collect(),
        }
    }

    /// The same place in a frame without the panel.
    pub fn blank(&self, number: u64) -> Self {
        Self {
            frame: number,
            pixels: vec![118; self.pixels.len()],
            ..*self
        }
    }

    /// As it is sent, with the panel's place where that is told.
    pub fn region(&self, corners: Option<Corners>) -> Region<'_> {
        Region {
            frame: self.frame,
            origin: self.origin,
            size: [self.side; 2],
            corners: corners.map(|corners| corners.points()),
            pixels: &self.pixels,
        }
    }
}
