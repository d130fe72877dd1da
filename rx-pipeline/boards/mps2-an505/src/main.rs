//! The receiver of a Raspberry Pi Pico 2 on a Cortex-M33 that QEMU emulates: the application, the reader and the settings are the Pico's,
//! the camera is a film in memory. It says what it reads, and how many ticks each frame took.
//!
//! The board is Arm's MPS2 with its FPGA image AN505, whose Cortex-M33 has the FPU that the RP2350's has (of the two in AN521, the first
//! one, which starts, has none). What it cannot show is the RP2350 around the processor: the camera's pins, PIO, DMA, and cycles.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod capture;
mod film;
mod machine;
#[path = "../../pico/src"]
mod pico {
    pub mod reader;
    pub mod stack;
}

use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use rx_pipeline::standalone::{Application, Settings};
use static_cell::StaticCell;

use crate::{capture::MODE, film::Film, machine::Mps2, pico::reader};

type Receiver = Application<&'static mut reader::Reader>;

/// As in the Pico 2's program.
const SYMBOL_MILLIHERTZ: u32 = 20_400;

#[cortex_m_rt::entry]
fn main() -> ! {
    let status = match (Mps2::start(), application()) {
        (Some(board), Some(application)) => {
            watch(board, application);
            debug::EXIT_SUCCESS
        }
        _ => debug::EXIT_FAILURE,
    };
    loop {
        debug::exit(status);
    }
}

/// Takes in the film, and says a line about each frame: `frame`, ticks, readings, times found and lost, messages, lines and gain of the
/// exposure, stack.
fn watch(mut board: Mps2, application: &mut Receiver) {
    application.start(&mut board);
    for (number, pixels) in (1u64..).zip(Film::in_memory().frames()) {
        board.now_us = number * u64::from(MODE.period_us());
        let began = board.ticks();
        application.frame(pixels, board.now_us, &mut board);
        let ticks = board.ticks_since(began);
        let (counters, exposure) = (application.counters(), application.exposure());
        hprintln!(
            "frame {} {} {} {} {} {} {} {}",
            ticks,
            counters.readings,
            counters.found,
            counters.lost,
            counters.messages,
            exposure.lines,
            exposure.gain_log2,
            pico::stack::deepest_bytes()
        );
    }
}

/// The application. Not inlined, as on the Pico: what it takes of the stack to make it is free again before the first frame comes.
#[inline(never)]
fn application() -> Option<&'static mut Receiver> {
    static APPLICATION: StaticCell<Receiver> = StaticCell::new();
    let settings = Settings {
        mode: MODE,
        symbol_millihertz: SYMBOL_MILLIHERTZ,
        was_reset: false,
    };
    let application = Application::new(reader::take()?, settings).ok()?;
    Some(APPLICATION.init(application))
}
