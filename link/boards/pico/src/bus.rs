//! An I2C bus with a time limit on every wait.

use core::{future::Future, future::poll_fn, pin::pin, task::Poll};

use embassy_futures::block_on;
use embassy_rp::{
    Peri,
    gpio::{Level, OutputOpenDrain, Pin},
    i2c::{self, Async, I2c},
    peripherals::I2C0,
};
use embassy_time::{Delay, Duration, Instant};
use embedded_hal::i2c::{ErrorKind, ErrorType, Operation};

/// Time limit of a transfer: about forty times its length. A chip that holds the clock line for longer is broken.
const PATIENCE: Duration = Duration::from_millis(5);

/// Frees a bus whose data line is held by a chip that was being read when this processor was reset. Call it before the controller takes the
/// pins.
pub fn free(clock: Peri<'_, impl Pin>, data: Peri<'_, impl Pin>) {
    let mut clock = OutputOpenDrain::new(clock, Level::High);
    let mut data = OutputOpenDrain::new(data, Level::High);
    clock.set_pullup(true);
    data.set_pullup(true);
    i2c_bus::free(&mut clock, &mut data, &mut Delay);
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusError {
    /// The controller reports an error, usually a missing acknowledgement.
    Controller(i2c::Error),
    /// The transfer took too long.
    TimedOut,
    /// The transfer is more than a write followed by a read, which no sensor or camera here needs.
    Unsupported,
}

impl embedded_hal::i2c::Error for BusError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// A bus for blocking drivers. It is used at the lowest priority level, so everything else continues while it waits.
pub struct Bus(I2c<'static, I2C0, Async>);

impl Bus {
    /// Takes over the controller.
    pub fn new(controller: I2c<'static, I2C0, Async>) -> Self {
        Self(controller)
    }
}

impl ErrorType for Bus {
    type Error = BusError;
}

impl embedded_hal::i2c::I2c for Bus {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BusError> {
        let address = u16::from(address);
        match operations {
            [Operation::Write(bytes)] => in_time(self.0.write_async(address, bytes.iter().copied())),
            [Operation::Read(buffer)] => in_time(self.0.read_async(address, buffer)),
            [Operation::Write(bytes), Operation::Read(buffer)] => in_time(self.0.write_read_async(address, bytes.iter().copied(), buffer)),
            _ => Err(BusError::Unsupported),
        }
    }
}

fn in_time(transfer: impl Future<Output = Result<(), i2c::Error>>) -> Result<(), BusError> {
    let deadline = Instant::now() + PATIENCE;
    let mut transfer = pin!(transfer);
    block_on(poll_fn(|context| match transfer.as_mut().poll(context) {
        Poll::Ready(result) => Poll::Ready(result.map_err(BusError::Controller)),
        Poll::Pending if Instant::now() >= deadline => Poll::Ready(Err(BusError::TimedOut)),
        Poll::Pending => Poll::Pending,
    }))
}
