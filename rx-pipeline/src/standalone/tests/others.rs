//! Blinking objects that are not panels: the floating-point receiver finds them, too, and gives them up.

use super::*;
use crate::frame::Frame;
use std::println;

const FRAMES: u64 = 600;
/// A proof takes 30 symbols, 45 frames; from one find to the next it takes another 132 and some more for the search.
const MOST_FOLLOWED: u32 = 45 * 4;
const EXPOSURE: Exposure = Exposure { lines: 40, gain_log2: 0 };

/// The number of frames in which it reports that it follows something. A naive one accepts anything that it finds.
fn followed(is_naive: bool, scene: &mut Scene) -> u32 {
    let rate = SYMBOL_MILLIHERTZ as f32 * QVGA.period_us() as f32 * 1e-9;
    let mut receiver = follower(QVGA);
    receiver.begin(rate).unwrap();
    let mut count = 0;
    for number in 1..=FRAMES {
        if is_naive {
            receiver.proof = Proof::new(rate);
        }
        let pixels = scene.frame(number * u64::from(QVGA.period_us()), EXPOSURE);
        let frame = Frame::new(&pixels, QVGA.width, QVGA.height).unwrap();
        count += u32::from(receiver.frame(number, &frame, &mut ()).is_following);
    }
    count
}

fn shows(bits: impl Fn(u64) -> u64) -> Scene {
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"none of the link");
    scene.symbols = (0..840).map(bits).collect();
    scene
}

/// An edge that passes over lamps, one column at a time; and a sign of which eight lamps are lit, one after another.
#[test]
fn what_blinks_otherwise_than_panels_do_is_given_up() {
    for (what, bits) in [
        ("an edge over lamps", (|k| 0x0101_0101_0101_0101 << (k % 8)) as fn(u64) -> u64),
        ("a running light", |k| {
            0x8040_2010_0804_0201u64.rotate_left((k * 3 % 8) as u32) | 1 << (k % 64)
        }),
    ] {
        let [naive, careful] = [true, false].map(|is_naive| followed(is_naive, &mut shows(bits)));
        println!("{what}: followed in {naive} of {FRAMES} frames naively, in {careful}");
        assert!(naive > 450, "{what}: {naive}");
        assert!(careful <= MOST_FOLLOWED, "{what}: {careful}");
    }
}

/// A panel stays accepted, message after message.
#[test]
fn a_panel_goes_on_being_followed() {
    let mut scene = Scene::new(QVGA, SYMBOL_MILLIHERTZ, b"ice on the bridge");
    let count = followed(false, &mut scene);
    assert!(count > FRAMES as u32 - 30, "{count}");
}
