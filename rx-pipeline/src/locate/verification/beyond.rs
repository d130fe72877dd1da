//! Detects lattices that continue. A panel ends on all four sides. Boards of lamps, dot-matrix signs, windows and the modules of a code
//! continue on the same lattice.
//!
//! At an LED the light is curved along rows and along columns; the LEDs found give the amount for this camera. Each place on the lattice,
//! up to [`LINES`] lines beyond it, with the same curvature counts as one more LED. Edges, gradients and textures of another size rarely
//! have it in both directions.

use super::led_likeness::{median_of, second_differences, unexplained};
use crate::spots::{LatticeModel, Observation};
use heapless::Vec;
use link::panel::{LEDS, SIDE};

/// Lines to search beyond the lattice on each side (count). More: more distant letters of a sign are found, and more chance likenesses of
/// an LED.
const LINES: i32 = 4;
/// A place counts as a further LED if it differs from the usual one by less (share of the step from Off to On). Higher: more by chance.
const JUST_LIKE: f32 = 0.3;
/// Its curvature must also be at least this part of the usual one (share).
const LEAST_SHARE: f32 = 0.5;
/// On LEDs are the reference if their curvature exceeds this (share of the step from Off to On). Otherwise Off LEDs are, as on a white
/// board or in merged spots.
const STANDS_OUT: f32 = 0.28;
/// LEDs in the other state that look like the reference, at most (count): with more, the light is ambiguous.
const MOST_MISTAKEN: usize = 2;
/// Further LEDs in the line next to the lattice, and in all lines beyond the number between them, at most (count). Panels before
/// photographs have next to none. Lower: more panels before clutter wait for other frames.
const MOST: (u32, u32) = (1, 5);
/// Offsets of half a line, where the lattice has no places (pitches).
const BETWEEN: [[f32; 2]; 3] = [[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]];

/// The number of further LEDs beyond the lattice, if it continues; `None` if it ends as a panel does.
pub(super) fn goes_on(observation: Observation<'_, '_>, spots: &LatticeModel) -> Option<u32> {
    let (mut on, mut off) = (Vec::<f32, LEDS>::new(), Vec::<f32, LEDS>::new());
    for led in 0..LEDS {
        let group = if spots.state[led] > 0.5 { &mut on } else { &mut off };
        let at = [(led % SIDE) as f32, (led / SIDE) as f32];
        // The capacity holds all LEDs.
        let _full = group.push(curvature(spots, at, |at| Some(observation.light_at(at)?.0)));
    }
    let (of_on, of_off) = (median_of(&mut on)?, median_of(&mut off)?);
    let step = of_on - of_off;
    let (usual, others) = if of_on > STANDS_OUT * step { (of_on, &off) } else { (of_off, &on) };
    let is_like = |value: f32| (value - usual).abs() < JUST_LIKE * step.abs() && value / usual > LEAST_SHARE;
    if others.iter().filter(|&&value| is_like(value)).count() > MOST_MISTAKEN {
        return None;
    }
    let count = |offset: [f32; 2]| {
        let side = SIDE as i32;
        let places = (-LINES..side + LINES).flat_map(|row| (-LINES..side + LINES).map(move |column| [column, row]));
        let (mut next, mut all) = (0, 0);
        for place in places {
            let beyond = place.map(|line| (-line).max(line - (side - 1)));
            let beyond = beyond[0].max(beyond[1]);
            let at = [0, 1].map(|axis| place[axis] as f32 + offset[axis]);
            // Without the light spilled by the LEDs.
            if beyond > 0 && is_like(curvature(spots, at, |at| Some(unexplained(observation, spots, at)))) {
                all += 1;
                next += u32::from(beyond == 1);
            }
        }
        (next, all)
    };
    let (next, all) = count([0.0; 2]);
    // Other lights lie as often between the lattice's lines as on them.
    let by_chance = || BETWEEN.map(|offset| count(offset).1).into_iter().fold(0, u32::max);
    (next > MOST.0 || all > MOST.1 && all > MOST.1 + by_chance()).then_some(all)
}

/// The lesser of the second differences of a light along the row and along the column; 0 at the frame's edge.
fn curvature(spots: &LatticeModel, at: [f32; 2], light: impl Fn([f32; 2]) -> Option<f32>) -> f32 {
    second_differences(spots, at, light).map_or(0.0, |[across, down]| across.min(down))
}
