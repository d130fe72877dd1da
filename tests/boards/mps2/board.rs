//! The emulated board: loads a film into its memory and records its reports.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::film::{Film, START};
use crate::format::Report;

/// QEMU advances 2⁰ ns per instruction.
const SHIFT: u32 = 0;
/// Ticks of the board's clock are 40 ns.
const TICK_NS: u64 = 40;

/// Runs a program on a film; returns its report on each region.
pub fn read(image: &Path, film: &Film) -> Vec<Report> {
    let mut memory = tempfile::NamedTempFile::new().expect("a file");
    film.write(&mut memory).expect("the film is written");
    let loader = format!("loader,file={},addr={START:#x},force-raw=on", memory.path().display());
    let output = Command::new("qemu-system-arm")
        .args(["-machine", "mps2-an500", "-display", "none"])
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
    assert_eq!(reports.len(), film.regions());
    reports
}

/// Converts ticks to instructions.
pub fn instructions(ticks: u32) -> u64 {
    (u64::from(ticks) * TICK_NS) >> SHIFT
}
