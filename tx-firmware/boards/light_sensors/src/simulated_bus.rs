//! A bus in simulated time, and a board that polls its sensor.

extern crate std;

use core::cell::{Cell, RefCell};
use core::convert::Infallible;

use embedded_hal::{
    delay::DelayNs,
    i2c::{ErrorType, I2c, Operation},
};
use tx_firmware::{
    light_sensor::{LightSensor, PolledSensor},
    light_watch::{LightSample, LightWatch},
};

const POLL_US: u64 = 20_000;

/// A chip on the bus.
pub trait Chip {
    /// The chip's address.
    const ADDRESS: u8;
    /// Receives the bytes of a write.
    fn write(&mut self, now_us: u64, bytes: &[u8]);
    /// Answers a read.
    fn read(&mut self, now_us: u64, buffer: &mut [u8]);
}

/// The time, a chip, and the duration of a transfer.
pub struct Bench<C> {
    pub chip: RefCell<C>,
    now_us: Cell<u64>,
    transfer_us: u64,
}

impl<C: Chip> Bench<C> {
    pub fn new(chip: C, transfer_us: u64) -> Self {
        Self {
            chip: RefCell::new(chip),
            now_us: Cell::new(0),
            transfer_us,
        }
    }

    /// Polls like a board until this time, and passes on each reading.
    pub fn follow<S: LightSensor>(
        &self,
        sensor: &mut PolledSensor<S>,
        watch: &mut LightWatch,
        until_ms: u64,
        mut see: impl FnMut(u64, LightSample, &LightWatch),
    ) {
        while self.now_us.get() < until_ms * 1_000 {
            let now_us = self.now_us.get();
            let now_ms = now_us / 1_000;
            match sensor.poll(now_ms, watch.next_range()) {
                Some((range, sample)) => {
                    watch.observe(now_ms, range, sample);
                    see(now_ms, sample, watch);
                }
                None => watch.watch(now_ms),
            }
            self.now_us.set((now_us + POLL_US).max(self.now_us.get()));
        }
    }
}

impl<C> ErrorType for &Bench<C> {
    type Error = Infallible;
}

impl<C: Chip> I2c for &Bench<C> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Infallible> {
        assert_eq!(address, C::ADDRESS);
        self.now_us.set(self.now_us.get() + self.transfer_us);
        for operation in operations {
            match operation {
                Operation::Write(bytes) => self.chip.borrow_mut().write(self.now_us.get(), bytes),
                Operation::Read(buffer) => self.chip.borrow_mut().read(self.now_us.get(), buffer),
            }
        }
        Ok(())
    }
}

/// A delay that does nothing.
pub struct NoDelay;

impl DelayNs for NoDelay {
    fn delay_ns(&mut self, _: u32) {}
}
