//! The image that is flashed, and what it takes to run it.

use std::path::PathBuf;
use std::process::Command;

use vocc_tests::firmware;
use vocc_tests::programs::{self, output, root};
use vocc_tests::trials::Unready;

/// What the tests run: each is made by the command that a user would give.
pub struct Programs {
    /// The ELF file of the board.
    pub image: PathBuf,
    /// The `vocc` program.
    pub vocc: PathBuf,
}

impl Programs {
    /// Builds the image and `vocc`, and fetches the emulator.
    ///
    /// # Errors
    /// What is absent, or why something cannot be built.
    pub fn provide() -> Result<Self, Unready> {
        provide_emulator()?;
        let built = firmware::build("thumbv6m-none-eabi", "tx-firmware/boards/pico")?;
        Ok(Self {
            image: built.join("vocc-pico"),
            vocc: programs::vocc()?,
        })
    }
}

fn provide_emulator() -> Result<(), Unready> {
    output(Command::new("node").arg("--version"))?;
    let folder = root().join("tests/emulator");
    if folder.join("node_modules/rp2040js").is_dir() {
        return Ok(());
    }
    output(
        Command::new("npm")
            .arg("ci")
            .arg("--no-audit")
            .arg("--prefix")
            .arg(folder),
    )
    .map(drop)
}
