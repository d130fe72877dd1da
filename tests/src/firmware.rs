//! Builds and measures programs for microcontrollers.

use std::io::Write;
use std::path::PathBuf;
use std::process::Command;

use object::read::elf::ElfFile32;
use object::{LittleEndian, Object, ObjectSegment};

use crate::programs::output;
use crate::trials::Unready;

/// Builds the program in the folder `board` as a user would, with these Cargo arguments; returns its output folder.
pub fn build(target: &str, board: &str, arguments: &[&str]) -> Result<PathBuf, Unready> {
    build_with([], target, board, arguments)
}

/// As [`build`], with these variables in the environment.
pub fn build_with<'a>(
    environment: impl IntoIterator<Item = (&'a str, &'a str)>,
    target: &str,
    board: &str,
    arguments: &[&str],
) -> Result<PathBuf, Unready> {
    let built = output(
        Command::new("bash")
            .envs(environment)
            .arg("tests/tools/cargo-embedded")
            .args([target, "--manifest-path"])
            .arg(format!("{board}/Cargo.toml"))
            .args(arguments),
    )?;
    Ok(built.lines().last().unwrap_or_default().into())
}

/// Memory use of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Bytes of flash.
    pub flash: u32,
    /// Bytes of static RAM, without the stack.
    pub ram: u32,
}

/// Flash use of an image, including its boot loader, and static RAM without the stack.
pub fn size(elf: &[u8]) -> Size {
    let file = ElfFile32::<LittleEndian>::parse(elf).expect("an ELF file of 32 bits");
    let mut size = Size { flash: 0, ram: 0 };
    for segment in file.segments() {
        let (_, in_file) = segment.file_range();
        size.flash += in_file as u32;
        if segment.address() >= 0x2000_0000 {
            size.ram += segment.size() as u32;
        }
    }
    size
}

/// The median; 0 if `values` is empty.
pub fn median(values: &[u64]) -> u64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

/// Prints a measurement past the test's captured output.
pub fn say(what: &str) {
    let _ = writeln!(std::io::stderr(), "measured: {what}");
}
