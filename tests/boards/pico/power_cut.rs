//! Power cuts in the middle of flash operations.

use std::path::Path;

use crate::emulator::Emulator;
use crate::image::Programs;
use crate::terminal::Terminal;
use crate::vocc::vocc;

/// A powered board, shortly after its start.
fn started(programs: &Programs, folder: &Path) -> Emulator {
    let mut board = Emulator::power_up(programs, folder, &[]);
    board.run_ms(100);
    board
}

/// Lets `vocc` change a board in `folder`.
pub fn change(programs: &Programs, folder: &Path, words: &[&str]) {
    let mut board = started(programs, folder);
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    vocc(programs, folder, words, terminal.name()).json();
}

/// Lets `vocc` begin the same change repeatedly, always on a board in the same state, and cuts the power after an increasing number of
/// flash operations, until the change is complete before the cut. After each cut, `is_new`, with the number of operations, says whether the
/// board has the new state. It must have the old state up to some cut, and the new one after it. Returns the number of attempts.
pub fn at_every_operation(programs: &Programs, folder: &Path, words: &[&str], is_new: impl Fn(&Terminal, u32) -> bool) -> usize {
    let flashed = folder.join("flash.bin");
    let before = std::fs::read(&flashed).expect("the flash is a file");
    let mut kept = vec![];
    for operations in 0.. {
        std::fs::write(&flashed, &before).expect("the flash is a file");
        let off = {
            let mut board = started(programs, folder);
            board.cut_power_after(operations);
            board.real_time(true);
            let terminal = Terminal::open(board.socket());
            vocc(programs, folder, words, terminal.name());
            board.is_off()
        };
        let mut board = started(programs, folder);
        board.real_time(true);
        kept.push(is_new(&Terminal::open(board.socket()), operations));
        if !off {
            break;
        }
    }
    assert!(kept.is_sorted() && !kept[0] && kept[kept.len() - 1], "{kept:?}");
    kept.len()
}
