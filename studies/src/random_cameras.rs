//! Panels from 3 m on before random cameras that the receiver does not know, and their reception.

use image::GrayImage;
use link::camera::Camera;
use link::fec::Code;
use link::framing::{Event, Framer};
use link::panel::PanelFrame;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{FrameReading, FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};

use sim::accuracy::Level;
use sim::camera::clock::WINDOW;
use sim::renderer::canvas::Canvas;
use sim::renderer::{PanelExposure, Renderer};
use sim::road::calibrated_camera_of;
use sim::scene::Scene;
use sim::view::View;

use crate::random_scenes::{RIGHT, RandomSceneError, ShakenPhotograph, WINDOW_PIXELS, backdrop, farthest};
use crate::statistics::Reliability;

/// The message.
pub const MESSAGE: &[u8] = b"Lane closed ahead";
/// Frames of a film: two repeats of the message, from any start.
pub const FRAMES: u64 = 36;
/// Frames within which a panel should be found.
pub const IN_TIME: u64 = 5;

/// The least and the greatest distance, in metres.
const DISTANCE_M: [f64; 2] = [3.0, 70.0];
/// The least and the greatest standard deviation of the blur, in pixels.
const BLUR_PX: [f64; 2] = [0.6, 4.0];
/// The greatest readable blur, in pitches.
const SOFTEST: f64 = 0.6;
/// Side of the square for a panel rotated by 15°, in pitches.
const ROOM: f64 = 9.8;
/// A setting of panels with broken LEDs.
const BROKEN_LEDS: &str = "panel.dead_leds";
/// Symbols a second, for 100 frames a second.
const SYMBOL_RATE_HZ: f64 = 90.0;

/// A film of one panel that repeats a message.
pub struct RandomFilm {
    /// The drawn settings, in words.
    pub what: String,
    /// The corner LEDs: top left, top right, bottom right, bottom left, in pixels.
    pub corners: [[f64; 2]; 4],
    /// Distance of neighbouring LEDs along the panel's shorter side, in pixels.
    pub pitch_px: f64,
    /// The renderer's camera, for a receiver that is configured.
    pub camera: Camera,
    /// Whether LEDs are broken, whose bits cannot be read in a single frame.
    pub has_broken_leds: bool,
    seed: u64,
    renderer: Renderer,
    canvas: Canvas<f32>,
    symbols: Vec<PanelFrame>,
    pixels: Vec<u8>,
}

impl RandomFilm {
    /// Film `seed`, frames of `size` (width and height), two in three before a photograph if there are any.
    ///
    /// # Errors
    /// If that size is invalid for a scene.
    pub fn draw(seed: u64, size: [usize; 2], photographs: &[GrayImage]) -> Result<Self, RandomSceneError> {
        let [width, height] = size;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let place = settings_of_place(size, &mut random);
        let softest = BLUR_PX[1].min(SOFTEST * place.pitch_px);
        let lens = settings_of_camera(softest, &mut random);
        let panel = settings_of_panel(&mut random);
        let has_broken_leds = panel.iter().any(|setting| setting.starts_with(BROKEN_LEDS));
        let settings = [place.settings, lens, panel].concat();
        let scene = Scene::load("day", &settings)?;
        let camera = calibrated_camera_of(&scene);
        let has_photograph = !photographs.is_empty() && random.random_range(0..3) > 0;
        let view = if has_photograph {
            View::before(&scene, &backdrop(photographs, width, height, &mut random)?)?
        } else {
            View::new(&scene)?
        };
        let renderer = Renderer::of(view, Level::Fast);
        let corners = renderer.corner_leds_px(0);
        let along = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) / 7.0;
        Ok(Self {
            what: format!(
                "seed {seed}: {}{}",
                if has_photograph { "photograph " } else { "" },
                settings[2..].join(" ")
            ),
            pitch_px: along(corners[0], corners[1]).min(along(corners[1], corners[2])),
            corners,
            camera,
            has_broken_leds,
            seed,
            canvas: Canvas::new(renderer.lit_region()),
            renderer,
            symbols: symbols(random.random_range(0..64)),
            pixels: vec![0; width * height],
        })
    }

    /// Exposes frame `number`, below [`FRAMES`]: its pixels, and the panel's bits; no bits if the exposure is shared by two symbols.
    pub fn frame(&mut self, number: u64) -> (&[u8], Option<PanelFrame>) {
        let renderer = &self.renderer;
        let moment = renderer.moment(self.seed, number);
        let first = moment.symbol as usize;
        let shown = PanelExposure {
            symbols: std::array::from_fn(|ahead| self.symbols[first + ahead]),
            ..renderer.steady(0, PanelFrame::default())
        };
        renderer.frame(self.seed, &moment, &[shown], &mut self.canvas, &mut self.pixels);
        let bits = (!renderer.straddles(0, &moment)).then(|| renderer.truth(0, &moment, &shown));
        (&self.pixels, bits)
    }
}

/// The message, repeated, from its symbol `begins` on.
fn symbols(begins: usize) -> Vec<PanelFrame> {
    let Ok(mut framer) = Framer::new(MESSAGE, Code::for_length(MESSAGE.len()), false) else {
        return Vec::new();
    };
    let count = FRAMES as usize + WINDOW + 2;
    let all: Vec<PanelFrame> = (0..begins + count).map(|_| framer.next_panel()).collect();
    all[begins..].to_vec()
}

/// A panel's position, and the least pitch of its LEDs.
struct Place {
    settings: Vec<String>,
    pitch_px: f64,
}

fn settings_of_place([width, height]: [usize; 2], random: &mut impl Rng) -> Place {
    let focal_px = 25e-3 / 6.875e-6;
    let interval = random.random_range(0.5..2.0);
    let pitch_m = 0.03 * (1.0 + interval);
    let nearest = DISTANCE_M[0].max(ROOM * focal_px * pitch_m / width.min(height) as f64);
    let distance = nearest * (DISTANCE_M[1] / nearest).powf(random.random());
    let pitch_px = focal_px * pitch_m / distance;
    let (roll, yaw, tilt): (f64, f64, f64) = (
        random.random_range(-15.0..15.0),
        random.random_range(-30.0..30.0),
        random.random_range(-10.0..10.0),
    );
    let mut side = |length: usize| {
        let room = ((length as f64 - ROOM * pitch_px) / 2.0).max(0.0);
        random.random_range(-1.0..1.0) * room * distance / focal_px
    };
    let (x, y) = (side(width), side(height));
    Place {
        settings: vec![
            format!("camera.width_px={width}"),
            format!("camera.height_px={height}"),
            format!("pose.distance_m={distance:.3}"),
            format!("panel.interval={interval:.3}"),
            format!("pose.roll_deg={roll:.2}"),
            format!("pose.yaw_deg={yaw:.2}"),
            format!("pose.pitch_deg={tilt:.2}"),
            format!("pose.x_m={x}"),
            format!("pose.y_m={y}"),
        ],
        pitch_px: pitch_px * yaw.to_radians().cos(),
    }
}

/// A camera: lens, curve, noise, and picture processing.
fn settings_of_camera(softest_px: f64, random: &mut impl Rng) -> Vec<String> {
    let mut is = |share: f64| random.random::<f64>() < share;
    let [sharpens, compresses, has_pattern, has_hot_pixels, vignettes, is_defocused] = [0.35, 0.3, 0.5, 0.4, 0.3, 0.25].map(&mut is);
    let blur = BLUR_PX[0] * (softest_px / BLUR_PX[0]).max(1.0).powf(random.random());
    let curve = [
        "camera.encoding=linear",
        "camera.gamma=1.8",
        "camera.gamma=2.2",
        "camera.gamma=2.6",
        "camera.encoding=srgb",
        "camera.encoding=rec709",
        "camera.encoding=shoulder",
    ][random.random_range(0..7)];
    let mut settings = vec![
        curve.into(),
        format!("camera.blur_sigma_px={blur:.3}"),
        format!("camera.black_grey={}", [0, 0, 4, 16][random.random_range(0..4)]),
        format!("camera.exposure_bias_ev={:.2}", random.random_range(-1.5..0.5)),
        format!("camera.read_noise_e={:.1}", random.random_range(1.5..6.0)),
        format!("camera.vignetting={vignettes}"),
        format!("camera.seed={}", random.random::<u32>()),
        format!("link.phase={:.3}", random.random::<f64>()),
        format!("link.symbol_rate_hz={SYMBOL_RATE_HZ}"),
        format!("ambient.illuminance_lx={:.0}", 50.0 * 200f64.powf(random.random())),
    ];
    if is_defocused {
        settings.push("camera.psf=disc".into());
    }
    if random.random::<f64>() < 0.35 {
        settings.push(format!("camera.blur_aspect={:.2}", random.random_range(0.6..1.7)));
    }
    if sharpens {
        settings.push(format!("camera.sharpening={:.2}", random.random_range(0.3..1.5)));
        settings.push(format!("camera.sharpening_radius_px={:.2}", random.random_range(0.8..2.0)));
    }
    if compresses {
        settings.push(format!("camera.jpeg_quality={}", random.random_range(50..96)));
    }
    if has_pattern {
        settings.push(format!("camera.prnu_percent={:.2}", random.random_range(0.0..2.0)));
    }
    if has_hot_pixels {
        settings.push(format!("camera.hot_pixels_ppm={:.0}", random.random_range(10.0..150.0)));
    }
    settings
}

/// A real panel: with a board or without, with unequal LEDs, some broken.
fn settings_of_panel(random: &mut impl Rng) -> Vec<String> {
    let mut settings = vec![
        format!("panel.reflectance={:.3}", random.random_range(0.3..0.5)),
        format!("panel.seed={}", random.random::<u32>()),
    ];
    if random.random::<f64>() < 0.75 {
        settings.push(format!("panel.board_reflectance={:.3}", 0.02 * 45f64.powf(random.random())));
    }
    if random.random() {
        settings.push(format!("panel.led_spread={:.3}", random.random_range(0.0..0.12)));
    }
    if random.random::<f64>() < 0.3 {
        let dead = random.random_range(0..=2);
        settings.push(format!("{BROKEN_LEDS}={dead}"));
        settings.push(format!("panel.stuck_leds={}", 2 - dead));
    }
    if random.random::<f64>() < 0.15 {
        settings.push(format!("panel.dim_row={}", random.random_range(0..8)));
    }
    settings
}

/// The result of a film.
#[derive(Debug, Default)]
pub struct FilmResult {
    /// The frame in which the panel was first found, and the error of the worst corner LED there, in pixels.
    pub found: Option<(u64, f64)>,
    /// Whether a panel was ever seen at a wrong place.
    pub misplaced: bool,
    /// The frame that completed the message.
    pub delivered_at: Option<u64>,
    /// Wrong bits of frames that show one symbol.
    pub errors: u64,
    /// All bits of these frames.
    pub bits: u64,
    /// The reported confidence of those bits.
    pub reliability: Reliability,
    /// The reported confidence of bits in the frames with the panel at its place.
    pub reliability_in_place: Reliability,
    /// The receiver's last reason for a failure.
    pub why: String,
}

/// Receives a film until its message has arrived, with the camera settings `camera`.
///
/// # Panics
/// If a film has no pixels.
pub fn receive(film: &mut RandomFilm, size: [usize; 2], camera: Camera) -> FilmResult {
    let settings = ReceiverSettings {
        camera,
        symbols_per_frame: (SYMBOL_RATE_HZ / 100.0) as f32,
        ..ReceiverSettings::default()
    };
    let mut receiver = receiver(settings, size);
    let mut fate = FilmResult::default();
    let (corners, pitch_px) = (film.corners, film.pitch_px);
    for number in 0..FRAMES {
        let (pixels, bits) = film.frame(number);
        let outcome = receiver.frame(number, &frame(pixels, size));
        match outcome.reading {
            Ok(reading) => {
                let off = farthest(reading.corners.points(), corners);
                fate.found.get_or_insert((number, off));
                fate.misplaced |= off > RIGHT * pitch_px;
                if let Some(bits) = bits {
                    fate.errors += u64::from(reading.detection.bits.distance(bits));
                    fate.bits += 64;
                    fate.reliability.push(&reading.detection.soft, bits);
                    if off <= RIGHT * pitch_px {
                        fate.reliability_in_place.push(&reading.detection.soft, bits);
                    }
                }
            }
            Err(loss) => fate.why = loss.to_string(),
        }
        if is_the_message(&outcome.event) {
            fate.delivered_at = Some(number);
            return fate;
        }
    }
    fate.delivered_at = is_the_message(&receiver.finish()).then_some(FRAMES);
    fate
}

/// The reading of a film's first frame of one symbol by a thorough search, as for a single picture; and the panel's bits there. `None` if
/// no panel is found.
///
/// # Panics
/// If a film has no pixels.
pub fn read_alone(film: &mut RandomFilm, size: [usize; 2]) -> Option<(FrameReading, PanelFrame)> {
    let number = (0..FRAMES).find(|&number| film.frame(number).1.is_some())?;
    let (pixels, bits) = film.frame(number);
    let mut receiver = Receiving::new(ReceiverSettings::default(), Box::default(), search(size).thorough()).expect("the default settings");
    let reading = receiver.frame(0, &frame(pixels, size)).reading;
    Some((reading.ok()?, bits?))
}

fn is_the_message(event: &Event<'_>) -> bool {
    matches!(event, Event::Delivered(delivery) if delivery.message == MESSAGE)
}

/// Searches for panels in the frames of a shaken photograph without one; returns the positions of false positives.
///
/// # Errors
/// If there is no photograph.
pub fn receive_without_panel(seed: u64, size: [usize; 2], photographs: &[GrayImage]) -> Result<Vec<[[f32; 2]; 4]>, RandomSceneError> {
    let photograph = ShakenPhotograph::draw(seed, size, photographs)?;
    let mut receiver = receiver(ReceiverSettings::default(), size);
    let mut seen = Vec::new();
    for (number, pixels) in (0..).zip(&photograph.frames) {
        if let Ok(reading) = receiver.frame(number, &frame(pixels, size)).reading {
            seen.push(reading.corners.points());
        }
    }
    Ok(seen)
}

type Receiving = Receiver<WINDOW_PIXELS, Box<ReceiverMemory<WINDOW_PIXELS>>, FrameSearch<Box<SearchMemory>, Vec<u8>>>;

fn receiver(settings: ReceiverSettings, size: [usize; 2]) -> Receiving {
    Receiver::new(settings, Box::default(), search(size)).expect("settings in range")
}

fn search([width, height]: [usize; 2]) -> FrameSearch<Box<SearchMemory>, Vec<u8>> {
    let room = FrameSearch::<Box<SearchMemory>>::bytes(width, height);
    FrameSearch::with_history(Box::default(), vec![0; room])
}

fn frame(pixels: &[u8], [width, height]: [usize; 2]) -> Frame<'_> {
    Frame::new(pixels, width, height).expect("as many pixels as the frame has")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [640, 480];

    #[test]
    fn every_drawn_camera_is_one_that_the_simulator_has() {
        for seed in 0..20 {
            let film = RandomFilm::draw(seed, SIZE, &[]).unwrap();
            let inside = |corner: &[f64; 2]| (0.0..640.0).contains(&corner[0]) && (0.0..480.0).contains(&corner[1]);
            assert!(film.corners.iter().all(inside), "{}", film.what);
        }
    }

    #[test]
    fn a_film_is_the_same_whenever_it_is_drawn() {
        let mut films = [(); 2].map(|()| RandomFilm::draw(7, SIZE, &[]).unwrap());
        let [first, second] = films.each_mut().map(|film| film.frame(3).0.to_vec());
        assert!(first == second);
    }

    #[test]
    fn without_a_photograph_there_is_nothing_to_search() {
        let nothing = receive_without_panel(1, SIZE, &[]);
        assert!(matches!(nothing, Err(RandomSceneError::Backdrop { .. })));
    }
}
