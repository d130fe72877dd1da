//! The whole transmitter, but for its timers.

use fixed::types::I32F32;
use link::{
    fec::Code,
    framing::FramingError,
    l2a_table::{Illuminance, L2aTable},
    panel::PanelFrame,
};

use crate::{
    ambient::{Ambient, Smoothing},
    calibration::Calibration,
    dimming::Dimming,
    matrix::LedMatrix,
    schedule::{Repeats, Schedule},
};

/// Light in, panels out: what a board's program calls from its two timers, and a simulator from its
/// own clock.
///
/// - once a sensor period, [`sense`](Self::sense) with the reading, or [`miss`](Self::miss) when
///   there was none: dims the panel;
/// - once a symbol, [`tick`](Self::tick): shows the next panel;
/// - whenever there is something to say, [`send`](Self::send).
///
/// Until the first reading the panel stays dark: there is no telling how bright it may be.
///
/// ```
/// use fixed::types::{I32F32, U1F31, U12F20, U32F32};
/// use link::{fec::Code, l2a_table::{Interval, L2aTable}};
/// use tx_firmware::{
///     ambient::Smoothing,
///     calibration::{Calibration, Measured},
///     matrix::RecordingMatrix,
///     schedule::Repeats,
///     transmitter::Transmitter,
/// };
///
/// let calibration = Calibration::new(Measured {
///     luminance_full_cd_m2: U32F32::lit("8000"),
///     shortest_pulse_ns: 100,
///     pwm_period_ns: 20_000,
///     reflectance: U1F31::lit("0.4"),
///     interval: Interval::lit("1"),
///     sensor_gain: U12F20::lit("1"),
/// })?;
/// let matrix = RecordingMatrix::default();
/// let mut transmitter =
///     Transmitter::new(matrix, calibration, L2aTable::shipped(), Smoothing::default());
///
/// transmitter.send(b"ice ahead", Code::for_length(9), Repeats::Forever)?;
/// transmitter.sense(I32F32::lit("2000"))?;
/// let panel = transmitter.tick()?;
///
/// assert_eq!(transmitter.matrix().panel, panel);
/// assert!(transmitter.matrix().duty > 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Transmitter<M> {
    matrix: M,
    calibration: Calibration,
    table: L2aTable,
    ambient: Ambient,
    schedule: Schedule,
    dimming: Option<Dimming>,
}

impl<M: LedMatrix> Transmitter<M> {
    /// A transmitter that has seen no light and beacons, on a `matrix` that is dark.
    pub fn new(matrix: M, calibration: Calibration, table: L2aTable, smoothing: Smoothing) -> Self {
        let ambient = Ambient::new(calibration.measured().sensor_gain, smoothing);
        Self {
            matrix,
            calibration,
            table,
            ambient,
            schedule: Schedule::new(),
            dimming: None,
        }
    }

    /// Takes a reading of the light sensor, in lux before its gain, and dims the panel to the
    /// light.
    ///
    /// # Errors
    /// Of the matrix, which then may not have the new duty; the next reading tries again.
    pub fn sense(&mut self, reading_lx: I32F32) -> Result<Dimming, M::Error> {
        let illuminance_lx = self.ambient.sense(reading_lx);
        self.dim(illuminance_lx)
    }

    /// Notes that a reading did not come: the panel keeps its luminance at first, and dims down if
    /// the sensor stays away. None before the first reading ever.
    ///
    /// # Errors
    /// As [`sense`](Self::sense).
    pub fn miss(&mut self) -> Result<Option<Dimming>, M::Error> {
        match self.ambient.miss() {
            Some(illuminance_lx) => self.dim(illuminance_lx).map(Some),
            None => Ok(None),
        }
    }

    /// Shows the panel of the next symbol, and returns it.
    ///
    /// # Errors
    /// Of the matrix; the symbol is then lost, and the next call goes on with the one after it.
    pub fn tick(&mut self) -> Result<PanelFrame, M::Error> {
        let panel = self.schedule.next_panel();
        self.matrix.show(panel)?;
        Ok(panel)
    }

    /// Shows `message` (1 to 1024 bytes) under `code` from the next symbol on, see
    /// [`Schedule::send`].
    ///
    /// # Errors
    /// [`FramingError`] when the message is empty or too long; what is being shown then goes on.
    pub fn send(
        &mut self,
        message: &[u8],
        code: Code,
        repeats: Repeats,
    ) -> Result<(), FramingError> {
        self.schedule.send(message, code, repeats)
    }

    /// Beacons from the next symbol on.
    pub fn stop(&mut self) {
        self.schedule.stop();
    }

    /// Puts another table in place; it takes effect with the next reading.
    pub fn set_table(&mut self, table: L2aTable) {
        self.table = table;
    }

    fn dim(&mut self, illuminance_lx: Illuminance) -> Result<Dimming, M::Error> {
        let interval = self.calibration.measured().interval.saturating_to_num();
        let l2a = self
            .table
            .l2a(illuminance_lx.saturating_to_num(), interval)
            .to_num();
        let dimming = Dimming::new(l2a, illuminance_lx, &self.calibration);
        self.matrix.set_duty(dimming.duty)?;
        self.dimming = Some(dimming);
        Ok(dimming)
    }
}

impl<M> Transmitter<M> {
    /// The ambient illuminance E, lx; none before the first reading.
    pub fn illuminance_lx(&self) -> Option<Illuminance> {
        self.ambient.illuminance_lx()
    }

    /// How bright the panel is, and why; none before the first reading.
    pub fn dimming(&self) -> Option<Dimming> {
        self.dimming
    }

    /// Whether the next panel is one of a message, not of a beacon.
    pub fn is_sending(&self) -> bool {
        self.schedule.is_sending()
    }

    /// The table in use.
    pub fn table(&self) -> &L2aTable {
        &self.table
    }

    /// What was measured of the panel.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The LEDs.
    pub fn matrix(&self) -> &M {
        &self.matrix
    }

    /// Gives the LEDs back, as they are lit.
    pub fn release(self) -> M {
        self.matrix
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::{
        ambient::MISSES_HELD, calibration::Measured, dimming::Limit, matrix::RecordingMatrix,
    };
    use fixed::types::{U1F31, U12F20, U32F32};
    use link::{
        framing::{Deframer, Event},
        l2a_table::Interval,
        panel::SoftPanel,
    };
    use proptest::prelude::*;
    use std::{boxed::Box, vec::Vec};

    const MEASURED: Measured = Measured {
        luminance_full_cd_m2: U32F32::lit("8000"),
        shortest_pulse_ns: 100,
        pwm_period_ns: 20_000,
        reflectance: U1F31::lit("0.5"),
        interval: Interval::ONE,
        sensor_gain: U12F20::ONE,
    };

    fn transmitter<M: LedMatrix>(matrix: M) -> Transmitter<M> {
        let calibration = Calibration::new(MEASURED).unwrap();
        Transmitter::new(
            matrix,
            calibration,
            L2aTable::shipped(),
            Smoothing::default(),
        )
    }

    /// L2A 1 in the dark to 4 in the sun at interval 1, and 0.5 at interval 2.
    fn table() -> L2aTable {
        L2aTable::new(&[10.0, 10_000.0], &[1.0, 2.0], &[1.0, 0.5, 4.0, 0.5]).unwrap()
    }

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
            if self.broken {
                Err(Broken)
            } else {
                Ok(&mut self.inner)
            }
        }
    }

    impl LedMatrix for FragileMatrix {
        type Error = Broken;

        fn show(&mut self, panel: PanelFrame) -> Result<(), Broken> {
            self.intact()?.panel = panel;
            Ok(())
        }

        fn set_duty(&mut self, fraction: u16) -> Result<(), Broken> {
            self.intact()?.duty = fraction;
            Ok(())
        }
    }

    #[test]
    fn it_is_dark_until_the_first_reading() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        for _ in 0..2 * MISSES_HELD {
            assert_eq!(transmitter.miss(), Ok(None));
            transmitter.tick().unwrap();
        }
        assert_eq!(transmitter.matrix().duty, 0);
        assert_eq!(
            (transmitter.illuminance_lx(), transmitter.dimming()),
            (None, None)
        );
    }

    #[test]
    fn a_reading_sets_the_luminance_that_the_table_wants_at_that_light_and_interval() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        transmitter.set_table(table());
        let dimming = transmitter.sense(I32F32::from_num(1000)).unwrap();
        // Two thirds of the decades from 1 to 4: L2A 3, L* = 3·1000·0.5, duty 1500/8000.
        assert!((dimming.l2a.to_num::<f64>() - 3.0).abs() < 0.001);
        assert!((dimming.wanted_cd_m2.to_num::<f64>() - 1500.0).abs() < 0.5);
        assert_eq!(transmitter.matrix().duty, dimming.duty);
        assert!((f64::from(dimming.duty) / 65_535.0 * 8000.0 - 1500.0).abs() < 0.6);
        assert_eq!(transmitter.dimming(), Some(dimming));
    }

    #[test]
    fn another_table_takes_effect_with_the_next_reading() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        transmitter.sense(I32F32::from_num(1000)).unwrap();
        let before = transmitter.matrix().duty;
        transmitter.set_table(table());
        assert_eq!(transmitter.table(), &table());
        assert_eq!(transmitter.matrix().duty, before);
        transmitter.sense(I32F32::from_num(1000)).unwrap();
        assert!(transmitter.matrix().duty > before);
    }

    #[test]
    fn a_panel_whose_sensor_is_gone_goes_dark() {
        let mut transmitter = transmitter(RecordingMatrix::default());
        transmitter.sense(I32F32::from_num(20_000)).unwrap();
        let mut duties = Vec::new();
        for _ in 0..MISSES_HELD + 200 {
            transmitter.miss().unwrap();
            duties.push(transmitter.matrix().duty);
        }
        assert!(duties.is_sorted_by(|earlier, later| earlier >= later));
        assert_eq!((duties.first(), duties.last()), (Some(&u16::MAX), Some(&0)));
        assert_eq!(transmitter.dimming().unwrap().limited, Some(Limit::Off));
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

    #[test]
    fn a_failing_matrix_is_reported_and_costs_one_symbol_or_one_reading() {
        let mut transmitter = transmitter(FragileMatrix::default());
        let mut beacons = Schedule::new();
        let before = transmitter.sense(I32F32::from_num(100)).unwrap();
        assert_eq!(transmitter.tick(), Ok(beacons.next_panel()));

        transmitter.matrix.broken = true;
        assert_eq!(transmitter.tick(), Err(Broken));
        assert_eq!(transmitter.sense(I32F32::from_num(5000)), Err(Broken));
        assert_eq!(transmitter.dimming(), Some(before));

        transmitter.matrix.broken = false;
        beacons.next_panel();
        assert_eq!(transmitter.tick(), Ok(beacons.next_panel()));
        let after = transmitter.sense(I32F32::from_num(5000)).unwrap();
        assert_eq!(transmitter.matrix().inner.duty, after.duty);
        assert!(after.duty > before.duty);
    }

    proptest! {
        #[test]
        fn whatever_the_sensor_says_the_panel_never_outshines_its_surroundings(
            readings in prop::collection::vec(any::<Option<i64>>(), 1..50),
        ) {
            let mut transmitter = transmitter(RecordingMatrix::default());
            for reading in readings {
                match reading {
                    Some(bits) => transmitter.sense(I32F32::from_bits(bits)).map(Some).unwrap(),
                    None => transmitter.miss().unwrap(),
                };
                transmitter.tick().unwrap();
                let illuminance_lx = transmitter.illuminance_lx().map_or(0.0, |lx| lx.to_num::<f64>());
                let shown_cd_m2 = f64::from(transmitter.matrix().duty) / 65_535.0 * 8000.0;
                let half_a_step = 0.5 / 65_535.0 * 8000.0;
                prop_assert!(shown_cd_m2 <= 4.0 * illuminance_lx * 0.5 + half_a_step * 1.001);
            }
        }
    }
}
