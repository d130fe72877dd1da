//! Duty → the pulses of a PWM: which frequency, at which resolution, and what they cost in accuracy.
//!
//! A camera sums the pulses that fall into its exposure T. With a period P and a lit share d the sum strays from its mean by
//!
//! ```text
//! ripple = (1 − d)·P/T            the exposure's ends cut a period anywhere
//! step   = 1/(2·P·f)              the period is a whole number of counts of the timer's clock f
//! ```
//!
//! at most, relative to the mean. Short periods ripple less. But a driver's pulse is clean from τ_min on only, so a period of P
//! cannot be lit for less than τ_min/P: dim light needs long periods. Hence the rule, in counts of the clock:
//!
//! ```text
//! w = ⌈τ_min·f⌉                                   the shortest pulse
//! P_short = ⌊ρ·T_short·f⌋,  P_long = ⌊ρ·T_long·f⌋     ρ = RIPPLE_MAX
//!
//! d ≥ w/P_short            lit = d·P_short,   period = lit/d         bright: as fast as the shortest exposure asks for
//! w/P_long ≤ d             lit = w,           period = w/d           dim: the shortest pulse, ever more rarely
//! s·w/P_long ≤ d           the same with d/s, at the low current     s = the light's share at the low current
//! less                     lit = w,           period = P_long        the floor
//! ```
//!
//! with lit and period rounded to whole counts, the period last: that is why the step is one of the period and not of the pulse,
//! which at 13 counts could be off by 4 %. T_long is the exposure in dim light, T_short the one in the brightest: a camera
//! shortens it only when there is light in plenty ([`exposure_ns`]), and then the panel is bright too.
//!
//! With τ_min = 100 ns, 125 MHz, T from 1/1000 s to 1/6300 s and a panel of 26 000 cd/m² (which an L2A of 4 on R = 0.4 asks for
//! at 16 000 lx), `cargo run -p tx-firmware --example drive` prints what is left for each illuminance. The tests hold ripple and
//! step together to [`FIDELITY_PPM`] from 50 to 100 000 lx.

use fixed::types::U0F32;
use thiserror::Error;

/// The ripple that the periods are chosen for, in parts per million of the light; the rest of [`FIDELITY_PPM`] is the step's.
pub const RIPPLE_MAX_PPM: u32 = 49_000;

/// Bound of ripple and step together, in parts per million of the light, for every duty from the floor up and every exposure
/// of the rule.
pub const FIDELITY_PPM: u32 = 50_000;

/// The share of the floor by which a duty must be above it again before the full current returns.
const HYSTERESIS: u32 = 8;

/// The longest exposure that a camera for this link takes, ns (Do & Yoo 2020, Table 1).
pub const EXPOSURE_LONG_NS: u32 = 1_000_000;
/// The shortest one, ns: 1/6300 s, at 100 000 lx.
pub const EXPOSURE_SHORT_NS: u32 = 158_730;
/// The illuminance, lx, above which the camera's ISO speed is at its least, so that its exposure shortens.
const ISO_FLOOR_LX: u32 = 15_873;

/// The exposure of an automatic camera at an illuminance, ns: the longest until the ISO speed can fall no more, then in
/// inverse proportion to the light.
///
/// ```
/// use tx_firmware::drive::exposure_ns;
/// assert_eq!(exposure_ns(50), 1_000_000);
/// assert_eq!(exposure_ns(100_000), 158_730);
/// ```
pub const fn exposure_ns(illuminance_lx: u32) -> u32 {
    if illuminance_lx <= ISO_FLOOR_LX {
        return EXPOSURE_LONG_NS;
    }
    (EXPOSURE_LONG_NS as u64 * ISO_FLOOR_LX as u64 / illuminance_lx as u64) as u32
}

/// What the rule goes by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Clock of the PWM's counter, Hz.
    pub clock_hz: u32,
    /// The shortest clean pulse τ_min, ns.
    pub shortest_pulse_ns: u32,
    /// The exposure in dim light T_long, ns.
    pub longest_exposure_ns: u32,
    /// The exposure in the brightest light T_short, ns.
    pub shortest_exposure_ns: u32,
    /// An LED's light at the low current over that at the full one; one if the current cannot be switched.
    pub low_current: LowCurrent,
}

/// Whether the LEDs' current can be switched, and to what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LowCurrent {
    /// It cannot.
    None,
    /// It can: the light is this share of the full one then.
    Share(U0F32),
}

/// Which limits leave no rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum DriveError {
    /// The exposures are in the wrong order, or none.
    #[error(
        "exposures of {shortest_ns} to {longest_ns} ns are none: give the shortest first, above 0"
    )]
    Exposures {
        /// The shortest exposure given, ns.
        shortest_ns: u32,
        /// The longest exposure given, ns.
        longest_ns: u32,
    },
    /// The longest period does not fit into the counter.
    #[error(
        "a period of {counts} counts does not fit into a 16-bit counter, at most 65535: divide its clock or shorten the exposure"
    )]
    LongestPeriod {
        /// The longest period, counts.
        counts: u64,
    },
    /// The shortest pulse fills the shortest period.
    #[error(
        "a pulse of {pulse} counts leaves no dark in the shortest period of {period}: use a faster LED driver or a longer exposure"
    )]
    ShortestPulse {
        /// The shortest pulse, counts.
        pulse: u64,
        /// The shortest period, counts.
        period: u64,
    },
    /// The shortest period has so few counts that its step is too coarse.
    #[error(
        "a period of {counts} counts is too coarse, at least {COUNTS_MIN} are needed: use a faster clock or a longer exposure"
    )]
    ShortestPeriod {
        /// The shortest period, counts.
        counts: u64,
    },
    /// The low current gives no light.
    #[error(
        "a low current without light is none: give its share of the light, or none if it cannot be switched"
    )]
    LowCurrent,
}

/// Counts of a period from which on the step stays within what the ripple leaves of [`FIDELITY_PPM`].
const COUNTS_MIN: u64 = 1_000_000 / (2 * (FIDELITY_PPM - RIPPLE_MAX_PPM) as u64);

/// The pulses of one duty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pulses {
    /// Counts of the clock for which the LEDs are lit in each period.
    pub lit: u16,
    /// Counts of a period; 0 with a `lit` of 0 for no pulses at all.
    pub period: u16,
    /// Whether they are lit at the low current.
    pub low_current: bool,
}

/// The rule of the [module](self) for one board and panel.
///
/// ```
/// use fixed::types::U0F32;
/// use tx_firmware::drive::{Drive, EXPOSURE_LONG_NS, EXPOSURE_SHORT_NS, Limits, LowCurrent, Pulses};
///
/// let drive = Drive::new(Limits {
///     clock_hz: 125_000_000,
///     shortest_pulse_ns: 100,
///     longest_exposure_ns: EXPOSURE_LONG_NS,
///     shortest_exposure_ns: EXPOSURE_SHORT_NS,
///     low_current: LowCurrent::Share(U0F32::lit("0.125")),
/// })?;
/// let pulses = |duty| drive.pulses(U0F32::from_num(duty), Pulses::default());
/// assert_eq!(pulses(0.5), Pulses { lit: 486, period: 972, low_current: false }); // 129 kHz
/// assert_eq!(pulses(0.004), Pulses { lit: 13, period: 3250, low_current: false }); // 38 kHz
/// assert_eq!(pulses(0.001), Pulses { lit: 13, period: 1625, low_current: true });
/// # Ok::<(), tx_firmware::drive::DriveError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    shortest_pulse: u16,
    shortest_period: u16,
    longest_period: u16,
    low_current: LowCurrent,
    clock_hz: u32,
}

impl Drive {
    /// The rule for these limits.
    ///
    /// # Errors
    /// [`DriveError`] for the first limit that leaves none.
    pub fn new(limits: Limits) -> Result<Self, DriveError> {
        let Limits {
            clock_hz,
            shortest_pulse_ns,
            longest_exposure_ns: longest_ns,
            shortest_exposure_ns: shortest_ns,
            low_current,
        } = limits;
        if shortest_ns == 0 || shortest_ns > longest_ns {
            return Err(DriveError::Exposures {
                shortest_ns,
                longest_ns,
            });
        }
        if low_current == LowCurrent::Share(U0F32::ZERO) {
            return Err(DriveError::LowCurrent);
        }
        let pulse = counts_ceil(shortest_pulse_ns, clock_hz).max(1);
        let [shortest, longest] = [shortest_ns, longest_ns].map(|ns| period_counts(ns, clock_hz));
        if shortest < COUNTS_MIN {
            return Err(DriveError::ShortestPeriod { counts: shortest });
        }
        if pulse >= shortest {
            return Err(DriveError::ShortestPulse {
                pulse,
                period: shortest,
            });
        }
        let too_long = |_| DriveError::LongestPeriod { counts: longest };
        Ok(Self {
            // Shorter than the shortest period, hence than the longest.
            shortest_pulse: pulse.try_into().map_err(too_long)?,
            shortest_period: shortest.try_into().map_err(too_long)?,
            longest_period: longest.try_into().map_err(too_long)?,
            low_current,
            clock_hz,
        })
    }

    /// The pulses for a duty, after those of `before`; none at all for a duty of 0. Below the floor they are the floor's.
    pub fn pulses(&self, duty: U0F32, before: Pulses) -> Pulses {
        if duty == U0F32::ZERO {
            return Pulses {
                lit: 0,
                period: self.longest_period,
                low_current: before.low_current,
            };
        }
        match self.low_current {
            LowCurrent::Share(share) if duty < self.full_current_from(before) => {
                let duty = duty.checked_div(share).unwrap_or(U0F32::MAX);
                Pulses {
                    low_current: true,
                    ..self.at_one_current(duty)
                }
            }
            _ => self.at_one_current(duty),
        }
    }

    /// The least duty that the full current can give, and that the low one can.
    pub fn floor(&self) -> U0F32 {
        match self.low_current {
            LowCurrent::None => self.full_current_floor(),
            LowCurrent::Share(share) => self.full_current_floor() * share,
        }
    }

    /// The longest period, ns: what a calibration calls the period of the dimming.
    pub fn longest_period_ns(&self) -> u32 {
        (u64::from(self.longest_period) * NANOS_PER_S / u64::from(self.clock_hz)) as u32
    }

    fn full_current_floor(&self) -> U0F32 {
        share(self.shortest_pulse.into(), self.longest_period.into())
    }

    /// Coming from the low current a bit more is asked for, so that a duty at the floor does not switch to and fro.
    fn full_current_from(&self, before: Pulses) -> U0F32 {
        let floor = self.full_current_floor();
        if before.low_current {
            floor + floor / HYSTERESIS
        } else {
            floor
        }
    }

    fn at_one_current(&self, duty: U0F32) -> Pulses {
        let duty = u64::from(duty.to_bits()).max(1);
        let bright = (duty * u64::from(self.shortest_period) + ONE / 2) >> 32;
        let lit = bright.max(self.shortest_pulse.into());
        let period = ((lit << 32) + duty / 2) / duty;
        Pulses {
            lit: lit as u16,
            // At least the pulse itself: a duty of almost one is one.
            period: period.clamp(lit, self.longest_period.into()) as u16,
            low_current: false,
        }
    }
}

impl Pulses {
    /// The share of the full light that they give, at the full current or at the low one's `share`.
    pub fn duty(&self, low_current: LowCurrent) -> U0F32 {
        let lit = share(self.lit.into(), self.period.into());
        match low_current {
            LowCurrent::Share(share) if self.low_current => lit * share,
            _ => lit,
        }
    }

    /// How far the light of an exposure strays from its mean at most, in parts per million.
    pub fn ripple_ppm(&self, exposure_ns: u32, clock_hz: u32) -> u32 {
        let dark_ns = u64::from(self.period - self.lit.min(self.period)) * NANOS_PER_S
            / u64::from(clock_hz.max(1));
        (dark_ns * 1_000_000 / u64::from(exposure_ns.max(1))) as u32
    }

    /// How far rounding takes the light from the wanted one at most, in parts per million.
    pub fn step_ppm(&self) -> u32 {
        500_000u32.div_ceil(u32::from(self.period).max(1))
    }
}

const ONE: u64 = 1 << 32;
const NANOS_PER_S: u64 = 1_000_000_000;

fn counts_ceil(ns: u32, clock_hz: u32) -> u64 {
    (u64::from(ns) * u64::from(clock_hz)).div_ceil(NANOS_PER_S)
}

/// The longest period whose ripple is not too much for an exposure.
fn period_counts(exposure_ns: u32, clock_hz: u32) -> u64 {
    let exposure_counts = u64::from(exposure_ns) * u64::from(clock_hz) / NANOS_PER_S;
    exposure_counts * u64::from(RIPPLE_MAX_PPM) / 1_000_000
}

fn share(part: u32, whole: u32) -> U0F32 {
    let bits = (u64::from(part) << 32) / u64::from(whole.max(1));
    U0F32::from_bits(bits.try_into().unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use proptest::prelude::*;

    const CLOCK_HZ: u32 = 125_000_000;
    const LOW: LowCurrent = LowCurrent::Share(U0F32::lit("0.125"));
    const LIMITS: Limits = Limits {
        clock_hz: CLOCK_HZ,
        shortest_pulse_ns: 100,
        longest_exposure_ns: EXPOSURE_LONG_NS,
        shortest_exposure_ns: EXPOSURE_SHORT_NS,
        low_current: LOW,
    };

    fn drive() -> Drive {
        Drive::new(LIMITS).unwrap()
    }

    /// The lit time from the start of a period to `time_ns`, summed pulse by pulse.
    fn lit_ns(pulses: Pulses, time_ns: f64) -> f64 {
        let count_ns = 1e9 / f64::from(CLOCK_HZ);
        let (lit, period) = (
            f64::from(pulses.lit) * count_ns,
            f64::from(pulses.period) * count_ns,
        );
        (time_ns / period).floor() * lit + (time_ns % period).min(lit)
    }

    #[test]
    fn each_impossible_limit_has_its_own_error() {
        let refused = |limits| Drive::new(limits).unwrap_err();
        assert_eq!(
            refused(Limits {
                shortest_exposure_ns: EXPOSURE_LONG_NS + 1,
                ..LIMITS
            }),
            DriveError::Exposures {
                shortest_ns: EXPOSURE_LONG_NS + 1,
                longest_ns: EXPOSURE_LONG_NS
            }
        );
        assert_eq!(
            refused(Limits {
                longest_exposure_ns: 20_000_000,
                ..LIMITS
            }),
            DriveError::LongestPeriod { counts: 122_500 }
        );
        assert_eq!(
            refused(Limits {
                shortest_pulse_ns: 8_000,
                ..LIMITS
            }),
            DriveError::ShortestPulse {
                pulse: 1000,
                period: 972
            }
        );
        assert_eq!(
            refused(Limits {
                shortest_exposure_ns: 50_000,
                ..LIMITS
            }),
            DriveError::ShortestPeriod { counts: 306 }
        );
        assert_eq!(
            refused(Limits {
                low_current: LowCurrent::Share(U0F32::ZERO),
                ..LIMITS
            }),
            DriveError::LowCurrent
        );
    }

    #[test]
    fn no_light_is_no_pulse_and_all_light_no_gap() {
        let pulses = |duty| drive().pulses(duty, Pulses::default());
        assert_eq!(pulses(U0F32::ZERO).lit, 0);
        let full = pulses(U0F32::MAX);
        assert_eq!((full.lit, full.low_current), (full.period, false));
    }

    #[test]
    fn the_low_current_takes_over_below_the_floor_and_hands_back_above_it() {
        let floor = drive().full_current_floor();
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
    fn without_a_switch_the_floor_is_held() {
        let drive = Drive::new(Limits {
            low_current: LowCurrent::None,
            ..LIMITS
        })
        .unwrap();
        let floor = drive.pulses(drive.floor(), Pulses::default());
        assert_eq!((floor.lit, floor.period), (13, 6125));
        assert_eq!(drive.pulses(drive.floor() / 5, Pulses::default()), floor);
        assert_eq!(drive.longest_period_ns(), 49_000);
    }

    proptest! {
        /// A panel that gives an L2A of 4 at some bright light, under any light from 50 lx up to it, as far as its floor allows.
        #[test]
        fn ripple_and_step_stay_within_five_percent(
            full_lx in 16_000f64..100_000.0, octave in 0f64..1.0, l2a in 0.2f64..4.0, phase in 0f64..1.0,
        ) {
            let lx = 50.0 * (full_lx / 50.0).powf(octave);
            let duty = U0F32::saturating_from_num(l2a * lx / (4.0 * full_lx));
            prop_assume!(duty >= drive().floor());
            let pulses = drive().pulses(duty, Pulses::default());
            let exposure = exposure_ns(lx as u32);
            prop_assert!(pulses.ripple_ppm(exposure, CLOCK_HZ) + pulses.step_ppm() <= FIDELITY_PPM, "{pulses:?}");

            // What an exposure that begins anywhere gets, against what was wanted.
            let start_ns = phase * f64::from(pulses.period) * 1e9 / f64::from(CLOCK_HZ);
            let exposure_ns = f64::from(exposure);
            let current = if pulses.low_current { 0.125 } else { 1.0 };
            let light = current * (lit_ns(pulses, start_ns + exposure_ns) - lit_ns(pulses, start_ns));
            let error = light / (exposure_ns * duty.to_num::<f64>()) - 1.0;
            let bound = f64::from(pulses.ripple_ppm(exposure, CLOCK_HZ) + pulses.step_ppm() + 2) / 1e6;
            prop_assert!(error.abs() <= bound, "{error} of {bound} at {lx} lx, {pulses:?}");
        }

        #[test]
        fn no_pulse_is_shorter_than_the_driver_needs_and_no_period_longer_than_the_exposure_bears(duty in 1u32..) {
            let pulses = drive().pulses(U0F32::from_bits(duty), Pulses::default());
            prop_assert!(pulses.lit >= 13 && pulses.lit <= pulses.period && pulses.period <= 6125);
        }

        #[test]
        fn more_duty_is_never_less_light(duty in 1u32.., more in 0u32..1 << 24) {
            let pulses = drive().pulses(U0F32::from_bits(duty), Pulses::default());
            let brighter = drive().pulses(U0F32::from_bits(duty.saturating_add(more)), pulses);
            let slack = pulses.duty(LOW) / 900;
            prop_assert!(brighter.duty(LOW) >= pulses.duty(LOW) - slack);
        }

        #[test]
        fn any_limits_are_a_rule_or_an_error(
            clock_hz in any::<u32>(), shortest_pulse_ns in any::<u32>(), longest_exposure_ns in any::<u32>(),
            shortest_exposure_ns in any::<u32>(), share in any::<u32>(), duty in any::<u32>(),
        ) {
            let limits = Limits {
                clock_hz, shortest_pulse_ns, longest_exposure_ns, shortest_exposure_ns,
                low_current: LowCurrent::Share(U0F32::from_bits(share)),
            };
            for limits in [limits, Limits { clock_hz, ..LIMITS }, Limits { shortest_pulse_ns, ..LIMITS }] {
                if let Ok(drive) = Drive::new(limits) {
                    let pulses = drive.pulses(U0F32::from_bits(duty), Pulses::default());
                    prop_assert!(pulses.lit <= pulses.period);
                }
            }
        }
    }
}
