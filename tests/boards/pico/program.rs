//! The program's hash, by which a board is compared with a file.

use std::path::Path;

use link::serial::Request;
use reception::bytes::hex;
use tx_firmware::program::ProgramHash;

use crate::emulator::Emulator;
use crate::image::Programs;
use crate::signing::assert_symbols_went_on;
use crate::terminal::Terminal;
use crate::vocc::vocc;

/// The function that computes the hash.
const COMPUTES: &str = "11ProgramHash4read";
/// A byte of the second-stage boot loader behind its code: it changes nothing that runs.
const SPARE_BYTE: usize = 0xf0;

/// The board names the program that was flashed, of each image, and another one if a byte in the flash is another.
pub fn names_the_program_that_was_flashed(programs: &Programs, folder: &Path) {
    let images = [&programs.image, &programs.unsigned, &programs.kit];
    for (image, place) in images.into_iter().zip(["image", "unsigned", "kit"]) {
        let folder = &folder.join(place);
        std::fs::create_dir(folder).expect("a folder");
        let hello = || {
            let mut board = Emulator::power_up_image(image, folder);
            board.run_ms(100);
            board.real_time(true);
            let terminal = Terminal::open(board.socket());
            vocc(programs, folder, &["device", "hello"], terminal.name()).json()
        };
        let told = hello();
        let length = told["program_bytes"].as_u64().expect("it is reported") as usize;
        let flashed = folder.join("flash.bin");
        let mut flash = std::fs::read(&flashed).expect("the flash is a file");
        // Nothing of the program is behind it.
        assert!(flash[length..].iter().all(|&byte| byte == 0xff), "{place}: {length} bytes");
        assert_eq!(told["program_sha256"], hex(&ProgramHash::of(&flash[..length]).sha256));
        let image = image.to_str().expect("a name");
        let file = std::process::Command::new(&programs.vocc)
            .args(["device", "hello", "--json", "--no-board", "--image", image])
            .output()
            .expect("vocc runs");
        let file: serde_json::Value = serde_json::from_slice(&file.stdout).expect("JSON");
        assert_eq!(
            (&file["file_bytes"], &file["file_sha256"]),
            (&told["program_bytes"], &told["program_sha256"])
        );

        flash[SPARE_BYTE] ^= 1;
        std::fs::write(&flashed, &flash).expect("the flash is a file");
        let other = hello();
        assert_eq!(other["program_bytes"], told["program_bytes"]);
        assert_eq!(other["program_sha256"], hex(&ProgramHash::of(&flash[..length]).sha256));
        assert_ne!(other["program_sha256"], told["program_sha256"]);
    }
}

/// Symbols keep their time while the hash is computed.
pub fn symbols_go_on_while_the_program_is_hashed(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up_still(programs, folder, &["--time", COMPUTES]);
    board.run_ms(100);
    let events = board.ask(1, &Request::ReadProgramHash, 1_000);
    assert!(events.iter().all(|event| event.reset.is_none()));
    assert_symbols_went_on(&events, COMPUTES, "the program's hash");
    // Once after a start.
    let events = board.ask(2, &Request::ReadProgramHash, 1_000);
    let cycles = events.last().and_then(|last| last.cycles.as_ref()).expect("cycles were counted");
    assert_eq!(cycles[COMPUTES]["count"], 1);
}
