//! A carrier that nobody sees flicker, and that a camera reads.
//!
//! At f Hz, an exposure of T holds φ = f·T cycles. Whole cycles show nothing, so that the contrast is at most d/φ with the distance d of φ
//! from the nearest whole number. It is that on a share 1 − 2·d of all phases, and falls linearly to 0 on the others: the mean of |c| is
//! (d/φ)·(1 − d). Up to half a cycle the contrast is 1 on some phases.
//!
//! If the frame rate of a camera, or half of it, nearly divides f, the phase creeps and stays where there is no contrast. A carrier
//! therefore keeps apart from the multiples of half the usual frame rates, and of this camera's.

use link::framing::FramingError;
use link::symbol_rate::SymbolRate;
use link::waveform::{SymbolTiming, Waveform};
use thiserror::Error;

use super::TrialOutcome;
use crate::flicker::{Flicker, Practice, panels};
use crate::stop::Stop;

/// Usual frame rates of cameras, Hz.
pub const USUAL_FRAMES_HZ: [f64; 6] = [25.0, 30.0, 50.0, 60.0, 100.0, 120.0];
/// The least distance from multiples of half a usual frame rate, Hz: phases without contrast last a quarter of a second at most, and clocks
/// that are wrong by 500 parts in a million move a carrier by 1.5 Hz.
const APART_HZ: f64 = 2.0;
/// The least distance from multiples of half of this camera's frame rate, as a share of it.
const APART_OF_FRAMES: f64 = 0.05;
/// The least greatest contrast: with less, receivers are not tested.
const CONTRAST_MIN: f64 = 0.2;
/// Symbol rates down to this share of the requested one are looked at, in steps of 0.1 Hz.
const SLOWEST: f64 = 0.95;
/// The most cycles between the first and the last line of a panel with which the receiver was tested.
const CYCLES_BETWEEN_LINES: f64 = 6.4;
/// Carriers to try.
pub(super) const TRIED: usize = 3;
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
    /// Its modulation relative to the limit of low risk: see [`low_risk_times`].
    pub low_risk_times: f64,
    /// Its trial.
    pub tried: TrialOutcome,
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
    /// No carrier is apart from the multiples of frame rates.
    #[error(
        "no carrier of low risk at about {rate} symbols a second is apart from the multiples of frame rates: choose another symbol rate"
    )]
    FrameRates {
        /// The symbol rate.
        rate: SymbolRate,
    },
    /// Messages do not arrive.
    #[error("{}", not_delivered(.best, *.exposure_s))]
    NotDelivered {
        /// The carrier of the most messages.
        best: Box<CarrierAdvice>,
        /// The exposure, s.
        exposure_s: f64,
    },
}

fn not_delivered(best: &CarrierAdvice, exposure_s: f64) -> String {
    let CarrierAdvice { carrier, tried, .. } = best;
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
        "come nearer, give the panel more light, or use still panels".into()
    };
    format!(
        "of the carriers that were tried, {:.1} Hz ({} cycles at {} symbols a second) delivers most, {} of {} messages; {why}",
        hz,
        carrier.timing.waveform().cycles(),
        carrier.timing.rate(),
        tried.delivered,
        tried.runs
    )
}

/// The greatest modulation of light that shows these panels, relative to the limit of low risk of IEEE Std 1789-2015: of the worst LED and
/// of all together, at every frequency. Up to 1, the practice is met.
pub fn low_risk_times(flicker: &Flicker, rate_hz: f64) -> f64 {
    let lights = [&flicker.worst_led, &flicker.panel];
    lights
        .map(|light| Practice::LowRisk.times(light, rate_hz))
        .into_iter()
        .fold(0.0, f64::max)
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

impl Camera {
    /// Whether a carrier keeps apart from the multiples of half the frame rates.
    fn is_apart(self, carrier_hz: f64) -> bool {
        let apart = |frames_hz: f64| (carrier_hz / frames_hz - (2.0 * carrier_hz / frames_hz).round() / 2.0).abs() * frames_hz;
        USUAL_FRAMES_HZ.into_iter().all(|frames_hz| apart(frames_hz) >= APART_HZ)
            && apart(self.frames_hz) >= APART_HZ.max(APART_OF_FRAMES * self.frames_hz)
    }

    /// The carriers that are apart from frame rates, each number of cycles at the fastest possible symbol rate, the slowest carrier first.
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

    /// The carriers of low risk for messages like this one and for beacons that this camera sees best, the best first.
    pub fn candidates(self, rate: SymbolRate, message: &[u8], stop: Stop) -> Result<Result<Vec<(Carrier, f64)>, NoCarrier>, FramingError> {
        let shown = [panels(None)?, panels(Some(message))?];
        let of_low_risk = |carrier: Carrier| {
            if stop.is_asked() {
                return None;
            }
            let timing = carrier.timing;
            let times = shown.iter().map(|panels| {
                let flicker = Flicker::shown(panels, timing.waveform());
                low_risk_times(&flicker, timing.rate().hz())
            });
            let times = times.fold(0.0, f64::max);
            (times <= 1.0).then_some((carrier, times))
        };
        let mut seen: Vec<Carrier> = self.carriers(rate).filter(|carrier| carrier.contrast >= CONTRAST_MIN).collect();
        seen.sort_by(|one, other| other.mean_contrast().total_cmp(&one.mean_contrast()));
        let found: Vec<_> = seen.into_iter().filter_map(of_low_risk).take(TRIED).collect();
        if !found.is_empty() {
            return Ok(Ok(found));
        }
        Ok(Err(match self.carriers(rate).find_map(of_low_risk) {
            Some((slowest, _)) => NoCarrier::Exposure {
                exposure_s: self.exposure_s,
                needed_s: 0.5 / slowest.hz(),
                carrier_hz: slowest.hz(),
            },
            None => NoCarrier::FrameRates { rate },
        }))
    }
}

/// The carrier of the most messages, if enough of them arrive; of equals, the first.
pub(super) fn best(tried: Vec<CarrierAdvice>, exposure_s: f64) -> Option<Result<CarrierAdvice, NoCarrier>> {
    let best = tried.into_iter().reduce(|best, other| {
        let is_better = other.tried.delivered > best.tried.delivered;
        if is_better { other } else { best }
    })?;
    let is_enough = best.tried.delivered as f64 >= DELIVERED_MIN * best.tried.runs as f64;
    Some(if is_enough {
        Ok(best)
    } else {
        Err(NoCarrier::NotDelivered {
            best: Box::new(best),
            exposure_s,
        })
    })
}
