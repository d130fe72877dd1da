//! Invalid frames: the receiver finds nothing in them, does not panic, and delivers nothing.

use link::framing::Event;
use properties::prelude::*;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};

const PIXELS: usize = 4096;
const LARGEST: usize = 160;

type Owned = Receiver<PIXELS, Box<ReceiverMemory<PIXELS>>, FrameSearch<Box<SearchMemory>, Vec<u8>>>;

fn receiver() -> Owned {
    let search = FrameSearch::with_history(Box::default(), vec![0; FrameSearch::<Box<SearchMemory>>::bytes(LARGEST, LARGEST)]);
    Receiver::new(ReceiverSettings::default(), Box::default(), search).expect("the default settings")
}

/// Processes frames; returns the numbers of readings and of messages.
fn receive(receiver: &mut Owned, frames: impl IntoIterator<Item = Picture>) -> (usize, usize) {
    let (mut read, mut delivered) = (0, 0);
    for (number, picture) in (0..).zip(frames) {
        let frame = Frame::new(&picture.pixels, picture.width, picture.height).expect("a frame");
        let outcome = receiver.frame(number, &frame);
        read += usize::from(outcome.reading.is_ok());
        delivered += usize::from(matches!(outcome.event, Event::Delivered(_)));
    }
    (read, delivered)
}

#[derive(Clone, Debug)]
struct Picture {
    pixels: Vec<u8>,
    width: usize,
    height: usize,
}

impl Picture {
    fn plain(width: usize, height: usize, grey: u8) -> Self {
        Self {
            pixels: vec![grey; width * height],
            width,
            height,
        }
    }

    /// A plain picture with `columns` × `rows` spots; `lit` says which are lit.
    fn spots(
        width: usize,
        height: usize,
        first: [f32; 2],
        pitch: f32,
        [columns, rows]: [usize; 2],
        lit: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let mut picture = Self::plain(width, height, 100);
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            let mut light = 0.0;
            for row in 0..rows {
                for column in (0..columns).filter(|&column| lit(column, row)) {
                    let (dx, dy) = (x - first[0] - column as f32 * pitch, y - first[1] - row as f32 * pitch);
                    light += (-(dx * dx + dy * dy) / 5.0).exp();
                }
            }
            *pixel = (100.0 + 110.0 * light).min(255.0) as u8;
        }
        picture
    }
}

/// A pseudorandom bit.
fn random(seed: u64) -> bool {
    let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed ^ mixed >> 32) & 1 == 1
}

#[test]
fn black_white_and_tiny_frames_hold_nothing() {
    for (width, height) in [(1, 1), (1, 160), (160, 1), (2, 2), (15, 17), (160, 160)] {
        for grey in [0, 118, 255] {
            let frames = (0..4).map(|_| Picture::plain(width, height, grey));
            assert_eq!(receive(&mut receiver(), frames), (0, 0), "{width}x{height} at {grey}");
        }
    }
}

#[test]
fn a_screen_full_of_blinking_lights_is_no_panel() {
    for pitch in [4.4, 6.0, 9.0] {
        let lights = (150.0 / pitch) as usize;
        let frames = (0..8u64).map(|number| {
            Picture::spots(160, 160, [5.0, 5.0], pitch, [lights; 2], |column, row| {
                random(number * 10_000 + (row * 100 + column) as u64)
            })
        });
        assert_eq!(receive(&mut receiver(), frames), (0, 0), "pitch {pitch}");
    }
}

#[test]
fn a_panel_half_out_of_the_frame_is_not_read() {
    for first in [[-15.0, 40.0], [40.0, -15.0], [140.0, 60.0], [60.0, 140.0], [-12.0, -12.0]] {
        let frames = (0..8u64).map(|number| {
            Picture::spots(160, 160, first, 4.4, [8; 2], |column, row| {
                random(number * 100 + (row * 8 + column) as u64)
            })
        });
        assert_eq!(receive(&mut receiver(), frames), (0, 0), "{first:?}");
    }
}

#[test]
fn a_panel_wholly_in_the_frame_is() {
    let frames = (0..8u64).map(|number| {
        Picture::spots(160, 160, [60.3, 50.6], 4.4, [8; 2], |column, row| {
            random(number * 100 + (row * 8 + column) as u64)
        })
    });
    let (read, delivered) = receive(&mut receiver(), frames);
    assert!(read >= 7 && delivered == 0, "{read} read, {delivered} delivered");
}

fn picture() -> impl Strategy<Value = Picture> {
    let size = (1..LARGEST, 1..LARGEST);
    let noise = size.clone().prop_flat_map(|(width, height)| {
        let grey = prop_oneof![any::<u8>(), Just(0), Just(255)];
        prop::collection::vec(grey, width * height).prop_map(move |pixels| Picture { pixels, width, height })
    });
    let blocks = (size, any::<u64>(), 1..12usize, any::<[u8; 2]>()).prop_map(|((width, height), seed, side, greys)| {
        let mut picture = Picture::plain(width, height, 0);
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let block = (i / width / side) * 200 + i % width / side;
            *pixel = greys[usize::from(random(seed.wrapping_add(block as u64)))];
        }
        picture
    });
    prop_oneof![noise, blocks]
}

properties! {
    #![cases(24)]

    #[test]
    fn no_frames_of_changing_size_panic_or_deliver(frames in prop::collection::vec(picture(), 1..8)) {
        let (_, delivered) = receive(&mut receiver(), frames);
        prop_assert_eq!(delivered, 0);
    }
}
