//! The transmitter, shared between the symbol interrupt and the program.

use core::convert::Infallible;

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_sync::{blocking_mutex::raw::RawMutex, once_lock::OnceLock};
use link::{panel::PanelFrame, serial::Measured, waveform::SymbolTiming};
use on_embassy::shared::RingMatrix;
use tx_firmware::{dimming::Duty, drive::Dimmer, matrix::LedMatrix, panel_ring::PanelRing, store::Remembered};

use crate::{leds, symbols::Symbols};

/// The LEDs.
pub struct Panel {
    pub ring: PanelRing<Symbols>,
    pub dimmer: Dimmer<leds::Lines>,
}

impl LedMatrix for Panel {
    type Error = Infallible;

    const FULL_DUTY_LX: u32 = leds::FULL_DUTY_LX;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Infallible> {
        self.ring.push(&leds::entry(panel));
        Ok(())
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Infallible> {
        self.dimmer.set(duty);
        Ok(())
    }

    fn set_calibration(&mut self, measured: &Measured) {
        self.dimmer.set_drive(leds::drive(measured));
    }

    fn set_timing(&mut self, timing: SymbolTiming) {
        self.ring.set_timing(timing);
    }
}

impl RingMatrix for Panel {
    type Output = Symbols;

    fn ring(&mut self) -> &mut PanelRing<Symbols> {
        &mut self.ring
    }
}

/// Masks the symbol interrupt only.
pub struct AmongSharers;

#[allow(unsafe_code)]
// SAFETY: one core runs this program. The holder of the lock is at thread level or in the symbol interrupt, which does not begin
// while the lock is held; so neither interrupts the other.
unsafe impl RawMutex for AmongSharers {
    const INIT: Self = Self;

    fn lock<R>(&self, work: impl FnOnce() -> R) -> R {
        let was_enabled = interrupt::LPTIM1.is_enabled();
        interrupt::LPTIM1.disable();
        cortex_m::asm::dsb();
        cortex_m::asm::isb();
        let result = work();
        if was_enabled {
            // SAFETY: it was enabled when the lock was taken.
            unsafe { interrupt::LPTIM1.enable() }
        }
        result
    }
}

pub type Shared = on_embassy::shared::Shared<AmongSharers, Panel>;

static SHARED: OnceLock<Shared> = OnceLock::new();

/// Installs the transmitter for all its users.
pub fn install(panel: Panel, start: Remembered) -> &'static Shared {
    SHARED.get_or_init(|| Shared::new(panel, start))
}

/// The transmitter, once it is installed.
pub fn get() -> Option<&'static Shared> {
    SHARED.try_get()
}
