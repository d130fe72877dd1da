//! Panels anywhere in the range that the locator is made for, filmed for a few frames.

use std::path::Path;

use image::GrayImage;
use image::imageops::{self, FilterType};
use link::panel::PanelFrame;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use sim::accuracy::Level;
use sim::renderer::canvas::Canvas;
use sim::renderer::{Renderer, Shown};
use sim::scene::Scene;
use sim::view::View;

/// Successive frames in which a panel is to be found.
pub const FRAMES: usize = 3;
/// A panel is found if no corner LED is further off than this share of a pitch: then each cell holds its own LED.
pub const RIGHT: f64 = 0.35;
/// The most pixels of a window around a panel.
pub const WINDOW_PIXELS: usize = 160 * 160;

/// A few frames of one panel, and what is true of them.
pub struct Sighting {
    /// What was drawn, in words.
    pub what: String,
    /// Columns of a frame.
    pub width: usize,
    /// Rows of a frame.
    pub height: usize,
    /// The frames' pixels.
    pub frames: Vec<Vec<u8>>,
    /// The corner LEDs: top left, top right, bottom right, bottom left.
    pub corners: [[f64; 2]; 4],
    /// What the panel shows in the middle of each exposure.
    pub bits: Vec<u64>,
    /// Distance of neighbouring LEDs along the panel's shorter side, in pixels.
    pub pitch_px: f64,
    /// Whether a photograph is behind the panel.
    pub photograph: bool,
    /// Ambient illuminance.
    pub illuminance_lx: f64,
}

/// The photographs of a folder, in the order of their names.
///
/// # Panics
/// When the folder or a picture cannot be read.
pub fn photographs(folder: &Path) -> Vec<GrayImage> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("a readable folder").path())
        .collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "png"));
    paths.sort();
    let open = |path: &std::path::PathBuf| {
        image::open(path)
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
            .into_luma8()
    };
    paths.iter().map(open).collect()
}

/// A random part of a random photograph, mirrored or not, at a random scale, as large as a frame.
pub fn backdrop(
    photographs: &[GrayImage],
    width: usize,
    height: usize,
    random: &mut impl Rng,
) -> GrayImage {
    let photo = &photographs[random.random_range(0..photographs.len())];
    let largest =
        (f64::from(photo.width()) / width as f64).min(f64::from(photo.height()) / height as f64);
    let scale = largest * random.random_range(0.3..1.0);
    let size = [
        (width as f64 * scale).max(1.0) as u32,
        (height as f64 * scale).max(1.0) as u32,
    ];
    let (x, y) = (
        random.random_range(0..=photo.width() - size[0]),
        random.random_range(0..=photo.height() - size[1]),
    );
    let part = imageops::crop_imm(photo, x, y, size[0], size[1]).to_image();
    let part = if random.random() {
        imageops::flip_horizontal(&part)
    } else {
        part
    };
    imageops::resize(&part, width as u32, height as u32, FilterType::CatmullRom)
}

impl Sighting {
    /// Sighting `seed` of the range: 30 to 70 m, interval 0.5 to 2, roll to 15°, yaw to 30°, 50 to 10 000 lx, with and without a
    /// board, two in three before a photograph if there are any; `count` successive frames of 1/100 s, 90 symbols a second.
    ///
    /// # Panics
    /// When the scene cannot be drawn.
    pub fn draw(
        seed: u64,
        [width, height]: [usize; 2],
        count: u64,
        photographs: &[GrayImage],
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let distance = random.random_range(30.0..70.0);
        let interval = random.random_range(0.5..2.0);
        let (roll, yaw) = (
            random.random_range(-15.0..15.0),
            random.random_range(-30.0..30.0),
        );
        let illuminance_lx = 50.0 * 200f64.powf(random.random());
        let board = random.random_range(0.05..0.3);
        let has_board: bool = random.random();
        let photograph = !photographs.is_empty() && random.random_range(0..3) > 0;
        let focal_px = 25e-3 / 6.875e-6;
        let mut side = |length: usize| {
            let room = (length as f64 / 2.0 - 70.0).max(0.0);
            random.random_range(-1.0..1.0) * room * distance / focal_px
        };
        let (x, y) = (side(width), side(height));
        let mut settings = vec![
            format!("camera.width_px={width}"),
            format!("camera.height_px={height}"),
            format!("pose.distance_m={distance}"),
            format!("panel.interval={interval}"),
            format!("pose.roll_deg={roll}"),
            format!("pose.yaw_deg={yaw}"),
            format!("pose.x_m={x}"),
            format!("pose.y_m={y}"),
            format!("ambient.illuminance_lx={illuminance_lx}"),
            format!("panel.reflectance={}", random.random_range(0.3..0.5)),
            format!("link.phase={}", random.random::<f64>()),
        ];
        if has_board {
            settings.push(format!("panel.board_reflectance={board}"));
        }
        let scene = Scene::load("day", &settings).expect("a valid scene");
        let view = if photograph {
            View::before(&scene, &backdrop(photographs, width, height, &mut random))
        } else {
            View::new(&scene)
        }
        .expect("a visible scene");
        let l2a = view.panels[0].l2a;
        let renderer = Renderer::of(view, Level::Fast);
        let mut canvas = Canvas::new(renderer.lit_region());
        let symbols: Vec<u64> = (0..count + 8).map(|_| random.next_u64()).collect();
        let (mut frames, mut bits, mut straddled) = (Vec::new(), Vec::new(), false);
        for frame in 0..count {
            let moment = renderer.moment(frame);
            let steady = renderer.steady(0, PanelFrame::default());
            let shown = Shown {
                symbols: std::array::from_fn(|ahead| {
                    PanelFrame::from_bits(symbols[moment.symbol as usize + ahead])
                }),
                ..steady
            };
            let mut pixels = vec![0; width * height];
            renderer.frame(seed, &moment, &[shown], &mut canvas, &mut pixels);
            straddled |= renderer.straddles(0, &moment);
            bits.push(renderer.truth(0, &moment, &shown).bits());
            frames.push(pixels);
        }
        let corners = renderer.corner_leds_px(0);
        let along = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) / 7.0;
        let pitch_px = along(corners[0], corners[1]).min(along(corners[1], corners[2]));
        Self {
            what: format!(
                "seed {seed}: {distance:.0} m, interval {interval:.2}, roll {roll:.0}, yaw {yaw:.0}, {illuminance_lx:.0} lx, L2A {l2a:.1}, board {}, {}{}",
                if has_board {
                    format!("{board:.2}")
                } else {
                    "none".into()
                },
                if photograph { "photograph" } else { "plain" },
                if straddled { ", straddled" } else { "" },
            ),
            width,
            height,
            frames,
            corners,
            bits,
            pitch_px,
            photograph,
            illuminance_lx,
        }
    }

    /// The greatest distance of a corner from the truth, in pixels.
    pub fn error_px(&self, corners: [[f32; 2]; 4]) -> f64 {
        let pairs = corners.iter().zip(&self.corners);
        pairs
            .map(|(a, b)| (f64::from(a[0]) - b[0]).hypot(f64::from(a[1]) - b[1]))
            .fold(0.0, f64::max)
    }
}
