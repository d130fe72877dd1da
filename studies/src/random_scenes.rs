//! Panels anywhere in the locator's range, in films of a few frames.

use std::path::{Path, PathBuf};

use image::GrayImage;
use image::imageops::{self, FilterType};
use link::panel::PanelFrame;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use sim::accuracy::Level;
use sim::input;
use sim::renderer::canvas::Canvas;
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::{Scene, SceneError};
use sim::view::{View, ViewError};

/// Successive frames in which a panel must be found.
pub const FRAMES: usize = 3;
/// The greatest error of a corner LED of a found panel, as a share of a pitch: then each cell holds its own LED.
pub const RIGHT: f64 = 0.35;
/// The most pixels of a window around a panel.
pub const WINDOW_PIXELS: usize = 160 * 160;

/// A few frames of one panel, and the truth.
pub struct RandomScene {
    /// The drawn settings, in words.
    pub what: String,
    /// Columns of a frame.
    pub width: usize,
    /// Rows of a frame.
    pub height: usize,
    /// The frames' pixels.
    pub frames: Vec<Vec<u8>>,
    /// The corner LEDs: top left, top right, bottom right, bottom left.
    pub corners: [[f64; 2]; 4],
    /// The panel's bits in the middle of each exposure.
    pub bits: Vec<u64>,
    /// Distance of neighbouring LEDs along the panel's shorter side, in pixels.
    pub pitch_px: f64,
    /// Whether a photograph is behind the panel.
    pub photograph: bool,
    /// Ambient illuminance.
    pub illuminance_lx: f64,
}

/// Why there is no random scene.
#[derive(Debug, thiserror::Error)]
pub enum RandomSceneError {
    /// A folder of photographs cannot be listed.
    #[error("the photographs in {folder} cannot be listed: {source}")]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// A photograph cannot be read.
    #[error("the photograph {path} cannot be read: {source}")]
    Photograph {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: input::PictureError,
    },
    /// There is no photograph, or an empty one, for a backdrop.
    #[error(
        "a backdrop of {width} × {height} pixels cannot be cut from {photographs} photographs: give at least one, and none without pixels"
    )]
    Backdrop {
        /// Requested columns.
        width: usize,
        /// Requested rows.
        height: usize,
        /// Number of photographs.
        photographs: usize,
    },
    /// The frame is too small or too large for a scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The panel cannot be seen.
    #[error(transparent)]
    View(#[from] ViewError),
}

/// The photographs of a folder (`.png`), sorted by name.
///
/// # Errors
/// If the folder or a picture cannot be read.
pub fn photographs(folder: &Path) -> Result<Vec<GrayImage>, RandomSceneError> {
    let unlisted = |source| RandomSceneError::Folder {
        folder: folder.into(),
        source,
    };
    let mut paths = input::list(folder).map_err(unlisted)?;
    paths.retain(|path| path.extension().is_some_and(|e| e == "png"));
    let open = |path: PathBuf| match input::picture(&path) {
        Ok(picture) => Ok(picture.image.into_luma8()),
        Err(source) => Err(RandomSceneError::Photograph { path, source }),
    };
    paths.into_iter().map(open).collect()
}

/// A random part of a random photograph, mirrored or not, at a random scale, as large as a frame.
///
/// # Errors
/// If there is no photograph, or one without pixels.
pub fn backdrop(photographs: &[GrayImage], width: usize, height: usize, random: &mut impl Rng) -> Result<GrayImage, RandomSceneError> {
    let is_empty = |photo: &GrayImage| photo.width() == 0 || photo.height() == 0;
    if width == 0 || height == 0 || photographs.is_empty() || photographs.iter().any(is_empty) {
        return Err(RandomSceneError::Backdrop {
            width,
            height,
            photographs: photographs.len(),
        });
    }
    let photo = &photographs[random.random_range(0..photographs.len())];
    let largest = (f64::from(photo.width()) / width as f64).min(f64::from(photo.height()) / height as f64);
    let scale = largest * random.random_range(0.3..1.0);
    let size = [(width as f64 * scale).max(1.0) as u32, (height as f64 * scale).max(1.0) as u32];
    let (x, y) = (
        random.random_range(0..=photo.width() - size[0]),
        random.random_range(0..=photo.height() - size[1]),
    );
    let part = imageops::crop_imm(photo, x, y, size[0], size[1]).to_image();
    let part = if random.random() { imageops::flip_horizontal(&part) } else { part };
    Ok(imageops::resize(&part, width as u32, height as u32, FilterType::CatmullRom))
}

/// Frames of a photograph without a panel, of any gain and noise, each after a shake of the camera.
pub struct ShakenPhotograph {
    /// The standard deviation of the noise, in grey levels.
    pub noise_grey: f32,
    /// The frames' pixels.
    pub frames: [Vec<u8>; FRAMES],
}

impl ShakenPhotograph {
    /// Photograph `seed`, frames of `size` (width and height) from places up to 16 px apart.
    ///
    /// # Errors
    /// If there is no photograph, or one without pixels.
    pub fn draw(seed: u64, [width, height]: [usize; 2], photographs: &[GrayImage]) -> Result<Self, RandomSceneError> {
        const SHAKE_PX: u32 = 16;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let shake = SHAKE_PX as usize;
        let backdrop = backdrop(photographs, width + shake, height + shake, &mut random)?;
        let noise_grey = [0.0f32, 1.0, 4.0, 20.0][random.random_range(0..4)];
        let gain: f32 = random.random_range(0.6..1.6);
        let frames = [(); FRAMES].map(|()| {
            let [x, y] = [(); 2].map(|()| random.random_range(0..SHAKE_PX));
            let part = imageops::crop_imm(&backdrop, x, y, width as u32, height as u32).to_image();
            // Approximately standard normal: the sum of twelve uniform numbers.
            let mut normal = || (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0;
            let noisy = |&grey: &u8| (f32::from(grey) * gain + noise_grey * normal()) as u8;
            part.as_raw().iter().map(noisy).collect()
        });
        Ok(Self { noise_grey, frames })
    }
}

/// The distance of the worst corner from the truth.
pub fn farthest(corners: [[f32; 2]; 4], truth: [[f64; 2]; 4]) -> f64 {
    let pairs = corners.iter().zip(&truth);
    pairs
        .map(|(a, b)| (f64::from(a[0]) - b[0]).hypot(f64::from(a[1]) - b[1]))
        .fold(0.0, f64::max)
}

impl RandomScene {
    /// Scene `seed` of the range: 30 to 70 m, interval 0.5 to 2, roll to 15°, yaw to 30°, 50 to 10 000 lx, with and without a
    /// board, two in three before a photograph if there are any; `count` successive frames of 1/100 s, 90 symbols a second.
    ///
    /// # Errors
    /// If that size is invalid for a scene.
    pub fn draw(seed: u64, size: [usize; 2], count: u64, photographs: &[GrayImage]) -> Result<Self, RandomSceneError> {
        Self::draw_turned(seed, 0.0, size, count, photographs)
    }

    /// As [`RandomScene::draw`], rotated further by an angle in degrees, 0 to 180.
    ///
    /// # Errors
    /// As [`RandomScene::draw`].
    pub fn draw_turned(
        seed: u64,
        turn_deg: f64,
        [width, height]: [usize; 2],
        count: u64,
        photographs: &[GrayImage],
    ) -> Result<Self, RandomSceneError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let distance = random.random_range(30.0..70.0);
        let interval = random.random_range(0.5..2.0);
        let (roll, yaw) = (random.random_range(-15.0..15.0), random.random_range(-30.0..30.0));
        let roll = if roll + turn_deg > 180.0 {
            roll + turn_deg - 360.0
        } else {
            roll + turn_deg
        };
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
        let scene = Scene::load("day", &settings)?;
        let view = if photograph {
            View::before(&scene, &backdrop(photographs, width, height, &mut random)?)?
        } else {
            View::new(&scene)?
        };
        let l2a = view.panels[0].l2a;
        let renderer = Renderer::of(view, Level::Fast);
        let mut canvas = Canvas::new(renderer.lit_region());
        let symbols: Vec<u64> = (0..count + 8).map(|_| random.next_u64()).collect();
        let (mut frames, mut bits, mut straddled) = (Vec::new(), Vec::new(), false);
        for frame in 0..count {
            let moment = renderer.moment(seed, frame);
            let steady = renderer.steady(0, PanelFrame::default());
            let shown = PanelExposure {
                symbols: std::array::from_fn(|ahead| PanelFrame::from_bits(symbols[moment.symbol as usize + ahead])),
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
        Ok(Self {
            what: format!(
                "seed {seed}: {distance:.0} m, interval {interval:.2}, roll {roll:.0}, yaw {yaw:.0}, {illuminance_lx:.0} lx, L2A \
                 {l2a:.1}, board {}, {}{}",
                if has_board { format!("{board:.2}") } else { "none".into() },
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
        })
    }

    /// The greatest distance of a corner from the truth, in pixels.
    pub fn error_px(&self, corners: [[f32; 2]; 4]) -> f64 {
        let mut corners = corners;
        let turned = (0..4).map(|_| {
            corners.rotate_left(1);
            farthest(corners, self.corners)
        });
        turned.fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_drawn_or_read_is_said_to_be_so() {
        let missing = photographs(Path::new("no/such/folder"));
        assert!(matches!(missing, Err(RandomSceneError::Folder { .. })));
        let random = &mut ChaCha8Rng::seed_from_u64(1);
        let nothing = backdrop(&[], 64, 48, random);
        assert!(matches!(nothing, Err(RandomSceneError::Backdrop { photographs: 0, .. })));
        let empty = backdrop(&[GrayImage::new(0, 9)], 64, 48, random);
        assert!(matches!(empty, Err(RandomSceneError::Backdrop { .. })));
        let no_frame = RandomScene::draw(1, [0, 0], 1, &[]);
        assert!(matches!(no_frame, Err(RandomSceneError::Scene(_))));
        assert!(RandomScene::draw(1, [640, 480], 1, &[]).is_ok());
    }
}
