//! The flashed images and the programs that run them.

use std::path::{Path, PathBuf};

use vocc_tests::programs;
use vocc_tests::trials::Unready;
use vocc_tests::{emulator, firmware};

/// The programs under test, each built with the command that a user would give.
pub struct Programs {
    /// The ELF file of the board.
    pub image: PathBuf,
    /// The ELF file of a board that signs no messages.
    pub unsigned: PathBuf,
    /// The ELF file of the desk kit: with a MAX7219, and without a light sensor.
    pub kit: PathBuf,
    /// The `vocc` program.
    pub vocc: PathBuf,
}

impl Programs {
    /// Builds the images and `vocc`, and downloads the emulator.
    pub fn provide() -> Result<Self, Unready> {
        emulator::provide()?;
        Ok(Self {
            kit: built("kit", &["--no-default-features", "--features", KIT])?,
            unsigned: built("unsigned", &["--no-default-features", "--features", UNSIGNED])?,
            image: built("default", &[])?,
            vocc: programs::vocc()?,
        })
    }
}

/// The features of the desk kit, as `docs/hardware/desk-kit.md` gives them.
const KIT: &str = "rp2040,max7219,no-sensor";

/// The default features without `signing`.
const UNSIGNED: &str = "rp2040,opt3001";

/// Builds an image and keeps a copy with this name, because the next build overwrites it.
fn built(name: &str, features: &[&str]) -> Result<PathBuf, Unready> {
    let folder = firmware::build("thumbv6m-none-eabi", "tx-firmware/boards/pico", features)?;
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("vocc-pico-{name}"));
    std::fs::copy(folder.join("vocc-pico"), &kept)?;
    Ok(kept)
}
