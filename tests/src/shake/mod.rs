//! Films by a shaking camera, drawn without the simulator: a panel on a board in front of houses, in linear light; the camera's direction
//! and roll change between frames, and so may the light.
//!
//! Discs are sampled, not modelled; the lens is a Gaussian blur of the whole image; the sensor adds shot and read noise, and encodes by a
//! power law. Ground truth is the panel's centre and pitch in each frame.

mod drawing;
mod ground;
mod light;

use std::fmt::{self, Display, Formatter};
use std::ops::Add;

pub(crate) use drawing::Drawing;
pub use light::Light;
use reception::{PanelEvent, Reception, ReceptionSettings, Stamp};
use rx_pipeline::frame::Frame;

/// Frame rate, Hz.
const FPS: f64 = 100.0;
const SYMBOL_RATE_HZ: f64 = 90.0;
/// Exposure time, s.
const EXPOSURE_S: f64 = 0.001;
/// The panel's message.
const MESSAGE: &[u8] = b"Lane closed ahead";

/// A larger position error (pitches) means that the reading is off by a line.
const LINE_OFF: f64 = 0.6;
/// Maximum confidence (probability) that such a reading should have.
const SURE: f32 = 0.9;

/// How the camera shakes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shake {
    /// Independent random directions in each frame.
    Random,
    /// Sums of sines of 1 to 12 Hz, like a hand or a vehicle.
    Smooth,
    /// Rotation about the image centre by a number of degrees per frame, back and forth, with the panel far from the centre.
    Turn,
}

/// Parameters of a film.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    /// The random seed.
    pub seed: u64,
    /// Distance of neighbouring LEDs (px).
    pub pitch_px: f64,
    /// How the camera shakes.
    pub shake: Shake,
    /// RMS displacement of the panel between frames (px); degrees per frame for a turn.
    pub step: f64,
    /// Number of frames.
    pub frames: usize,
    /// How the light changes.
    pub light: Light,
}

/// Outcome of films.
#[derive(Clone, Copy, Debug, Default)]
pub struct FilmResult {
    /// Films whose message arrived.
    pub delivered: usize,
    /// Total frames.
    pub frames: usize,
    /// Frames with a reading.
    pub read: usize,
    /// Readings that are off by at least 0.6 pitches.
    pub line_off: usize,
    /// Such readings with a confidence above 90 %.
    pub surely: usize,
    /// Wrong bits in correctly located frames that show a single symbol.
    pub wrong_bits: usize,
    /// Frames without a reading in which each On LED is brighter at its centre than all Off LEDs.
    pub legible_unread: usize,
}

impl FilmResult {
    /// What its text shows.
    pub const COLUMNS: &str =
        "films delivered / frames read of all, % / legible but unread / line off / of them surely / bits wrong of readings in place";
}

impl Display for FilmResult {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            delivered,
            frames,
            read,
            line_off,
            surely,
            wrong_bits,
            legible_unread,
        } = self;
        let share = 100.0 * *read as f64 / *frames as f64;
        write!(
            f,
            "{delivered:3} / {share:5.1} / {legible_unread:4} / {line_off:4} / {surely:4} / {wrong_bits}"
        )
    }
}

impl Add for FilmResult {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            delivered: self.delivered + other.delivered,
            frames: self.frames + other.frames,
            read: self.read + other.read,
            line_off: self.line_off + other.line_off,
            surely: self.surely + other.surely,
            wrong_bits: self.wrong_bits + other.wrong_bits,
            legible_unread: self.legible_unread + other.legible_unread,
        }
    }
}

/// Receives a film as `vocc receive` does, with known frame and symbol rates; `verbose` prints each frame.
pub fn receive(film: Film, verbose: bool) -> FilmResult {
    let mut drawing = Drawing::new(film);
    let side = drawing.side();
    let settings = ReceptionSettings {
        fps: FPS as f32,
        symbol_rate_hz: Some(SYMBOL_RATE_HZ as f32),
        ..ReceptionSettings::default()
    };
    let mut reception = Reception::new(settings).expect("settings");
    let no_lens = Err(String::from("no lens"));
    let mut fate = FilmResult::default();
    let mut came = |event: &PanelEvent| matches!(event, PanelEvent::Message(message) if message.data == MESSAGE);
    for number in 0..film.frames {
        let taken = drawing.take(number);
        let frame = Frame::new(&taken.grey, side, side).expect("a frame");
        fate.frames += 1;
        let stamp = Stamp::of(number as u64);
        let reports = reception.frame(stamp, &frame, &no_lens, &mut ()).expect("a report");
        for report in &reports {
            if report.events.iter().any(&mut came) {
                fate.delivered = 1;
            }
            match &report.reading {
                Ok(reading) => {
                    let points = reading.corners.points();
                    let centre = [0, 1].map(|i| points.iter().map(|point| f64::from(point[i])).sum::<f64>() / 4.0);
                    let off = (centre[0] - taken.centre_px[0]).hypot(centre[1] - taken.centre_px[1]) / film.pitch_px;
                    let wrong = (reading.detection.bits.bits() ^ taken.bits).count_ones() as usize;
                    fate.read += 1;
                    if reading.detection.mixed.is_none() && off < LINE_OFF {
                        fate.wrong_bits += wrong;
                    }
                    if off > LINE_OFF {
                        fate.line_off += 1;
                        fate.surely += usize::from(reading.detection.confidence > SURE);
                    }
                    if verbose {
                        let sure = reading.detection.confidence;
                        let mixed = if reading.detection.mixed.is_some() { ", mixed" } else { "" };
                        println!("  {number:3} {off:6.2} pitches off, {wrong:2} wrong, {sure:.3} sure{mixed}");
                    }
                }
                Err(loss) => {
                    fate.legible_unread += usize::from(taken.is_legible);
                    if verbose {
                        println!("  {number:3} {loss}");
                    }
                }
            }
        }
    }
    if reception.finish().iter().any(|(_, event)| came(event)) {
        fate.delivered = 1;
    }
    fate
}
