//! The light sensor's I2C bus, on which nothing waits for ever.

use core::{future::Future, future::poll_fn, pin::pin, task::Poll};

use embassy_futures::block_on;
use embassy_rp::{
    i2c::{self, Async, I2c},
    peripherals::I2C0,
};
use embassy_time::{Duration, Instant};
use embedded_hal::i2c::{ErrorKind, ErrorType, Operation};

/// What a transfer may take: some forty times its length. A sensor that holds the clock line longer is broken.
const PATIENCE: Duration = Duration::from_millis(5);

/// Why a transfer gave nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusError {
    /// The controller reports an error, mostly that nobody answers.
    Controller(i2c::Error),
    /// It took too long.
    TimedOut,
    /// More than a write and then a read, which no light sensor needs.
    Unsupported,
}

impl embedded_hal::i2c::Error for BusError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// A bus for blocking drivers. It is used at the lowest level of all, so while it waits everything else goes on.
pub struct Bus(I2c<'static, I2C0, Async>);

impl Bus {
    /// Takes the controller over.
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
