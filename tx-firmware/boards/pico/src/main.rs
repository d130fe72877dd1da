//! The transmitter of an optical camera link on a Raspberry Pi Pico.
//!
//! | level | what runs there |
//! |---|---|
//! | hardware alone | the symbol clock and shifting ([`symbols`]); the latch and the dimming ([`leds`]) |
//! | interrupt | the next panels ([`shared`]) |
//! | interrupt executor | the serial ports, the flash and signatures ([`ports`], [`memory`]) |
//! | thread | the light sensor and the watchdog |
//!
//! `docs/hardware` has the wiring of both kits.

#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod halt;
mod leds;
mod memory;
mod ports;
mod shared;
mod symbols;

#[cfg(feature = "defmt")]
use defmt_rtt as _;

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_rp::{
    bind_interrupts, i2c, interrupt,
    interrupt::{InterruptExt, Priority},
    pac,
    peripherals::{I2C0, UART0, USB},
    uart, usb,
    watchdog::Watchdog,
};
use embassy_sync::mutex::Mutex;
use embassy_time::Delay;
use light_sensors::Sensor;
use link::{panel::PanelFrame, serial::Faults};
use on_embassy::light::{self, WATCHDOG};
use pico::bus::Bus;
use static_cell::StaticCell;
use tx_firmware::{calibration::Calibration, panel_ring::PanelRing, store::Remembered};

use crate::{
    leds::Dimmer,
    ports::{RequestContext, SharedStore},
    shared::Panel,
    symbols::Symbols,
};

bind_interrupts!(struct Irqs {
    UART0_IRQ => uart::BufferedInterruptHandler<UART0>;
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
    USBCTRL_IRQ => usb::InterruptHandler<USB>;
});

/// Prepares the next panels when a symbol was loaded.
#[interrupt]
fn DMA_IRQ_1() {
    symbols::acknowledge_interrupt();
    if let Some(shared) = shared::get() {
        shared.prepare_symbols();
    }
}

/// The executor of the serial ports.
static PORTS: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
#[allow(unsafe_code)]
unsafe fn SWI_IRQ_0() {
    // SAFETY: the executor was started with this interrupt.
    unsafe { PORTS.on_interrupt() }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_rp::init(Default::default());
    let mut watchdog = Watchdog::new(board.WATCHDOG);
    let was_reset = watchdog.reset_reason().is_some();
    watchdog.start(WATCHDOG);

    let (Ok(mut store), Ok(typical)) = (memory::store(board.FLASH), Calibration::new(leds::TYPICAL)) else {
        panic!("the store's place or the typical calibration is none");
    };
    // Destructured, because a task keeps the memory of everything borrowed in it, and the table is large.
    let Remembered {
        calibration,
        table,
        timing,
        mut faults,
    } = store.remembered::<Panel>(typical);
    faults.set(Faults::WATCHDOG, was_reset);

    #[cfg(not(feature = "max7219"))]
    let dimmer = Dimmer::dark(board.PWM_SLICE2, board.PIN_20, board.PIN_21, calibration.measured());
    #[cfg(feature = "max7219")]
    let dimmer = Dimmer::default();
    let hardware = symbols::Hardware {
        slice: board.PWM_SLICE0,
        leds: leds::Lines {
            latch: board.PIN_17,
            spi: board.SPI0,
            clock: board.PIN_18,
            data: board.PIN_19,
        },
        trigger: board.DMA_CH0,
        shift: board.DMA_CH1,
        load: board.DMA_CH2,
    };
    let symbols = Symbols::start(hardware, timing, &dimmer.entry(PanelFrame::default()));
    let panel = Panel {
        ring: PanelRing::new(symbols, timing),
        dimmer,
    };
    let start = Remembered {
        calibration,
        table,
        timing,
        faults,
    };
    let shared = shared::install(panel, start);
    symbols::enable_interrupt();

    static STORE: StaticCell<SharedStore> = StaticCell::new();
    static TRANSMIT: StaticCell<[u8; 256]> = StaticCell::new();
    static RECEIVE: StaticCell<[u8; 256]> = StaticCell::new();
    let uart = uart::BufferedUart::new(
        board.UART0,
        board.PIN_0,
        board.PIN_1,
        Irqs,
        TRANSMIT.init([0; 256]),
        RECEIVE.init([0; 256]),
        uart::Config::default(),
    );
    // Without an adapter, the line stays high: no break.
    pac::PADS_BANK0.gpio(1).modify(|pad| pad.set_pue(true));
    let context = RequestContext {
        shared,
        store: STORE.init(Mutex::new(store)),
    };
    interrupt::SWI_IRQ_0.set_priority(Priority::P3);
    let ports = PORTS.start(interrupt::SWI_IRQ_0);
    // The pool has room for one task, and this is the only one.
    if let Ok(task) = ports::serve(uart, board.USB, context) {
        ports.spawn(task);
    }

    let bus = Bus::new(board.I2C0, board.PIN_5, board.PIN_4, Irqs);
    light::follow(Sensor::new(bus, Delay), shared, symbols::position, || watchdog.feed(WATCHDOG)).await;
}
