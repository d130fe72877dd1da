//! The symbol rate and code of the highest net rate through a camera.
//!
//! A camera of `f` frames a second that exposes for `E`, and whose sensor takes `R` to read the panel's lines, sees a whole exposure of
//! each symbol, on every row and at any phase, if a symbol lasts at least 1/f + E + R ([`SymbolRate::for_camera`]). Faster symbols share
//! exposures. The receiver reads those as far as it can. The benefit is measured, not computed: messages are sent over the rendered road
//! ([`Trial`]) at several rates, at phases that cover a symbol evenly, and then under each code at the best rate. [`Search::carrier`] tries
//! the carriers without visible flicker that the camera sees best, with a receiver that also has to find the panel.
//!
//! ```no_run
//! use sim::scene::Scene;
//! use studies::signalling::Search;
//! use studies::stop::Stop;
//! let phone = Scene::load("phone", &[])?;
//! let advice = Search { bytes: 48, runs: 8, seed: 1 }.run(&phone, Stop::NEVER, || {}, |_trial| {})?;
//! let best = advice.best();
//! println!("{} symbols a second under {}: {:.0} bit/s", best.rate, best.code, best.net_bit_s());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod carrier;
mod dimming;
mod exposed;
mod trial;

use crate::parallel::try_map;
use link::fec::Code;
use link::symbol_rate::{SymbolRate, SymbolRateError};
use link::waveform::{SymbolTiming, Waveform};
use sim::camera::exposure::Exposure;
use sim::scene::Scene;
use thiserror::Error;

pub use carrier::{Carrier, CarrierAdvice, NoCarrier, USUAL_FRAMES_HZ, parked_at};
pub use dimming::DimmingBeat;
pub use exposed::exposed_for;
pub use trial::{Trial, TrialError};

use crate::flicker::panels;
use crate::statistics::FrameErrors;
use crate::stop::Stop;

/// Rates to try beside that of whole exposures, as shares of the frame rate.
const SHARES_OF_FRAMES: [f64; 6] = [0.5, 0.6, 0.7, 0.8, 0.9, 0.95];
/// Rates that differ by less, relatively, count as one.
const APART: f64 = 0.03;
/// Phases are spread by the golden ratio: any number of them covers a symbol evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The amount of trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// Bytes of a message, 1 to 1024.
    pub bytes: usize,
    /// Messages at each setting, at least 1.
    pub runs: u64,
    /// The seed of all random numbers.
    pub seed: u64,
}

/// The result of a symbol rate and a code.
#[derive(Clone, Copy, Debug)]
pub struct TrialOutcome {
    /// Symbols a second.
    pub rate: SymbolRate,
    /// The waveform of a symbol.
    pub waveform: Waveform,
    /// The code.
    pub code: Code,
    /// Messages sent.
    pub runs: u64,
    /// Messages that arrived within [`Trial::frames`].
    pub delivered: u64,
    /// Payload of those, bits.
    pub bits: u64,
    /// The total time of all messages, s.
    pub seconds: f64,
    /// Wrong bits of single frames, compared with the symbol in the middle of the exposure.
    errors: FrameErrors,
}

impl TrialOutcome {
    /// The rate of wrong bits in single frames. `None` with a carrier: frames that are read before it is known may show complements.
    pub fn bit_error_rate(&self) -> Option<f64> {
        self.waveform.is_still().then(|| self.errors.rate())
    }

    /// Payload a second, including the time of lost messages, bit/s.
    pub fn net_bit_s(&self) -> f64 {
        self.bits as f64 / self.seconds
    }

    /// Seconds a message, including the time of lost ones; infinite if none arrived.
    pub fn seconds_a_message(&self) -> f64 {
        self.seconds / self.delivered as f64
    }
}

/// The recommendation for a camera.
#[derive(Clone, Debug)]
pub struct Advice {
    /// The rate at which every symbol has a whole exposure on every row of the panel, at any phase.
    pub whole_exposures: SymbolRate,
    /// All trials, in order.
    pub trials: Vec<TrialOutcome>,
    /// The index of the best in `trials`.
    best: usize,
    /// The beat of each panel with PWM dimming or row scanning.
    pub dimming: Vec<DimmingBeat>,
}

impl Advice {
    /// The trial of the highest net rate.
    pub fn best(&self) -> &TrialOutcome {
        &self.trials[self.best]
    }
}

/// Why there is no advice.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SignallingError {
    /// The camera needs slower symbols than any transmitter can show.
    #[error(
        "a camera of {frames_hz} frames a second that exposes for {exposure_s} s and takes {readout_s} s to read the panel out sees no whole \
         symbol of a transmitter: {source}; expose for less"
    )]
    TooSlow {
        /// Frames a second.
        frames_hz: f64,
        /// The exposure, s.
        exposure_s: f64,
        /// Time from the panel's first line to its last, s.
        readout_s: f64,
        /// The required rate.
        source: SymbolRateError,
    },
    /// A trial could not be made.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// There are no trials.
    #[error("0 runs per setting give no result: give at least 1")]
    NoRuns,
}

impl Search {
    /// The most settings of a search.
    pub const SETTINGS_MAX: u64 = (1 + SHARES_OF_FRAMES.len() + Code::ALL.len() + carrier::CANDIDATES_MAX) as u64;

    /// Tries rates and codes; `done` is called after each message, `tell` after each setting.
    ///
    /// # Errors
    /// [`SignallingError`]: a camera too slow, an invalid scene or message, or a stop.
    pub fn run(
        &self,
        scene: &Scene,
        stop: Stop,
        done: impl Fn() + Sync,
        mut tell: impl FnMut(&TrialOutcome),
    ) -> Result<Advice, SignallingError> {
        if self.runs == 0 {
            return Err(SignallingError::NoRuns);
        }
        let dimming = dimming::beats(scene).map_err(TrialError::from)?;
        let whole_exposures = whole_exposures(scene)?;
        let usual = Code::for_length(self.bytes);
        let mut trials = Vec::new();
        for rate in rates(scene, whole_exposures) {
            trials.push(self.attempt(scene, SymbolTiming::still(rate), usual, stop, &done)?);
            trials.last().into_iter().for_each(&mut tell);
        }
        let rate = trials[best(&trials)].rate;
        for code in Code::ALL.into_iter().filter(|&code| code != usual) {
            trials.push(self.attempt(scene, SymbolTiming::still(rate), code, stop, &done)?);
            trials.last().into_iter().for_each(&mut tell);
        }
        Ok(Advice {
            whole_exposures,
            best: best(&trials),
            trials,
            dimming,
        })
    }

    /// Tries carriers at about the rate of whole exposures, as [`run`](Self::run) tries rates: the first with which all messages arrive, or
    /// that of most, or why none is recommended.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn carrier(
        &self,
        scene: &Scene,
        stop: Stop,
        done: impl Fn() + Sync,
        mut tell: impl FnMut(&TrialOutcome),
    ) -> Result<Result<CarrierAdvice, NoCarrier>, SignallingError> {
        if self.runs == 0 {
            return Err(SignallingError::NoRuns);
        }
        let rate = whole_exposures(scene)?;
        let camera = carrier::Camera {
            frames_hz: scene.camera.frame_rate_hz,
            exposure_s: Exposure::of(scene).time_s,
            readout_s: dimming::panel_readout_s(scene).map_err(TrialError::from)?,
        };
        let code = Code::for_length(self.bytes);
        let message = self.trial(SymbolTiming::still(rate), code, 0).message();
        let shown = [panels(None), panels(Some(&message))];
        let shown = shown.into_iter().collect::<Result<Vec<_>, _>>().map_err(TrialError::from)?;
        let mut trials: Vec<CarrierAdvice> = Vec::new();
        for (carrier, low_risk_times) in camera.candidates(rate, &shown, stop) {
            let trial = self.attempt(scene, carrier.timing, code, stop, &done)?;
            tell(&trial);
            trials.push(CarrierAdvice {
                carrier,
                low_risk_times,
                trial,
            });
            if trial.delivered == trial.runs {
                break;
            }
        }
        let advice = carrier::best(trials, camera.exposure_s);
        let advice = advice.unwrap_or_else(|| Err(camera.no_candidate(rate, &shown, self.bytes, stop)));
        match stop.is_asked() {
            true => Err(TrialError::Stopped.into()),
            false => Ok(advice),
        }
    }

    /// One message. A carrier's receiver also has to find the panel, as `vocc link` does.
    fn trial(&self, timing: SymbolTiming, code: Code, run: u64) -> Trial {
        Trial {
            code,
            bytes: self.bytes,
            rate_hz: timing.rate().hz(),
            waveform: timing.waveform(),
            phase: (GOLDEN * run as f64).fract(),
            seed: self.seed.wrapping_add(run),
            true_corners: timing.waveform().is_still(),
        }
    }

    /// One rate and waveform under one code.
    fn attempt(
        &self,
        scene: &Scene,
        timing: SymbolTiming,
        code: Code,
        stop: Stop,
        done: &(impl Fn() + Sync),
    ) -> Result<TrialOutcome, TrialError> {
        // In order, so that the sum of seconds is the same on any number of threads.
        let runs = try_map(0..self.runs, |run| {
            let result = self.trial(timing, code, run).run(scene, stop);
            done();
            result
        })?;
        let mut sum = TrialOutcome {
            rate: timing.rate(),
            waveform: timing.waveform(),
            code,
            runs: self.runs,
            delivered: 0,
            bits: 0,
            seconds: 0.0,
            errors: FrameErrors::default(),
        };
        for run in runs {
            sum.delivered += u64::from(run.received.is_some());
            sum.seconds += run.frames as f64 / scene.camera.frame_rate_hz;
            sum.errors.merge(&run.errors);
        }
        sum.bits = 8 * self.bytes as u64 * sum.delivered;
        Ok(sum)
    }
}

/// The trial of the highest net rate, the first of equals.
fn best(trials: &[TrialOutcome]) -> usize {
    let net = |at: usize| trials[at].net_bit_s();
    (0..trials.len()).fold(0, |best, at| if net(at) > net(best) { at } else { best })
}

/// The rate at which every symbol has a whole exposure on every row of the first panel.
fn whole_exposures(scene: &Scene) -> Result<SymbolRate, SignallingError> {
    let frames_hz = scene.camera.frame_rate_hz;
    let exposure_s = Exposure::of(scene).time_s;
    let readout_s = dimming::panel_readout_s(scene).map_err(TrialError::from)?;
    SymbolRate::for_camera(frames_hz, exposure_s + readout_s).map_err(|source| SignallingError::TooSlow {
        frames_hz,
        exposure_s,
        readout_s,
        source,
    })
}

/// The rates to try, from the slowest: that of whole exposures, and those of shared ones.
fn rates(scene: &Scene, whole_exposures: SymbolRate) -> Vec<SymbolRate> {
    let faster = SHARES_OF_FRAMES.map(|share| share * scene.camera.frame_rate_hz);
    let faster = faster.into_iter().filter_map(|hz| SymbolRate::from_hz(hz).ok());
    let apart = |rate: &SymbolRate| rate.hz() > (1.0 + APART) * whole_exposures.hz();
    std::iter::once(whole_exposures).chain(faster.filter(apart)).collect()
}

#[cfg(test)]
mod tests;
