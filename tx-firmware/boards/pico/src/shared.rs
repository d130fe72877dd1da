//! The transmitter, shared between the symbol interrupt, the light sensor and the serial ports.

use core::{cell::RefCell, convert::Infallible};

use embassy_rp::interrupt::{Interrupt, InterruptExt};
use embassy_sync::{
    blocking_mutex::{Mutex, raw::RawMutex},
    once_lock::OnceLock,
};
use link::{l2a_table::L2aTable, panel::PanelFrame, serial::Measured, waveform::SymbolTiming};
use tx_firmware::{
    ambient::Smoothing, calibration::Calibration, dimming::Duty, matrix::LedMatrix, service::Device, transmitter::Transmitter,
};

use crate::{
    leds::{Dimmer, FULL_DUTY_LX, IMAGES},
    symbols::{LEAD, Symbols},
};

/// The LEDs.
pub struct Panel {
    pub symbols: Symbols,
    pub dimmer: Dimmer,
}

impl LedMatrix for Panel {
    type Error = Infallible;

    const SHOWS_CARRIER: bool = IMAGES > 1;
    const FULL_DUTY_LX: u32 = FULL_DUTY_LX;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Infallible> {
        self.symbols.push(&self.dimmer.entry(panel));
        Ok(())
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Infallible> {
        self.dimmer.set(duty, &self.symbols);
        Ok(())
    }

    fn set_calibration(&mut self, measured: &Measured) {
        self.dimmer.set_calibration(measured);
    }

    fn set_timing(&mut self, timing: SymbolTiming) {
        self.symbols.set_timing(timing);
    }
}

/// The transmitter, and turns at it.
pub struct Shared(Mutex<AmongSharers, RefCell<Transmitter<Panel>>>);

/// Keeps those out who share the transmitter, and lets all other interrupts come: a block is encoded for 2 ms, and the UART's controller
/// holds bytes of 2.8 ms.
struct AmongSharers;

/// The symbol interrupt, and that of the serial ports' executor. All else that shares the transmitter is at thread level.
const SHARERS: [Interrupt; 2] = [Interrupt::DMA_IRQ_1, Interrupt::SWI_IRQ_0];

#[allow(unsafe_code)]
// SAFETY: one core runs this program. Whoever has the lock is at thread level or in one of the sharers' interrupts, and while it has it
// neither of these begins; so none is interrupted by another one.
unsafe impl RawMutex for AmongSharers {
    const INIT: Self = Self;

    fn lock<R>(&self, work: impl FnOnce() -> R) -> R {
        let enabled = keep_sharers_out();
        let result = work();
        let_sharers_in(enabled);
        result
    }
}

/// Which of them were let in before. Neither this nor the other is inlined: turns are taken in many places.
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

impl Shared {
    /// Puts the transmitter where all can reach it.
    pub fn install(panel: Panel, calibration: Calibration, table: L2aTable, timing: SymbolTiming) -> &'static Self {
        SHARED.get_or_init(|| {
            let mut transmitter = Transmitter::new(panel, calibration, table, Smoothing::default());
            transmitter.set_timing(timing);
            Self(Mutex::new(RefCell::new(transmitter)))
        })
    }

    /// The transmitter, once it is installed.
    pub fn get() -> Option<&'static Self> {
        SHARED.try_get()
    }

    /// A turn.
    pub fn with<R>(&self, work: impl FnOnce(&mut Transmitter<Panel>) -> R) -> R {
        self.0.lock(|transmitter| work(&mut transmitter.borrow_mut()))
    }

    /// Makes the panels ready that are shown next, when one was loaded.
    pub fn prepare_symbols(&self) {
        self.with(|transmitter| transmitter.matrix_mut().symbols.begin_wanted_timing());
        self.prepare(LEAD);
    }

    /// Makes as many panels ready as are shown while the flash stops the processor.
    pub fn prepare_for_stop(&self) {
        self.prepare(self.with(|transmitter| transmitter.matrix().symbols.lead_before_stop()));
    }

    /// A turn for each panel, so that interrupts have theirs.
    fn prepare(&self, lead: usize) {
        let prepare_one = |transmitter: &mut Transmitter<Panel>| {
            let short = transmitter.matrix_mut().symbols.is_short_of(lead);
            if short {
                let Ok(_) = transmitter.tick();
            }
            short
        };
        while self.with(prepare_one) {}
    }
}

impl Device for &'static Shared {
    type Matrix = Panel;

    fn read<R>(&self, read: impl FnOnce(&Transmitter<Panel>) -> R) -> R {
        self.with(|transmitter| read(transmitter))
    }

    fn change<R>(&mut self, change: impl FnOnce(&mut Transmitter<Panel>) -> R) -> R {
        self.with(change)
    }
}
