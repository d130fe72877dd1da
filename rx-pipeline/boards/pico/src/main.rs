//! The receiver of an optical camera link on a Raspberry Pi Pico 2 or Pico with an HM01B0: flash it, point it at a panel, read the text.
//!
//! | level | what runs there |
//! |---|---|
//! | hardware alone | pixels from the camera to memory ([`capture`]) |
//! | interrupt executor | the next frame is begun when one has ended ([`capture`]) |
//! | thread | all else: `rx_pipeline::standalone`, on what [`board`] has |
//!
//! `docs/hardware.md` has the wiring.

#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod board;
mod bus;
mod capture;
mod halt;
mod stack;

use core::fmt::Write as _;

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_rp::{
    bind_interrupts,
    gpio::{Level, Output},
    i2c, interrupt,
    interrupt::{InterruptExt, Priority},
    peripherals::{I2C0, UART0},
    uart,
    watchdog::Watchdog,
};
use embassy_time::{Duration, Instant, with_timeout};
use link::camera::{Camera, Encoding};
use rx_pipeline::{
    detect::Detector,
    hm01b0::{BLACK_GREY, Hm01b0},
    receiver::{FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory},
    standalone::{Application, Port, Settings},
};
use static_cell::{ConstStaticCell, StaticCell};

use crate::{
    board::{Pico, WATCHDOG},
    bus::Bus,
    capture::{Capture, MODE, Wires},
};

/// Pixels that a panel is read in; larger ones are seen in larger pixels.
const PIXELS: usize = if cfg!(feature = "rp2040") {
    48 * 48
} else {
    64 * 64
};
/// Two earlier frames, or one where there is less memory; and those in larger pixels.
const HISTORY: usize =
    MODE.width() * MODE.height() * if cfg!(feature = "rp2040") { 22 } else { 10 } / 10;
/// What a panel shows in a second, thousandths. Not a simple fraction of the frame rate: exposures then meet changes of symbols in turn.
const SYMBOL_MILLIHERTZ: u32 = if cfg!(feature = "rp2040") {
    9_000
} else {
    20_400
};
/// A camera that sends no frame for so long is set up anew.
const PATIENCE: Duration = Duration::from_secs(1);
/// The port and the lamp are looked after so often where no frames come.
const NAP: Duration = Duration::from_millis(40);

type Search = FrameSearch<&'static mut SearchMemory, &'static mut [u8]>;
type Follower = (
    Receiver<PIXELS, &'static mut ReceiverMemory<PIXELS>, Search>,
    ReceiverSettings,
);

bind_interrupts!(struct Irqs {
    UART0_IRQ => uart::BufferedInterruptHandler<UART0>;
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
});

/// What looks after the capture, before all else.
static EYE: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
#[allow(unsafe_code)]
unsafe fn SWI_IRQ_0() {
    // SAFETY: this is the interrupt that the executor was started with.
    unsafe { EYE.on_interrupt() }
}

#[embassy_executor::task]
async fn capture_frames(mut capture: Capture) {
    capture.run().await
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let pico = embassy_rp::init(Default::default());
    let mut watchdog = Watchdog::new(pico.WATCHDOG);
    let was_reset = watchdog.reset_reason().is_some();
    watchdog.start(WATCHDOG);

    static TRANSMIT: ConstStaticCell<[u8; 1536]> = ConstStaticCell::new([0; 1536]);
    static RECEIVE: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);
    let uart = uart::BufferedUart::new(
        pico.UART0,
        pico.PIN_0,
        pico.PIN_1,
        Irqs,
        TRANSMIT.take(),
        RECEIVE.take(),
        uart::Config::default(),
    );
    let (transmit, receive) = uart.split();
    let mut bus = i2c::Config::default();
    bus.frequency = 400_000;
    let bus = i2c::I2c::new_async(pico.I2C0, pico.PIN_5, pico.PIN_4, Irqs, bus);
    let mut board = Pico {
        camera: Hm01b0::new(Bus::new(bus), MODE),
        receive,
        transmit,
        lamp: Output::new(pico.PIN_25, Level::Low),
        watchdog,
    };
    if let Some(words) = halt::last_words() {
        let mut line = heapless::String::<192>::new();
        let _ = write!(
            line,
            "fault: the program ended before this start: {words}\r\n"
        );
        board.write(line.as_bytes());
    }
    let (capture, mut shots) = Capture::new(Wires {
        pio: pico.PIO0,
        dma: pico.DMA_CH0,
        data: (
            pico.PIN_6,
            pico.PIN_7,
            pico.PIN_8,
            pico.PIN_9,
            pico.PIN_10,
            pico.PIN_11,
            pico.PIN_12,
            pico.PIN_13,
        ),
        pixel_clock: pico.PIN_14,
        line_valid: pico.PIN_15,
        frame_valid: pico.PIN_16,
    });
    interrupt::SWI_IRQ_0.set_priority(Priority::P2);
    let eye = EYE.start(interrupt::SWI_IRQ_0);
    // There is room for one, and one is begun.
    if let Ok(task) = capture_frames(capture) {
        eye.spawn(task);
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

/// The application, made in its place. Not inlined: what that takes of the stack is free again before the first frame comes.
#[inline(never)]
fn application(was_reset: bool) -> &'static mut Application<Follower> {
    static MEMORY: ConstStaticCell<ReceiverMemory<PIXELS>> =
        ConstStaticCell::new(ReceiverMemory::new());
    static SEARCH: ConstStaticCell<SearchMemory> = ConstStaticCell::new(SearchMemory::new());
    static EARLIER: ConstStaticCell<[u8; HISTORY]> = ConstStaticCell::new([0; HISTORY]);
    static APPLICATION: StaticCell<Application<Follower>> = StaticCell::new();
    let settings = ReceiverSettings {
        camera: Camera {
            encoding: Encoding::LINEAR,
            black_grey: BLACK_GREY.into(),
            blur_sigma_px: 0.7,
            ..Camera::default()
        },
        method: Detector::KMeans.into(),
        symbols_per_frame: 1.0,
    };
    let search: Search = FrameSearch::with_history(SEARCH.take(), &mut EARLIER.take()[..]);
    let application = Receiver::new(settings, MEMORY.take(), search)
        .ok()
        .and_then(|receiver| {
            let settings_of_application = Settings {
                mode: MODE,
                symbol_millihertz: SYMBOL_MILLIHERTZ,
                was_reset,
            };
            Application::new((receiver, settings), settings_of_application).ok()
        });
    match application {
        Some(application) => APPLICATION.init(application),
        None => panic!("the settings are out of their ranges"),
    }
}
