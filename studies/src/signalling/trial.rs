//! One message over the rendered road.

use link::fec::Code;
use link::framing::{Framer, FramingError};
use link::scramble::split_mix64;
use link::waveform::Waveform;
use sim::accuracy::Level;
use sim::road::{LinkSettings, ReceivedMessage, Road, RoadError};
use sim::scene::Scene;
use sim::view::ViewError;
use thiserror::Error;

use crate::detectors::DetectorChoice;
use crate::monte_carlo::{EvaluateError, receiving_method};
use crate::statistics::FrameErrors;
use crate::stop::Stop;

/// A random message at one symbol rate and phase, under one code.
///
/// ```
/// use link::fec::Code;
/// use link::waveform::Waveform;
/// use sim::scene::Scene;
/// use studies::signalling::Trial;
/// use studies::stop::Stop;
/// let small = ["camera.width_px=160", "camera.height_px=120"].map(String::from);
/// let day = Scene::load("day", &small)?;
/// let trial = Trial {
///     code: Code::Tc128, bytes: 8, rate_hz: 90.0, waveform: Waveform::STILL, phase: 0.3, seed: 1, true_corners: true
/// };
/// assert!(trial.run(&day, Stop::NEVER)?.received.is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// The code.
    pub code: Code,
    /// Bytes of the message, 1 to 1024.
    pub bytes: usize,
    /// Symbols a second.
    pub rate_hz: f64,
    /// The waveform of a symbol.
    pub waveform: Waveform,
    /// The phase within a symbol at which the first exposure starts, from 0 up to 1.
    pub phase: f64,
    /// The seed of the message and of all random numbers.
    pub seed: u64,
    /// Whether the receiver gets the panel's position, as if it followed the panel.
    pub true_corners: bool,
}

/// The result of a trial.
#[derive(Clone, Debug)]
pub struct Run {
    /// The message, if it arrived.
    pub received: Option<ReceivedMessage>,
    /// Frames until the message was whole or given up.
    pub frames: u64,
    /// Wrong bits of the frames.
    pub errors: FrameErrors,
}

/// Why a trial failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TrialError {
    /// The scene, the transmitter or the receiver is unusable.
    #[error(transparent)]
    Road(#[from] RoadError),
    /// The scene's camera does not see the panel.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The message is invalid.
    #[error(transparent)]
    Framing(#[from] FramingError),
    /// The receiver's detector cannot be used.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The work was stopped.
    #[error("stopped before all was tried")]
    Stopped,
}

impl Trial {
    /// Repeats after which a message that has not arrived is lost.
    pub const REPEATS: u32 = 3;
    /// With a carrier, at least this many frames: the receiver looks for one in the last 48, and refines it over the last 128.
    pub const CARRIER_FRAMES: u64 = 150;

    /// The number of frames after which a message of `panels` panels that has not arrived is lost.
    pub fn frames(&self, panels: u32, frames_hz: f64) -> u64 {
        let frames = (f64::from(Self::REPEATS * panels) * frames_hz / self.rate_hz).ceil() as u64;
        if self.waveform.is_still() {
            frames
        } else {
            frames.max(Self::CARRIER_FRAMES)
        }
    }

    /// The message.
    pub fn message(&self) -> Vec<u8> {
        let bytes = 0..self.bytes as u64;
        bytes.map(|at| split_mix64(self.seed << 32 | at) as u8).collect()
    }

    /// Sends it.
    ///
    /// # Errors
    /// [`TrialError`]: an invalid scene or message, or a stop.
    pub fn run(&self, scene: &Scene, stop: Stop) -> Result<Run, TrialError> {
        let mut scene = scene.clone();
        scene.link.symbol_rate_hz = self.rate_hz;
        scene.link.phase = self.phase;
        scene.link.carrier_cycles = Some(self.waveform.cycles());
        let message = self.message();
        let panels = Framer::new(&message, self.code, false)?.panels_per_repeat();
        let settings = LinkSettings {
            code: Some(self.code),
            true_corners: self.true_corners,
            ..LinkSettings::new(
                message,
                receiving_method(&scene, DetectorChoice::Best, self.seed, Level::Fast)?,
                self.seed,
            )
        };
        let mut road = Road::new(&scene, &settings)?;
        let mut errors = FrameErrors::default();
        let arrived = |received: &ReceivedMessage| received.message == settings.message;
        let frames = self.frames(panels, scene.camera.frame_rate_hz);
        for frame in 0..frames {
            if stop.is_asked() {
                return Err(TrialError::Stopped);
            }
            let report = road.frame(frame)?;
            errors.push(report.bit_errors);
            if let Some(received) = report.delivered.filter(arrived) {
                return Ok(Run {
                    received: Some(received),
                    frames: frame + 1,
                    errors,
                });
            }
        }
        Ok(Run {
            received: road.finish().filter(arrived),
            frames,
            errors,
        })
    }
}
