//! What WebAssembly gives to JavaScript, and what it takes from it: plain functions, and places in memory.
//!
//! JavaScript writes a request as JSON into [`text_room`], bytes that go with it into [`bytes_room`], and calls [`ask`]: 0, or 1 where
//! [`answer`] is the sentence of a fault. It reads the answer at [`answer`], bytes at [`out`], and, of a frame that it has had drawn by
//! [`frame`], the numbers at [`numbers`] and the bits at [`bits`]. All places hold until the next call.
#![expect(unsafe_code, reason = "functions that JavaScript calls by their names, and those that it gives")]

use std::cell::RefCell;
use std::sync::Once;
use std::time::Duration;

use crate::ask::{LARGE, Page};

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    /// Milliseconds since some moment.
    safe fn now_ms() -> f64;
    /// Hears why the module will stop.
    safe fn panicked(text: *const u8, length: usize);
}

/// Numbers of a frame: AGR and GRI of each LED, the border between them, confidence, and three answers of yes (1) or no.
const NUMBERS: usize = 64 + 64 + 3 + 1 + 3;

/// The page and what JavaScript reads and writes of it.
struct Buffers {
    page: Page,
    text: Vec<u8>,
    bytes: Vec<u8>,
    answer: String,
    numbers: [f32; NUMBERS],
    bits: [u64; 3],
}

thread_local! {
    static DESK: RefCell<Buffers> = RefCell::new(Buffers {
        page: Page::default(),
        text: Vec::new(),
        bytes: Vec::new(),
        answer: String::new(),
        numbers: [0.0; NUMBERS],
        bits: [0; 3],
    });
}

fn at_desk<T>(work: impl FnOnce(&mut Buffers) -> T) -> T {
    static HOOKED: Once = Once::new();
    HOOKED.call_once(|| {
        std::panic::set_hook(Box::new(|why| {
            let why = why.to_string();
            panicked(why.as_ptr(), why.len());
        }));
    });
    DESK.with_borrow_mut(work)
}

/// The browser's clock.
pub fn clock() -> Duration {
    Duration::from_secs_f64(now_ms().max(0.0) / 1000.0)
}

/// Room for the text of a request.
#[unsafe(no_mangle)]
pub extern "C" fn text_room(length: usize) -> *mut u8 {
    at_desk(|desk| {
        desk.text.resize(length, 0);
        desk.text.as_mut_ptr()
    })
}

/// Room for the bytes of a request.
#[unsafe(no_mangle)]
pub extern "C" fn bytes_room(length: usize) -> *mut u8 {
    at_desk(|desk| {
        desk.bytes.resize(length, 0);
        desk.bytes.as_mut_ptr()
    })
}

/// Answers the request in the rooms.
#[unsafe(no_mangle)]
pub extern "C" fn ask() -> u32 {
    at_desk(|desk| {
        let text = String::from_utf8_lossy(&desk.text);
        let answer = desk.page.ask(&text, &desk.bytes);
        if desk.bytes.capacity() > LARGE {
            desk.bytes = Vec::new();
        }
        let is_fault = answer.is_err();
        desk.answer = answer.unwrap_or_else(|fault| fault.to_string());
        u32::from(is_fault)
    })
}

/// Draws and reads a frame of the scene that is open.
#[unsafe(no_mangle)]
pub extern "C" fn frame(number: u32) -> u32 {
    at_desk(|desk| {
        if let Err(fault) = desk.page.frame(number.into()) {
            desk.answer = fault.to_string();
            return 1;
        }
        let sight = desk.page.sight();
        let yes = |is: bool| f32::from(u8::from(is));
        let [by_features, by_pixels] = sight.is_read;
        let numbers = sight.agr.into_iter().chain(sight.gri).chain(sight.border);
        let rest = [sight.confidence, yes(sight.is_mixed), yes(by_features), yes(by_pixels)];
        for (place, number) in desk.numbers.iter_mut().zip(numbers.chain(rest)) {
            *place = number;
        }
        desk.bits = [sight.sent, sight.kmeans, sight.likeliest].map(|panel| panel.bits());
        desk.answer.clear();
        desk.answer.push_str(&sight.why);
        0
    })
}

/// The text of the answer, or of the fault; of a frame why it cannot be read.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    at_desk(|desk| desk.answer.as_ptr())
}

/// Its bytes.
#[unsafe(no_mangle)]
pub extern "C" fn answer_length() -> usize {
    at_desk(|desk| desk.answer.len())
}

/// The bytes that go with the answer.
#[unsafe(no_mangle)]
pub extern "C" fn out() -> *const u8 {
    at_desk(|desk| desk.page.out().as_ptr())
}

/// How many they are.
#[unsafe(no_mangle)]
pub extern "C" fn out_length() -> usize {
    at_desk(|desk| desk.page.out().len())
}

/// The frame's picture.
#[unsafe(no_mangle)]
pub extern "C" fn grey() -> *const u8 {
    at_desk(|desk| desk.page.grey().as_ptr())
}

/// Its pixels.
#[unsafe(no_mangle)]
pub extern "C" fn grey_length() -> usize {
    at_desk(|desk| desk.page.grey().len())
}

/// AGR and GRI of its LEDs, k-means' border, confidence, whether two symbols were caught, and who has read it: k-means, maximum
/// likelihood.
#[unsafe(no_mangle)]
pub extern "C" fn numbers() -> *const f32 {
    at_desk(|desk| desk.numbers.as_ptr())
}

/// What was sent, what k-means has read, and what maximum likelihood has.
#[unsafe(no_mangle)]
pub extern "C" fn bits() -> *const u64 {
    at_desk(|desk| desk.bits.as_ptr())
}
