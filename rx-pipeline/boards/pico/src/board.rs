//! The hardware that the application uses: camera, clock, port and the rest.

use core::task::Poll;

use embassy_futures::poll_once;
use embassy_rp::{
    gpio::Output,
    uart::{BufferedUartRx, BufferedUartTx},
    watchdog::Watchdog,
};
use embassy_time::{Delay, Duration, Instant};
use embedded_io_async::Read;
use pico::bus::Bus;
use rx_pipeline::{
    hm01b0::Hm01b0,
    standalone::{Camera, CameraError, Clock, Exposure, Machine, Port},
};

use crate::{Irqs, capture, stack, usb};

/// Longer than any part of a search that does not feed the watchdog.
pub const WATCHDOG: Duration = Duration::from_secs(8);

/// The board.
pub struct Pico {
    pub camera: Hm01b0<Bus<Irqs>, Delay>,
    pub receive: BufferedUartRx,
    pub transmit: BufferedUartTx,
    pub lamp: Output<'static>,
    pub watchdog: Watchdog,
}

impl Camera for Pico {
    fn start(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        self.camera.start(exposure)
    }

    fn expose(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        self.camera.expose(exposure)
    }
}

impl Clock for Pico {
    fn micros(&self) -> u64 {
        Instant::now().as_micros()
    }
}

impl Port for Pico {
    fn read(&mut self) -> Option<u8> {
        let mut byte = [0];
        // After a line error, the driver accepts no more bytes until a read has returned the error, which it does only if no bytes wait. So
        // this reads even if nothing is expected. The error damages a frame, whose checksum then fails.
        match poll_once(self.receive.read(&mut byte)) {
            Poll::Ready(Ok(1)) => Some(byte[0]),
            _ => usb::read(),
        }
    }

    fn write(&mut self, bytes: &[u8]) {
        usb::write(bytes);
        let mut rest = bytes;
        while let Ok(count) = self.transmit.blocking_write(rest) {
            match rest.get(count..) {
                Some(left) if count > 0 && !left.is_empty() => rest = left,
                _ => return,
            }
        }
    }
}

impl Machine for Pico {
    const BOARD: &'static str = if cfg!(feature = "rp2040") {
        "receiver-pico"
    } else {
        "receiver-pico2"
    };
    const FIRMWARE: &'static str = env!("CARGO_PKG_VERSION");

    fn alive(&mut self) {
        self.watchdog.feed(WATCHDOG);
    }

    fn lamp(&mut self, is_on: bool) {
        self.lamp.set_level(is_on.into());
    }

    fn stack_bytes(&self) -> u32 {
        stack::deepest_bytes()
    }

    fn cut_short(&self) -> u32 {
        capture::cut_short()
    }
}
