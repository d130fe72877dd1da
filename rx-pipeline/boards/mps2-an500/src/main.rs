//! The receiver's core on a Cortex-M7 that QEMU emulates: it reads regions of frames from its memory, and reports the readings and their
//! duration in ticks.
//!
//! The board is Arm's MPS2 with its FPGA image AN500.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod clock;
mod film;
mod host;
#[path = "../../pico/src/stack.rs"]
mod stack;
mod stopwatch;

use cortex_m_semihosting::hio;
use rx_pipeline::corners::Corners;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{NoSearch, Receiver, ReceiverError, ReceiverMemory, ReceiverSettings};
use static_cell::{ConstStaticCell, StaticCell};

use film::{BYTES, Head, Region, Report, START};
use stopwatch::Stopwatch;

/// Number of pixels in which a panel is read, 96×96; a larger panel is binned.
const PIXELS: usize = 9_216;
/// Maximum size of a report in bytes.
const REPORT_MAX: usize = 256;

type Reader = Receiver<PIXELS, &'static mut ReceiverMemory<PIXELS>>;

#[cortex_m_rt::entry]
fn main() -> ! {
    host::end(read())
}

fn read() -> Option<()> {
    clock::start()?;
    // SAFETY: the memory exists as long as the program runs, nobody writes to it, and any bytes are valid.
    #[allow(unsafe_code)]
    let film = unsafe { core::slice::from_raw_parts(START as *const u8, BYTES) };
    let (head, mut film) = postcard::take_from_bytes::<Head>(film).ok()?;
    let receiver = receiver(head.settings()).as_mut().ok()?;
    let mut out = hio::hstdout().ok()?;
    for number in 0..head.regions {
        let (region, rest) = postcard::take_from_bytes::<Region<'_>>(film).ok()?;
        film = rest;
        let size = [usize::from(region.side); 2];
        let frame = Frame::new(region.pixels, size[0], size[1]).ok()?;
        if number == 0 {
            receiver.place(Corners::new(head.corners).ok()?, region.origin, size.into()).ok()?;
        }
        let mut watch = Stopwatch::default();
        let began = clock::now();
        let outcome = receiver.region(number.into(), region.origin, &frame, &mut watch);
        let report = Report {
            reading: outcome.reading.ok().map(Into::into),
            ticks: clock::since(began),
            stage_ticks: watch.ticks,
            stack_bytes: stack::deepest_bytes(),
        };
        out.write_all(postcard::to_slice(&report, &mut [0; REPORT_MAX]).ok()?).ok()?;
    }
    Some(())
}

/// Makes the receiver in its final place, because returning it would copy it over the stack. Not inlined, so that the stack it uses is free
/// again before the first region is read.
#[inline(never)]
fn receiver(settings: ReceiverSettings) -> &'static mut Result<Reader, ReceiverError> {
    static MEMORY: ConstStaticCell<ReceiverMemory<PIXELS>> = ConstStaticCell::new(ReceiverMemory::new());
    static RECEIVER: StaticCell<Result<Reader, ReceiverError>> = StaticCell::new();
    let memory = MEMORY.take();
    RECEIVER.init_with(|| Receiver::new(settings, memory, NoSearch))
}
