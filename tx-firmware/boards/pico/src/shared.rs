//! The transmitter, shared between the symbol interrupt, the light sensor and the serial ports.

use core::{cell::RefCell, convert::Infallible};

use embassy_sync::{
    blocking_mutex::{Mutex, raw::CriticalSectionRawMutex},
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
pub struct Shared(Mutex<CriticalSectionRawMutex, RefCell<Transmitter<Panel>>>);

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

    /// A turn, with interrupts off.
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
