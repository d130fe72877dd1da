//! The flashed images and the programs that run them.

use std::path::{Path, PathBuf};

use vocc_tests::programs;
use vocc_tests::trials::Unready;
use vocc_tests::{emulator, firmware};

use crate::signed;

/// The programs under test, each built with the command that a user would give.
pub struct Programs {
    /// The ELF file of the transmitter.
    pub transmitter: PathBuf,
    /// The ELF file of the receiver.
    pub receiver: PathBuf,
    /// The program that draws the camera's view.
    pub eye: PathBuf,
    /// The `vocc` program.
    pub vocc: PathBuf,
}

const RP2040: &str = "thumbv6m-none-eabi";
/// The receiver's features for the first Pico.
const RECEIVER: [&str; 3] = ["--no-default-features", "--features", "rp2040"];

impl Programs {
    /// Builds the images and `vocc`, and downloads the emulator.
    pub fn provide() -> Result<Self, Unready> {
        emulator::provide()?;
        Ok(Self {
            transmitter: built("tx-firmware/boards/pico", "vocc-pico", &[], "")?,
            receiver: built("rx-pipeline/boards/pico", "vocc-receiver-pico", &RECEIVER, &signed::trusted())?,
            eye: env!("CARGO_BIN_EXE_hm01b0_eye").into(),
            vocc: programs::vocc()?,
        })
    }
}

/// Builds an image that trusts these keys and keeps a copy, because other tests overwrite it.
fn built(board: &str, name: &str, features: &[&str], trusted: &str) -> Result<PathBuf, Unready> {
    let folder = firmware::build_with([("VOCC_TRUST", trusted)], RP2040, board, features)?;
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-of-a-pair"));
    std::fs::copy(folder.join(name), &kept)?;
    Ok(kept)
}
