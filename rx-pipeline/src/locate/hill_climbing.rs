//! The pose of greatest evidence, from coarse to fine.

use super::evidence::Evidence;
use crate::lattice::Lattice;

/// A climb ends when its step is shorter (pitches). Shorter: more rounds, and a pose closer to the top.
const LAST_STEP: f32 = 0.02;
/// Climbs to lattices with a line more, less or further on, at most (count). More: slower, and worse starts are corrected.
const LINES: usize = 4;
/// Minimum gain of evidence by such a change (natural logarithm). Higher: lattices stay off by a line.
const MARGIN: f32 = 1.0;

/// A pose in five numbers, and the numbers of its lattice that take long to compute.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub centre: [f32; 2],
    /// Logarithm of the pitch along rows and along columns.
    log_pitch: [f32; 2],
    roll_rad: f32,
    /// Along rows and along columns, in samples.
    pub pitch: [f32; 2],
    /// Sine and cosine of the rotation.
    direction: (f32, f32),
}

impl Pose {
    pub fn new(centre: [f32; 2], log_pitch: [f32; 2], roll_rad: f32) -> Self {
        Self {
            centre,
            log_pitch,
            roll_rad,
            pitch: log_pitch.map(libm::expf),
            direction: (libm::sinf(roll_rad), libm::cosf(roll_rad)),
        }
    }

    /// The same around another centre.
    pub fn at(&self, centre: [f32; 2]) -> Self {
        Self { centre, ..*self }
    }

    pub fn lattice(&self) -> Lattice {
        Lattice::along(self.centre, self.pitch, self.direction)
    }

    /// One of [`MOVES`], `step` in samples at the panel's edge.
    fn moved(&self, kind: usize, step: f32) -> Self {
        let mut moved = *self;
        let ([across, down], (sin, cos)) = (self.pitch, self.direction);
        let mut grow = |axis: usize, by: f32| {
            moved.log_pitch[axis] += by;
            moved.pitch[axis] = libm::expf(moved.log_pitch[axis]);
        };
        match kind {
            0 | 1 => moved.centre[kind] += step,
            2..=5 => {
                // One side moves by a step, the other stays.
                let (axis, sign) = ((kind - 2) / 2, if kind.is_multiple_of(2) { 1.0 } else { -1.0 });
                let (pitch, direction) = if axis == 0 { (across, [cos, sin]) } else { (down, [-sin, cos]) };
                grow(axis, step / (7.0 * pitch));
                for (centre, direction) in moved.centre.iter_mut().zip(direction) {
                    *centre += 0.5 * sign * step * direction;
                }
            }
            6 => {
                moved.roll_rad += step / (3.5 * across);
                moved.direction = (libm::sinf(moved.roll_rad), libm::cosf(moved.roll_rad));
            }
            // All sides at once, because the commonest error is a wrong size in both directions.
            _ => {
                grow(0, step / (3.5 * across));
                grow(1, step / (3.5 * down));
            }
        }
        moved
    }
}

/// Kinds of moves.
const MOVES: usize = 8;

/// Climbs from `start` in steps that shrink from the first (in pitches) to [`LAST_STEP`], in at most `rounds` rounds.
pub(super) fn climb(evidence: &Evidence, start: Pose, (step, rounds): (f32, usize)) -> Option<(f32, Pose)> {
    let mut overlap = evidence.overlap(start.pitch);
    // Moves of opposite sides share these: the last ones inwards and outwards.
    let mut lately = [overlap; 2];
    let mut best = (evidence.of_overlapping(&start.lattice(), &overlap)?, start);
    let mut step = step;
    for _ in 0..rounds {
        let pitch = libm::expf(0.5 * (best.1.log_pitch[0] + best.1.log_pitch[1]));
        let mut improved = false;
        for kind in 0..MOVES {
            for (direction, lately) in [-1.0, 1.0].into_iter().zip(&mut lately) {
                let moved = best.1.moved(kind, direction * step * pitch);
                let changed = moved.pitch != best.1.pitch;
                if changed {
                    *lately = evidence.overlap_like(moved.pitch, [&overlap, lately]);
                }
                let other = if changed { &*lately } else { &overlap };
                if let Some(value) = evidence.of_overlapping(&moved.lattice(), other)
                    && value > best.0
                {
                    best = (value, moved);
                    overlap = *other;
                    improved = true;
                    break;
                }
            }
        }
        if !improved {
            step *= 0.5;
            if step < LAST_STEP {
                break;
            }
        }
    }
    Some(best)
}

/// Climbs, and then from poses with a row or a column more, less or further on, as long as that leads higher.
pub(super) fn explore(evidence: &Evidence, start: Pose, steps: (f32, usize)) -> Option<(f32, Pose)> {
    let mut best = climb(evidence, start, steps)?;
    for _ in 0..LINES {
        let mut highest: Option<(f32, Pose)> = None;
        let here = evidence.overlap(best.1.pitch);
        for pose in neighbours(&best.1) {
            let overlap = evidence.overlap_like(pose.pitch, [&here; 2]);
            if let Some(value) = evidence.of_overlapping(&pose.lattice(), &overlap)
                && highest.as_ref().is_none_or(|h| value > h.0)
            {
                highest = Some((value, pose));
            }
        }
        let next = climb(evidence, highest?.1, steps)?;
        if next.0 <= best.0 + MARGIN {
            break;
        }
        best = next;
    }
    Some(best)
}

/// The poses with one side or two sides a line further out or in.
fn neighbours(pose: &Pose) -> impl Iterator<Item = Pose> {
    let (pose, pitch) = (*pose, pose.pitch);
    // The number of lines by which the right, left, lower and upper side move right or down.
    let sides = |code: i32| [code % 3 - 1, code / 3 % 3 - 1, code / 9 % 3 - 1, code / 27 - 1];
    (0..81)
        .map(sides)
        .filter(|s| (1..=2).contains(&s.iter().filter(|&&s| s != 0).count()))
        .map(move |sides| {
            // Kinds 2 to 5 move right, left, lower and upper side outwards.
            sides.iter().enumerate().fold(pose, |pose, (i, &lines)| {
                let outwards = if i % 2 == 0 { 1.0 } else { -1.0 };
                pose.moved(2 + i, outwards * lines as f32 * pitch[i / 2])
            })
        })
}
