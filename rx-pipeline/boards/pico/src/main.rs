//! The receiver of an optical camera link on a Raspberry Pi Pico 2 or Pico with an HM01B0: flash it, point it at a panel, read the text.
//!
//! | level | what runs there |
//! |---|---|
//! | hardware alone | pixels from the camera to memory ([`capture`]) |
//! | interrupt executor | the next frame is begun when one has ended ([`capture`]) |
//! | interrupt executor below it | the serial port over USB ([`usb`]) |
//! | thread | all else: `rx_pipeline::standalone`, on what [`board`] has |
//!
//! `docs/hardware/receiver.md` has the wiring.

#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod board;
mod capture;
mod halt;
mod reader;
mod stack;
mod usb;

use core::fmt::Write as _;

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_rp::{
    bind_interrupts,
    gpio::{Level, Output},
    i2c, interrupt,
    interrupt::{InterruptExt, Priority},
    pac,
    peripherals::{I2C0, UART0, USB},
    uart,
    usb::InterruptHandler,
    watchdog::Watchdog,
};
use embassy_time::{Delay, Duration, Instant, with_timeout};
use pico::bus::Bus;
use rx_pipeline::{
    hm01b0::Hm01b0,
    standalone::{Application, Port, Settings, Trust},
};
use static_cell::{ConstStaticCell, StaticCell};

use crate::{
    board::{Pico, WATCHDOG},
    capture::{CAMERA_MODE, Capture, MODE, Wires},
    reader::Reader,
};

/// Symbol rate of a panel in thousandths of a hertz. It is not a simple fraction of the frame rate, so that exposures catch changes of
/// symbols only occasionally.
const SYMBOL_MILLIHERTZ: u32 = if cfg!(feature = "rp2040") { 9_000 } else { 20_400 };
/// The trusted public keys, as `vocc keys show` prints them, from the environment of the build; without it there are none.
const TRUSTED: Option<&str> = option_env!("VOCC_TRUST");
/// A camera that sends no whole frame for this long is set up again.
const PATIENCE: Duration = Duration::from_secs(1);
/// Interval at which the port and the lamp are served while no frames arrive.
const NAP: Duration = Duration::from_millis(40);

bind_interrupts!(struct Irqs {
    UART0_IRQ => uart::BufferedInterruptHandler<UART0>;
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
    USBCTRL_IRQ => InterruptHandler<USB>;
});

/// The executor of the capture, at the highest priority.
static EYE: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
#[allow(unsafe_code)]
unsafe fn SWI_IRQ_0() {
    // SAFETY: the executor was started with this interrupt.
    unsafe { EYE.on_interrupt() }
}

/// The executor of USB.
static PLUG: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
#[allow(unsafe_code)]
unsafe fn SWI_IRQ_1() {
    // SAFETY: the executor was started with this interrupt.
    unsafe { PLUG.on_interrupt() }
}

#[embassy_executor::task]
async fn capture_frames(mut capture: Capture) {
    capture.run().await
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(Default::default());
    let mut watchdog = Watchdog::new(chip.WATCHDOG);
    let was_reset = watchdog.reset_reason().is_some();
    watchdog.start(WATCHDOG);

    static TRANSMIT: ConstStaticCell<[u8; 1536]> = ConstStaticCell::new([0; 1536]);
    static RECEIVE: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);
    let uart = uart::BufferedUart::new(
        chip.UART0,
        chip.PIN_0,
        chip.PIN_1,
        Irqs,
        TRANSMIT.take(),
        RECEIVE.take(),
        uart::Config::default(),
    );
    // Without an adapter, the line stays high: no break.
    pac::PADS_BANK0.gpio(1).modify(|pad| pad.set_pue(true));
    let (transmit, receive) = uart.split();
    let bus = Bus::new(chip.I2C0, chip.PIN_5, chip.PIN_4, Irqs);
    let mut board = Pico {
        camera: Hm01b0::new(bus, Delay, MODE),
        receive,
        transmit,
        lamp: Output::new(chip.PIN_25, Level::Low),
        watchdog,
    };
    if let Some(words) = halt::last_words() {
        let mut line = heapless::String::<256>::new();
        let _ = write!(line, "fault: the program ended before this start: {words}\r\n");
        board.write(line.as_bytes());
    }
    let (capture, mut shots) = Capture::new(Wires {
        pio: chip.PIO0,
        dma: chip.DMA_CH0,
        data: (
            chip.PIN_6,
            chip.PIN_7,
            chip.PIN_8,
            chip.PIN_9,
            chip.PIN_10,
            chip.PIN_11,
            chip.PIN_12,
            chip.PIN_13,
        ),
        pixel_clock: chip.PIN_14,
        line_valid: chip.PIN_15,
        frame_valid: chip.PIN_16,
    });
    interrupt::SWI_IRQ_0.set_priority(Priority::P2);
    let eye = EYE.start(interrupt::SWI_IRQ_0);
    // The pool has room for one task, and this is the only one.
    if let Ok(task) = capture_frames(capture) {
        eye.spawn(task);
    }
    interrupt::SWI_IRQ_1.set_priority(Priority::P3);
    let plug = PLUG.start(interrupt::SWI_IRQ_1);
    if let Ok(task) = usb::serve(chip.USB) {
        plug.spawn(task);
    }

    let application = application(was_reset);
    application.start(&mut board);
    let mut seen_at = Instant::now();
    loop {
        match with_timeout(NAP, shots.receive()).await {
            Ok(shot) => {
                application.frame(shot.pixels(), shot.ended.as_micros(), &mut board);
                shots.receive_done();
                seen_at = Instant::now();
            }
            Err(_) if seen_at.elapsed() > PATIENCE => {
                application.no_frame(&mut board);
                seen_at = Instant::now();
            }
            Err(_) => application.serve(&mut board),
        }
    }
}

/// Makes the application. Not inlined, so that the stack it uses is free again before the first frame arrives.
#[inline(never)]
fn application(was_reset: bool) -> &'static mut Application<&'static mut Reader> {
    static APPLICATION: StaticCell<Application<&'static mut Reader>> = StaticCell::new();
    let settings = Settings {
        mode: CAMERA_MODE,
        symbol_millihertz: SYMBOL_MILLIHERTZ,
        was_reset,
    };
    let application = reader::take().and_then(|reader| Application::new(reader, settings).ok());
    match application {
        Some(application) => {
            let application = APPLICATION.init(application);
            if let Some(keys) = TRUSTED {
                application.trust(Trust::parse(keys));
            }
            application
        }
        None => panic!("the settings are out of their ranges"),
    }
}
