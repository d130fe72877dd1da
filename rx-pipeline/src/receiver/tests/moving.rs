//! A panel that moves by itself, while the camera and the ground behind the panel rest.

use super::near::{before_blocks, off, receiver_of, square};
use super::*;

/// At a whole pitch a frame, all but one line of LEDs fall on other LEDs' old places, and the ground says that nothing has moved.
#[test]
fn a_panel_that_moves_before_a_still_ground_is_followed() {
    const FRAMES: u64 = 30;
    const PITCH: f32 = 9.0;
    let size = [480, 160];
    let panels = panels(FRAMES as usize);
    for pitches_a_frame in [0.3, 0.6, 1.0, 1.25] {
        let mut receiver = receiver_of(size[0], size[1]);
        let mut missed = 0;
        for number in 0..FRAMES {
            let centre = [60.0 + pitches_a_frame * PITCH * number as f32, 80.5];
            let pixels = before_blocks(size, centre, PITCH, panels[number as usize / 2].bits(), number);
            let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
            let reading = receiver.frame(number, &frame).reading;
            let is_right = reading.is_ok_and(|reading| off(&reading.corners, &square(centre, PITCH)) < 0.3 * PITCH);
            missed += u64::from(!is_right);
        }
        assert!(
            missed <= FRAMES / 4,
            "{pitches_a_frame} pitches a frame: {missed} of {FRAMES} not read in place"
        );
    }
}

/// A panel that drives into the frame is found, lost and found again. It is then expected at the speed between the two places.
#[test]
fn a_panel_that_is_found_twice_is_followed_at_its_speed() {
    const FRAMES: u64 = 40;
    const PITCH: f32 = 8.7;
    let size = [900, 160];
    let panels = panels(FRAMES as usize);
    for pitches_a_frame in [1.5, 1.9, 2.0, 2.1] {
        let mut receiver = receiver_of(size[0], size[1]);
        let mut missed = 0;
        for number in 0..FRAMES {
            let centre = [30.0 + pitches_a_frame * PITCH * number as f32, 80.5];
            let pixels = before_blocks(size, centre, PITCH, panels[number as usize].bits(), number);
            let frame = Frame::new(&pixels, size[0], size[1]).unwrap();
            let reading = receiver.frame(number, &frame).reading;
            let is_right = reading.is_ok_and(|reading| off(&reading.corners, &square(centre, PITCH)) < 0.3 * PITCH);
            missed += u64::from(!is_right);
        }
        assert!(
            missed <= 3,
            "{pitches_a_frame} pitches a frame: {missed} of {FRAMES} not read in place"
        );
    }
}
