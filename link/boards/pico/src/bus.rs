//! An I2C bus with a time limit on every wait.

use core::{future::Future, future::poll_fn, pin::pin, task::Poll};

use embassy_futures::block_on;
use embassy_rp::{
    Peri,
    gpio::{Level, OutputOpenDrain},
    i2c::{self, Async, I2c, InterruptHandler},
    interrupt::typelevel::{Binding, I2C0_IRQ},
    peripherals::{I2C0, PIN_4, PIN_5},
};
use embassy_time::{Delay, Duration, Instant};
use embedded_hal::i2c::{ErrorKind, ErrorType, Operation};

const FREQUENCY_HZ: u32 = 400_000;

/// Time limit of a transfer: about forty times its length. A chip that holds the clock line for longer is broken.
const PATIENCE: Duration = Duration::from_millis(5);

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
///
/// Each transfer frees the bus and sets the controller up again, because a chip may hold the data line at any time: a reset or a
/// disturbance may have taken a clock from it while it was being read.
pub struct Bus<I> {
    controller: Peri<'static, I2C0>,
    clock: Peri<'static, PIN_5>,
    data: Peri<'static, PIN_4>,
    interrupts: I,
}

impl<I: Binding<I2C0_IRQ, InterruptHandler<I2C0>> + Copy> Bus<I> {
    /// Takes over the controller, SCL and SDA.
    pub fn new(controller: Peri<'static, I2C0>, clock: Peri<'static, PIN_5>, data: Peri<'static, PIN_4>, interrupts: I) -> Self {
        Self {
            controller,
            clock,
            data,
            interrupts,
        }
    }

    /// The controller, on a bus that no chip holds.
    fn ready(&mut self) -> I2c<'_, I2C0, Async> {
        let mut clock = OutputOpenDrain::new(self.clock.reborrow(), Level::High);
        let mut data = OutputOpenDrain::new(self.data.reborrow(), Level::High);
        clock.set_pullup(true);
        data.set_pullup(true);
        i2c_bus::free(&mut clock, &mut data, &mut Delay);
        drop((clock, data));
        let mut config = i2c::Config::default();
        config.frequency = FREQUENCY_HZ;
        I2c::new_async(
            self.controller.reborrow(),
            self.clock.reborrow(),
            self.data.reborrow(),
            self.interrupts,
            config,
        )
    }
}

impl<I> ErrorType for Bus<I> {
    type Error = BusError;
}

impl<I: Binding<I2C0_IRQ, InterruptHandler<I2C0>> + Copy> embedded_hal::i2c::I2c for Bus<I> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BusError> {
        let address = u16::from(address);
        let mut controller = self.ready();
        match operations {
            [Operation::Write(bytes)] => in_time(controller.write_async(address, bytes.iter().copied())),
            [Operation::Read(buffer)] => in_time(controller.read_async(address, buffer)),
            [Operation::Write(bytes), Operation::Read(buffer)] => {
                in_time(controller.write_read_async(address, bytes.iter().copied(), buffer))
            }
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
