//! The transmitter, shared between the symbol interrupt, the light sensor and the serial ports.

use core::convert::Infallible;

use embassy_rp::interrupt::{Interrupt, InterruptExt};
use embassy_sync::{blocking_mutex::raw::RawMutex, once_lock::OnceLock};
use link::{panel::PanelFrame, serial::Measured, waveform::SymbolTiming};
use on_embassy::shared::RingMatrix;
use tx_firmware::{dimming::Duty, matrix::LedMatrix, panel_ring::PanelRing, store::Remembered};

use crate::{
    leds::{Dimmer, FULL_DUTY_LX, IMAGES},
    symbols::Symbols,
};

/// The LEDs.
pub struct Panel {
    pub ring: PanelRing<Symbols>,
    pub dimmer: Dimmer,
}

impl LedMatrix for Panel {
    type Error = Infallible;

    const SHOWS_CARRIER: bool = IMAGES > 1;
    const FULL_DUTY_LX: u32 = FULL_DUTY_LX;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Infallible> {
        self.ring.push(&self.dimmer.entry(panel));
        Ok(())
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Infallible> {
        self.dimmer.set(duty, self.ring.output());
        Ok(())
    }

    fn set_calibration(&mut self, measured: &Measured) {
        self.dimmer.set_calibration(measured);
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

/// The transmitter, behind a lock.
pub type Shared = on_embassy::shared::Shared<AmongSharers, Panel>;

/// Masks only the interrupts that share the transmitter.
pub struct AmongSharers;

/// The symbol interrupt, and that of the serial ports' executor. All other users of the transmitter are at thread level.
const SHARERS: [Interrupt; 2] = [Interrupt::DMA_IRQ_1, Interrupt::SWI_IRQ_0];

#[allow(unsafe_code)]
// SAFETY: one core runs this program. The holder of the lock is at thread level or in one of these interrupts, and while it is held,
// neither of them begins; so no holder interrupts another.
unsafe impl RawMutex for AmongSharers {
    const INIT: Self = Self;

    fn lock<R>(&self, work: impl FnOnce() -> R) -> R {
        let enabled = keep_sharers_out();
        let result = work();
        let_sharers_in(enabled);
        result
    }
}

/// Returns which of them were enabled before. Neither this nor the other is inlined, because the lock is taken in many places.
#[inline(never)]
fn keep_sharers_out() -> [bool; SHARERS.len()] {
    let enabled = SHARERS.map(InterruptExt::is_enabled);
    SHARERS.into_iter().for_each(InterruptExt::disable);
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    enabled
}

#[inline(never)]
#[allow(unsafe_code)]
fn let_sharers_in(enabled: [bool; SHARERS.len()]) {
    for (sharer, _) in SHARERS.into_iter().zip(enabled).filter(|(_, is_enabled)| *is_enabled) {
        // SAFETY: it was enabled when the lock was taken.
        unsafe { sharer.enable() }
    }
}

static SHARED: OnceLock<Shared> = OnceLock::new();

/// Installs the transmitter for all its users.
pub fn install(panel: Panel, start: Remembered) -> &'static Shared {
    SHARED.get_or_init(|| Shared::new(panel, start))
}

/// The transmitter, once it is installed.
pub fn get() -> Option<&'static Shared> {
    SHARED.try_get()
}
