//! Plausibility of the light sensor: the known light from its readings.
//!
//! A panel controlled by a broken sensor dazzles at night or vanishes at noon. Each [`LightSample`] therefore either is evidence of the
//! light or is not, and light without evidence for [`HOLD_MS`] counts as lost:
//!
//! | reading | is evidence |
//! |---|---|
//! | lux, from a register that changed within [`STUCK_MS`], from or to saturation too | for that illuminance |
//! | 0 lux | for darkness, however often it repeats: if it is false, the panel is dim and therefore safe |
//! | lux, from a register that has not changed for longer | none: *stuck* |
//! | saturated, and within [`CONFIRM_MS`] in the other range too | for daylight |
//! | saturated, in one range alone | none: *saturated* |
//! | a full register that hangs, or that no daylight fills | none: *stuck* |
//! | missing | none: *missing* |
//! | the sensor was not polled | none: *silent* |
//!
//! ```text
//!               evidence                         no evidence
//!   Unknown ───────────────▶ Measured, Daylight ─────────────▶ Held
//!      │                          ▲        ▲                    │ │
//!      │                          │        └──── evidence ──────┘ │
//!      │ HOLD_MS                  │ evidence, RECOVERY            │ HOLD_MS after
//!      │ after the start          │ times in succession           │ the last evidence
//!      └───────────────────────▶ Lost ◀───────────────────────────┘
//! ```
//!
//! **The stated times.** A sensor that is missing, silent, saturated or stuck at a full register is detected [`HOLD_MS`] after the last
//! evidence; one that is stuck elsewhere, [`STUCK_MS`] + [`HOLD_MS`] after its last change. To this comes the time between two calls of
//! [`LightWatch::watch`].
//!
//! **The cross-check.** Steady light gives the same reading again and again, and so does a sensor that hangs. A measurement in another
//! range, set by gain or integration time, distinguishes them, because a working sensor's register must then differ. So steady light is
//! never stuck, however bright, if the sensor meets the [requirements on its ranges](crate::light_sensor). [`LightWatch::next_range`]
//! selects the range: the other one after a saturated reading, and after [`PROBE_MS`] without a change. A sensor that has one range only
//! may pass anything that changes with each conversion as its `word`; its saturation is then never confirmed.
//!
//! **A full register** is the same in both ranges, whether the sun or a sensor that hangs has filled it. Only the driver can distinguish
//! them, and returns [`LightSample::Stuck`] if it cannot: a panel at the night limit by day is safe, and one that shines as in daylight at
//! night dazzles.

use fixed::types::I32F32;
use link::serial::{Faults, Light};

/// Time for which light without new evidence still counts, ms.
pub const HOLD_MS: u64 = 2_000;
/// Time for which a register may stay the same before a reading in the other range, ms.
pub const PROBE_MS: u64 = 1_000;
/// Time for which a register may stay the same before it counts as stuck, ms.
pub const STUCK_MS: u64 = 3_000;
/// Time within which a reading in the other range confirms a saturated one, ms.
pub const CONFIRM_MS: u64 = 1_000;
/// Successive readings with evidence, after which a lost sensor is trusted again.
pub const RECOVERY: u8 = 5;

/// One of two ranges of a sensor, by gain or integration time: its register differs in the same light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorRange {
    /// The range for most light.
    Operating,
    /// Another range for comparison, preferably less sensitive.
    CrossCheck,
}

/// The result of one attempt to read the light sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LightSample {
    /// An illuminance.
    Light {
        /// Lux, before the sensor's gain.
        #[cfg_attr(feature = "defmt", defmt(Display2Format))]
        lux: I32F32,
        /// The register behind it.
        word: u16,
    },
    /// Too much light for this range, by a conversion that the driver knows to be new.
    Saturated,
    /// A full register that hangs, or that may.
    Stuck,
    /// No answer, or an error on the bus.
    Missing,
}

/// The evidence of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Evidence {
    /// An illuminance in lux, before the sensor's gain.
    Light(#[cfg_attr(feature = "defmt", defmt(Display2Format))] I32F32),
    /// More light than the sensor can read in either range.
    Daylight,
    /// No measurement.
    None,
}

/// The known light, and its age.
///
/// ```
/// use fixed::types::I32F32;
/// use link::serial::{Faults, Light};
/// use tx_firmware::light_watch::{Evidence, HOLD_MS, LightWatch, LightSample, SensorRange};
///
/// let mut watch = LightWatch::new();
/// let overcast = LightSample::Light { lux: I32F32::lit("5000"), word: 0x7a12 };
/// assert_eq!(watch.observe(100, SensorRange::Operating, overcast), Evidence::Light(I32F32::lit("5000")));
/// assert_eq!(watch.light(), Light::Measured);
///
/// assert_eq!(watch.observe(200, SensorRange::Operating, LightSample::Missing), Evidence::None);
/// assert_eq!(watch.light(), Light::Held);
/// watch.watch(101 + HOLD_MS);
/// assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_MISSING));
/// ```
#[derive(Clone, Debug)]
pub struct LightWatch {
    light: Light,
    /// The time of the last evidence; at first, of the start.
    known_ms: u64,
    /// The time of the last attempt to read the sensor.
    asked_ms: u64,
    /// Why the latest reading was no evidence.
    doubt: Faults,
    /// The latest register, and below, since when it has been the same.
    word: Option<u16>,
    changed_ms: u64,
    /// The time of each range's saturation; `None` if its last reading was not saturated.
    saturated_ms: [Option<u64>; 2],
    next: SensorRange,
    /// Successive readings with evidence, while light is lost.
    recovered: u8,
}

impl LightWatch {
    /// A watch that starts at time 0 without any evidence.
    pub const fn new() -> Self {
        Self {
            light: Light::Unknown,
            known_ms: 0,
            asked_ms: 0,
            doubt: Faults::empty(),
            word: None,
            changed_ms: 0,
            saturated_ms: [None; 2],
            next: SensorRange::Operating,
            recovered: 0,
        }
    }

    /// Adds a sample of the sensor in `range`, and returns its evidence: none until a lost sensor is trusted again.
    pub fn observe(&mut self, now_ms: u64, range: SensorRange, sample: LightSample) -> Evidence {
        self.watch(now_ms);
        self.asked_ms = now_ms;
        let evidence = self.weigh(now_ms, range, sample);
        let light = match evidence {
            Evidence::Light(_) => Light::Measured,
            Evidence::Daylight => Light::Daylight,
            // One saturated reading is not a fault yet: the other range decides.
            Evidence::None if self.doubt == Faults::SENSOR_SATURATED => return Evidence::None,
            Evidence::None => {
                self.recovered = 0;
                if matches!(self.light, Light::Measured | Light::Daylight) {
                    self.light = Light::Held;
                }
                return Evidence::None;
            }
        };
        if self.light == Light::Lost {
            self.recovered += 1;
            if self.recovered < RECOVERY {
                return Evidence::None;
            }
            self.recovered = 0;
        }
        self.light = light;
        self.known_ms = now_ms;
        self.doubt = Faults::empty();
        evidence
    }

    /// Advances the time. Call it often, and not from the code that reads the sensor, which may hang.
    pub fn watch(&mut self, now_ms: u64) {
        if now_ms.saturating_sub(self.asked_ms) > HOLD_MS {
            self.doubt = Faults::SENSOR_SILENT;
            self.recovered = 0;
        }
        if now_ms.saturating_sub(self.known_ms) > HOLD_MS {
            self.light = Light::Lost;
        }
    }

    /// The state of the light.
    pub const fn light(&self) -> Light {
        self.light
    }

    /// Why light is held or lost; empty while it is known.
    pub const fn faults(&self) -> Faults {
        match self.light {
            Light::Held | Light::Lost => self.doubt,
            Light::Unknown | Light::Measured | Light::Daylight => Faults::empty(),
        }
    }

    /// The range for the next reading of the sensor.
    pub const fn next_range(&self) -> SensorRange {
        self.next
    }

    fn weigh(&mut self, now_ms: u64, range: SensorRange, sample: LightSample) -> Evidence {
        let since = |then_ms: u64| now_ms.saturating_sub(then_ms);
        let (this, other, opposite) = match range {
            SensorRange::Operating => (0, 1, SensorRange::CrossCheck),
            SensorRange::CrossCheck => (1, 0, SensorRange::Operating),
        };
        self.saturated_ms[this] = (sample == LightSample::Saturated).then_some(now_ms);
        self.next = SensorRange::Operating;
        match sample {
            LightSample::Missing => self.none(Faults::SENSOR_MISSING),
            LightSample::Stuck => {
                self.next = opposite;
                self.none(Faults::SENSOR_STUCK)
            }
            LightSample::Saturated => {
                self.next = opposite;
                // A full register is another one than before, even if the other range then reads the same again.
                self.word = None;
                match self.saturated_ms[other] {
                    Some(then_ms) if since(then_ms) <= CONFIRM_MS => Evidence::Daylight,
                    _ => self.none(Faults::SENSOR_SATURATED),
                }
            }
            LightSample::Light { lux, word } => {
                if self.word != Some(word) {
                    (self.word, self.changed_ms) = (Some(word), now_ms);
                }
                if since(self.changed_ms) >= PROBE_MS {
                    self.next = opposite;
                }
                if lux <= I32F32::ZERO || since(self.changed_ms) <= STUCK_MS {
                    Evidence::Light(lux)
                } else {
                    self.none(Faults::SENSOR_STUCK)
                }
            }
        }
    }

    const fn none(&mut self, doubt: Faults) -> Evidence {
        self.doubt = doubt;
        Evidence::None
    }
}

impl Default for LightWatch {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use properties::prelude::*;
    use std::vec::Vec;

    const LUX: I32F32 = I32F32::lit("5000");

    #[test]
    fn a_lost_sensor_is_trusted_again_in_light_that_saturates_one_range() {
        let mut watch = measured();
        watch.watch(101 + HOLD_MS);
        assert_eq!(watch.light(), Light::Lost);
        for turn in 1..=u64::from(RECOVERY) {
            let now_ms = 101 + HOLD_MS + 200 * turn;
            watch.observe(now_ms, SensorRange::Operating, LightSample::Saturated);
            watch.observe(now_ms + 100, SensorRange::CrossCheck, light(turn as u16));
        }
        assert_eq!(watch.light(), Light::Measured);
    }

    fn light(word: u16) -> LightSample {
        LightSample::Light { lux: LUX, word }
    }

    /// A watch after light at 100 ms.
    fn measured() -> LightWatch {
        let mut watch = LightWatch::new();
        watch.observe(100, SensorRange::Operating, light(1));
        assert_eq!((watch.light(), watch.faults()), (Light::Measured, Faults::empty()));
        watch
    }

    /// A watch after saturation in both ranges, at 100 and 200 ms.
    fn daylight() -> LightWatch {
        let mut watch = LightWatch::new();
        assert_eq!(watch.observe(100, SensorRange::Operating, LightSample::Saturated), Evidence::None);
        assert_eq!(watch.next_range(), SensorRange::CrossCheck);
        assert_eq!(
            watch.observe(200, SensorRange::CrossCheck, LightSample::Saturated),
            Evidence::Daylight
        );
        assert_eq!((watch.light(), watch.faults()), (Light::Daylight, Faults::empty()));
        assert_eq!(watch.next_range(), SensorRange::Operating);
        watch
    }

    /// A watch that has lost the light.
    fn lost() -> LightWatch {
        let mut watch = measured();
        watch.watch(5_000);
        assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_SILENT));
        watch
    }

    #[test]
    fn unknown_stays_until_the_first_evidence_or_the_end_of_patience() {
        let mut watch = LightWatch::new();
        assert_eq!((watch.light(), watch.faults()), (Light::Unknown, Faults::empty()));
        assert_eq!(watch.observe(100, SensorRange::Operating, LightSample::Missing), Evidence::None);
        watch.watch(HOLD_MS);
        assert_eq!((watch.light(), watch.faults()), (Light::Unknown, Faults::empty()));
        watch.watch(HOLD_MS + 1);
        assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_MISSING));
    }

    #[test]
    fn a_watch_that_nobody_feeds_calls_the_sensor_silent() {
        let mut watch = LightWatch::new();
        watch.watch(HOLD_MS + 1);
        assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_SILENT));
    }

    #[test]
    fn measured_light_is_held_without_a_reading_and_measured_again_with_one() {
        let mut watch = measured();
        assert_eq!(watch.observe(200, SensorRange::Operating, LightSample::Missing), Evidence::None);
        assert_eq!((watch.light(), watch.faults()), (Light::Held, Faults::SENSOR_MISSING));
        assert_eq!(watch.observe(300, SensorRange::Operating, light(2)), Evidence::Light(LUX));
        assert_eq!((watch.light(), watch.faults()), (Light::Measured, Faults::empty()));
    }

    #[test]
    fn held_light_is_lost_when_its_time_is_over() {
        for sample in [LightSample::Missing, LightSample::Saturated, LightSample::Stuck] {
            let mut watch = measured();
            for now_ms in (200..=100 + HOLD_MS).step_by(100) {
                watch.observe(now_ms, SensorRange::Operating, sample);
                assert_ne!(watch.light(), Light::Lost);
            }
            watch.observe(101 + HOLD_MS, SensorRange::Operating, sample);
            assert_eq!(watch.light(), Light::Lost);
            let fault = match sample {
                LightSample::Saturated => Faults::SENSOR_SATURATED,
                LightSample::Stuck => Faults::SENSOR_STUCK,
                _ => Faults::SENSOR_MISSING,
            };
            assert_eq!(watch.faults(), fault);
        }
    }

    #[test]
    fn steady_light_of_a_living_sensor_is_never_lost() {
        let mut watch = LightWatch::new();
        let mut probes = 0;
        for now_ms in (100..60_000).step_by(100) {
            let range = watch.next_range();
            probes += u32::from(range == SensorRange::CrossCheck);
            let word = if range == SensorRange::Operating { 7 } else { 14 };
            assert_eq!(watch.observe(now_ms, range, light(word)), Evidence::Light(LUX));
            assert_eq!(watch.light(), Light::Measured);
        }
        assert!((30..=60).contains(&probes), "{probes} probes in a minute");
    }

    #[test]
    fn a_stuck_sensor_is_held_then_lost_and_asked_in_the_other_range_before() {
        let mut watch = measured();
        let mut states = Vec::new();
        for now_ms in (200..=100 + STUCK_MS + HOLD_MS + 100).step_by(100) {
            assert_eq!(
                watch.next_range() == SensorRange::CrossCheck,
                now_ms > 100 + PROBE_MS && (now_ms / 100) % 2 == 0
            );
            watch.observe(now_ms, watch.next_range(), light(1));
            states.push((now_ms, watch.light()));
        }
        let first = |light| states.iter().find(|state| state.1 == light).map(|state| state.0);
        assert_eq!(first(Light::Held), Some(100 + STUCK_MS + 100));
        assert_eq!(first(Light::Lost), Some(100 + STUCK_MS + HOLD_MS + 100));
        assert_eq!(watch.faults(), Faults::SENSOR_STUCK);
    }

    #[test]
    fn darkness_may_stay_the_same_for_ever() {
        let mut watch = LightWatch::new();
        let dark = LightSample::Light {
            lux: I32F32::ZERO,
            word: 0,
        };
        for now_ms in (100..60_000).step_by(100) {
            watch.observe(now_ms, watch.next_range(), dark);
            assert_eq!(watch.light(), Light::Measured);
        }
    }

    #[test]
    fn daylight_lasts_while_both_ranges_stay_saturated() {
        let mut watch = daylight();
        for now_ms in (300..60_000).step_by(100) {
            assert_eq!(
                watch.observe(now_ms, watch.next_range(), LightSample::Saturated),
                Evidence::Daylight
            );
        }
    }

    #[test]
    fn daylight_is_held_then_lost_without_readings() {
        let mut watch = daylight();
        watch.observe(300, SensorRange::Operating, LightSample::Missing);
        assert_eq!((watch.light(), watch.faults()), (Light::Held, Faults::SENSOR_MISSING));
        watch.watch(201 + HOLD_MS);
        assert_eq!(watch.light(), Light::Lost);
    }

    #[test]
    fn daylight_ends_with_a_reading() {
        let mut watch = daylight();
        assert_eq!(watch.observe(300, SensorRange::Operating, light(1)), Evidence::Light(LUX));
        assert_eq!(watch.light(), Light::Measured);
    }

    #[test]
    fn light_that_saturates_one_range_alone_is_read_at_the_other() {
        let mut watch = LightWatch::new();
        for now_ms in (100..60_000).step_by(100) {
            let range = watch.next_range();
            let sample = match range {
                SensorRange::Operating => LightSample::Saturated,
                SensorRange::CrossCheck => light((now_ms / 100) as u16),
            };
            let evidence = watch.observe(now_ms, range, sample);
            assert_ne!(evidence, Evidence::Daylight);
            if now_ms > 200 {
                assert_eq!((watch.light(), watch.faults()), (Light::Measured, Faults::empty()));
            }
        }
    }

    #[test]
    fn steady_light_that_saturates_one_range_alone_is_never_lost() {
        let mut watch = LightWatch::new();
        for now_ms in (100..60_000).step_by(100) {
            let range = watch.next_range();
            let sample = match range {
                SensorRange::Operating => LightSample::Saturated,
                SensorRange::CrossCheck => light(40_000),
            };
            watch.observe(now_ms, range, sample);
            if now_ms > 200 {
                assert_eq!((watch.light(), watch.faults()), (Light::Measured, Faults::empty()), "{now_ms} ms");
            }
        }
    }

    #[test]
    fn saturation_long_ago_confirms_nothing() {
        let mut watch = measured();
        watch.observe(200, SensorRange::Operating, LightSample::Saturated);
        let late = watch.observe(201 + CONFIRM_MS, SensorRange::CrossCheck, LightSample::Saturated);
        assert_eq!(late, Evidence::None);
        assert_eq!(watch.light(), Light::Measured);
    }

    #[test]
    fn lost_light_needs_several_readings_in_succession() {
        let mut watch = lost();
        let mut now_ms = 5_000;
        let mut next = |watch: &mut LightWatch, sample| {
            now_ms += 100;
            watch.observe(now_ms, SensorRange::Operating, sample)
        };
        for word in 0..u16::from(RECOVERY) - 1 {
            assert_eq!(next(&mut watch, light(word)), Evidence::None);
        }
        assert_eq!(next(&mut watch, LightSample::Missing), Evidence::None);
        for word in 0..u16::from(RECOVERY) - 1 {
            assert_eq!(next(&mut watch, light(word)), Evidence::None);
            assert_eq!(watch.light(), Light::Lost);
        }
        assert_eq!(next(&mut watch, light(99)), Evidence::Light(LUX));
        assert_eq!((watch.light(), watch.faults()), (Light::Measured, Faults::empty()));
    }

    #[test]
    fn lost_light_can_come_back_as_daylight() {
        let mut watch = lost();
        let mut now_ms = 5_000;
        while watch.light() == Light::Lost {
            now_ms += 100;
            watch.observe(now_ms, watch.next_range(), LightSample::Saturated);
            assert!(now_ms < 7_000);
        }
        assert_eq!(watch.light(), Light::Daylight);
    }

    fn readings() -> impl Strategy<Value = Option<LightSample>> {
        prop_oneof![
            (0u16..4).prop_map(|word| Some(light(word))),
            Just(Some(LightSample::Saturated)),
            Just(Some(LightSample::Stuck)),
            Just(Some(LightSample::Missing)),
            Just(None),
        ]
    }

    properties! {
        /// The transitions of the module's diagram and no others, each with its cause.
        #[test]
        fn there_are_no_other_transitions(events in prop::collection::vec((0u64..1500, readings()), 1..200)) {
            let mut watch = LightWatch::new();
            let (mut now_ms, mut evidence_ms) = (0, 0);
            for (wait_ms, sample) in events {
                now_ms += wait_ms;
                let before = watch.light();
                let evidence = match sample {
                    Some(sample) => watch.observe(now_ms, watch.next_range(), sample),
                    None => { watch.watch(now_ms); Evidence::None }
                };
                let after = watch.light();
                if evidence != Evidence::None {
                    evidence_ms = now_ms;
                }
                match evidence {
                    Evidence::Light(_) => prop_assert_eq!(after, Light::Measured),
                    Evidence::Daylight => prop_assert_eq!(after, Light::Daylight),
                    Evidence::None => prop_assert!(
                        after == before
                            || after == Light::Held && matches!(before, Light::Measured | Light::Daylight)
                            || after == Light::Lost
                    ),
                }
                prop_assert_eq!(after == Light::Lost, now_ms - evidence_ms > HOLD_MS);
                if after == Light::Lost {
                    prop_assert_ne!(watch.faults(), Faults::empty());
                }
            }
        }
    }
}
