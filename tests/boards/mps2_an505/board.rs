//! The emulated board: a film is put into its memory, and what it says is taken down.

use std::path::Path;
use std::process::{Command, Stdio};

use rx_pipeline::hm01b0::Exposure;

use crate::film::Film;
use crate::here::Said;

/// QEMU lets 2² ns pass with each instruction.
const SHIFT: u32 = 2;
/// Ticks of the board's clock are 50 ns.
const TICK_NS: u64 = 50;
/// Where the film begins in the board's memory.
const FILM_AT: &str = "0x80000000";

/// What the board made of a film.
pub struct Run {
    /// What it said of each frame, and the instructions that it took.
    pub frames: Vec<(Said, u64)>,
    /// Its text, line by line.
    pub text: Vec<String>,
    /// The deepest that the stack has been, bytes.
    pub stack_bytes: u32,
}

/// Has a program read a film.
pub fn read(image: &Path, film: &Film) -> Run {
    let mut memory = tempfile::NamedTempFile::new().expect("a file");
    film.write(&mut memory).expect("the film is written");
    let loader = format!("loader,file={},addr={FILM_AT},force-raw=on", memory.path().display());
    let output = Command::new("qemu-system-arm")
        .args(["-machine", "mps2-an505", "-display", "none"])
        .args(["-monitor", "none", "-serial", "none"])
        .args(["-chardev", "stdio,id=text,signal=off"])
        .args(["-semihosting-config", "enable=on,target=native,chardev=text"])
        .args(["-device", &loader])
        .arg("-icount")
        .arg(format!("shift={SHIFT},sleep=off"))
        .arg("-kernel")
        .arg(image)
        .stdin(Stdio::null())
        .output()
        .expect("QEMU runs");
    let text = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}{errors}");
    let mut run = Run {
        frames: vec![],
        text: vec![],
        stack_bytes: 0,
    };
    for line in text.lines() {
        match line.strip_prefix("frame ") {
            Some(numbers) => run.add(numbers),
            None => run.text.push(line.into()),
        }
    }
    run
}

impl Run {
    /// A line about a frame, as the board's program writes it.
    fn add(&mut self, numbers: &str) {
        let words = numbers.split(' ').map(str::parse);
        let words: Vec<u32> = words.collect::<Result<_, _>>().expect("numbers");
        let &[ticks, readings, found, lost, messages, lines, gain, stack] = &words[..] else {
            panic!("{numbers}: eight numbers");
        };
        let said = Said {
            readings,
            found,
            lost,
            messages,
            exposure: Exposure {
                lines: lines as u16,
                gain_log2: gain as u8,
            },
        };
        let instructions = (u64::from(ticks) * TICK_NS) >> SHIFT;
        self.frames.push((said, instructions));
        self.stack_bytes = stack;
    }
}
