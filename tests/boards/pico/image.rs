//! The image that is flashed, and what it takes to run it.

use std::path::{Path, PathBuf};

use vocc_tests::programs;
use vocc_tests::trials::Unready;
use vocc_tests::{emulator, firmware};

/// What the tests run: each is made by the command that a user would give.
pub struct Programs {
    /// The ELF file of the board.
    pub image: PathBuf,
    /// The same for a board that signs no messages.
    pub unsigned: PathBuf,
    /// That of the desk kit: with a MAX7219, and without a light sensor.
    pub kit: PathBuf,
    /// The `vocc` program.
    pub vocc: PathBuf,
}

impl Programs {
    /// Builds the image and `vocc`, and fetches the emulator.
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

/// The default ones but for `signing`.
const UNSIGNED: &str = "rp2040,opt3001";

/// Builds the image and keeps it by this name: the next build has another in its place.
fn built(name: &str, features: &[&str]) -> Result<PathBuf, Unready> {
    let folder = firmware::build("thumbv6m-none-eabi", "tx-firmware/boards/pico", features)?;
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("vocc-pico-{name}"));
    std::fs::copy(folder.join("vocc-pico"), &kept)?;
    Ok(kept)
}
