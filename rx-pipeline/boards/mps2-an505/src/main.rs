//! The receiver's verdicts on signed messages on a Cortex-M33, the Pico 2's processor, that QEMU emulates: it reads keys, messages and
//! signatures from its memory, and reports the verdicts and their duration in ticks.
//!
//! The board is Arm's MPS2 with its FPGA image AN505.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod cases;
#[path = "../../mps2-an500/src/clock.rs"]
mod clock;
#[path = "../../mps2-an500/src/host.rs"]
mod host;
#[path = "../../pico/src/stack.rs"]
mod stack;

use cortex_m_semihosting::hio;
use link::framing::{Signature, SignedPayload};
use rx_pipeline::standalone::Trust;

use cases::{BYTES, Case, Head, Report, START};

/// Maximum size of a report in bytes.
const REPORT_MAX: usize = 64;

#[cortex_m_rt::entry]
fn main() -> ! {
    host::end(judge())
}

fn judge() -> Option<()> {
    clock::start()?;
    // SAFETY: the memory exists as long as the program runs, nobody writes to it, and any bytes are valid.
    #[allow(unsafe_code)]
    let cases = unsafe { core::slice::from_raw_parts(START as *const u8, BYTES) };
    let (head, mut cases) = postcard::take_from_bytes::<Head<'_>>(cases).ok()?;
    let mut trust = Trust::parse(head.keys).ok()?;
    let mut out = hio::hstdout().ok()?;
    for _ in 0..head.cases {
        let (case, rest) = postcard::take_from_bytes::<Case<'_>>(cases).ok()?;
        cases = rest;
        let signed = SignedPayload {
            message: case.message,
            signature: Signature::from_bytes(case.signature.try_into().ok()?),
        };
        let began = clock::now();
        let report = Report {
            verdict: trust.verdict(&signed),
            ticks: clock::since(began),
            stack_bytes: stack::deepest_bytes(),
        };
        out.write_all(postcard::to_slice(&report, &mut [0; REPORT_MAX]).ok()?).ok()?;
    }
    Some(())
}
