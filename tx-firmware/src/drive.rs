//! The pulses of a PWM for a duty: frequency, resolution, and their cost in accuracy.
//!
//! A camera sums the pulses within its exposure T. With a period P and a lit share d the sum deviates from its mean by at most
//!
//! ```text
//! ripple = (1 − d)·P/T            the exposure's ends cut a period anywhere
//! step   = 1/(2·P·f)              the period is a whole number of counts of the timer's clock f
//! ```
//!
//! relative to the mean. Short periods have less ripple. But a driver's pulse is clean only from τ_min on, so a period of P cannot be lit
//! for less than τ_min/P: dim light needs long periods. The rule, in counts of the clock:
//!
//! ```text
//! w = ⌈τ_min·f⌉                                   the shortest pulse
//! P_short = ⌊ρ·T_short·f⌋,  P_long = ⌊ρ·T_long·f⌋     ρ = RIPPLE_MAX_PPM; a calibration may have another P_long
//!
//! d ≥ w/P_short            lit = d·P_short,   period = lit/d         bright: as fast as the shortest exposure asks for
//! w/P_long ≤ d             lit = w,           period = w/d           dim: the shortest pulse, ever more rarely
//! s·w/P_long ≤ d           the same with d/s, at the low current     s = the light's share at the low current
//! less                     lit = d·P_long,    period = P_long        below the floor: pulses too short to be clean
//! ```
//!
//! Lit time and period are rounded to whole counts, the period last. So the rounding error is that of the period, not of the pulse, which
//! at 13 counts could be off by 4 %. T_long is the exposure in dim light, T_short that in the brightest: a camera shortens its exposure
//! only in bright light ([`exposure_ns`]), and then the panel is bright too.
//!
//! With τ_min = 100 ns, 125 MHz, T from 1/1000 s to 1/6300 s and a panel of 26 000 cd/m² (for an L2A of 4 on R = 0.4 at 16 000 lx),
//! `cargo run -p vocc-tx-firmware --example drive` prints the error at each illuminance. The tests limit ripple and step together to
//! [`FIDELITY_PPM`] from 50 to 100 000 lx.

use fixed::types::U1F31;
use link::{exposure::AutoExposure, serial::Measured};

use crate::matrix::Duty;

/// The target of the ripple, in parts per million of the light; the step may add the rest of [`FIDELITY_PPM`].
pub const RIPPLE_MAX_PPM: u32 = 49_000;

/// Bound of ripple and step together, in parts per million of the light, for every duty from the floor up and the camera's exposure there.
pub const FIDELITY_PPM: u32 = 50_000;

/// The least clock of the counter, Hz, at which the step fits beside the ripple in [`FIDELITY_PPM`].
pub const CLOCK_MIN_HZ: u32 = 65_000_000;

/// The longest exposure of a camera for this link, ns (Do & Yoo 2020, Table 1).
pub const EXPOSURE_LONG_NS: u32 = 1_000_000;
/// The shortest one, ns: 1/6300 s, at 100 000 lx.
pub const EXPOSURE_SHORT_NS: u32 = 158_730;
/// The illuminance, lx, above which the camera's ISO speed is at its minimum, so that its exposure shortens.
const ISO_FLOOR_LX: u32 = 15_873;

/// The [automatic exposure](AutoExposure) at an illuminance, ns.
///
/// ```
/// use tx_firmware::drive::exposure_ns;
/// assert_eq!(exposure_ns(50), 1_000_000);
/// assert_eq!(exposure_ns(100_000), 158_730);
/// ```
pub fn exposure_ns(illuminance_lx: u32) -> u32 {
    let camera = AutoExposure {
        longest_s: f64::from(EXPOSURE_LONG_NS) * 1e-9,
        iso_min: 1.0,
        iso_max: f64::INFINITY,
    };
    let (time_s, _) = camera.time_and_iso(camera.longest_s * f64::from(ISO_FLOOR_LX) / f64::from(illuminance_lx));
    (time_s * 1e9 + 0.5) as u32
}

/// The longest period for an exposure, ns. A calibration should use that of the longest exposure.
///
/// ```
/// use tx_firmware::drive::{EXPOSURE_LONG_NS, period_ns};
/// assert_eq!(period_ns(EXPOSURE_LONG_NS), 49_000);
/// ```
pub const fn period_ns(exposure_ns: u32) -> u32 {
    (exposure_ns as u64 * RIPPLE_MAX_PPM as u64 / 1_000_000) as u32
}

/// The pulses for one duty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pulses {
    /// Counts of the clock for which the LEDs are lit in each period.
    pub lit: u16,
    /// Counts of a period; 0 with a `lit` of 0 for no pulses at all.
    pub period: u16,
    /// Whether the LEDs have the low current.
    pub low_current: bool,
}

/// A PWM on the LEDs' output enable, and a switch of their current.
pub trait PulseOutput {
    /// Sets the counts of a period and those for which it is lit. Until both are in effect, the light may be less than either, not more.
    fn set_pulses(&mut self, lit: u16, period: u16);

    /// Switches between the full and the low current.
    fn set_full_current(&mut self, full: bool);

    /// Waits until a period of this number of counts has ended.
    fn wait_for_end(&mut self, period: u16);
}

/// Dims LEDs by the rule of the [module](self).
#[derive(Debug)]
pub struct Dimmer<O> {
    output: O,
    drive: Drive,
    shown: Pulses,
}

impl<O: PulseOutput> Dimmer<O> {
    /// An output that is dark, at the full current.
    pub const fn new(output: O, drive: Drive) -> Self {
        Self {
            output,
            drive,
            shown: Pulses {
                lit: 0,
                period: 0,
                low_current: false,
            },
        }
    }

    /// Another rule, from the next duty on.
    pub fn set_drive(&mut self, drive: Drive) {
        self.drive = drive;
    }

    /// Lights On LEDs with this share of full luminance. At no moment do they have long pulses and the full current: pulses and current
    /// change in the order that dims first.
    pub fn set(&mut self, duty: Duty) {
        let pulses = self.drive.pulses(duty, self.shown);
        if pulses == self.shown {
            return;
        }
        if pulses.low_current {
            self.output.set_full_current(false);
        }
        self.output.set_pulses(pulses.lit, pulses.period);
        if self.shown.low_current && !pulses.low_current {
            // The pulses take effect when the present period ends.
            self.output.wait_for_end(self.shown.period);
            self.output.set_full_current(true);
        }
        self.shown = pulses;
    }
}

/// The rule of the [module](self) for one board and panel.
///
/// ```
/// use tx_firmware::{calibration::SWITCHED, dimming::Duty, drive::{Drive, Pulses}};
///
/// let drive = Drive::new(&SWITCHED, 125_000_000);
/// let pulses = |duty| drive.pulses(Duty::from_num(duty), Pulses::default());
/// assert_eq!(pulses(0.5), Pulses { lit: 486, period: 972, low_current: false }); // 129 kHz
/// assert_eq!(pulses(0.004), Pulses { lit: 13, period: 3250, low_current: false }); // 38 kHz
/// assert_eq!(pulses(0.001), Pulses { lit: 13, period: 2134, low_current: true });
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    /// Counts, the first at most the second, and that at most the third.
    shortest_pulse: u16,
    shortest_period: u16,
    longest_period: u16,
    low_current_share: U1F31,
}

impl Drive {
    /// The rule for a panel, with a 16-bit counter at `clock_hz`. A period that exceeds the counter is reduced to its maximum: light below
    /// the resulting floor is dimmer than requested.
    pub fn new(panel: &Measured, clock_hz: u32) -> Self {
        let counts = |ns: u32| u64::from(ns) * u64::from(clock_hz);
        let longest = (counts(panel.pwm_period_ns) / NANOS_PER_S).clamp(1, u16::MAX.into());
        let pulse = counts(panel.shortest_pulse_ns).div_ceil(NANOS_PER_S).clamp(1, longest);
        let shortest = counts(period_ns(EXPOSURE_SHORT_NS)) / NANOS_PER_S;
        Self {
            shortest_pulse: pulse as u16,
            shortest_period: shortest.clamp(pulse, longest) as u16,
            longest_period: longest as u16,
            low_current_share: panel.low_current_share,
        }
    }

    /// The pulses for a duty, after those of `before`; none for a duty of 0.
    pub fn pulses(&self, duty: Duty, before: Pulses) -> Pulses {
        let mut floor = self.floor_at_full_current();
        if before.low_current {
            floor = floor.saturating_add(floor / HYSTERESIS);
        }
        let low_current = self.low_current_share < U1F31::ONE && duty < floor;
        let of_current = if low_current {
            (u64::from(duty.to_bits()) << U1F31::FRAC_NBITS) / u64::from(self.low_current_share.to_bits().max(1))
        } else {
            duty.to_bits().into()
        };
        Pulses {
            low_current,
            ..self.at_one_current(of_current.try_into().unwrap_or(u32::MAX))
        }
    }

    /// The duty of the shortest pulse at the full current.
    pub fn floor_at_full_current(&self) -> Duty {
        share(self.shortest_pulse, self.longest_period)
    }

    /// The pulses for a duty in steps of 2⁻³².
    fn at_one_current(&self, duty: u32) -> Pulses {
        let duty = u64::from(duty);
        let [pulse, shortest, longest] = [self.shortest_pulse, self.shortest_period, self.longest_period].map(u64::from);
        // Below the floor a pulse may be shorter than a clean one: dimmer than requested, never brighter.
        if duty * longest < pulse * ONE {
            return Pulses {
                lit: ((duty * longest) >> ONE_BITS) as u16,
                period: self.longest_period,
                low_current: false,
            };
        }
        let lit = ((duty * shortest + ONE / 2) >> ONE_BITS).max(pulse);
        let period = ((lit << ONE_BITS) + duty / 2) / duty;
        Pulses {
            lit: lit as u16,
            // A duty of almost 1 becomes 1.
            period: period.clamp(lit, longest) as u16,
            low_current: false,
        }
    }
}

impl Pulses {
    /// The share of full luminance of these pulses on a panel with this `low_current_share`.
    pub fn duty(&self, low_current_share: U1F31) -> Duty {
        let lit = share(self.lit, self.period);
        if self.low_current {
            let product = u64::from(lit.to_bits()) * u64::from(low_current_share.to_bits());
            Duty::from_bits((product >> U1F31::FRAC_NBITS).try_into().unwrap_or(u32::MAX))
        } else {
            lit
        }
    }

    /// The greatest deviation of an exposure's light from its mean, in parts per million.
    pub fn ripple_ppm(&self, exposure_ns: u32, clock_hz: u32) -> u32 {
        let dark = u64::from(self.period.saturating_sub(self.lit));
        let dark_ns = dark * NANOS_PER_S / u64::from(clock_hz.max(1));
        let ppm = dark_ns * 1_000_000 / u64::from(exposure_ns.max(1));
        ppm.try_into().unwrap_or(u32::MAX)
    }

    /// The greatest error of the light by rounding, in parts per million.
    pub fn step_ppm(&self) -> u32 {
        500_000u32.div_ceil(u32::from(self.period).max(1))
    }
}

/// The margin above the floor from which on the full current returns, as 1/8 of the floor, so that a duty at the floor does not alternate.
const HYSTERESIS: u32 = 8;
const NANOS_PER_S: u64 = 1_000_000_000;
const ONE_BITS: u32 = Duty::FRAC_NBITS;
const ONE: u64 = 1 << ONE_BITS;

fn share(part: u16, whole: u16) -> Duty {
    let bits = (u64::from(part) << ONE_BITS) / u64::from(whole.max(1));
    Duty::from_bits(bits.try_into().unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::calibration::{BENCH, SWITCHED};
    use properties::prelude::*;
    use std::vec::Vec;

    const CLOCK_HZ: u32 = 125_000_000;

    fn drive() -> Drive {
        Drive::new(&SWITCHED, CLOCK_HZ)
    }

    fn floor() -> f64 {
        drive().floor_at_full_current().to_num::<f64>() * SWITCHED.low_current_share.to_num::<f64>()
    }

    /// The lit time from the start of a period to `time_ns`, summed pulse by pulse.
    fn lit_ns(pulses: Pulses, time_ns: f64) -> f64 {
        let count_ns = 1e9 / f64::from(CLOCK_HZ);
        let (lit, period) = (f64::from(pulses.lit) * count_ns, f64::from(pulses.period) * count_ns);
        (time_ns / period).floor() * lit + (time_ns % period).min(lit)
    }

    /// Records the light after each change.
    #[derive(Default)]
    struct Lamp {
        pulses: Pulses,
        waits: Vec<u16>,
        light: Vec<f64>,
    }

    impl Lamp {
        fn record(&mut self) {
            self.light.push(light(self.pulses));
        }
    }

    fn light(pulses: Pulses) -> f64 {
        if pulses.period == 0 {
            0.0
        } else {
            pulses.duty(SWITCHED.low_current_share).to_num()
        }
    }

    impl PulseOutput for Lamp {
        fn set_pulses(&mut self, lit: u16, period: u16) {
            (self.pulses.lit, self.pulses.period) = (lit, period);
            self.record();
        }

        fn set_full_current(&mut self, full: bool) {
            self.pulses.low_current = !full;
            self.record();
        }

        fn wait_for_end(&mut self, period: u16) {
            self.waits.push(period);
        }
    }

    #[test]
    fn a_dimmer_waits_for_long_pulses_to_end_before_the_full_current() {
        let mut dimmer = Dimmer::new(Lamp::default(), drive());
        dimmer.set(Duty::from_num(0.001));
        let low = dimmer.output.pulses;
        assert!(low.low_current && dimmer.output.waits.is_empty());
        dimmer.set(Duty::from_num(0.004));
        assert!(!dimmer.output.pulses.low_current);
        assert_eq!(dimmer.output.waits, [low.period]);
        let changes = dimmer.output.light.len();
        dimmer.set(Duty::from_num(0.004));
        assert_eq!(dimmer.output.light.len(), changes);
    }

    #[test]
    fn no_light_is_no_pulse_and_all_light_no_gap() {
        let pulses = |duty| drive().pulses(duty, Pulses::default());
        assert_eq!(pulses(Duty::ZERO).lit, 0);
        let full = pulses(Duty::MAX);
        assert_eq!((full.lit, full.low_current), (full.period, false));
    }

    #[test]
    fn the_low_current_takes_over_below_the_floor_and_hands_back_above_it() {
        let floor = drive().floor_at_full_current();
        let mut pulses = Pulses::default();
        let mut low_at = |duty| {
            pulses = drive().pulses(duty, pulses);
            pulses.low_current
        };
        assert!(!low_at(floor));
        assert!(low_at(floor - floor / 100));
        assert!(low_at(floor + floor / 100));
        assert!(!low_at(floor + floor / 4));
        assert!(!low_at(floor + floor / 100));
    }

    #[test]
    fn without_a_switch_light_below_the_floor_is_dimmer_than_asked_for() {
        let drive = Drive::new(&BENCH, CLOCK_HZ);
        let pulses = |duty| drive.pulses(duty, Pulses::default());
        let floor = drive.floor_at_full_current();
        // 13/6125 is not a whole number of duty steps.
        let above = pulses(floor + Duty::DELTA);
        assert_eq!((above.lit, above.period), (13, 6125));
        let below = pulses(floor / 5);
        assert_eq!((below.lit, below.period, below.low_current), (2, 6125, false));
    }

    properties! {
        #[test]
        fn a_dimmer_is_at_no_moment_brighter_than_before_and_after(duties in prop::collection::vec(0.0..0.01f64, 1..50)) {
            let mut dimmer = Dimmer::new(Lamp::default(), drive());
            for duty in duties {
                let before = light(dimmer.output.pulses);
                let from = dimmer.output.light.len();
                dimmer.set(Duty::from_num(duty));
                let after = light(dimmer.output.pulses);
                let expected = drive().pulses(Duty::from_num(duty), dimmer.shown);
                prop_assert_eq!(dimmer.output.pulses.lit, expected.lit);
                for &light in &dimmer.output.light[from..] {
                    prop_assert!(light <= before.max(after), "{before} to {after} by {light}");
                }
            }
        }

        /// A panel with an L2A of 4 at some bright light, in any light from 50 lx up to that, as far as its floor allows.
        #[test]
        fn ripple_and_step_stay_within_five_percent(
            full_lx in 16_000f64..100_000.0, octave in 0f64..1.0, l2a in 0.2f64..4.0, phase in 0f64..1.0,
        ) {
            let lx = 50.0 * (full_lx / 50.0).powf(octave);
            let duty = Duty::saturating_from_num(l2a * lx / (4.0 * full_lx));
            prop_assume!(duty.to_num::<f64>() > floor());
            let pulses = drive().pulses(duty, Pulses::default());
            let exposure = exposure_ns(lx as u32);
            prop_assert!(pulses.ripple_ppm(exposure, CLOCK_HZ) + pulses.step_ppm() <= FIDELITY_PPM, "{pulses:?}");

            // The light of an exposure with any start, compared with the requested light.
            let start_ns = phase * f64::from(pulses.period) * 1e9 / f64::from(CLOCK_HZ);
            let exposure_ns = f64::from(exposure);
            let current = if pulses.low_current { SWITCHED.low_current_share.to_num() } else { 1.0 };
            let light = current * (lit_ns(pulses, start_ns + exposure_ns) - lit_ns(pulses, start_ns));
            let error = light / (exposure_ns * duty.to_num::<f64>()) - 1.0;
            let bound = f64::from(pulses.ripple_ppm(exposure, CLOCK_HZ) + pulses.step_ppm() + 2) / 1e6;
            prop_assert!(error.abs() <= bound, "{error} of {bound} at {lx} lx, {pulses:?}");
        }

        #[test]
        fn from_the_floor_up_no_pulse_is_shorter_than_is_clean_and_no_period_longer_than_an_exposure_bears(duty in 1u32..) {
            let duty = Duty::from_bits(duty);
            prop_assume!(duty.to_num::<f64>() > floor());
            let pulses = drive().pulses(duty, Pulses::default());
            prop_assert!(pulses.lit >= 13 && pulses.lit <= pulses.period && pulses.period <= 6125);
        }

        #[test]
        fn more_duty_is_never_less_light_but_for_a_step(duty in any::<u32>(), more in 0u32..1 << 24) {
            let pulses = drive().pulses(Duty::from_bits(duty), Pulses::default());
            let brighter = drive().pulses(Duty::from_bits(duty.saturating_add(more)), pulses);
            let [dim, bright] = [pulses, brighter].map(|pulses| pulses.duty(SWITCHED.low_current_share).to_num::<f64>());
            let step = f64::from(pulses.step_ppm() + brighter.step_ppm()) / 1e6;
            prop_assert!(bright >= dim * (1.0 - step));
        }

        #[test]
        fn without_a_calibration_no_panel_is_brighter_than_asked_for_whether_it_has_the_switch_or_not(
            duty in any::<u32>(), low_current in any::<bool>(),
        ) {
            let before = Pulses { low_current, ..Pulses::default() };
            let pulses = Drive::new(&BENCH, CLOCK_HZ).pulses(Duty::from_bits(duty), before);
            let asked = Duty::from_bits(duty).to_num::<f64>();
            let step = f64::from(pulses.step_ppm()) / 1e6;
            for share in [U1F31::ONE, SWITCHED.low_current_share] {
                let given = pulses.duty(share).to_num::<f64>();
                prop_assert!(given <= asked * (1.0 + 2.0 * step) + 1e-9, "{given} for {asked}, {pulses:?}");
            }
        }

        #[test]
        fn any_panel_has_pulses_that_are_not_brighter_than_asked_for_by_more_than_a_step(
            clock_hz in any::<u32>(), shortest_pulse_ns in any::<u32>(), pwm_period_ns in any::<u32>(),
            share in 1u32..1 << 31, duty in any::<u32>(), low_current in any::<bool>(),
        ) {
            let low_current_share = U1F31::from_bits(share);
            let wild = Measured { shortest_pulse_ns, pwm_period_ns, low_current_share, ..BENCH };
            for panel in [wild, Measured { pwm_period_ns: BENCH.pwm_period_ns, ..wild }] {
                let before = Pulses { low_current, ..Pulses::default() };
                let pulses = Drive::new(&panel, clock_hz).pulses(Duty::from_bits(duty), before);
                prop_assert!(pulses.lit <= pulses.period);
                let given = pulses.duty(low_current_share).to_num::<f64>();
                let asked = Duty::from_bits(duty).to_num::<f64>();
                let step = f64::from(pulses.step_ppm()) / 1e6;
                prop_assert!(given <= asked * (1.0 + 2.0 * step) + 1e-9, "{given} for {asked}, {pulses:?}");
            }
        }
    }
}
