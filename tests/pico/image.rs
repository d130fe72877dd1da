//! The image that is flashed, and what it takes to run it.

use std::path::{Path, PathBuf};
use std::process::Command;

use vocc_tests::firmware::{self, output, root};

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
    /// What is missing on this computer, in words.
    pub fn provide() -> Result<Self, String> {
        provide_emulator()?;
        let built = firmware::build("thumbv6m-none-eabi", "tx-firmware/boards/pico")?;
        let beside = beside_the_tests()?;
        let optimised = beside.ends_with("release").then_some("--release");
        output(
            Command::new(env!("CARGO"))
                .args(["build", "--quiet", "--locked", "--bin", "vocc"])
                .args(optimised),
        )?;
        Ok(Self {
            image: built.join("vocc-pico"),
            vocc: beside.join("vocc"),
        })
    }
}

/// Where Cargo puts programs of the profile that this test was built with.
fn beside_the_tests() -> Result<PathBuf, String> {
    let test = std::env::current_exe().map_err(|error| error.to_string())?;
    let folder = test.parent().and_then(Path::parent);
    folder
        .map(Path::to_owned)
        .ok_or(format!("{} lies in no target folder", test.display()))
}

fn provide_emulator() -> Result<(), String> {
    let folder = root().join("tests/emulator");
    if folder.join("node_modules/rp2040js").is_dir() {
        return output(Command::new("node").arg("--version")).map(drop);
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
