//! What a film takes on the board: the same text and the same decisions as here, and how many instructions.

use vocc_tests::firmware::{median, say, size};

use crate::Images;
use crate::board::{self, Run};
use crate::film::{DARK_S, Film, Panel};
use crate::here::{MODE, Said};

/// The Pico 2's clock, and all of its memory.
const CYCLES_A_US: u64 = 150;
const RAM_BYTES: u32 = 520 * 1024;
/// The times of a frame that one may take: an instruction takes a cycle or more, so that at two times of it one frame passes by, at three
/// two.
///
/// A searched frame is to be done before the next one is there; some are not.
const SEARCHED_AT_MOST: u64 = 2;
/// The panel is found and read in the same frame.
const FOUND_AT_MOST: u64 = 2;
/// Followed frames take half of their time, as a rule.
const FOLLOWED_SHARE: u64 = 2;
/// One that ends a code word which can hardly be decoded takes long,
const FOLLOWED_AT_MOST: u64 = 3;
/// and no more than one in so many does.
const SELDOM: usize = 50;

/// Within which a text of 48 bytes is there from afar, s.
const FAR_TEXT_S: f64 = 4.0;

const TEXT: &str = "Hello by light";
const LONG_TEXT: &str = "Ice on the bridge, 40 km/h, keep 50 m apart, ok.";

pub fn a_panel_at_rest_is_read_as_on_this_computer(images: &Images) {
    let panel = Panel {
        text: TEXT,
        distance_m: 4.0,
        interval: 1.0,
        drift_m: 0.0,
    };
    reads_as_here(images, "3.6 px pitch at rest", panel);
}

pub fn a_large_panel_is_read_as_on_this_computer(images: &Images) {
    let panel = Panel {
        text: TEXT,
        distance_m: 1.5,
        interval: 1.0,
        drift_m: 0.0,
    };
    reads_as_here(images, "9.7 px pitch at rest", panel);
}

pub fn a_moving_panel_is_read_as_on_this_computer(images: &Images) {
    let panel = Panel {
        text: TEXT,
        distance_m: 3.0,
        interval: 1.0,
        drift_m: 0.002_5,
    };
    reads_as_here(images, "4.8 px pitch, 0.2 px a frame", panel);
}

pub fn a_long_text_is_read_as_on_this_computer(images: &Images) {
    let panel = Panel {
        text: LONG_TEXT,
        distance_m: 5.0,
        interval: 1.0,
        drift_m: 0.0,
    };
    reads_as_here(images, "2.9 px pitch at rest, 48 bytes", panel);
}

/// LEDs 90 mm apart, as far away as this camera reads them.
pub fn a_far_panel_is_read_within_four_seconds(images: &Images) {
    let panel = Panel {
        text: LONG_TEXT,
        distance_m: 10.0,
        interval: 2.0,
        drift_m: 0.0,
    };
    let text_after_s = reads_as_here(images, "2.2 px pitch at 10 m, 48 bytes", panel);
    assert!(text_after_s < FAR_TEXT_S, "{text_after_s} s");
}

/// The seconds of light until the text was there.
fn reads_as_here(images: &Images, what: &str, panel: Panel) -> f64 {
    let film = Film::draw(panel);
    let text = format!("message: {}", panel.text);
    assert!(film.text.contains(&text), "here: {:?}", film.text);
    let run = board::read(&images.board, &film);
    let said = run.frames.iter().map(|(said, _)| *said);
    let differs = said.zip(&film.said).position(|(there, here)| there != *here);
    if let Some(number) = differs {
        let (there, here) = (&run.frames[number], &film.said[number]);
        panic!("frame {number}: {there:?} there, {here:?} here");
    }
    assert_eq!(run.frames.len(), film.said.len());
    assert_eq!(run.text, film.text);
    let text_after_s = tell_times(what, &film);
    Costs::of(&run).hold(what);
    holds_in_memory(images, what, run.stack_bytes);
    text_after_s
}

/// Tells, and gives the latter, after how much of the panel's light it was found, and the text was there, where no frame passes by.
fn tell_times(what: &str, film: &Film) -> f64 {
    let after_s = |is_there: fn(&Said) -> bool| {
        let frame = film.said.iter().position(is_there).expect("it is found and read");
        (frame + 1) as f64 * f64::from(MODE.period_us()) / 1e6 - DARK_S
    };
    let text_after_s = after_s(|said| said.messages > 0);
    say(&format!(
        "Cortex-M33, {what}: found after {:.2} s, the text after {text_after_s:.2} s of light",
        after_s(|said| said.found > 0),
    ));
    text_after_s
}

/// Instructions of each frame, by what it was.
#[derive(Default)]
struct Costs {
    searched: Vec<u64>,
    found: Vec<u64>,
    followed: Vec<u64>,
}

impl Costs {
    fn of(run: &Run) -> Self {
        let mut costs = Self::default();
        let mut was_following = false;
        for (said, instructions) in &run.frames {
            let is_following = said.found > said.lost;
            let kind = match (was_following, is_following) {
                (false, false) => &mut costs.searched,
                (false, true) => &mut costs.found,
                _ => &mut costs.followed,
            };
            kind.push(*instructions);
            was_following = is_following;
        }
        costs
    }

    /// Says them, and holds them against the frame's time.
    fn hold(&self, what: &str) {
        let period = CYCLES_A_US * u64::from(MODE.period_us());
        for (kind, counts) in [
            ("searched", &self.searched),
            ("found and first read", &self.found),
            ("followed", &self.followed),
        ] {
            say(&format!(
                "Cortex-M33, {what}: {} frames {kind}, {} instructions each, {} at most; {period} cycles are a frame's time",
                counts.len(),
                median(counts),
                most(counts),
            ));
            assert!(!counts.is_empty(), "no frame was {kind}");
        }
        let late = self.followed.iter().filter(|&&count| count > period);
        let late = late.count();
        say(&format!(
            "Cortex-M33, {what}: {late} frames followed took longer than a frame's time"
        ));
        assert!(median(&self.searched) <= period, "{:?}", self.searched);
        assert!(most(&self.searched) <= SEARCHED_AT_MOST * period, "{:?}", self.searched);
        assert!(most(&self.found) <= FOUND_AT_MOST * period, "{:?}", self.found);
        assert!(median(&self.followed) <= period / FOLLOWED_SHARE, "{:?}", self.followed);
        assert!(most(&self.followed) <= FOLLOWED_AT_MOST * period, "{:?}", self.followed);
        assert!(late <= self.followed.len() / SELDOM, "{:?}", self.followed);
    }
}

fn most(counts: &[u64]) -> u64 {
    counts.iter().copied().max().unwrap_or_default()
}

/// The stack fits beside what the Pico 2's program has in memory. There the interrupts of the capture and the ports use it, too.
fn holds_in_memory(images: &Images, what: &str, stack_bytes: u32) {
    let elf = std::fs::read(&images.pico).expect("the image is built");
    let left = RAM_BYTES.saturating_sub(size(&elf).ram);
    say(&format!(
        "Cortex-M33, {what}: stack {stack_bytes} bytes of {left} that the Pico 2's program leaves"
    ));
    assert!(stack_bytes <= left);
}
