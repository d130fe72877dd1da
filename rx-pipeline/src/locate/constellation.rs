//! The lattice of isolated spots, by autocorrelation.
//!
//! If only spots are left, a patch correlates with itself one LED further on, along rows and along columns, whatever the panel's bits, its
//! board and its surroundings: the autocorrelation has a peak at each of the lattice's steps. The two shortest steps are its columns and
//! rows. The panel is where 64 such places hold the most light.

use super::patch::{PATCH_SIDE, Patch};
use crate::lattice::Lattice;
use core::f32::consts::FRAC_1_SQRT_2;
use heapless::Vec;
use link::panel::LEDS;

/// The shortest step between LEDs (samples). Shorter: slower, and more repeating textures are tried.
const SHORTEST: i32 = 2;
/// The longest step between LEDs (samples). Longer: slower, and more repeating textures are tried.
const LONGEST: i32 = 12;
/// The greatest slope of rows against their search direction, and of columns (tangent); less than the half angle between two directions
/// would leave gaps. More: slower, and diagonals look like rows.
const STEEPEST: f32 = 0.45;
/// Search directions of rows and columns, upright and turned by half a right angle: together they cover all rotations.
const DIRECTIONS: [[[f32; 2]; 2]; 2] = [
    [[1.0, 0.0], [0.0, 1.0]],
    [[FRAC_1_SQRT_2, FRAC_1_SQRT_2], [-FRAC_1_SQRT_2, FRAC_1_SQRT_2]],
];
/// Steps along rows and along columns that are paired (count). More: slower.
const PEAKS: usize = 4;
/// The least agreement of a pair of shorter steps that is preferred to the best pair (share of the best's agreement). Lower: clutter makes
/// steps shorter; higher: every other LED is left out.
const AS_GOOD: f32 = 0.6;

type Samples = [[f32; PATCH_SIDE]; PATCH_SIDE];

/// A step from a place to a similar one, in samples, and their agreement.
#[derive(Clone, Copy, Debug)]
struct Step {
    by: [f32; 2],
    agreement: f32,
}

/// The lattice of the brightest 64 spots, in samples; `None` if nothing repeats.
pub(super) fn lattice(patch: &Patch) -> Option<Lattice> {
    let mean = patch.sample.iter().flatten().sum::<f32>() / (PATCH_SIDE * PATCH_SIDE) as f32;
    let spots = patch.sample.map(|row| row.map(|sample| sample - mean));
    let mut agreements = Autocorrelation::of(&spots);
    let (column, row) = steps(&mut agreements)?;
    let [column, row] = [column, row].map(|step| refined(&mut agreements, step));
    let shape = Lattice {
        centre: [0.0; 2],
        column,
        row,
        tilt: [0.0; 2],
    };
    fullest(&spots, &shape)
}

/// The steps along rows and along columns.
fn steps(agreements: &mut Autocorrelation<'_>) -> Option<([f32; 2], [f32; 2])> {
    let squared = |step: &Step| step.by[0] * step.by[0] + step.by[1] * step.by[1];
    let mut pairs: Vec<(f32, f32, [f32; 2], [f32; 2]), { 2 * PEAKS * PEAKS }> = Vec::new();
    for directions in DIRECTIONS {
        let [columns, rows] = directions.map(|direction| peaks(agreements, direction));
        for (u, v) in columns.iter().flat_map(|u| rows.iter().map(move |v| (u, v))) {
            // On a lattice, sums of steps are steps.
            let mut across = |sign: f32| {
                let by = core::array::from_fn(|axis| round(u.by[axis] + sign * v.by[axis]));
                agreements.near(by).agreement
            };
            let agreement = u.agreement.min(v.agreement).min(across(1.0)).min(across(-1.0));
            // The capacity holds all pairs.
            let _full = pairs.push((agreement, squared(u) + squared(v), u.by, v.by));
        }
    }
    let best = pairs.iter().fold(0.0f32, |best, pair| best.max(pair.0));
    // Twice a step is also a step, and so are diagonals.
    pairs
        .iter()
        .filter(|pair| best > 0.0 && pair.0 > AS_GOOD * best)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|&(_, _, column, row)| (column, row))
}

/// The steps of greatest agreement near a direction.
fn peaks(agreements: &mut Autocorrelation<'_>, [x, y]: [f32; 2]) -> Vec<Step, PEAKS> {
    let mut peaks: Vec<Step, PEAKS> = Vec::new();
    for (dx, dy) in (-LONGEST..=LONGEST).flat_map(|dy| (-LONGEST..=LONGEST).map(move |dx| (dx, dy))) {
        let [along, aside] = [dx as f32 * x + dy as f32 * y, dy as f32 * x - dx as f32 * y];
        if !(SHORTEST as f32..=LONGEST as f32).contains(&along) || aside.abs() > STEEPEST * along {
            continue;
        }
        let step = agreements.near([dx, dy]);
        let is_peak = step.by == [dx, dy].map(|c| c as f32) && step.agreement > 0.0;
        if !is_peak {
            continue;
        }
        let place = peaks
            .iter()
            .position(|other| other.agreement < step.agreement)
            .unwrap_or(peaks.len());
        if peaks.is_full() && place < peaks.len() {
            peaks.pop();
        }
        // If the list is full, this fails only for the worst.
        let _worst = peaks.insert(place, step);
    }
    peaks
}

/// The step, refined as a fraction of a longer one, which is more precise.
fn refined(agreements: &mut Autocorrelation<'_>, step: [f32; 2]) -> [f32; 2] {
    let mut step = step;
    for times in [2.0, 4.0] {
        let far = agreements.near(step.map(|c| round(times * c)));
        if far.agreement > 0.0 {
            step = agreements.centred(far.by.map(round)).map(|c| c / times);
        }
    }
    step
}

/// The range of cached steps, with a sample around each (samples).
const REACH: usize = LONGEST as usize + 1;

/// The autocorrelation of a patch; short steps are cached.
struct Autocorrelation<'a> {
    spots: &'a Samples,
    /// By rows down and columns to the right, from −[`REACH`] on: NaN if not yet computed.
    known: [[f32; 2 * REACH + 1]; REACH + 1],
}

impl<'a> Autocorrelation<'a> {
    fn of(spots: &'a Samples) -> Self {
        Self {
            spots,
            known: [[f32::NAN; 2 * REACH + 1]; REACH + 1],
        }
    }

    /// The agreement at a step, which is that of the opposite step.
    fn at(&mut self, [dx, dy]: [i32; 2]) -> f32 {
        let [dx, dy] = if dy < 0 { [-dx, -dy] } else { [dx, dy] };
        let (column, row) = (dx + REACH as i32, dy as usize);
        let Some(known) = usize::try_from(column)
            .ok()
            .and_then(|column| self.known.get_mut(row)?.get_mut(column))
        else {
            return agreement(self.spots, [dx, dy]);
        };
        if known.is_nan() {
            *known = agreement(self.spots, [dx, dy]);
        }
        *known
    }

    /// The best step within one sample of `lag`.
    fn near(&mut self, [dx, dy]: [i32; 2]) -> Step {
        let mut best = Step {
            by: [0.0; 2],
            agreement: f32::NEG_INFINITY,
        };
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            let agreement = self.at([dx + i, dy + j]);
            if agreement > best.agreement {
                best = Step {
                    by: [dx + i, dy + j].map(|c| c as f32),
                    agreement,
                };
            }
        }
        best
    }

    /// The top of a peak, to a fraction of a sample: its centre of gravity.
    fn centred(&mut self, [dx, dy]: [i32; 2]) -> [f32; 2] {
        let (mut sum, mut moment) = (0.0, [0.0; 2]);
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            let weight = self.at([dx + i, dy + j]).max(0.0);
            sum += weight;
            moment = [moment[0] + weight * i as f32, moment[1] + weight * j as f32];
        }
        let sum = sum.max(f32::MIN_POSITIVE);
        [dx as f32 + moment[0] / sum, dy as f32 + moment[1] / sum]
    }
}

/// The mean product of samples at that distance.
fn agreement(spots: &Samples, [dx, dy]: [i32; 2]) -> f32 {
    let [across, down] = [dx, dy].map(|c| c.unsigned_abs() as usize);
    if across >= PATCH_SIDE || down >= PATCH_SIDE {
        return 0.0;
    }
    let (here, there) = if dx >= 0 {
        (0..PATCH_SIDE - across, across..PATCH_SIDE)
    } else {
        (across..PATCH_SIDE, 0..PATCH_SIDE - across)
    };
    let (from, to) = if dy >= 0 { (0, down) } else { (down, 0) };
    let mut products = [0.0f32; PATCH_SIDE];
    for (upper, lower) in spots[from..].iter().zip(&spots[to..]) {
        let pairs = upper[here.clone()].iter().zip(&lower[there.clone()]);
        for (sum, (a, b)) in products.iter_mut().zip(pairs) {
            *sum += a * b;
        }
    }
    products.iter().sum::<f32>() / ((PATCH_SIDE - across) * (PATCH_SIDE - down)) as f32
}

/// The lattice of that shape whose places hold the most light.
fn fullest(spots: &Samples, shape: &Lattice) -> Option<Lattice> {
    let corners = shape.corners();
    let room = |axis: usize| {
        let ends = corners.iter().map(|corner| corner[axis]);
        let (low, high) = ends.fold((0.0f32, 0.0f32), |(low, high), c| (low.min(c), high.max(c)));
        1 - low as i32..PATCH_SIDE as i32 - 1 - high as i32
    };
    let places: [[f32; 2]; LEDS] = core::array::from_fn(|led| shape.position((led % 8) as f32, (led / 8) as f32));
    let mut best = (0.0, None);
    for (x, y) in room(0).flat_map(|x| room(1).map(move |y| (x, y))) {
        let held: f32 = places
            .iter()
            .map(|place| {
                let at = |c: f32, offset: i32| (round(c) + offset).clamp(0, PATCH_SIDE as i32 - 1) as usize;
                spots[at(place[1], y)][at(place[0], x)]
            })
            .sum();
        if held > best.0 {
            let centre = [x, y].map(|c| c as f32);
            best = (held, Some(Lattice { centre, ..*shape }));
        }
    }
    best.1
}

fn round(value: f32) -> i32 {
    libm::roundf(value) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::scramble::split_mix64;

    fn patch_of(lattice: &Lattice, bits: u64) -> Patch {
        let mut sample = [[0.0; PATCH_SIDE]; PATCH_SIDE];
        for (j, row) in sample.iter_mut().enumerate() {
            for (i, sample) in row.iter_mut().enumerate() {
                for led in 0..LEDS {
                    let [x, y] = lattice.position((led % 8) as f32, (led / 8) as f32);
                    let (dx, dy) = (i as f32 - x, j as f32 - y);
                    let height = if bits >> led & 1 == 1 { 1.0 } else { 0.1 };
                    *sample += height * libm::expf(-0.5 * (dx * dx + dy * dy));
                }
            }
        }
        let mut patch = Patch {
            sample,
            origin: [0.0; 2],
            step: 1,
        };
        patch.spots_only((0.5 * lattice.pitch()[0]) as usize);
        patch
    }

    /// Panels whose bits repeat by chance give another lattice: they wait for the next frame.
    #[test]
    fn scrambled_panels_are_seen_whatever_their_pose() {
        const PANELS: u64 = 200;
        let is_seen = |panel: u64, roll_rad: f32| {
            let mut counter = 100 * panel;
            let mut between = |low: f32, high: f32| {
                counter += 1;
                let part = (split_mix64(counter) >> 40) as f32 / (1 << 24) as f32;
                low + part * (high - low)
            };
            let centre = [between(29.0, 35.0), between(29.0, 35.0)];
            let (across, down) = (between(4.0, 6.0), between(4.0, 6.0));
            let mut truth = Lattice::turned(centre, across, down, roll_rad + between(-0.25, 0.25));
            truth.row[0] += between(-0.5, 0.5);
            let Some(found) = lattice(&patch_of(&truth, split_mix64(100 * panel))) else {
                return false;
            };
            let off = |a: [f32; 2], b: [f32; 2]| libm::hypotf(a[0] - b[0], a[1] - b[1]);
            // An outer line of Off LEDs may be missing.
            truth.turns().any(|truth| {
                off(found.column, truth.column) < 0.25
                    && off(found.row, truth.row) < 0.25
                    && off(found.centre, truth.centre) < 1.6 * across.max(down)
            })
        };
        for roll_rad in [0.0, 0.4, 0.8, 1.2] {
            let seen = (0..PANELS).filter(|&panel| is_seen(panel, roll_rad)).count();
            assert!(seen >= 190, "{seen} of {PANELS} at {roll_rad}");
        }
    }

    #[test]
    fn nothing_is_seen_where_nothing_repeats() {
        let mut patch = patch_of(&Lattice::turned([32.0; 2], 5.0, 5.0, 0.0), 0);
        patch.sample = [[1.0; PATCH_SIDE]; PATCH_SIDE];
        assert!(lattice(&patch).is_none());
    }
}
