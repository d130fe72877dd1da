//! `vocc receive` on frames with time stamps.

mod common;

use std::path::{Path, PathBuf};

use common::recording::{MESSAGE, film, run};
use common::{command, folder, says, text};

/// The frames with their times in seconds.
type Stamps = Vec<(String, f64)>;

/// Symbols a second.
const SYMBOLS_HZ: u32 = 30;

/// Hundredths of a second from one frame to the next, repeated: usually 2, sometimes earlier or later, and sometimes frames are lost.
const STEPS: [u32; 9] = [2, 1, 3, 2, 7, 2, 3, 4, 1];

/// A film of irregular frames, every seventh of which exists twice, all numbered in sequence, and the times of its frames.
fn irregular(name: &str) -> (PathBuf, Stamps) {
    let whole = film(&format!("{name}-whole"), MESSAGE, 160, SYMBOLS_HZ);
    let broken = folder(name);
    std::fs::create_dir_all(&broken).expect("a folder");
    let mut stamps = Vec::new();
    let mut frame = 0;
    for (count, step) in STEPS.iter().cycle().enumerate() {
        for _ in 0..if count % 7 == 6 { 2 } else { 1 } {
            let to = format!("f{:03}.png", stamps.len());
            let from = whole.join(format!("frame-{frame:06}.png"));
            std::fs::copy(from, broken.join(&to)).expect("a frame");
            stamps.push((to, 17.0 + f64::from(frame) * 0.01));
        }
        frame += step;
        if frame >= 160 {
            break;
        }
    }
    (broken, stamps)
}

fn write(folder: &Path, stamps: &[(String, f64)]) {
    let lines = stamps.iter().map(|(frame, time_s)| format!("{frame},{time_s:.4}\n"));
    let csv = "frame,seconds\n".to_owned() + &lines.collect::<String>();
    std::fs::write(folder.join("timestamps.csv"), csv).expect("a file");
}

fn receive(folder: &Path) -> std::process::Output {
    let rate = SYMBOLS_HZ.to_string();
    run(command(&["receive", "--json", "--symbol-rate", &rate]).arg(folder))
}

#[test]
fn frames_are_counted_by_their_times() {
    let (film, stamps) = irregular("stamped");
    write(&film, &stamps);
    let received = receive(&film);
    assert!(text(&received.stdout).contains(MESSAGE), "{}", text(&received.stderr));
    assert!(text(&received.stderr).contains("have the time of the frame before"));
    // With the numbers alone, frames are counted wrongly.
    std::fs::remove_file(film.join("timestamps.csv")).expect("the file");
    assert!(!text(&receive(&film).stdout).contains(MESSAGE));
}

#[test]
fn what_is_no_time_is_refused() {
    let (film, stamps) = irregular("mistimed");
    let refused = |change: &dyn Fn(&mut Stamps), sentences: &[&str]| {
        let mut stamps = stamps.clone();
        change(&mut stamps);
        write(&film, &stamps);
        says(&receive(&film), 2, sentences);
    };
    refused(&|stamps| stamps[5].1 -= 1.0, &["run backwards", "f005.png", "f004.png"]);
    refused(&|stamps| stamps.truncate(3), &["f003.png has no time stamp", "add a line for it"]);
    refused(
        &|stamps| stamps[5].1 = f64::NAN,
        &["line 7: \"f005.png,NaN\" is not a frame and its time"],
    );
    refused(
        &|stamps| stamps.push(("f999.png".to_owned(), 99.0)),
        &["has a time for f999.png, and the folder has no such frame"],
    );
    refused(
        &|stamps| stamps.iter_mut().for_each(|(_, time_s)| *time_s *= 1e3),
        &["give the times in seconds"],
    );
    std::fs::write(film.join("timestamps.csv"), [0xff, 0xfe, 0x00]).expect("a file");
    says(&receive(&film), 2, &["cannot read the time stamps"]);
}
