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

/// LEDs that take their panels from a ring.
pub trait RingMatrix: LedMatrix<Error = Infallible> {
    /// The hardware behind the ring.
    type Output: PanelOutput;

    /// The ring.
    fn ring(&mut self) -> &mut PanelRing<Self::Output>;
}

/// The transmitter, behind a lock. The lock masks only the interrupts that share the transmitter, because encoding a block takes
/// 2 ms on a Cortex-M0+, and a UART buffers at most 2.8 ms of bytes.
pub struct Shared<L: RawMutex, M>(Mutex<L, RefCell<Transmitter<M>>>);

impl<L: RawMutex, M: RingMatrix> Shared<L, M> {
    /// Shares a transmitter with these LEDs, settings and faults.
    pub fn new(matrix: M, start: Remembered) -> Self {
        Self(Mutex::new(RefCell::new(Transmitter::from_store(matrix, start))))
    }

    /// Runs `work` with the transmitter locked.
    pub fn with<R>(&self, work: impl FnOnce(&mut Transmitter<M>) -> R) -> R {
        self.0.lock(|transmitter| work(&mut transmitter.borrow_mut()))
    }

    /// Prepares the next panels. Call it from the interrupt at the beginning of a symbol, which no other user of the transmitter
    /// interrupts.
    pub fn prepare_symbols(&self) {
        self.with(|transmitter| {
            transmitter.matrix_mut().ring().begin_wanted_timing();
            while prepare_one(transmitter, LEAD) {}
        });
    }

    /// Prepares the panels that are shown while the processor stops. It locks the transmitter for each panel, so that interrupts can run in
    /// between.
    pub fn prepare_for_stop(&self, stop_ms: u32) {
        let lead = self.with(|transmitter| transmitter.matrix_mut().ring().lead_before_stop(stop_ms));
        while self.with(|transmitter| prepare_one(transmitter, lead)) {}
    }
}

/// Prepares a panel if fewer than `lead` wait, and returns whether it did.
fn prepare_one<M: RingMatrix>(transmitter: &mut Transmitter<M>, lead: usize) -> bool {
    let is_short = transmitter.matrix_mut().ring().is_short_of(lead);
    if is_short {
        let Ok(_) = transmitter.tick();
    }
    is_short
}

impl<L: RawMutex, M: RingMatrix> Device for &'static Shared<L, M> {
    type Matrix = M;

    fn read<R>(&self, read: impl FnOnce(&Transmitter<M>) -> R) -> R {
        self.with(|transmitter| read(transmitter))
    }

    fn change<R>(&mut self, change: impl FnOnce(&mut Transmitter<M>) -> R) -> R {
        self.with(change)
    }
}
