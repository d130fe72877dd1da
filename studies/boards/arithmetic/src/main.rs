//! Runs the transmitter's control path in different kinds of arithmetic, over the whole range of light.
//!
//! It does nothing else and has no output: `tests/boards/emulator/arithmetic.mjs` runs it on an emulated Cortex-M0+ and counts the cycles
//! of each path from entry to return.
#![no_std]
#![no_main]

#[path = "../../../src/work_precision/transmitter/paths.rs"]
mod paths;
#[path = "../../../src/work_precision/transmitter/tables.rs"]
mod tables;

use core::hint::black_box;

use cortex_m_rt::entry;
use link::l2a_table::Illuminance;
use panic_halt as _;
use paths::Transmitter;

/// Makes a separate function for a path, so that the emulator finds it by its name.
macro_rules! timed {
    ($($name:ident: $path:expr;)*) => {
        $(
            #[inline(never)]
            fn $name(transmitter: &Transmitter, lx: Illuminance) {
                black_box($path(transmitter, lx));
            }
        )*
        const TIMED: &[fn(&Transmitter, Illuminance)] = &[$($name),*];
    };
}

timed! {
    timed_firmware: paths::firmware;
    timed_single_libm: paths::single_libm;
    timed_single_micromath: paths::single_micromath;
    timed_double_libm: paths::double_libm;
    timed_linear_8_: paths::by_table::<8, 1>;
    timed_linear_32_: paths::by_table::<32, 1>;
    timed_linear_128_: paths::by_table::<128, 1>;
    timed_linear_512_: paths::by_table::<512, 1>;
    timed_quadratic_8_: paths::by_table::<8, 2>;
    timed_quadratic_32_: paths::by_table::<32, 2>;
    timed_quadratic_128_: paths::by_table::<128, 2>;
    timed_quadratic_512_: paths::by_table::<512, 2>;
}

/// Readings of 1 lx to 131 072 lx, eight per octave.
const READINGS: u32 = 8 * 17;

#[entry]
fn main() -> ! {
    if let Some(transmitter) = Transmitter::new() {
        for reading in 0..READINGS {
            let octave = 4096u32 << (reading / 8);
            let lx = octave + octave / 8 * (reading % 8);
            for timed in black_box(TIMED) {
                timed(&transmitter, Illuminance::from_bits(lx));
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
