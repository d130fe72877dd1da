//! An I2C bus with a time limit on every wait.

use core::{future::Future, future::poll_fn, pin::pin, task::Poll};

use embassy_futures::block_on;
use embassy_rp::{
    Peri,
    gpio::{Level, OutputOpenDrain, Pin},
    i2c::{self, Async, I2c},
    peripherals::I2C0,
};
use embassy_time::{Duration, Instant, block_for};
use embedded_hal::i2c::{ErrorKind, ErrorType, Operation};

/// Time limit of a transfer: about forty times its length. A chip that holds the clock line for longer is broken.
const PATIENCE: Duration = Duration::from_millis(5);

/// Clocks after which a chip has sent the rest of a byte and missed its acknowledgement.
const CLOCKS_OF_A_BYTE: u32 = 9;
/// Half a clock period at 100 kHz.
const HALF_CLOCK: Duration = Duration::from_micros(5);

/// Frees a bus whose data line is held by a chip that was being read when this processor was reset: clocks the rest of the byte out of the
/// chip and ends the transfer. A chip that holds nothing ignores this. Call it before the controller takes the pins.
pub fn free(clock: Peri<'_, impl Pin>, data: Peri<'_, impl Pin>) {
    let mut clock = OutputOpenDrain::new(clock, Level::High);
    let mut data = OutputOpenDrain::new(data, Level::High);
    clock.set_pullup(true);
    data.set_pullup(true);
    block_for(HALF_CLOCK);
    for _ in 0..CLOCKS_OF_A_BYTE {
        clock.set_low();
        block_for(HALF_CLOCK);
        clock.set_high();
        block_for(HALF_CLOCK);
    }
    // A rise of the data line while the clock is high ends a transfer.
    clock.set_low();
    data.set_low();
    block_for(HALF_CLOCK);
    clock.set_high();
    block_for(HALF_CLOCK);
    data.set_high();
    block_for(HALF_CLOCK);
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
