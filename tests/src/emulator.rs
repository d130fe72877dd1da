//! The emulator of the RP2040 in `tests/boards/emulator`, which takes Node.

use std::process::Command;

use crate::programs::{output, root};
use crate::trials::Unready;

/// Sees to it that the emulator can be run.
///
/// # Errors
/// `Absent` where there is no Node; why the emulator cannot be fetched.
pub fn provide() -> Result<(), Unready> {
    output(Command::new("node").arg("--version"))?;
    let folder = root().join("tests/boards/emulator");
    if folder.join("node_modules/rp2040js").is_dir() {
        return Ok(());
    }
    output(Command::new("npm").arg("ci").arg("--no-audit").arg("--prefix").arg(folder)).map(drop)
}
