//! Programs for microcontrollers: built, and measured.

use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

use crate::programs::output;
use crate::trials::Unready;

/// Builds the program in the folder `board` as a user would; the folder that it then lies in.
///
/// # Errors
/// Why it cannot be built; `Absent` where there is no compiler for the target.
pub fn build(target: &str, board: &str) -> Result<PathBuf, Unready> {
    let built = output(
        Command::new("bash")
            .arg("tests/cargo-embedded")
            .args([target, "--manifest-path"])
            .arg(format!("{board}/Cargo.toml")),
    )?;
    Ok(built.lines().last().unwrap_or_default().into())
}

/// What a program takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Bytes of flash.
    pub flash: u32,
    /// Bytes of RAM before its stack.
    pub ram: u32,
}

/// What an image takes of the flash, its boot loader included, and of the RAM before its stack.
///
/// # Panics
/// When it is no ELF file of 32 bits.
pub fn size(elf: &[u8]) -> Size {
    let word = |at: usize| u32::from_le_bytes(elf[at..at + 4].try_into().expect("4 bytes"));
    let half = |at: usize| u16::from_le_bytes(elf[at..at + 2].try_into().expect("2 bytes"));
    let (start, each, count) = (word(28) as usize, half(42) as usize, half(44) as usize);
    let mut size = Size { flash: 0, ram: 0 };
    for at in (0..count).map(|index| start + index * each) {
        let [kind, address, in_file, in_memory] = [0, 8, 16, 20].map(|offset| word(at + offset));
        if kind == 1 {
            size.flash += in_file;
            if address >= 0x2000_0000 {
                size.ram += in_memory;
            }
        }
    }
    size
}

/// Tells a measurement, past the test's own output.
pub fn say(what: &str) {
    let _ = writeln!(std::io::stderr(), "measured: {what}");
}
