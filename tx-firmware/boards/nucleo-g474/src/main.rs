//! The transmitter of an optical camera link on an STM32 Nucleo-G474RE. No board has run it yet: it is built, not tested.
//!
//! | level | what runs there |
//! |---|---|
//! | hardware alone | the symbol clock, the latch and shifting ([`symbols`]); the dimming ([`leds`]) |
//! | interrupt | the next panels ([`shared`]) |
//! | thread | the serial port, the store ([`memory`]), the light sensor and the watchdog |
//!
//! | pin | to |
//! |---|---|
//! | PA5, PA7 | shift clock and serial in of the shift registers |
//! | PC1 | their latch |
//! | PA8 | the gate of their output enable, with a pull-down; high lights the LEDs |
//! | PB10 | the full current of the LEDs if high, with a pull-down |
//! | PC8, PC9 | SCL and SDA of the light sensor, with pull-ups; PB8, the SCL of the Arduino connector, is also BOOT0 |
//! | PA2, PA3 | serial port at 115 200 baud, through the board's ST-LINK |

#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod halt;
mod leds;
mod memory;
mod shared;
mod symbols;

use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_stm32::{
    bind_interrupts,
    gpio::{Level, OutputOpenDrain, Speed},
    i2c::{self, I2c},
    interrupt, pac,
    peripherals::LPUART1,
    rcc,
    time::Hertz,
    usart::{self, BufferedUart},
    wdg::IndependentWatchdog,
};
use embassy_sync::mutex::Mutex;
use embassy_time::{Delay, Duration};
use light_sensors::Sensor;
use link::{panel::PanelFrame, serial::Faults};
use on_embassy::{
    light::{self, WATCHDOG},
    port::{self, PortService, RequestContext, SharedStore},
};
use static_cell::StaticCell;
use tx_firmware::{calibration::Calibration, panel_ring::PanelRing, service::Identity, store::Store};

use crate::{memory::StoreFlash, shared::Panel, symbols::Symbols};

const IDENTITY: Identity = Identity {
    firmware: env!("CARGO_PKG_VERSION"),
    board: "nucleo-g474re",
};

/// Time limit of a transfer to the light sensor: about twenty times its duration.
const I2C_PATIENCE: Duration = Duration::from_millis(5);

bind_interrupts!(struct Irqs {
    LPUART1 => usart::BufferedInterruptHandler<LPUART1>;
});

/// Prepares the next panels when a symbol has begun.
#[interrupt]
fn LPTIM1() {
    symbols::acknowledge_interrupt();
    if let Some(shared) = shared::get() {
        shared.prepare_symbols();
    }
}

/// 170 MHz from the board's 24 MHz crystal. LPTIM 1 has a quarter of it, so that its divider reaches 9 symbols a second.
fn clocks() -> embassy_stm32::Config {
    use rcc::{APBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(24_000_000),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.boost = true;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let mut board = embassy_stm32::init(clocks());
    let mut watchdog = IndependentWatchdog::new(board.IWDG, WATCHDOG.as_micros() as u32);
    watchdog.unleash();
    let was_reset = pac::RCC.csr().read().iwdgrstf();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));

    let (Ok(mut store), Ok(typical)) = (memory::store(board.FLASH), Calibration::new(leds::TYPICAL)) else {
        panic!("the store's place or the typical calibration is none");
    };
    let mut start = store.remembered::<Panel>(typical);
    start.faults.set(Faults::WATCHDOG, was_reset);

    let hardware = symbols::Hardware {
        timer: board.LPTIM1,
        latch: board.PC1,
        spi: board.SPI1,
        clock: board.PA5,
        data: board.PA7,
        channel: board.DMA1_CH1,
    };
    let symbols = Symbols::start(hardware, start.timing, &leds::entry(PanelFrame::default()));
    let panel = Panel {
        ring: PanelRing::new(symbols, start.timing),
        dimmer: leds::dark(board.TIM1, board.PA8, board.PB10, start.calibration.measured()),
    };
    let shared = shared::install(panel, start);
    symbols::enable_interrupt();

    static STORE: StaticCell<SharedStore<Store<StoreFlash>>> = StaticCell::new();
    static TRANSMIT: StaticCell<[u8; 256]> = StaticCell::new();
    static RECEIVE: StaticCell<[u8; 256]> = StaticCell::new();
    static SERVICE: StaticCell<PortService> = StaticCell::new();
    let uart = BufferedUart::new(
        board.LPUART1,
        board.PA3,
        board.PA2,
        TRANSMIT.init([0; 256]),
        RECEIVE.init([0; 256]),
        Irqs,
        usart::Config::default(),
    );
    let Ok(uart) = uart else {
        panic!("the serial port has no such baud rate");
    };
    let (transmit, receive) = uart.split();
    let context = RequestContext {
        shared,
        store: STORE.init(Mutex::new(store)),
    };
    let service = SERVICE.init_with(|| PortService::new(IDENTITY));

    i2c_bus::free(
        &mut OutputOpenDrain::new(board.PC8.reborrow(), Level::High, Speed::Low),
        &mut OutputOpenDrain::new(board.PC9.reborrow(), Level::High, Speed::Low),
        &mut Delay,
    );
    let mut bus = i2c::Config::default();
    bus.frequency = Hertz(400_000);
    bus.timeout = I2C_PATIENCE;
    let sensor = Sensor::new(I2c::new_blocking(board.I2C3, board.PC8, board.PC9, bus), Delay);
    let light = light::follow(sensor, shared, symbols::position, || watchdog.pet());
    join(light, port::serve(receive, transmit, service, context)).await;
}
