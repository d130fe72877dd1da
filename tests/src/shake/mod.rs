//! Films by a camera that shakes, drawn without the simulator: a panel on a board before houses, in linear light, taken by a camera whose
//! direction and roll change from frame to frame.
//!
//! Discs are sampled, not modelled; the lens blurs the whole picture by a Gaussian; the sensor adds the noise of its electrons, and encodes
//! by a power law. What a film shows is known: the panel's centre and pitch in each frame.

mod drawing;
mod ground;

use std::ops::Add;

pub(crate) use drawing::Drawing;
use reception::{PanelEvent, Reception, ReceptionSettings, Stamp};
use rx_pipeline::frame::Frame;

/// Frames a second, symbols a second and seconds of exposure.
const FPS: f64 = 100.0;
const SYMBOL_RATE_HZ: f64 = 90.0;
/// See there.
const EXPOSURE_S: f64 = 0.001;
/// What the panel says.
const MESSAGE: &[u8] = b"Lane closed ahead";

/// A place farther from the truth is another line's (pitches).
const LINE_OFF: f64 = 0.6;
/// Such a reading should not be said to be surer (probability).
const SURE: f32 = 0.9;

/// How the camera shakes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shake {
    /// Each frame by itself: a new direction that has nothing to do with the last.
    Random,
    /// Sums of sines of 1 to 12 Hz, as a hand's or a vehicle's.
    Smooth,
    /// A turn about the picture's centre by a number of degrees a frame, there and back, the panel far from the centre.
    Turn,
}

/// A film of a shaken camera.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    /// The seed of everything that is drawn at random.
    pub seed: u64,
    /// Distance of neighbouring LEDs (px).
    pub pitch_px: f64,
    /// How the camera shakes.
    pub shake: Shake,
    /// By how much the panel moves from frame to frame, root mean square (px); degrees a frame for a turn.
    pub step: f64,
    /// Frames.
    pub frames: usize,
}

/// What came of films.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fate {
    /// Films whose message came.
    pub delivered: usize,
    /// Frames.
    pub frames: usize,
    /// Frames that were read.
    pub read: usize,
    /// Those read at least 0.6 pitches off.
    pub line_off: usize,
    /// Those of them said to be more than 90 % sure.
    pub surely: usize,
    /// Wrong bits of frames that were read in their place and show one symbol.
    pub wrong_bits: usize,
}

impl Add for Fate {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            delivered: self.delivered + other.delivered,
            frames: self.frames + other.frames,
            read: self.read + other.read,
            line_off: self.line_off + other.line_off,
            surely: self.surely + other.surely,
            wrong_bits: self.wrong_bits + other.wrong_bits,
        }
    }
}

/// Receives a film as `vocc receive` does, told its two rates; `verbose` prints each frame.
pub fn receive(film: Film, verbose: bool) -> Fate {
    let mut drawing = Drawing::new(film);
    let side = drawing.side();
    let settings = ReceptionSettings {
        fps: FPS as f32,
        symbol_rate_hz: Some(SYMBOL_RATE_HZ as f32),
        ..ReceptionSettings::default()
    };
    let mut reception = Reception::new(settings).expect("settings");
    let no_lens = Err(String::from("no lens"));
    let mut fate = Fate::default();
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
                Err(loss) if verbose => println!("  {number:3} {loss}"),
                Err(_) => {}
            }
        }
    }
    if reception.finish().iter().any(|(_, event)| came(event)) {
        fate.delivered = 1;
    }
    fate
}
