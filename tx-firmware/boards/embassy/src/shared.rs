//! The transmitter, shared between the symbol interrupt, the light sensor and the serial ports.

use core::{cell::RefCell, convert::Infallible};

use embassy_sync::blocking_mutex::{Mutex, raw::RawMutex};
use tx_firmware::{
    matrix::LedMatrix,
    panel_ring::{LEAD, PanelOutput, PanelRing},
    service::Device,
    store::Remembered,
    transmitter::Transmitter,
};

/// LEDs whose panels wait in a ring.
pub trait Ringed: LedMatrix<Error = Infallible> {
    /// The hardware behind the ring.
    type Output: PanelOutput;

    /// The ring.
    fn ring(&mut self) -> &mut PanelRing<Self::Output>;
}

/// The transmitter, and turns at it. The lock keeps those out who share the transmitter, and lets all other interrupts come: a block is
/// encoded for 2 ms on a Cortex-M0+, and a UART holds bytes of no more than 2.8 ms.
pub struct Shared<L: RawMutex, M>(Mutex<L, RefCell<Transmitter<M>>>);

impl<L: RawMutex, M: Ringed> Shared<L, M> {
    /// Shares a transmitter with these LEDs, settings and faults.
    pub fn new(matrix: M, start: Remembered) -> Self {
        Self(Mutex::new(RefCell::new(Transmitter::from_store(matrix, start))))
    }

    /// A turn.
    pub fn with<R>(&self, work: impl FnOnce(&mut Transmitter<M>) -> R) -> R {
        self.0.lock(|transmitter| work(&mut transmitter.borrow_mut()))
    }

    /// Makes the panels ready that are shown next: for the interrupt at the beginning of a symbol, which no sharer interrupts.
    pub fn prepare_symbols(&self) {
        self.with(|transmitter| {
            transmitter.matrix_mut().ring().begin_wanted_timing();
            while prepare_one(transmitter, LEAD) {}
        });
    }

    /// Makes as many panels ready as are shown while the processor stops, with a turn for each, so that interrupts have theirs.
    pub fn prepare_for_stop(&self, stop_ms: u32) {
        let lead = self.with(|transmitter| transmitter.matrix_mut().ring().lead_before_stop(stop_ms));
        while self.with(|transmitter| prepare_one(transmitter, lead)) {}
    }
}

/// Makes a panel ready if fewer wait than `lead`, and returns whether it did.
fn prepare_one<M: Ringed>(transmitter: &mut Transmitter<M>, lead: usize) -> bool {
    let is_short = transmitter.matrix_mut().ring().is_short_of(lead);
    if is_short {
        let Ok(_) = transmitter.tick();
    }
    is_short
}

impl<L: RawMutex, M: Ringed> Device for &'static Shared<L, M> {
    type Matrix = M;

    fn read<R>(&self, read: impl FnOnce(&Transmitter<M>) -> R) -> R {
        self.with(|transmitter| read(transmitter))
    }

    fn change<R>(&mut self, change: impl FnOnce(&mut Transmitter<M>) -> R) -> R {
        self.with(change)
    }
}
