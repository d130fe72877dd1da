//! The whole transmitter without its timers.

#[cfg(feature = "signing")]
use link::framing::Signature;
use link::{
    fec::Code,
    framing::FramingError,
    intensity::IntensityLimit,
    l2a_table::{Illuminance, L2a, L2aTable},
    panel::PanelFrame,
    serial::{Answer, Counters, Faults, Light, SensorReading, Status},
    symbol_rate::SymbolRate,
    waveform::SymbolTiming,
};

use crate::{
    ambient::{Ambient, Smoothing},
    calibration::Calibration,
    dimming::{Dimming, L2A_MAX, NIGHT_LX, ceiling},
    light_watch::{Evidence, LightSample, LightWatch, SensorRange},
    matrix::{Duty, LedMatrix},
    schedule::{Repeats, Schedule},
    store::Remembered,
};

/// Light in, panels out. A board's program calls it from its two timers, and a simulator from its own clock:
///
/// - once a sensor period, [`sense`](Self::sense) with the sensor's sample in the range of [`next_range`](Self::next_range): dims the
///   panel;
/// - some ten times a second, [`watch`](Self::watch): makes the panel safe if readings stop;
/// - once a symbol, at the rate of [`symbol_rate`](Self::symbol_rate), [`tick`](Self::tick): shows the next panel;
/// - for each message, [`send`](Self::send).
///
/// Until the first reading the panel stays dark, because its allowed brightness is unknown. **When light is lost** (see
/// [`light_watch`](crate::light_watch)) its luminance falls to the night limit, that of [`L2A_MAX`] at [`NIGHT_LX`], or stays if it was
/// below. A panel without any reading then takes the night limit.
///
/// Times are milliseconds from the start, which never go back.
///
/// The [crate] opens with an example.
#[derive(Clone, Debug)]
pub struct Transmitter<M> {
    matrix: M,
    calibration: Calibration,
    table: L2aTable,
    ambient: Ambient,
    light_watch: LightWatch,
    schedule: Schedule,
    timing: SymbolTiming,
    /// The last L2A and illuminance while light was known.
    known: Option<(L2a, Illuminance)>,
    /// The greatest duty by the latest evidence of the light.
    most_duty: Duty,
    dimming: Option<Dimming>,
    test: Option<Test>,
    /// The latest in each range of the sensor.
    samples: [SensorReading; 2],
    now_ms: u64,
    faults: Faults,
    counters: Counters,
    /// The state that was logged last.
    #[cfg(feature = "defmt")]
    logged: Option<(Light, Faults)>,
}

/// The greatest share of a message's duty that a test may have if messages have a carrier: 32/44, so that a panel that stands still, of
/// which at most 44 LEDs are On, is no brighter than one with a carrier, whose LEDs are On half of the time. A board may have prepared
/// panels of the message, which stand still when a test begins.
const STILL_SHARE: [u64; 2] = [32, 44];

/// The panel shown instead of messages.
#[derive(Clone, Copy, Debug)]
struct Test {
    panel: PanelFrame,
    /// The share of the greatest duty that a test may have, in 1/255.
    share: u8,
    until_ms: u64,
    next_range: SensorRange,
    /// Whether the matrix is set to still panels.
    is_still: bool,
}

impl<M: LedMatrix> Transmitter<M> {
    /// A transmitter with a store's settings and faults, before its first reading.
    pub fn from_store(matrix: M, start: Remembered) -> Self {
        let mut transmitter = Self::new(matrix, start.calibration, start.table, Smoothing::default());
        transmitter.set_timing(start.timing);
        transmitter.set_faults(start.faults, true);
        transmitter
    }

    /// A transmitter before its first reading, which shows beacons on a dark `matrix`.
    pub fn new(matrix: M, calibration: Calibration, table: L2aTable, smoothing: Smoothing) -> Self {
        let ambient = Ambient::new(calibration.measured().sensor_gain, smoothing);
        Self {
            matrix,
            calibration,
            table,
            ambient,
            light_watch: LightWatch::new(),
            schedule: Schedule::new(),
            timing: SymbolTiming::default(),
            known: None,
            most_duty: ceiling(M::FULL_DUTY_LX, NIGHT_LX),
            dimming: None,
            test: None,
            samples: [SensorReading::None; 2],
            now_ms: 0,
            faults: Faults::empty(),
            counters: Counters::default(),
            #[cfg(feature = "defmt")]
            logged: None,
        }
    }

    /// Adds the light sensor's sample in `range`, and dims the panel to the light. Returns `None` while the panel stays dark because the
    /// light is unknown.
    ///
    /// # Errors
    /// Errors of the matrix, which then may not have the new duty; the next reading or [`watch`](Self::watch) tries again.
    pub fn sense(&mut self, now_ms: u64, range: SensorRange, sample: LightSample) -> Result<Option<Dimming>, M::Error> {
        self.now_ms = self.now_ms.max(now_ms);
        count(match sample {
            LightSample::Missing => &mut self.counters.missed_readings,
            LightSample::Light { .. } | LightSample::Saturated | LightSample::Stuck => &mut self.counters.readings,
        });
        let (latest, other) = match range {
            SensorRange::Operating => (0, SensorRange::CrossCheck),
            SensorRange::CrossCheck => (1, SensorRange::Operating),
        };
        self.samples[latest] = match sample {
            LightSample::Light { lux, .. } => SensorReading::Light(Illuminance::saturating_from_num(lux)),
            LightSample::Saturated | LightSample::Stuck => SensorReading::Saturated,
            LightSample::Missing => SensorReading::Missing,
        };
        if let Some(test) = &mut self.test {
            test.next_range = other;
        }
        let illuminance_lx = match self.light_watch.observe(self.now_ms, range, sample) {
            Evidence::Light(lux) => {
                self.most_duty = ceiling(M::FULL_DUTY_LX, Illuminance::saturating_from_num(lux));
                Some(self.ambient.sense(lux))
            }
            Evidence::Daylight => {
                self.most_duty = Duty::MAX;
                Some(self.ambient.sense_daylight())
            }
            Evidence::None => None,
        };
        if let Some(illuminance_lx) = illuminance_lx {
            let interval = self.calibration.measured().interval;
            self.known = Some((self.table.l2a(illuminance_lx, interval), illuminance_lx));
        }
        self.dim()
    }

    /// Advances the time: makes the panel's luminance safe after too long without evidence of the light.
    ///
    /// # Errors
    /// As [`sense`](Self::sense).
    pub fn watch(&mut self, now_ms: u64) -> Result<Option<Dimming>, M::Error> {
        self.now_ms = self.now_ms.max(now_ms);
        self.light_watch.watch(self.now_ms);
        self.dim()
    }

    /// Shows the panel of the next symbol, and returns it.
    ///
    /// # Errors
    /// Errors of the matrix; the symbol is then lost, and the next call continues with the one after it.
    pub fn tick(&mut self) -> Result<PanelFrame, M::Error> {
        // The size of a typical panel is not that of this one.
        let is_measured = !self.faults.contains(Faults::NO_CALIBRATION);
        let geometry = self.calibration.geometry().filter(|_| is_measured);
        let panel = match self.test {
            Some(test) => test.panel,
            None => self.schedule.next_panel_of(geometry),
        };
        let shown = self.matrix.show(panel);
        self.faults.set(Faults::LEDS, shown.is_err());
        count(if shown.is_ok() {
            &mut self.counters.symbols
        } else {
            &mut self.counters.lost_symbols
        });
        shown.map(|()| panel)
    }

    /// Shows `message` (1 to 1024 bytes) under `code` from the next symbol on, see
    /// [`Schedule::send`].
    ///
    /// # Errors
    /// [`FramingError`] if the message is empty or too long; the current content then continues.
    pub fn send(&mut self, message: &[u8], code: Code, repeats: Repeats) -> Result<(), FramingError> {
        self.schedule.send(message, code, repeats)
    }

    /// The same with a signature after each repeat of the message, see [`Schedule::send_signed`].
    ///
    /// # Errors
    /// As [`send`](Self::send).
    #[cfg(feature = "signing")]
    pub fn send_signed(&mut self, message: &[u8], code: Code, repeats: Repeats, signature: Signature) -> Result<(), FramingError> {
        self.schedule.send_signed(message, code, repeats, signature)
    }

    /// Shows beacons from the next symbol on.
    pub fn stop(&mut self) {
        self.schedule.stop();
    }

    /// Shows `panel` instead of messages for `time_ms`, with `share`/255 of their duty, and then continues with them where they stopped;
    /// 0 ms ends that at once. Panels are still meanwhile, whatever the timing; if messages have a carrier, the test has `share`/255 of
    /// 32/44 of their duty, because panels that are already prepared are still, too. A panel of at most
    /// [`TEST_LEDS_MAX`](link::serial::TEST_LEDS_MAX) LEDs is within all limits of messages.
    ///
    /// # Errors
    /// Errors of the matrix, which then may not have the new duty; the next reading or [`watch`](Self::watch) tries again.
    pub fn test(&mut self, panel: PanelFrame, share: u8, time_ms: u16) -> Result<(), M::Error> {
        self.test = Some(Test {
            panel,
            share,
            until_ms: self.now_ms + u64::from(time_ms),
            next_range: self.test.map_or(SensorRange::CrossCheck, |test| test.next_range),
            is_still: self.test.is_some_and(|test| test.is_still),
        });
        self.dim().map(|_| ())
    }

    /// Ends a test whose time is over.
    fn end_test(&mut self) {
        if self.test.is_some_and(|test| test.until_ms <= self.now_ms) {
            // The carrier first: it only takes light away, and the duty of messages may then follow.
            self.replace_test(None);
        }
    }

    /// Makes the panels of a test still, once they have its duty.
    fn hold_test(&mut self) {
        let held = self.test.map(|test| Test { is_still: true, ..test });
        self.replace_test(held);
    }

    fn replace_test(&mut self, test: Option<Test>) {
        let before = self.timing_shown();
        self.test = test;
        let now = self.timing_shown();
        if now != before {
            self.matrix.set_timing(now);
        }
    }

    /// A message's duty, or a test's share of it.
    fn duty_shown(&self, duty: Duty) -> Duty {
        let Some(test) = self.test else { return duty };
        let [most, of] = if self.timing.waveform().is_still() { [1, 1] } else { STILL_SHARE };
        let share = u64::from(duty.to_bits()) * u64::from(test.share) * most / (u64::from(u8::MAX) * of);
        Duty::from_bits(share as u32)
    }

    /// Replaces the table from the next reading on, and clears [`Faults::NO_TABLE`] and [`Faults::STORE`].
    pub fn set_table(&mut self, table: L2aTable) {
        self.table = table;
        self.faults.remove(Faults::NO_TABLE.union(Faults::STORE));
    }

    /// Replaces the measured values from the next reading on, and clears [`Faults::NO_CALIBRATION`] and [`Faults::STORE`]. The limit of the
    /// luminous intensity stays.
    pub fn set_calibration(&mut self, calibration: Calibration) {
        self.ambient.set_sensor_gain(calibration.measured().sensor_gain);
        self.calibration = calibration.limited_to(self.calibration.limit());
        self.matrix.set_calibration(calibration.measured());
        self.faults.remove(Faults::NO_CALIBRATION.union(Faults::STORE));
    }

    /// Replaces or removes the limit of the luminous intensity, from the next reading on.
    pub fn set_intensity_limit(&mut self, limit: Option<IntensityLimit>) {
        self.calibration = self.calibration.limited_to(limit);
    }

    /// Sets the symbol rate, at which to call [`tick`](Self::tick) from the next symbol on, and the waveform.
    pub fn set_timing(&mut self, timing: SymbolTiming) {
        self.timing = timing;
        self.matrix.set_timing(self.timing_shown());
    }

    /// Sets or clears faults that only the board detects, such as [`Faults::WATCHDOG`].
    pub fn set_faults(&mut self, faults: Faults, present: bool) {
        self.faults.set(faults, present);
    }

    /// Resets the counters.
    pub fn reset_counters(&mut self) {
        self.counters = Counters::default();
    }

    #[cfg(feature = "defmt")]
    fn log_changes(&mut self) {
        let (light, faults) = (self.light_watch.light(), self.faults());
        let logged = self.logged.replace((light, faults));
        if logged.is_none_or(|(before, _)| before != light) {
            defmt::info!("light: {}", light);
        }
        if logged.map_or(Faults::empty(), |(_, before)| before) != faults {
            defmt::warn!("faults: {}", faults);
        }
    }

    fn dim(&mut self) -> Result<Option<Dimming>, M::Error> {
        self.end_test();
        #[cfg(feature = "defmt")]
        self.log_changes();
        let light = self.light_watch.light();
        if light == Light::Lost {
            self.most_duty = ceiling(M::FULL_DUTY_LX, NIGHT_LX);
        }
        let calibration = self.calibration.with_duty_at_most(self.most_duty);
        let dimmed = |(l2a, lx)| Dimming::new(l2a, lx, &calibration);
        let dimming = match light {
            Light::Unknown => {
                // All is dark.
                self.hold_test();
                return Ok(None);
            }
            Light::Measured | Light::Held | Light::Daylight => self.known.map(dimmed),
            Light::Lost => {
                self.ambient.fall_back(NIGHT_LX);
                let night = Dimming::new(L2A_MAX, NIGHT_LX, &calibration);
                let known = self.known.map(dimmed);
                known.filter(|known| known.luminance_cd_m2 < night.luminance_cd_m2).or(Some(night))
            }
        };
        if let Some(dimming) = dimming {
            self.matrix.set_duty(self.duty_shown(dimming.duty))?;
            self.hold_test();
            self.dimming = Some(dimming);
        }
        Ok(dimming)
    }
}

/// Counts up to the greatest number of the type.
fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}

impl<M> Transmitter<M> {
    /// The ambient illuminance E, lx; `None` before the first reading.
    pub fn illuminance_lx(&self) -> Option<Illuminance> {
        self.ambient.illuminance_lx()
    }

    /// The panel's brightness, and the reason for it; `None` before the first reading.
    pub fn dimming(&self) -> Option<Dimming> {
        self.dimming
    }

    /// The range for the next reading of the light sensor.
    pub fn next_range(&self) -> SensorRange {
        self.test.map_or_else(|| self.light_watch.next_range(), |test| test.next_range)
    }

    /// The light sensor's latest reading in each range, as an answer.
    pub fn sensor(&self) -> Answer<'static> {
        let [operating, cross_check] = self.samples;
        Answer::Sensor { operating, cross_check }
    }

    /// The current faults.
    pub fn faults(&self) -> Faults {
        self.faults.union(self.light_watch.faults())
    }

    /// The transmitter's status; the serial port's own counters are 0.
    pub fn status(&self) -> Status {
        let (l2a, luminance_cd_m2, duty) = self
            .dimming
            .map_or_else(Default::default, |dimming| (dimming.l2a, dimming.luminance_cd_m2, dimming.duty));
        Status {
            uptime_s: u32::try_from(self.now_ms / 1000).unwrap_or(u32::MAX),
            light: self.light_watch.light(),
            illuminance_lx: self.ambient.illuminance_lx(),
            l2a,
            luminance_cd_m2,
            duty,
            limited: self.dimming.and_then(|dimming| dimming.limited),
            faults: self.faults(),
            table_crc: self.table.crc(),
            sending: self.schedule.is_sending(),
            counters: self.counters,
        }
    }

    /// Whether the next panel is one of a message, not of a beacon.
    pub fn is_sending(&self) -> bool {
        self.schedule.is_sending()
    }

    /// The table in use.
    pub fn table(&self) -> &L2aTable {
        &self.table
    }

    /// The rate at which to call [`tick`](Self::tick).
    pub fn symbol_rate(&self) -> SymbolRate {
        self.timing.rate()
    }

    /// The symbol rate and the waveform now: in a test, panels are still.
    pub fn timing_shown(&self) -> SymbolTiming {
        match self.test {
            Some(test) if test.is_still => SymbolTiming::still(self.timing.rate()),
            _ => self.timing,
        }
    }

    /// The symbol rate and the waveform.
    pub fn timing(&self) -> SymbolTiming {
        self.timing
    }

    /// The panel's measurements.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The LEDs.
    pub fn matrix(&self) -> &M {
        &self.matrix
    }

    /// The LEDs, for preparation; only the transmitter may set their panel and duty.
    pub fn matrix_mut(&mut self) -> &mut M {
        &mut self.matrix
    }

    /// Returns the LEDs in their current state.
    pub fn release(self) -> M {
        self.matrix
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::{
        calibration::{BENCH, BENCH_FULL_DUTY_LX, Measured},
        dimming::{DUTY_ERROR, Duty},
        light_watch::{HOLD_MS, RECOVERY, STUCK_MS},
        matrix::RecordingMatrix,
    };
    use fixed::types::{I32F32, U1F31, U32F32};
    use link::{
        framing::{Deframer, Event},
        l2a_table::Interval,
        panel::SoftPanel,
    };
    use properties::prelude::*;
    use std::{boxed::Box, vec::Vec};

    const MEASURED: Measured = Measured {
        luminance_full_cd_m2: U32F32::lit("8000"),
        pwm_period_ns: 20_000,
        reflectance: U1F31::lit("0.5"),
        ..BENCH
    };

    fn transmitter<M: LedMatrix>(matrix: M) -> Transmitter<M> {
        let calibration = Calibration::new(MEASURED).unwrap();
        Transmitter::new(matrix, calibration, L2aTable::shipped(), Smoothing::default())
    }

    /// L2A 1 in the dark to 4 in the sun at interval 1, and 0.5 at interval 2.
    fn table() -> L2aTable {
        L2aTable::new(&[10.0, 10_000.0], &[1.0, 2.0], &[1.0, 0.5, 4.0, 0.5]).unwrap()
    }

    fn light(lux: u32, word: u16) -> LightSample {
        LightSample::Light {
            lux: I32F32::from_num(lux),
            word,
        }
    }

    /// A single reading.
    fn lit<M: LedMatrix>(transmitter: &mut Transmitter<M>, lux: u32) -> Result<Dimming, M::Error> {
        let now_ms = transmitter.now_ms;
        let dimming = transmitter.sense(now_ms, SensorRange::Operating, light(lux, lux as u16))?;
        Ok(dimming.expect("a reading dims"))
    }

    /// The night limit of [`MEASURED`]: 4·50 lx·0.5, cd/m².
    const NIGHT_CD_M2: f64 = 100.0;

    fn shown_cd_m2(transmitter: &Transmitter<RecordingMatrix>) -> f64 {
        transmitter.matrix().duty.to_num::<f64>() * 8000.0
    }

    const ROUNDING_CD_M2: f64 = DUTY_ERROR * 8000.0;

    /// A matrix that refuses everything while `broken`.
    #[derive(Default)]
    struct FragileMatrix {
        inner: RecordingMatrix,
        broken: bool,
    }

    #[derive(Debug, PartialEq, Eq)]
    struct Broken;

    impl FragileMatrix {
        fn intact(&mut self) -> Result<&mut RecordingMatrix, Broken> {
            if self.broken { Err(Broken) } else { Ok(&mut self.inner) }
        }
    }

    impl LedMatrix for FragileMatrix {
        type Error = Broken;

        fn show(&mut self, panel: PanelFrame) -> Result<(), Broken> {
            self.intact()?.panel = panel;
            Ok(())
        }

        fn set_duty(&mut self, duty: Duty) -> Result<(), Broken> {
            self.intact()?.duty = duty;
            Ok(())
        }
    }

    /// LEDs of a board with a ceiling of the duty.
    #[derive(Default)]
    struct Dazzling(RecordingMatrix);

    impl LedMatrix for Dazzling {
        type Error = core::convert::Infallible;

        const FULL_DUTY_LX: u32 = BENCH_FULL_DUTY_LX;

        fn show(&mut self, panel: PanelFrame) -> Result<(), Self::Error> {
            self.0.show(panel)
        }

        fn set_duty(&mut self, duty: Duty) -> Result<(), Self::Error> {
            self.0.set_duty(duty)
        }
    }

    properties! {
        /// For any calibration, table and intensity limit, however wrong.
        #[test]
        fn no_calibration_takes_the_duty_above_the_ceiling(
            full in 1.0f64..1e6, gain in 0.02f64..999.0, reflectance in 0.06f64..1.0, pulse_ns in 0u32..49_000, lux in 0u32..130_000,
        ) {
            let calibration = Calibration::new(Measured {
                luminance_full_cd_m2: U32F32::from_num(full),
                sensor_gain: fixed::types::U12F20::from_num(gain),
                reflectance: U1F31::from_num(reflectance),
                shortest_pulse_ns: pulse_ns,
                ..BENCH
            }).unwrap();
            let mut transmitter = Transmitter::new(Dazzling::default(), calibration, L2aTable::shipped(), Smoothing::default());
            let most = |lux: u32| f64::from(lux.max(50)) / f64::from(BENCH_FULL_DUTY_LX);
            let duty = |transmitter: &Transmitter<Dazzling>| transmitter.matrix().0.duty.to_num::<f64>();
            for (now_ms, lux) in [(0, 120_000), (100, lux), (200, lux), (300, 50)] {
                lit_at(&mut transmitter, now_ms, lux);
                prop_assert!(duty(&transmitter) <= most(lux), "{} at {lux} lx", duty(&transmitter));
            }
            transmitter.watch(300 + 2 * HOLD_MS).unwrap();
            prop_assert!(transmitter.status().light == Light::Lost && duty(&transmitter) <= most(50));
        }

        /// The bench's panel never needs more.
        #[test]
        fn the_ceiling_leaves_the_benchs_panel_as_it_is(lux in 0u32..130_000, l2a in 0.2f32..4.0) {
            let table = L2aTable::new(&[1.0], &[1.0], &[l2a]).unwrap();
            let calibration = Calibration::new(BENCH).unwrap();
            let mut free = Transmitter::new(RecordingMatrix::default(), calibration, table.clone(), Smoothing::default());
            let mut ceiled = Transmitter::new(Dazzling::default(), calibration, table, Smoothing::default());
            lit_at(&mut free, 0, lux);
            lit_at(&mut ceiled, 0, lux);
            prop_assert_eq!(free.dimming(), ceiled.dimming());
        }
    }

    fn lit_at<M: LedMatrix>(transmitter: &mut Transmitter<M>, now_ms: u64, lux: u32) {
        let sample = light(lux, now_ms as u16);
        assert!(transmitter.sense(now_ms, SensorRange::Operating, sample).is_ok());
    }

    #[test]
    fn it_is_dark_until_the_first_reading_or_until_it_is_clear_that_none_will_come() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        for now_ms in (0..=HOLD_MS).step_by(100) {
            assert_eq!(transmitter.sense(now_ms, SensorRange::Operating, LightSample::Missing), Ok(None));
            transmitter.tick().unwrap();
            assert_eq!(transmitter.matrix().duty, 0);
            assert_eq!(transmitter.status().light, Light::Unknown);
        }
        transmitter.watch(HOLD_MS + 100).unwrap();
        assert!((shown_cd_m2(&transmitter) - NIGHT_CD_M2).abs() < ROUNDING_CD_M2);
        let status = transmitter.status();
        assert_eq!((status.light, status.faults), (Light::Lost, Faults::SENSOR_MISSING));
    }

    #[test]
    fn a_reading_sets_the_luminance_that_the_table_wants_at_that_light_and_interval() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        transmitter.set_table(table());
        let dimming = lit(&mut transmitter, 1000).unwrap();
        // Two thirds of the decades from 1 to 4: L2A 3, L* = 3·1000·0.5, duty 1500/8000.
        assert!((dimming.l2a.to_num::<f64>() - 3.0).abs() < 0.001);
        assert!((dimming.wanted_cd_m2.to_num::<f64>() - 1500.0).abs() < 0.5);
        assert_eq!(transmitter.matrix().duty, dimming.duty);
        assert!((dimming.duty.to_num::<f64>() * 8000.0 - 1500.0).abs() < 0.5);
        assert_eq!(transmitter.dimming(), Some(dimming));
    }

    #[test]
    fn another_table_takes_effect_with_the_next_reading() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        lit(&mut transmitter, 1000).unwrap();
        let before = transmitter.matrix().duty;
        transmitter.set_table(table());
        assert_eq!(transmitter.table(), &table());
        assert_eq!(transmitter.matrix().duty, before);
        lit(&mut transmitter, 1000).unwrap();
        assert!(transmitter.matrix().duty > before);
    }

    /// Continues from 20 000 lx with `sample` in place of the sensor's, and returns the time in ms until the panel was at the night limit,
    /// and the reason.
    fn time_to_night(sample: impl Fn(u64) -> Option<LightSample>) -> (u64, Faults) {
        let mut transmitter = transmitter(RecordingMatrix::default());
        lit(&mut transmitter, 20_000).unwrap();
        assert_eq!(transmitter.matrix().duty, Duty::MAX);
        for now_ms in (100..).step_by(100) {
            match sample(now_ms) {
                Some(sample) => transmitter.sense(now_ms, transmitter.next_range(), sample),
                None => transmitter.watch(now_ms),
            }
            .unwrap();
            if (shown_cd_m2(&transmitter) - NIGHT_CD_M2).abs() < ROUNDING_CD_M2 {
                return (now_ms, transmitter.faults());
            }
            assert_eq!(transmitter.matrix().duty, Duty::MAX);
            assert!(now_ms < 10_000, "the panel stays bright");
        }
        unreachable!()
    }

    #[test]
    fn every_fault_of_the_sensor_leads_to_the_night_limit_in_its_stated_time() {
        let soon = HOLD_MS + 100;
        assert_eq!(time_to_night(|_| Some(LightSample::Missing)), (soon, Faults::SENSOR_MISSING));
        assert_eq!(time_to_night(|_| None), (soon, Faults::SENSOR_SILENT));
        assert_eq!(time_to_night(|_| Some(LightSample::Stuck)), (soon, Faults::SENSOR_STUCK));
        assert_eq!(
            time_to_night(|_| Some(light(20_000, 20_000))),
            (STUCK_MS + soon, Faults::SENSOR_STUCK)
        );
        let sometimes_saturated = |now_ms: u64| match now_ms % 200 {
            0 => LightSample::Saturated,
            _ => LightSample::Missing,
        };
        let (time_ms, _) = time_to_night(|now_ms| Some(sometimes_saturated(now_ms)));
        assert_eq!(time_ms, soon);
    }

    #[test]
    fn daylight_that_saturates_both_ranges_holds_the_tables_top() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        for now_ms in (0..60_000).step_by(100) {
            let range = transmitter.next_range();
            transmitter.sense(now_ms, range, LightSample::Saturated).unwrap();
        }
        let dimming = transmitter.dimming().unwrap();
        assert_eq!(transmitter.status().light, Light::Daylight);
        assert_eq!(dimming.l2a, transmitter.table().l2a(Illuminance::from_num(130_000), Interval::ONE));
        assert_eq!(transmitter.matrix().duty, Duty::MAX);
    }

    #[test]
    fn a_panel_below_the_night_limit_stays_there_when_light_is_lost() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        let before = lit(&mut transmitter, 30).unwrap();
        transmitter.watch(HOLD_MS + 100).unwrap();
        assert_eq!(transmitter.status().light, Light::Lost);
        assert_eq!(transmitter.matrix().duty, before.duty);
    }

    #[test]
    fn a_sensor_that_comes_back_is_believed_after_some_readings_and_the_panel_fades_in() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        lit(&mut transmitter, 20_000).unwrap();
        transmitter.watch(HOLD_MS + 100).unwrap();
        let night = transmitter.matrix().duty;
        let mut duties = Vec::new();
        for n in 1..=60 {
            let now_ms = HOLD_MS + 100 + 100 * n;
            let sample = light(20_000, n as u16);
            transmitter.sense(now_ms, SensorRange::Operating, sample).unwrap();
            duties.push(transmitter.matrix().duty);
        }
        let doubtful = usize::from(RECOVERY) - 1;
        assert!(duties[..doubtful].iter().all(|&duty| duty == night));
        assert!(duties[doubtful..].is_sorted() && duties[doubtful] < u16::MAX / 2);
        assert_eq!(duties.last(), Some(&Duty::MAX));
        assert_eq!(transmitter.faults(), Faults::empty());
    }

    #[test]
    fn what_the_leds_show_is_the_message() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        let mut deframer = Box::new(Deframer::new());
        let message = b"vehicle ahead is braking";
        transmitter
            .send(message, Code::for_length(message.len()), Repeats::Times(1))
            .unwrap();
        let mut delivered = false;
        for index in 0.. {
            if !transmitter.is_sending() {
                break;
            }
            let panel = transmitter.tick().unwrap();
            assert_eq!(transmitter.matrix().panel, panel);
            let read = SoftPanel::certain(panel, 20);
            if let Event::Delivered(delivery) = deframer.push(index, 0, &read) {
                assert_eq!(delivery.message, message);
                delivered = true;
            }
        }
        assert!(delivered);
    }

    /// LEDs that know whether panels stand still.
    #[derive(Default)]
    struct TimedMatrix {
        inner: RecordingMatrix,
        timing: SymbolTiming,
        /// The greatest duty that panels had while they stood still.
        most_still: Duty,
        is_broken: bool,
    }

    impl TimedMatrix {
        fn note(&mut self) {
            if self.timing.waveform().is_still() {
                self.most_still = self.most_still.max(self.inner.duty);
            }
        }
    }

    impl LedMatrix for TimedMatrix {
        type Error = Broken;

        fn show(&mut self, panel: PanelFrame) -> Result<(), Broken> {
            self.inner.panel = panel;
            Ok(())
        }

        fn set_duty(&mut self, duty: Duty) -> Result<(), Broken> {
            if self.is_broken {
                return Err(Broken);
            }
            self.inner.duty = duty;
            self.note();
            Ok(())
        }

        fn set_timing(&mut self, timing: SymbolTiming) {
            self.timing = timing;
            self.note();
        }
    }

    const ROW: PanelFrame = PanelFrame::from_bits(0xff);

    #[test]
    fn a_test_is_shown_for_its_time_and_messages_go_on_where_they_were() {
        let mut transmitter = transmitter(TimedMatrix::default());
        let timing = SymbolTiming::new(SymbolRate::DEFAULT, link::waveform::Waveform::new(16).unwrap()).unwrap();
        transmitter.set_timing(timing);
        transmitter.send(b"goes on", Code::Tc256, Repeats::Forever).unwrap();
        let mut undisturbed = transmitter.schedule.clone();
        lit_at(&mut transmitter, 0, 100);
        let duty = transmitter.matrix().inner.duty;
        assert_eq!(transmitter.tick(), Ok(undisturbed.next_panel()));

        transmitter.test(ROW, 51, 500).unwrap();
        // A fifth of 32/44.
        let fifth = Duty::from_bits((u64::from(duty.to_bits()) * 32 / (44 * 5)) as u32);
        assert_eq!(transmitter.matrix().inner.duty, fifth);
        assert!(transmitter.matrix().timing.waveform().is_still());
        transmitter.watch(499).unwrap();
        assert_eq!((transmitter.tick(), transmitter.matrix().inner.duty), (Ok(ROW), fifth));
        assert_eq!(transmitter.timing(), timing);
        transmitter.watch(500).unwrap();
        assert_eq!(transmitter.tick(), Ok(undisturbed.next_panel()));
        assert_eq!((transmitter.matrix().inner.duty, transmitter.matrix().timing), (duty, timing));

        transmitter.test(ROW, 255, u16::MAX).unwrap();
        let most = Duty::from_bits((u64::from(duty.to_bits()) * 32 / 44) as u32);
        assert_eq!((transmitter.tick(), transmitter.matrix().inner.duty), (Ok(ROW), most));
        transmitter.test(ROW, 255, 0).unwrap();
        assert_eq!(transmitter.tick(), Ok(undisturbed.next_panel()));
        assert_eq!(transmitter.matrix().timing, timing);
    }

    /// A panel of a message with 44 LEDs On, which the board has prepared, may stand still with a test's duty.
    #[test]
    fn with_a_carrier_no_panel_stands_still_at_more_than_its_share_of_the_duty() {
        let timing = SymbolTiming::new(SymbolRate::DEFAULT, link::waveform::Waveform::new(16).unwrap()).unwrap();
        for is_broken in [false, true] {
            let mut transmitter = transmitter(TimedMatrix::default());
            transmitter.set_timing(timing);
            lit_at(&mut transmitter, 0, 100);
            let duty = transmitter.matrix().inner.duty;
            transmitter.matrix.most_still = Duty::ZERO;
            transmitter.matrix.is_broken = is_broken;
            assert_eq!(transmitter.test(ROW, 255, 500).is_err(), is_broken);
            assert_eq!(transmitter.timing_shown().waveform().is_still(), !is_broken);
            transmitter.matrix.is_broken = false;
            transmitter.watch(100).unwrap();
            assert!(transmitter.matrix().timing.waveform().is_still());
            lit_at(&mut transmitter, 200, 100);
            transmitter.test(ROW, 255, 0).unwrap();
            let matrix = transmitter.matrix();
            assert_eq!((matrix.inner.duty, matrix.timing), (duty, timing));
            let most = duty.to_num::<f64>() * 32.0 / 44.0;
            assert!(matrix.most_still > 0 && matrix.most_still.to_num::<f64>() <= most);
        }
        // Without a carrier a message's panels stand still at their whole duty anyway.
        let mut transmitter = transmitter(TimedMatrix::default());
        lit_at(&mut transmitter, 0, 100);
        let duty = transmitter.matrix().inner.duty;
        transmitter.test(ROW, 255, 500).unwrap();
        assert_eq!(transmitter.matrix().inner.duty, duty);
    }

    #[test]
    fn a_test_is_dark_while_nothing_is_known_of_the_light_and_ends_then_too() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        transmitter.test(ROW, 255, 300).unwrap();
        assert_eq!((transmitter.tick(), transmitter.matrix().duty), (Ok(ROW), Duty::ZERO));
        transmitter.watch(300).unwrap();
        assert_eq!(transmitter.tick(), Ok(Schedule::new().next_panel()));
    }

    #[test]
    fn a_test_reads_the_sensor_in_both_ranges() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        assert_eq!(
            transmitter.sensor(),
            Answer::Sensor {
                operating: SensorReading::None,
                cross_check: SensorReading::None
            }
        );
        transmitter.test(ROW, 255, 10_000).unwrap();
        for (now_ms, word) in [(0, 1), (100, 2), (200, 1), (300, 2)] {
            let range = transmitter.next_range();
            transmitter.sense(now_ms, range, light(word.into(), word)).unwrap();
            assert_ne!(transmitter.next_range(), range);
        }
        let [one, two] = [1, 2].map(|lux| SensorReading::Light(Illuminance::from_num(lux)));
        let (operating, cross_check) = (two, one);
        assert_eq!(transmitter.sensor(), Answer::Sensor { operating, cross_check });
        transmitter.sense(400, SensorRange::CrossCheck, LightSample::Missing).unwrap();
        let cross_check = SensorReading::Missing;
        assert_eq!(transmitter.sensor(), Answer::Sensor { operating, cross_check });
        transmitter.watch(20_000).unwrap();
        assert_eq!(transmitter.next_range(), SensorRange::Operating);
    }

    #[test]
    fn a_failing_matrix_is_reported_and_costs_one_symbol_or_one_reading() {
        let mut transmitter = transmitter(FragileMatrix::default());
        let mut beacons = Schedule::new();
        let before = lit(&mut transmitter, 100).unwrap();
        assert_eq!(transmitter.tick(), Ok(beacons.next_panel()));

        transmitter.matrix.broken = true;
        assert_eq!(transmitter.tick(), Err(Broken));
        assert_eq!(transmitter.faults(), Faults::LEDS);
        assert_eq!(lit(&mut transmitter, 5000), Err(Broken));
        assert_eq!(transmitter.dimming(), Some(before));

        transmitter.matrix.broken = false;
        beacons.next_panel();
        assert_eq!(transmitter.tick(), Ok(beacons.next_panel()));
        assert_eq!(transmitter.faults(), Faults::empty());
        let after = lit(&mut transmitter, 5000).unwrap();
        assert_eq!(transmitter.matrix().inner.duty, after.duty);
        assert!(after.duty > before.duty);
    }

    /// The events of a sensor, with the time until the next one, ms.
    fn events() -> impl Strategy<Value = (u64, Option<LightSample>)> {
        let sample = prop_oneof![
            any::<(i64, u16)>().prop_map(|(bits, word)| Some(LightSample::Light {
                lux: I32F32::from_bits(bits),
                word
            })),
            (0u32..100_000, any::<u16>()).prop_map(|(lux, word)| Some(light(lux, word))),
            Just(Some(LightSample::Saturated)),
            Just(Some(LightSample::Stuck)),
            Just(Some(LightSample::Missing)),
            Just(None),
        ];
        (0u64..3000, sample)
    }

    properties! {
        #[test]
        fn whatever_the_sensor_says_the_panel_keeps_to_its_l2a_or_the_night_limit(
            events in prop::collection::vec((events(), prop::option::of(any::<(u8, u16)>())), 1..80),
        ) {
            let mut transmitter = transmitter(RecordingMatrix::default());
            let mut now_ms = 0;
            for ((wait_ms, sample), test) in events {
                now_ms += wait_ms;
                match sample {
                    Some(sample) => transmitter.sense(now_ms, transmitter.next_range(), sample),
                    None => transmitter.watch(now_ms),
                }
                .unwrap();
                if let Some((share, time_ms)) = test {
                    transmitter.test(ROW, share, time_ms).unwrap();
                }
                transmitter.tick().unwrap();
                let illuminance_lx = transmitter.illuminance_lx().map_or(0.0, |lx| lx.to_num::<f64>());
                let most_cd_m2 = match transmitter.status().light {
                    Light::Unknown => 0.0,
                    Light::Measured | Light::Held | Light::Daylight => 4.0 * illuminance_lx * 0.5,
                    Light::Lost => NIGHT_CD_M2,
                };
                prop_assert!(shown_cd_m2(&transmitter) <= most_cd_m2 + ROUNDING_CD_M2);
            }
        }
    }
}
