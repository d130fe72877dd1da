//! TSL2591, at its least gain: to about 75 000 lx of daylight in 200 ms, and to 85 000 lx in 100 ms, the cross-check.
//!
//! It counts the light with infrared and the infrared alone. The datasheet has no formula for lux, so this is the one of Adafruit's driver
//! (`Adafruit_TSL2591.cpp`). How much light fills a range depends on the share of infrared: the numbers above are for a quarter.
//!
//! Sunlight saturates both ranges. The count ends at 65 535 in 200 ms, but at 36 863 in 100 ms, so a register that is full and the same in
//! both is stuck.
//!
//! A register that is always 0 may also be the dark, below 1 lx. The panel dims as in the dark, which is safe, and no fault is reported.
//!
//! The commands are few and written here: the constructors of the crates for this chip drop the bus if the sensor does not answer at the
//! start.

use embedded_hal::i2c::I2c;
use fixed::types::I32F32;
use tx_firmware::{
    light_sensor::LightSensor,
    light_watch::{LightSample, SensorRange},
};

use crate::Lost;

const ADDRESS: u8 = 0x29;
const IDENTITY: u8 = 0x50;

/// TSL2591 datasheet, "Register description": an access to a register has these bits in its command.
const COMMAND: u8 = 0b1010_0000;
const ENABLE: u8 = COMMAND;
const CONTROL: u8 = COMMAND | 0x01;
const ID: u8 = COMMAND | 0x12;
const STATUS: u8 = COMMAND | 0x13;
/// Both counts, the low bytes first.
const COUNTS: u8 = COMMAND | 0x14;

const OFF: u8 = 0;
/// Oscillator and converters.
const ON: u8 = 0b11;
/// In the status: a measurement has ended since the converters were switched on.
const VALID: u8 = 1;

/// Adafruit's driver: counts a lux of light without infrared, in a millisecond at gain 1, are 1 / 408.
const LUX_MS: u64 = 408;

/// A TSL2591.
pub struct Sensor<B> {
    bus: B,
    range: SensorRange,
    /// The last count of the operating range.
    usual: u16,
    /// Whether every reading has been full since the cross-check found the same full count as the operating range.
    is_stuck: bool,
}

impl<B: I2c> Sensor<B> {
    /// The sensor on a bus. It needs no delay.
    pub fn new<D>(bus: B, _: D) -> Self {
        Self {
            bus,
            range: SensorRange::Operating,
            usual: 0,
            is_stuck: false,
        }
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), Lost> {
        self.bus.write(ADDRESS, &[register, value]).map_err(|_| Lost)
    }

    fn read<const BYTES: usize>(&mut self, register: u8) -> Result<[u8; BYTES], Lost> {
        let mut bytes = [0; BYTES];
        self.bus.write_read(ADDRESS, &[register], &mut bytes).map_err(|_| Lost)?;
        Ok(bytes)
    }

    /// Ends the measurement that runs and begins another, with the settings.
    fn measure(&mut self) -> Result<(), Lost> {
        let time = time(self.range);
        self.write(ENABLE, OFF)?;
        self.write(CONTROL, time.setting)?;
        self.write(ENABLE, ON)
    }
}

impl<B: I2c> LightSensor for Sensor<B> {
    type Error = Lost;

    fn start(&mut self, _: u64, range: SensorRange) -> Result<(), Lost> {
        // Other chips have this address, too.
        if self.read(ID)? != [IDENTITY] {
            return Err(Lost);
        }
        self.range = range;
        self.measure()
    }

    fn take(&mut self, _: u64) -> Result<Option<LightSample>, Lost> {
        let [status] = self.read(STATUS)?;
        if status & VALID == 0 {
            return Ok(None);
        }
        let [a, b, c, d] = self.read(COUNTS)?;
        let (all, infrared) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        // The status tells a new measurement from an old one only after a start.
        self.measure()?;
        let time = time(self.range);
        let is_full = all.max(infrared) >= time.full;
        match self.range {
            SensorRange::Operating => {
                self.usual = all;
                self.is_stuck &= is_full;
            }
            SensorRange::CrossCheck => self.is_stuck = is_full && all == self.usual,
        }
        Ok(Some(if self.is_stuck {
            LightSample::Stuck
        } else if is_full {
            LightSample::Saturated
        } else {
            LightSample::Light {
                lux: lux(all, infrared, time.ms),
                word: all,
            }
        }))
    }
}

/// An integration time.
struct Time {
    ms: u64,
    /// The control register, with gain 1.
    setting: u8,
    /// The count at which a converter is saturated.
    full: u16,
}

const fn time(range: SensorRange) -> Time {
    match range {
        SensorRange::Operating => Time {
            ms: 200,
            setting: 1,
            full: u16::MAX,
        },
        SensorRange::CrossCheck => Time {
            ms: 100,
            setting: 0,
            full: 36_863,
        },
    }
}

/// Adafruit's driver: (all - infrared) · (1 - infrared / all) · 408 / (time in ms · gain).
fn lux(all: u16, infrared: u16, time_ms: u64) -> I32F32 {
    /// Bits of the quotient's fraction: with more, the dividend has more than 64.
    const BITS: u32 = 16;
    let visible = u64::from(all.saturating_sub(infrared));
    let dividend = (visible * visible * LUX_MS) << BITS;
    let quotient = dividend.checked_div(u64::from(all) * time_ms).unwrap_or(0);
    I32F32::from_bits((quotient << (I32F32::FRAC_NBITS - BITS)).cast_signed())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated_bus::{Bench, Chip, NoDelay};
    use link::serial::{Faults, Light};
    use tx_firmware::{
        light_sensor::{PATIENCE_MS, PolledSensor},
        light_watch::{HOLD_MS, LightWatch, STUCK_MS},
    };

    /// A transfer of four bytes at 400 kHz.
    const TRANSFER_US: u64 = 140;
    /// The longest time that the datasheet allows for 100 ms.
    const STEP_US: u64 = 105_000;
    /// The most daylight that there can be.
    const SUN_LX: f64 = 130_000.0;
    /// A usual share of infrared in daylight.
    const DAYLIGHT: f64 = 0.25;

    /// The chip. If it hangs, it reports measurements, and its counts stay.
    struct Simulated {
        lux: f64,
        /// Infrared in all light.
        infrared: f64,
        hangs: bool,
        identity: u8,
        enable: u8,
        control: u8,
        pointer: u8,
        is_valid: bool,
        counts: [u16; 2],
        /// The end of the measurement that runs.
        ends_us: Option<u64>,
    }

    impl Simulated {
        fn in_light(lux: f64, infrared: f64) -> Self {
            Self {
                lux,
                infrared,
                hangs: false,
                identity: IDENTITY,
                enable: OFF,
                control: 0,
                pointer: 0,
                is_valid: false,
                counts: [0; 2],
                ends_us: None,
            }
        }

        fn steps(&self) -> u64 {
            u64::from(self.control) + 1
        }

        fn measure(&mut self, now_us: u64) {
            while let Some(end) = self.ends_us.filter(|&end| end <= now_us) {
                self.is_valid = true;
                if !self.hangs {
                    let full = if self.control == 0 { 36_863.0 } else { 65_535.0 };
                    let all = self.lux * 100.0 * self.steps() as f64 / 408.0 / (1.0 - self.infrared).powi(2);
                    self.counts = [all, all * self.infrared].map(|count| count.min(full) as u16);
                }
                self.ends_us = Some(end + STEP_US * self.steps());
            }
        }

        /// Its supply fails for a moment.
        fn restart(&mut self) {
            (self.enable, self.control, self.counts) = (OFF, 0, [0; 2]);
            (self.is_valid, self.ends_us) = (false, None);
        }
    }

    impl Chip for Simulated {
        const ADDRESS: u8 = ADDRESS;

        fn write(&mut self, now_us: u64, bytes: &[u8]) {
            self.measure(now_us);
            self.pointer = bytes[0];
            match *bytes {
                [ENABLE, OFF] => (self.enable, self.is_valid, self.ends_us) = (OFF, false, None),
                [ENABLE, ON] => {
                    self.enable = ON;
                    self.ends_us = self.ends_us.or(Some(now_us + STEP_US * self.steps()));
                }
                // Gain 1, at 100 or 200 ms.
                [CONTROL, control @ 0..=1] if self.enable == OFF => self.control = control,
                [_] => {}
                _ => panic!("{bytes:x?} is not a command"),
            }
        }

        fn read(&mut self, now_us: u64, buffer: &mut [u8]) {
            self.measure(now_us);
            let [all, infrared] = self.counts.map(u16::to_le_bytes);
            match self.pointer {
                ID => buffer.copy_from_slice(&[self.identity]),
                STATUS => buffer.copy_from_slice(&[u8::from(self.is_valid)]),
                COUNTS => buffer.copy_from_slice([all, infrared].as_flattened()),
                other => panic!("{other:x} is not read by this driver"),
            }
        }
    }

    fn bench(lux: f64, infrared: f64) -> Bench<Simulated> {
        Bench::new(Simulated::in_light(lux, infrared), TRANSFER_US)
    }

    #[test]
    fn a_register_that_hangs_is_stuck_and_so_is_a_full_one() {
        for lux in [0.0, 5_000.0, 60_000.0, 80_000.0, SUN_LX] {
            for count in [0x1234, 32_000, 36_863, 37_888, 40_000, u16::MAX] {
                let bench = bench(lux, DAYLIGHT);
                let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
                bench.follow(&mut sensor, &mut watch, 10_000, |_, _, _| {});
                assert!(matches!(watch.light(), Light::Measured | Light::Daylight), "{lux} lx");
                let mut chip = bench.chip.borrow_mut();
                (chip.hangs, chip.counts) = (true, [count, count / 4]);
                drop(chip);
                bench.follow(&mut sensor, &mut watch, 11_000 + STUCK_MS + HOLD_MS, |_, _, _| {});
                let stuck = (Light::Lost, Faults::SENSOR_STUCK);
                assert_eq!((watch.light(), watch.faults()), stuck, "{count} at {lux} lx");
                bench.follow(&mut sensor, &mut watch, 40_000, |now_ms, _, watch| {
                    assert_eq!((watch.light(), watch.faults()), stuck, "{count} at {lux} lx, {now_ms} ms");
                });
                bench.chip.borrow_mut().hangs = false;
                bench.follow(&mut sensor, &mut watch, 45_000, |_, _, _| {});
                assert!(matches!(watch.light(), Light::Measured | Light::Daylight), "{lux} lx");
            }
        }
    }

    #[test]
    fn steady_light_and_the_dark_are_measured_and_never_stuck() {
        for lux in [0.0, 0.4, 1.2, 50.0, 5_000.0, 60_000.0, 80_000.0] {
            let bench = bench(lux, DAYLIGHT);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            bench.follow(&mut sensor, &mut watch, 1_000, |_, _, _| {});
            bench.follow(&mut sensor, &mut watch, 60_000, |now_ms, sample, watch| {
                let known = (Light::Measured, Faults::empty());
                assert_eq!((watch.light(), watch.faults()), known, "{lux} lx at {now_ms} ms");
                assert_ne!(sample, LightSample::Stuck, "{lux} lx at {now_ms} ms");
            });
        }
    }

    #[test]
    fn sunlight_that_fills_both_ranges_is_daylight() {
        for (lux, infrared) in [(SUN_LX, DAYLIGHT), (90_000.0, DAYLIGHT), (50_000.0, 0.5)] {
            let bench = bench(lux, infrared);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            bench.follow(&mut sensor, &mut watch, 1_000, |_, _, _| {});
            bench.follow(&mut sensor, &mut watch, 60_000, |now_ms, sample, watch| {
                assert_eq!(sample, LightSample::Saturated, "{lux} lx at {now_ms} ms");
                let known = (Light::Daylight, Faults::empty());
                assert_eq!((watch.light(), watch.faults()), known, "{lux} lx at {now_ms} ms");
            });
        }
    }

    /// A measurement from before a change of range would show another illuminance, by the ratio of the times.
    #[test]
    fn no_measurement_is_read_before_its_end() {
        for (lux, infrared) in [(100.0, 0.0), (1_000.0, 0.6), (5_000.0, DAYLIGHT), (80_000.0, DAYLIGHT)] {
            let bench = bench(lux, infrared);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            let mut ranges = 0;
            bench.follow(&mut sensor, &mut watch, 20_000, |now_ms, sample, watch| {
                ranges |= 1 << watch.next_range() as u8;
                match sample {
                    LightSample::Light { lux: read, .. } => {
                        assert!((read.to_num::<f64>() / lux - 1.0).abs() < 0.05, "{read} lx of {lux} at {now_ms} ms");
                    }
                    other => assert!(other == LightSample::Saturated && lux > 75_000.0, "{other:?} at {now_ms} ms"),
                }
            });
            assert_eq!(ranges, 0b11);
        }
    }

    #[test]
    fn a_sensor_is_missing_without_measurements_and_if_another_chip_answers() {
        let bench = bench(5_000.0, DAYLIGHT);
        let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
        bench.follow(&mut sensor, &mut watch, 1_000, |_, _, _| {});
        assert_eq!(watch.light(), Light::Measured);
        bench.chip.borrow_mut().restart();
        bench.follow(&mut sensor, &mut watch, 1_100 + PATIENCE_MS, |_, _, _| {});
        assert_eq!((watch.light(), watch.faults()), (Light::Held, Faults::SENSOR_MISSING));
        bench.follow(&mut sensor, &mut watch, 2_000, |_, _, _| {});
        assert_eq!(watch.light(), Light::Measured);
        let mut chip = bench.chip.borrow_mut();
        chip.identity = 0x44;
        chip.restart();
        drop(chip);
        bench.follow(&mut sensor, &mut watch, 3_000 + PATIENCE_MS + HOLD_MS, |_, _, _| {});
        assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_MISSING));
    }

    #[test]
    fn more_infrared_than_light_is_dark() {
        for (all, infrared) in [(0, 0), (0, 7), (7, 7), (7, u16::MAX)] {
            assert_eq!(lux(all, infrared, 200), I32F32::ZERO);
        }
        let most = lux(u16::MAX, 0, 100).to_num::<f64>();
        assert!((most / (65_535.0 * 4.08) - 1.0).abs() < 1e-6);
    }
}
