//! The receiver's core on a Cortex-M: regions of camera frames come in over UART 0, bits, soft values and messages go out.
//!
//! The board is Arm's MPS2 with one of its FPGA images AN385, AN386 or AN500 (Cortex-M3, M4, M7), which QEMU emulates. On another board
//! only `peripherals` and `memory.x` change; `docs/embedded-receiver.md` says what it takes.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod peripherals;
mod stack;

use panic_halt as _;
use rx_pipeline::board::{Machine, Service};
use rx_pipeline::receiver::{ReceiverError, ReceiverMemory};
use static_cell::{ConstStaticCell, StaticCell};

use peripherals::{Clock, Uart};

/// Pixels that a panel is read in; larger ones are seen in larger pixels: 96 × 96.
const PIXELS: usize = 9_216;

type Board = Service<PIXELS, &'static mut ReceiverMemory<PIXELS>>;

static MEMORY: ConstStaticCell<ReceiverMemory<PIXELS>> = ConstStaticCell::new(ReceiverMemory::new());
static SERVICE: StaticCell<Result<Board, ReceiverError>> = StaticCell::new();

struct Mps2 {
    clock: Clock,
}

impl Machine for Mps2 {
    const BOARD: &'static str = "mps2";
    const TICKS_HZ: u32 = peripherals::SYSTEM_HZ;

    fn ticks(&self) -> u32 {
        self.clock.ticks()
    }

    fn stack_bytes(&self) -> u32 {
        stack::deepest_bytes()
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let machine = Mps2 { clock: Clock::start() };
    let uart = Uart::start();
    if let Ok(service) = service() {
        loop {
            if let Some(answer) = service.receive(uart.read(), &machine) {
                uart.write(answer);
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// The service, made in its place: handed on, it would pass through the stack. Not inlined: what is taken of that is free again before
/// the first region comes.
#[inline(never)]
fn service() -> &'static mut Result<Board, ReceiverError> {
    let memory = MEMORY.take();
    SERVICE.init_with(|| Service::new(memory))
}
