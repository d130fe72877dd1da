//! The interface to JavaScript: plain functions, and addresses in WebAssembly's memory.
//!
//! JavaScript writes a request as JSON into [`text_room`], bytes that belong to it into [`bytes_room`], and calls [`ask`]. It returns 0, or
//! 1 for a fault, whose sentence is at [`answer`]. The answer is at [`answer`], its bytes are at [`out`]. For a frame drawn by [`frame`],
//! numbers are at [`numbers`] and bits at [`bits`]. All addresses are valid until the next call.
#![expect(unsafe_code, reason = "functions that JavaScript calls by their names, and those that it gives")]

use std::cell::RefCell;
use std::sync::Once;
use std::time::Duration;

use crate::ask::{LARGE, Page};

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    /// Milliseconds since an arbitrary time.
    safe fn now_ms() -> f64;
    /// Receives the reason before the module stops.
    safe fn panicked(text: *const u8, length: usize);
}

/// Numbers of a frame: AGR and GRI of each LED, the boundary between them, the confidence, and three flags (1 for yes, 0 for no).
const NUMBERS: usize = 64 + 64 + 3 + 1 + 3;

/// The page and its buffers for JavaScript.
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

/// A buffer for the text of a request.
#[unsafe(no_mangle)]
pub extern "C" fn text_room(length: usize) -> *mut u8 {
    at_desk(|desk| {
        desk.text.resize(length, 0);
        desk.text.as_mut_ptr()
    })
}

/// A buffer for the bytes of a request.
#[unsafe(no_mangle)]
pub extern "C" fn bytes_room(length: usize) -> *mut u8 {
    at_desk(|desk| {
        desk.bytes.resize(length, 0);
        desk.bytes.as_mut_ptr()
    })
}

/// Answers the request in the buffers.
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

/// Draws and reads a frame of the open scene.
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

/// The text of the answer or the fault; for a frame, the reason why it cannot be read.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    at_desk(|desk| desk.answer.as_ptr())
}

/// The length of the text in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn answer_length() -> usize {
    at_desk(|desk| desk.answer.len())
}

/// The bytes of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn out() -> *const u8 {
    at_desk(|desk| desk.page.out().as_ptr())
}

/// The number of bytes.
#[unsafe(no_mangle)]
pub extern "C" fn out_length() -> usize {
    at_desk(|desk| desk.page.out().len())
}

/// The frame's picture.
#[unsafe(no_mangle)]
pub extern "C" fn grey() -> *const u8 {
    at_desk(|desk| desk.page.grey().as_ptr())
}

/// The number of its pixels.
#[unsafe(no_mangle)]
pub extern "C" fn grey_length() -> usize {
    at_desk(|desk| desk.page.grey().len())
}

/// AGR and GRI of the frame's LEDs, the boundary of k-means, the confidence, whether two symbols were exposed, and whether k-means and
/// maximum likelihood could read the frame.
#[unsafe(no_mangle)]
pub extern "C" fn numbers() -> *const f32 {
    at_desk(|desk| desk.numbers.as_ptr())
}

/// The bits that were sent, those that k-means has read, and those of maximum likelihood.
#[unsafe(no_mangle)]
pub extern "C" fn bits() -> *const u64 {
    at_desk(|desk| desk.bits.as_ptr())
}
