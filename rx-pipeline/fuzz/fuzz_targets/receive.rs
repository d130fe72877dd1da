//! Receives any bytes as frames of any size: `cargo +nightly fuzz run receive` in `rx-pipeline`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};

fuzz_target!(|data: &[u8]| {
    let memory = Box::<ReceiverMemory<4096>>::default();
    let search = FrameSearch::with_history(
        Box::<SearchMemory>::default(),
        vec![0; FrameSearch::<Box<SearchMemory>>::bytes(128, 128)],
    );
    let mut receiver = Receiver::new(ReceiverSettings::default(), memory, search).expect("the default settings");
    let mut rest = data;
    let mut number = 0u64;
    // For each frame: its size, the increment of its number, and its pixels, repeated until the frame is full.
    while let [width, height, step, pixels @ ..] = rest {
        let (width, height) = (usize::from(*width % 128) + 1, usize::from(*height % 128) + 1);
        let part = pixels.len().min(width * height);
        if part == 0 {
            break;
        }
        let frame: Vec<u8> = pixels[..part].iter().copied().cycle().take(width * height).collect();
        number = number.wrapping_add(u64::from(*step));
        let _outcome = receiver.frame(number, &Frame::new(&frame, width, height).expect("a whole frame"));
        rest = &pixels[part..];
    }
    let _event = receiver.finish();
});
