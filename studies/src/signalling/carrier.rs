//! Searches for a carrier without visible flicker that a camera can read.
//!
//! At f Hz, an exposure of T holds φ = f·T cycles. Whole cycles show nothing, so that the contrast is at most d/φ with the distance d of φ
//! from the nearest whole number. It reaches that on a share 1 − 2·d of all phases, and falls linearly to 0 on the others: the mean of |c|
//! is (d/φ)·(1 − d). Up to half a cycle the contrast is 1 on some phases.
//!
//! If the frame rate of a camera, or half of it, nearly divides f, the phase creeps and stays where there is no contrast. A carrier
//! therefore keeps away from the multiples of half the usual frame rates, and of this camera's.

use link::framing::MESSAGE_MAX;
use link::panel::PanelFrame;
use link::symbol_rate::SymbolRate;
use link::waveform::{SymbolTiming, Waveform};
use thiserror::Error;

use super::TrialOutcome;
use crate::flicker::{Practice, low_risk_times};
use crate::stop::Stop;

/// Usual frame rates of cameras, Hz.
pub const USUAL_FRAMES_HZ: [f64; 6] = [25.0, 30.0, 50.0, 60.0, 100.0, 120.0];
/// The least distance from multiples of half a usual frame rate, Hz: phases without contrast last a quarter of a second at most, and clocks
/// that are wrong by 500 parts in a million move a carrier by 1.5 Hz.
const APART_HZ: f64 = 2.0;
/// The least distance from multiples of half of this camera's frame rate, as a share of it.
const APART_OF_FRAMES: f64 = 0.05;
/// The least greatest contrast: receivers were not tested with less.
const CONTRAST_MIN: f64 = 0.2;
/// Symbol rates down to this share of the requested one are tried, in steps of 0.1 Hz.
const SLOWEST: f64 = 0.95;
/// The most cycles between the first and the last line of a panel with which the receiver was tested.
const CYCLES_BETWEEN_LINES: f64 = 6.4;
/// The most carriers that are tried.
pub(super) const CANDIDATES_MAX: usize = 3;
/// The least share of messages that must arrive.
const DELIVERED_MIN: f64 = 0.75;

/// A carrier and its relation to a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carrier {
    /// Symbol rate and cycles a symbol.
    pub timing: SymbolTiming,
    /// Its cycles in an exposure.
    pub cycles_an_exposure: f64,
    /// The greatest contrast of any phase, 0 to 1.
    pub contrast: f64,
    /// Its cycles between the first and the last of the camera's lines that show the panel.
    pub cycles_between_lines: f64,
}

/// A carrier that delivers.
#[derive(Clone, Copy, Debug)]
pub struct CarrierAdvice {
    /// The carrier.
    pub carrier: Carrier,
    /// The greatest modulation, with the trial's message and with beacons, of any LED and of all together, relative to the limit of low
    /// risk of IEEE Std 1789-2015. Up to 1, the practice is met at every frequency.
    pub low_risk_times: f64,
    /// Its trial.
    pub trial: TrialOutcome,
}

/// Why no carrier is recommended.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum NoCarrier {
    /// All carriers of low risk have nearly whole cycles in an exposure.
    #[error(
        "an exposure of {exposure_s:.6} s shows less than {} % of the contrast of every carrier of low risk: expose for {needed_s:.6} s or less, \
         half a cycle of {carrier_hz:.1} Hz",
        1e2 * CONTRAST_MIN
    )]
    Exposure {
        /// The exposure, s.
        exposure_s: f64,
        /// An exposure of half a cycle, s.
        needed_s: f64,
        /// The frequency of the slowest carrier of low risk, Hz.
        carrier_hz: f64,
    },
    /// No carrier keeps away from the multiples of frame rates.
    #[error(
        "at about {rate} symbols a second, which {frames_hz} frames a second allow, every carrier is near a multiple of half a frame rate: \
         choose another camera.frame_rate_hz"
    )]
    FrameRates {
        /// The symbol rate of whole exposures.
        rate: SymbolRate,
        /// The camera's frames a second.
        frames_hz: f64,
    },
    /// Every carrier exceeds low risk.
    #[error(
        "every carrier at about {rate} symbols a second exceeds low risk with beacons or a message of {bytes} bytes: send messages of \
         another length, 1 to {MESSAGE_MAX} bytes"
    )]
    LowRisk {
        /// The symbol rate of whole exposures.
        rate: SymbolRate,
        /// Bytes of the message.
        bytes: usize,
    },
    /// Messages do not arrive.
    #[error("{}", not_delivered(.best, *.exposure_s))]
    NotDelivered {
        /// The carrier that delivered the most messages.
        best: Box<CarrierAdvice>,
        /// The exposure, s.
        exposure_s: f64,
    },
}

fn not_delivered(best: &CarrierAdvice, exposure_s: f64) -> String {
    let CarrierAdvice { carrier, trial, .. } = best;
    let hz = carrier.hz();
    let why = if carrier.cycles_an_exposure > 0.5 {
        format!(
            "an exposure of {exposure_s:.6} s shows at most {:.0} % of its contrast: expose for {:.6} s or less, half a cycle",
            1e2 * carrier.contrast,
            0.5 / hz
        )
    } else if carrier.cycles_between_lines > CYCLES_BETWEEN_LINES {
        format!(
            "it turns by {:.1} cycles between the first and the last line of the panel, and receivers are tested up to {CYCLES_BETWEEN_LINES}: \
             go farther away, or use a camera that reads out faster",
            carrier.cycles_between_lines
        )
    } else {
        "reduce the distance, give the panel more light, or use still panels".into()
    };
    format!(
        "of the carriers that were tried, {:.1} Hz ({} cycles at {} symbols a second) delivers most, {} of {} messages; {why}",
        hz,
        carrier.timing.waveform().cycles(),
        carrier.timing.rate(),
        trial.delivered,
        trial.runs
    )
}

impl Carrier {
    fn new(timing: SymbolTiming, camera: Camera) -> Self {
        let hz = hz(timing);
        let cycles = hz * camera.exposure_s;
        Self {
            timing,
            cycles_an_exposure: cycles,
            contrast: if cycles <= 0.5 { 1.0 } else { from_whole(cycles) / cycles },
            cycles_between_lines: hz * camera.readout_s,
        }
    }

    /// The frequency, Hz.
    pub fn hz(&self) -> f64 {
        hz(self.timing)
    }

    /// The mean of |c| over all phases.
    pub fn mean_contrast(&self) -> f64 {
        self.contrast * (1.0 - from_whole(self.cycles_an_exposure))
    }

    /// The greatest of [`low_risk_times`] with these panels, if all are of low risk; `None` also on a stop.
    fn low_risk_times(&self, shown: &[Vec<PanelFrame>], stop: Stop) -> Option<f64> {
        shown.iter().try_fold(0.0, |greatest: f64, panels| {
            let times = low_risk_times(panels, self.timing.waveform(), self.timing.rate().hz(), stop)?;
            (times <= 1.0).then_some(greatest.max(times))
        })
    }
}

/// The frequency of a carrier, Hz.
fn hz(timing: SymbolTiming) -> f64 {
    timing.rate().hz() * f64::from(timing.waveform().cycles())
}

/// The distance from the nearest whole number.
fn from_whole(cycles: f64) -> f64 {
    (cycles - cycles.round()).abs()
}

/// The camera's times.
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub frames_hz: f64,
    pub exposure_s: f64,
    /// Time from the panel's first line to its last, s.
    pub readout_s: f64,
}

/// The distance of a carrier from the nearest multiple of half a frame rate, Hz.
fn apart_hz(carrier_hz: f64, frames_hz: f64) -> f64 {
    (carrier_hz / frames_hz - (2.0 * carrier_hz / frames_hz).round() / 2.0).abs() * frames_hz
}

/// The usual frame rates, in Hz, for which the carrier is nearly a multiple of half the frame rate: such cameras see its phase change so
/// slowly that they may have no contrast for seconds.
///
/// ```
/// use studies::signalling::parked_at;
/// assert!(parked_at(1440.0).eq([30.0, 60.0, 120.0]));
/// assert_eq!(parked_at(1443.0).count(), 0);
/// ```
pub fn parked_at(carrier_hz: f64) -> impl Iterator<Item = f64> {
    let usual = USUAL_FRAMES_HZ.into_iter();
    usual.filter(move |&frames_hz| apart_hz(carrier_hz, frames_hz) < APART_HZ)
}

impl Camera {
    /// Whether a carrier keeps away from the multiples of half the frame rates.
    fn is_apart(self, carrier_hz: f64) -> bool {
        let own_hz = APART_HZ.max(APART_OF_FRAMES * self.frames_hz);
        parked_at(carrier_hz).next().is_none() && apart_hz(carrier_hz, self.frames_hz) >= own_hz
    }

    /// The carriers that keep away from frame rates, each number of cycles at the fastest possible symbol rate, the slowest carrier first.
    fn carriers(self, rate: SymbolRate) -> impl Iterator<Item = Carrier> {
        // A slower square wave is not of low risk, whatever it carries.
        let slowest_hz = Practice::LowRisk.lowest_hz(100.0);
        let steps = (rate.hz() * 10.0).floor() as u32;
        let rates = (0..steps)
            .map(move |step| f64::from(steps - step) / 10.0)
            .take_while(move |hz| *hz >= SLOWEST * rate.hz());
        let rates: Vec<SymbolRate> = rates.filter_map(|hz| SymbolRate::from_hz(hz).ok()).collect();
        let all = (u32::from(Waveform::MIN_CYCLES)..=Waveform::MAX_CYCLES.into()).filter_map(|cycles| Waveform::new(cycles).ok());
        all.filter_map(move |waveform| {
            let timings = rates.iter().filter_map(|&rate| SymbolTiming::new(rate, waveform).ok());
            let mut carriers = timings.map(|timing| Carrier::new(timing, self));
            carriers.find(|carrier| carrier.hz() >= slowest_hz && self.is_apart(carrier.hz()))
        })
    }

    /// The carriers that this camera sees best, among those of low risk with all these panels, the best first; none on a stop.
    pub fn candidates(self, rate: SymbolRate, shown: &[Vec<PanelFrame>], stop: Stop) -> Vec<(Carrier, f64)> {
        let mut seen: Vec<Carrier> = self.carriers(rate).filter(|carrier| carrier.contrast >= CONTRAST_MIN).collect();
        seen.sort_by(|one, other| other.mean_contrast().total_cmp(&one.mean_contrast()));
        let of_low_risk = |carrier: Carrier| Some((carrier, carrier.low_risk_times(shown, stop)?));
        seen.into_iter().filter_map(of_low_risk).take(CANDIDATES_MAX).collect()
    }

    /// Why there are no candidates.
    pub fn no_candidate(self, rate: SymbolRate, shown: &[Vec<PanelFrame>], bytes: usize, stop: Stop) -> NoCarrier {
        let mut carriers = self.carriers(rate).peekable();
        if carriers.peek().is_none() {
            let frames_hz = self.frames_hz;
            return NoCarrier::FrameRates { rate, frames_hz };
        }
        match carriers.find(|carrier| carrier.low_risk_times(shown, stop).is_some()) {
            Some(slowest) => NoCarrier::Exposure {
                exposure_s: self.exposure_s,
                needed_s: 0.5 / slowest.hz(),
                carrier_hz: slowest.hz(),
            },
            None => NoCarrier::LowRisk { rate, bytes },
        }
    }
}

/// The carrier that delivered the most messages, the first of equals; if too few arrived, why it is not recommended. `None` if none was
/// tried.
pub(super) fn best(trials: Vec<CarrierAdvice>, exposure_s: f64) -> Option<Result<CarrierAdvice, NoCarrier>> {
    let best = trials.into_iter().reduce(|best, other| {
        let is_better = other.trial.delivered > best.trial.delivered;
        if is_better { other } else { best }
    })?;
    let is_enough = best.trial.delivered as f64 >= DELIVERED_MIN * best.trial.runs as f64;
    Some(if is_enough {
        Ok(best)
    } else {
        Err(NoCarrier::NotDelivered {
            best: Box::new(best),
            exposure_s,
        })
    })
}
