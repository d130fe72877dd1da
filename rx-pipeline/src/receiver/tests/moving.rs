//! A panel that moves by itself, while the camera and the ground behind the panel rest.

use super::near::{before_blocks, off, receiver_of, square};
use super::*;

/// The number of frames, of `frames`, in which a panel that moves to the right is not read in place. Each of its symbols lasts for
/// `symbol_frames`.
fn missed(width: usize, [from_x, pitch, pitches_a_frame]: [f32; 3], frames: u64, symbol_frames: usize) -> usize {
    let size = [width, 160];
    let panels = panels(frames as usize);
    let mut receiver = receiver_of(size[0], size[1]);
    let mut is_missed = |number: u64| {
        let centre = [from_x + pitches_a_frame * pitch * number as f32, 80.5];
        let bits = panels[number as usize / symbol_frames].bits();
        let pixels = before_blocks(size, centre, pitch, bits, number);
        let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
        let reading = receiver.frame(number, &frame).reading;
        !reading.is_ok_and(|reading| off(&reading.corners, &square(centre, pitch)) < 0.3 * pitch)
    };
    (0..frames).filter(|&number| is_missed(number)).count()
}

/// At a whole pitch a frame, all but one line of LEDs fall on other LEDs' old places, and the ground says that nothing has moved.
#[test]
fn a_panel_that_moves_before_a_still_ground_is_followed() {
    for pitches_a_frame in [0.3, 0.6, 1.0, 1.25] {
        let missed = missed(480, [60.0, 9.0, pitches_a_frame], 30, 2);
        assert!(missed <= 7, "{pitches_a_frame} pitches a frame: {missed} of 30 not read in place");
    }
}

/// A panel that drives into the frame is found, lost and found again. It is then expected at the speed between the two places.
#[test]
fn a_panel_that_is_found_twice_is_followed_at_its_speed() {
    for pitches_a_frame in [1.5, 1.9, 2.0, 2.1] {
        let missed = missed(900, [30.0, 8.7, pitches_a_frame], 40, 1);
        assert!(missed <= 3, "{pitches_a_frame} pitches a frame: {missed} of 40 not read in place");
    }
}
