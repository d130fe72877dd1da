//! The trait of light sensors, and their polling.
//!
//! [`PolledSensor`] asks a [`LightSensor`] some fifty times a second and returns what [`Transmitter::sense`] takes. The folder
//! `boards/light_sensors` has drivers of four chips; [`SimulatedSensor`] needs none.
//!
//! # Two ranges
//!
//! A register that does not change is either steady light or a sensor that hangs. [`light_watch`](crate::light_watch) distinguishes them by
//! a measurement in a second range. A sensor and its driver have to meet four requirements:
//!
//! 1. **It can measure in two ways**, by gain, integration time or full scale, and both give lux. [`SensorRange::Operating`] is the one for
//!    most light.
//! 2. **The same light gives another register** in the other range, from the least light on that is more than 0 lx. Two sensitivities that
//!    differ by a factor of 2 or more, each rounded down, do so. A floating-point register does so through its exponent.
//! 3. **[`SensorRange::CrossCheck`] is the less sensitive one**, so that it reads light that saturates the other. Only if both saturate is
//!    there too much light for the sensor.
//! 4. **A full register that hangs is [`LightSample::Stuck`]**, because it is full in both ranges. The driver distinguishes it from
//!    [`LightSample::Saturated`] by a command that changes the register, by the range that the register contains, or by a range that no
//!    daylight fills. If it cannot, *stuck* is the safe answer.
//!
//! A driver starts a conversion in the range that it is asked for, and never returns one that began before. A sensor with one range counts
//! its conversions and passes the count as [`word`](LightSample::Light): then a sensor that answers but does not convert is detected, and
//! its saturation is never confirmed.
//!
//! [`Transmitter::sense`]: crate::transmitter::Transmitter::sense

use fixed::types::I32F32;

use crate::light_watch::{LightSample, SensorRange};

/// A sensor without a finished conversion for this time is missing, ms.
pub const PATIENCE_MS: u64 = 500;

/// A light sensor that measures again and again. The [module](self) has the requirements on its ranges.
///
/// No call waits for a conversion. Times are milliseconds from the start.
pub trait LightSensor {
    /// Why the sensor did not answer.
    type Error;

    /// Measures in `range` from now on. A sensor that lost its supply has lost its settings, too: write all of them.
    ///
    /// # Errors
    /// If the sensor does not answer.
    fn start(&mut self, now_ms: u64, range: SensorRange) -> Result<(), Self::Error>;

    /// The conversion that finished since the last call; `None` if none did.
    ///
    /// # Errors
    /// If the sensor does not answer.
    fn take(&mut self, now_ms: u64) -> Result<Option<LightSample>, Self::Error>;
}

/// A light sensor, and the range in which it measures.
///
/// ```
/// use fixed::types::I32F32;
/// use tx_firmware::{
///     light_sensor::{PolledSensor, SimulatedSensor},
///     light_watch::{LightSample, SensorRange},
/// };
///
/// let mut sensor = PolledSensor::new(SimulatedSensor::new(I32F32::lit("5000")));
/// assert_eq!(sensor.poll(0, SensorRange::Operating), None); // it has just begun
/// let reading = sensor.poll(100, SensorRange::Operating);
/// let light = LightSample::Light { lux: I32F32::lit("5000"), word: 5000 };
/// assert_eq!(reading, Some((SensorRange::Operating, light)));
/// ```
#[derive(Clone, Debug)]
pub struct PolledSensor<S> {
    sensor: S,
    /// Its range, and the time of its last conversion; `None` while it does not answer.
    measuring: Option<(SensorRange, u64)>,
}

impl<S: LightSensor> PolledSensor<S> {
    /// A sensor before its first poll.
    pub const fn new(sensor: S) -> Self {
        Self { sensor, measuring: None }
    }

    /// A new reading with its range, [`LightSample::Missing`] if the sensor does not answer or has nothing new for [`PATIENCE_MS`], or
    /// `None`. The sensor then measures in the range `wanted`.
    pub fn poll(&mut self, now_ms: u64, wanted: SensorRange) -> Option<(SensorRange, LightSample)> {
        let Some((range, since_ms)) = self.measuring.filter(|measuring| measuring.0 == wanted) else {
            return self.measure(now_ms, wanted);
        };
        match self.sensor.take(now_ms) {
            Ok(Some(sample)) => {
                self.measuring = Some((range, now_ms));
                Some((range, sample))
            }
            Ok(None) if now_ms.saturating_sub(since_ms) < PATIENCE_MS => None,
            Ok(None) | Err(_) => {
                self.measuring = None;
                Some((range, LightSample::Missing))
            }
        }
    }

    fn measure(&mut self, now_ms: u64, range: SensorRange) -> Option<(SensorRange, LightSample)> {
        let started = self.sensor.start(now_ms, range);
        self.measuring = started.is_ok().then_some((range, now_ms));
        started.is_err().then_some((range, LightSample::Missing))
    }

    /// The sensor.
    pub fn sensor_mut(&mut self) -> &mut S {
        &mut self.sensor
    }
}

/// The state of a [`SimulatedSensor`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// It measures.
    Works,
    /// It does not answer.
    Missing,
    /// It answers, and finishes no conversion.
    Silent,
    /// It answers with its last register, whatever the light and the range.
    Hangs,
}

/// A light sensor without a chip, whose register is a whole number of counts: steady light gives the same count each time.
#[derive(Clone, Debug)]
pub struct SimulatedSensor {
    /// The light.
    pub lux: I32F32,
    /// The state of the sensor.
    pub health: Health,
    /// Counts per lux, operating and cross-check.
    pub counts_per_lux: [I32F32; 2],
    /// The register's greatest count, which means saturation.
    pub full_count: u16,
    /// The time of a conversion, ms.
    pub conversion_ms: u64,
    range: SensorRange,
    ready_ms: u64,
    last: LightSample,
}

impl SimulatedSensor {
    /// A sensor with a 16-bit register, of one count per lux and of half a count per lux, that takes 100 ms.
    pub const fn new(lux: I32F32) -> Self {
        Self {
            lux,
            health: Health::Works,
            counts_per_lux: [I32F32::ONE, I32F32::lit("0.5")],
            full_count: u16::MAX,
            conversion_ms: 100,
            range: SensorRange::Operating,
            ready_ms: 0,
            last: LightSample::Saturated,
        }
    }

    fn convert(&self) -> LightSample {
        let counts_per_lux = match self.range {
            SensorRange::Operating => self.counts_per_lux[0],
            SensorRange::CrossCheck => self.counts_per_lux[1],
        };
        let word: u16 = self.lux.saturating_mul(counts_per_lux).saturating_to_num();
        if word >= self.full_count {
            LightSample::Saturated
        } else {
            let lux = I32F32::from(word).checked_div(counts_per_lux).unwrap_or(I32F32::MAX);
            LightSample::Light { lux, word }
        }
    }
}

/// A [`SimulatedSensor`] does not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoAnswer;

impl LightSensor for SimulatedSensor {
    type Error = NoAnswer;

    fn start(&mut self, now_ms: u64, range: SensorRange) -> Result<(), NoAnswer> {
        if self.health == Health::Missing {
            return Err(NoAnswer);
        }
        self.range = range;
        self.ready_ms = now_ms + self.conversion_ms;
        Ok(())
    }

    fn take(&mut self, now_ms: u64) -> Result<Option<LightSample>, NoAnswer> {
        match self.health {
            Health::Missing => return Err(NoAnswer),
            Health::Silent => return Ok(None),
            Health::Works | Health::Hangs if now_ms < self.ready_ms => return Ok(None),
            Health::Works => self.last = self.convert(),
            Health::Hangs if self.last == LightSample::Saturated => self.last = LightSample::Stuck,
            Health::Hangs => {}
        }
        self.ready_ms = now_ms + self.conversion_ms;
        Ok(Some(self.last))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::light_watch::{HOLD_MS, LightWatch, STUCK_MS};
    use link::serial::{Faults, Light};
    use properties::prelude::*;

    const POLL_MS: u64 = 20;
    const OPERATING: SensorRange = SensorRange::Operating;

    /// Polls from one time to another, as a board does.
    fn follow(
        sensor: &mut PolledSensor<SimulatedSensor>,
        watch: &mut LightWatch,
        times_ms: core::ops::Range<u64>,
        see: impl Fn(u64, &LightWatch),
    ) {
        for now_ms in times_ms.step_by(POLL_MS as usize) {
            match sensor.poll(now_ms, watch.next_range()) {
                Some((range, sample)) => _ = watch.observe(now_ms, range, sample),
                None => watch.watch(now_ms),
            }
            see(now_ms, watch);
        }
    }

    fn polled(lux: &str) -> PolledSensor<SimulatedSensor> {
        PolledSensor::new(SimulatedSensor::new(lux.parse().unwrap()))
    }

    #[test]
    fn another_range_is_begun_before_it_is_read() {
        let mut sensor = polled("5000");
        assert_eq!(sensor.poll(0, OPERATING), None);
        assert_eq!(sensor.poll(90, SensorRange::CrossCheck), None);
        assert_eq!(sensor.poll(110, SensorRange::CrossCheck), None);
        let half = LightSample::Light {
            lux: I32F32::lit("5000"),
            word: 2500,
        };
        assert_eq!(sensor.poll(190, SensorRange::CrossCheck), Some((SensorRange::CrossCheck, half)));
    }

    #[test]
    fn a_sensor_that_is_always_ready_changes_its_range_too() {
        let mut sensor = polled("5000");
        sensor.sensor_mut().conversion_ms = 0;
        sensor.poll(0, OPERATING);
        assert!(matches!(sensor.poll(20, OPERATING), Some((OPERATING, _))));
        assert_eq!(sensor.poll(40, SensorRange::CrossCheck), None);
        assert!(matches!(
            sensor.poll(60, SensorRange::CrossCheck),
            Some((SensorRange::CrossCheck, _))
        ));
    }

    #[test]
    fn a_sensor_that_does_not_answer_is_missing_and_begun_anew() {
        let mut sensor = polled("5000");
        sensor.sensor_mut().health = Health::Missing;
        for now_ms in [0, 20, 40] {
            assert_eq!(sensor.poll(now_ms, OPERATING), Some((OPERATING, LightSample::Missing)));
        }
        sensor.sensor_mut().health = Health::Works;
        assert_eq!(sensor.poll(60, OPERATING), None);
        assert!(matches!(sensor.poll(160, OPERATING), Some((OPERATING, LightSample::Light { .. }))));
    }

    #[test]
    fn a_sensor_that_never_finishes_is_missing_after_its_patience() {
        let mut sensor = polled("5000");
        sensor.sensor_mut().health = Health::Silent;
        for now_ms in (0..PATIENCE_MS).step_by(20) {
            assert_eq!(sensor.poll(now_ms, OPERATING), None);
        }
        assert_eq!(sensor.poll(PATIENCE_MS, OPERATING), Some((OPERATING, LightSample::Missing)));
        assert_eq!(sensor.poll(PATIENCE_MS + 20, OPERATING), None);
    }

    #[test]
    fn a_sensor_that_hangs_is_stuck_and_then_lost_whichever_range_it_measured_in() {
        for lux in ["5000", "80000"] {
            let (mut sensor, mut watch) = (polled(lux), LightWatch::new());
            follow(&mut sensor, &mut watch, 0..10_000, |_, _| {});
            assert_eq!(watch.light(), Light::Measured);
            let hung = sensor.sensor_mut();
            hung.health = Health::Hangs;
            hung.last = LightSample::Light {
                lux: I32F32::lit("60000"),
                word: 60_000,
            };
            follow(&mut sensor, &mut watch, 10_000..10_500 + STUCK_MS + HOLD_MS, |_, _| {});
            assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_STUCK), "{lux} lx");
        }
    }

    #[test]
    fn a_sensor_that_hangs_at_full_scale_is_stuck_and_then_lost_in_any_light() {
        for lux in ["5000", "80000", "200000"] {
            let (mut sensor, mut watch) = (polled(lux), LightWatch::new());
            follow(&mut sensor, &mut watch, 0..10_000, |_, _| {});
            assert!(matches!(watch.light(), Light::Measured | Light::Daylight));
            let hung = sensor.sensor_mut();
            hung.health = Health::Hangs;
            hung.last = LightSample::Saturated;
            follow(&mut sensor, &mut watch, 10_000..10_500 + HOLD_MS, |_, _| {});
            assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_STUCK), "{lux} lx");
        }
    }

    properties! {
        /// Lamps in a laboratory are steady, and a count hides the rest.
        #[test]
        fn steady_light_is_never_lost(lux in 0.0..200_000.0f64, conversion_ms in 0u64..300, full_count in 1_000u16..=u16::MAX) {
            let mut sensor = PolledSensor::new(SimulatedSensor {
                conversion_ms,
                full_count,
                ..SimulatedSensor::new(I32F32::from_num(lux))
            });
            let mut watch = LightWatch::new();
            follow(&mut sensor, &mut watch, 0..1_000, |_, _| {});
            follow(&mut sensor, &mut watch, 1_000..60_000, |now_ms, watch| {
                assert!(matches!(watch.light(), Light::Measured | Light::Daylight), "{:?} at {now_ms} ms", watch.faults());
            });
        }
    }
}
