//! The emulated boards: loads what they read into their memory and records their reports.

use std::path::Path;
use std::process::{Command, Stdio};

use serde::de::DeserializeOwned;

use crate::cases;
use crate::film::{Film, START};
use crate::format::Report;

/// QEMU advances 2⁰ ns per instruction.
const SHIFT: u32 = 0;

/// A board of QEMU.
pub struct Machine {
    name: &'static str,
    /// The duration of a tick of its clock, ns.
    tick_ns: u64,
    /// The address of the memory that is loaded.
    start: usize,
}

/// A Cortex-M7.
pub const AN500: Machine = Machine {
    name: "mps2-an500",
    tick_ns: 40,
    start: START,
};

/// A Cortex-M33.
pub const AN505: Machine = Machine {
    name: "mps2-an505",
    tick_ns: 50,
    start: cases::START,
};

/// Runs a program on a film; returns its report on each region.
pub fn read(image: &Path, film: &Film) -> Vec<Report> {
    let mut memory = tempfile::NamedTempFile::new().expect("a file");
    film.write(&mut memory).expect("the film is written");
    let reports = AN500.run(image, memory.path());
    assert_eq!(reports.len(), film.regions());
    reports
}

impl Machine {
    /// Runs a program on the contents of a file; returns its reports.
    pub fn run<R: DeserializeOwned>(&self, image: &Path, memory: &Path) -> Vec<R> {
        let loader = format!("loader,file={},addr={:#x},force-raw=on", memory.display(), self.start);
        let output = Command::new("qemu-system-arm")
            .args(["-machine", self.name, "-display", "none"])
            .args(["-monitor", "none", "-serial", "none"])
            .args(["-chardev", "stdio,id=text,signal=off"])
            .args(["-semihosting-config", "enable=on,target=native,chardev=text"])
            .args(["-device", &loader])
            .arg("-icount")
            .arg(format!("shift={SHIFT},sleep=off"))
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::null())
            .output()
            .expect("QEMU runs");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}{}", String::from_utf8_lossy(&output.stdout));
        let mut reports = vec![];
        let mut rest = &output.stdout[..];
        while !rest.is_empty() {
            let report;
            (report, rest) = postcard::take_from_bytes(rest).expect("a report");
            reports.push(report);
        }
        reports
    }

    /// Converts ticks to instructions.
    pub fn instructions(&self, ticks: u32) -> u64 {
        (u64::from(ticks) * self.tick_ns) >> SHIFT
    }
}

/// Converts ticks of the Cortex-M7's board to instructions.
pub fn instructions(ticks: u32) -> u64 {
    AN500.instructions(ticks)
}
