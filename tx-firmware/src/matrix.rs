//! The trait of LED hardware.

use fixed::types::U0F32;
use link::{panel::PanelFrame, serial::Measured, symbol_rate::SymbolRate, waveform::SymbolTiming};

/// The share of full luminance of a panel, 0 to 1; the greatest number of its type means 1.
pub type Duty = U0F32;

/// 64 LEDs that can be switched as one panel and dimmed together.
///
/// An implementation guarantees three things:
///
/// - it is dark from its construction until it has got both a panel and a duty;
/// - a panel appears on all LEDs at once (within a small part of the camera's exposure time), or, if the hardware scans its rows, in scans
///   so short that an exposure holds many whole ones;
/// - the light of an On LED is proportional to the duty, and an exposure holds many whole periods of the dimming.
///
/// ## A whole driver
///
/// A panel on the two halves of a 64-bit output port, its brightness set through a PWM channel.
/// [`ShiftRegisterPanel`] is the driver of a real one.
///
/// ```
/// use embedded_hal::pwm::SetDutyCycle;
/// use link::panel::PanelFrame;
/// use tx_firmware::{dimming::{Duty, duty_cycle}, matrix::LedMatrix};
///
/// struct PortPanel<'a, P> {
///     port: &'a mut [u32; 2],
///     brightness: P,
/// }
///
/// impl<'a, P: SetDutyCycle> PortPanel<'a, P> {
///     fn new(port: &'a mut [u32; 2], mut brightness: P) -> Result<Self, P::Error> {
///         brightness.set_duty_cycle_fully_off()?;
///         *port = [0, 0];
///         Ok(Self { port, brightness })
///     }
/// }
///
/// impl<P: SetDutyCycle> LedMatrix for PortPanel<'_, P> {
///     type Error = P::Error;
///
///     fn show(&mut self, panel: PanelFrame) -> Result<(), P::Error> {
///         *self.port = [panel.bits() as u32, (panel.bits() >> 32) as u32];
///         Ok(())
///     }
///
///     fn set_duty(&mut self, duty: Duty) -> Result<(), P::Error> {
///         let steps = duty_cycle(duty, self.brightness.max_duty_cycle());
///         self.brightness.set_duty_cycle(steps)
///     }
/// }
/// # use embedded_hal_mock::eh1::pwm::{Mock, Transaction};
/// # let duties = [Transaction::set_duty_cycle(0), Transaction::max_duty_cycle(1000), Transaction::set_duty_cycle(500)];
/// # let mut brightness = Mock::new(&duties);
/// # let mut port = [9, 9];
/// # let mut panel = PortPanel::new(&mut port, brightness.clone()).unwrap();
/// # panel.set_duty(Duty::lit("0.5")).unwrap();
/// # panel.show(PanelFrame::from_bits(0x0000_0001_8000_0000)).unwrap();
/// # assert_eq!(port, [0x8000_0000, 1]);
/// # brightness.done();
/// ```
///
/// [`ShiftRegisterPanel`]: crate::shift_register::ShiftRegisterPanel
pub trait LedMatrix {
    /// The error of the hardware.
    type Error;

    /// Whether it shows each panel with the carrier of [`set_timing`](Self::set_timing), if there is one: that needs LEDs that all change
    /// at once, four times a cycle.
    const SHOWS_CARRIER: bool = false;

    /// The symbol rate and the waveform until others are stored: a carrier, whose flicker nobody sees, if these LEDs can show one.
    const DEFAULT_TIMING: SymbolTiming = if Self::SHOWS_CARRIER {
        SymbolTiming::CARRIER
    } else {
        SymbolTiming::still(SymbolRate::DEFAULT)
    };

    /// The illuminance from which on these LEDs may have full duty, lx as the sensor itself reads it: [`ceiling`](crate::dimming::ceiling).
    /// So a calibration without measurements does not dazzle. 0 for LEDs that may have full duty in the dark.
    const FULL_DUTY_LX: u32 = 0;

    /// Shows `panel` until the next call: bit 8·row + column is the LED of that row and column, as seen by the camera.
    ///
    /// # Errors
    /// If the hardware did not accept the panel; it may show the old one, the new one or a mixture.
    fn show(&mut self, panel: PanelFrame) -> Result<(), Self::Error>;

    /// Sets the share of full luminance of On LEDs: 0 is dark, [`Duty::MAX`] is full.
    ///
    /// # Errors
    /// If the hardware did not accept the duty; it may still have the old one.
    fn set_duty(&mut self, duty: Duty) -> Result<(), Self::Error>;

    /// Sets the panel's measurements, which later duties assume.
    fn set_calibration(&mut self, _: &Measured) {}

    /// Sets the symbol rate and the waveform, from one of the next panels on.
    fn set_timing(&mut self, _: SymbolTiming) {}
}

/// A borrowed matrix is a matrix.
impl<M: LedMatrix + ?Sized> LedMatrix for &mut M {
    type Error = M::Error;

    const SHOWS_CARRIER: bool = M::SHOWS_CARRIER;
    const DEFAULT_TIMING: SymbolTiming = M::DEFAULT_TIMING;
    const FULL_DUTY_LX: u32 = M::FULL_DUTY_LX;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Self::Error> {
        (**self).show(panel)
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Self::Error> {
        (**self).set_duty(duty)
    }

    fn set_calibration(&mut self, measured: &Measured) {
        (**self).set_calibration(measured);
    }

    fn set_timing(&mut self, timing: SymbolTiming) {
        (**self).set_timing(timing);
    }
}

/// A matrix without LEDs: it records its last values, for simulations and tests.
///
/// ```
/// use link::panel::PanelFrame;
/// use tx_firmware::dimming::Duty;
/// use tx_firmware::matrix::{LedMatrix, RecordingMatrix};
///
/// let mut matrix = RecordingMatrix::default();
/// matrix.show(PanelFrame::from_bits(0xff)).unwrap();
/// matrix.set_duty(Duty::lit("0.25")).unwrap();
/// assert!(matrix.panel.count_on() == 8 && matrix.duty == 0.25);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordingMatrix {
    /// The panel shown last; all Off at first.
    pub panel: PanelFrame,
    /// The duty set last; 0 at first.
    pub duty: Duty,
}

impl LedMatrix for RecordingMatrix {
    type Error = core::convert::Infallible;

    /// The code that inspects it knows the waveform.
    const SHOWS_CARRIER: bool = true;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Self::Error> {
        self.panel = panel;
        Ok(())
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Self::Error> {
        self.duty = duty;
        Ok(())
    }
}
