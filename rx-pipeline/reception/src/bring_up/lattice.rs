//! Finds the LEDs in a camera's pictures. Pixels that name the same LED form a spot, and the spots lie on a lattice in perspective.

use link::orientation::Orientation;
use link::panel::{LEDS, SIDE};
use nalgebra::{SMatrix, SVector};

use super::PAIRS;

/// Minimum difference in each pair of a pixel that names an LED, as a share of the strongest pixels'.
const NAMES_MIN: f32 = 0.35;
/// Rank of the pixel that this is relative to: a row of LEDs has as many pixels.
const STRONGEST: usize = 16;
/// Minimum weight of a spot, as a share of the strongest spots'.
const WEIGHT_MIN: f32 = 0.1;
/// Maximum distance of a spot from its predicted place while the lattice grows, in pitches.
const NEAR: f64 = 0.35;
/// Maximum distance of a spot that the lattice is fitted to, in pitches.
const FITTED: f64 = 0.25;
/// Minimum number of spots in a lattice.
const SPOTS_MIN: usize = 6;
/// Radius of the disc in which an LED's level is measured, in pitches.
const RADIUS: f64 = 0.2;
/// Longest step while the lattice grows, in places.
const REACH: i32 = 3;
/// Number of fits.
const ROUNDS: usize = 4;

/// Pixels that name the same LED.
#[derive(Clone, Copy, Debug)]
struct Spot {
    at: [f64; 2],
    /// The signs of the differences, which name an LED.
    code: usize,
    weight: f32,
}

/// All spots of a film.
#[derive(Clone, Debug)]
pub struct Spots(Vec<Spot>);

impl Spots {
    /// The spots in the pictures of the steps that name LEDs.
    pub fn of(codes: &[Vec<f32>], width: usize, visible: f32) -> Self {
        let pixels = codes[0].len();
        let named: Vec<(f32, usize)> = (0..pixels)
            .map(|pixel| {
                let pairs = codes[1..].chunks_exact(2).map(|pair| pair[0][pixel] - pair[1][pixel]);
                let fold =
                    |(least, code): (f32, usize), (pair, by): (usize, f32)| (least.min(by.abs()), code | usize::from(by > 0.0) << pair);
                pairs.enumerate().fold((f32::INFINITY, 0), fold)
            })
            .collect();
        let mut strengths: Vec<f32> = named.iter().map(|&(strength, _)| strength).collect();
        strengths.sort_by(|one, other| other.total_cmp(one));
        let usual = strengths.get(STRONGEST).copied().unwrap_or(0.0);
        let least = visible.max(NAMES_MIN * usual);
        let mut spots = Vec::new();
        let mut is_seen: Vec<bool> = named.iter().map(|&(strength, _)| strength < least).collect();
        for start in 0..pixels {
            if !is_seen[start] {
                spots.push(spot(start, &named, &mut is_seen, width));
            }
        }
        let mut weights: Vec<f32> = spots.iter().map(|spot| spot.weight).collect();
        weights.sort_by(|one, other| other.total_cmp(one));
        let usual = weights.get(SIDE / 2).or(weights.last()).copied().unwrap_or(0.0);
        spots.retain(|spot| spot.weight >= WEIGHT_MIN * usual);
        Self(spots)
    }

    /// The number of spots.
    pub fn count(&self) -> usize {
        self.0.len()
    }
}

/// The spot that begins with pixel `start`: all connected pixels that name the same LED.
fn spot(start: usize, named: &[(f32, usize)], is_seen: &mut [bool], width: usize) -> Spot {
    let code = named[start].1;
    let (mut sum, mut weight) = ([0.0; 2], 0.0);
    let mut waiting = vec![start];
    is_seen[start] = true;
    while let Some(pixel) = waiting.pop() {
        let (x, y) = (pixel % width, pixel / width);
        let strength = named[pixel].0;
        weight += strength;
        sum[0] += f64::from(strength) * x as f64;
        sum[1] += f64::from(strength) * y as f64;
        for y in y.saturating_sub(1)..=y + 1 {
            for x in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                let other = y * width + x;
                if other < named.len() && !is_seen[other] && named[other].1 == code {
                    is_seen[other] = true;
                    waiting.push(other);
                }
            }
        }
    }
    Spot {
        at: sum.map(|sum| sum / f64::from(weight)),
        code,
        weight,
    }
}

/// A projective map from columns and rows of a lattice to pixels: x = (a·u + b·v + c)/(g·u + h·v + 1), y likewise (Hartley & Zisserman
/// 2004, Section 2.3).
#[derive(Clone, Copy, Debug)]
struct Perspective([f64; 8]);

impl Perspective {
    /// The least-squares solution of the linear equations (ibid., Section 4.1.2).
    fn fit(points: &[([f64; 2], [f64; 2])]) -> Option<Self> {
        let mut normal = SMatrix::<f64, 8, 8>::zeros();
        let mut right = SVector::<f64, 8>::zeros();
        for &([u, v], [x, y]) in points {
            for (row, value) in [
                ([u, v, 1.0, 0.0, 0.0, 0.0, -u * x, -v * x], x),
                ([0.0, 0.0, 0.0, u, v, 1.0, -u * y, -v * y], y),
            ] {
                let row = SVector::from(row);
                normal += row * row.transpose();
                right += row * value;
            }
        }
        normal.lu().solve(&right).map(|solved| Self(solved.into()))
    }

    fn pixel(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d, e, f, g, h] = self.0;
        let w = g * u + h * v + 1.0;
        [(a * u + b * v + c) / w, (d * u + e * v + f) / w]
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d, e, f, g, h] = self.0;
        // Two linear equations in u and v.
        let [p, q, r] = [a - g * x, b - h * x, x - c];
        let [s, t, k] = [d - g * y, e - h * y, y - f];
        let determinant = p * t - q * s;
        [(r * t - q * k) / determinant, (p * k - r * s) / determinant]
    }
}

/// The LEDs' positions in the pictures.
#[derive(Clone, Debug)]
pub struct Lattice {
    perspective: Perspective,
    /// The column and row of the top left LED.
    first: [i32; 2],
    /// The spot at each place, if there is one.
    spots: [Option<Spot>; LEDS],
}

impl Lattice {
    /// The upright lattice of 8×8 places with the most spots; none if there is none.
    pub fn through(spots: &Spots) -> Option<Self> {
        let spots = &spots.0[..];
        if spots.len() < SPOTS_MIN {
            return None;
        }
        let mut places = grown(spots)?;
        let mut perspective = None;
        for _ in 0..ROUNDS {
            let points: Vec<([f64; 2], [f64; 2])> = places.iter().map(|&(spot, place)| (place.map(f64::from), spots[spot].at)).collect();
            let fitted = Perspective::fit(&points)?;
            perspective = Some(fitted);
            let near = spots.iter().enumerate().filter_map(|(index, spot)| {
                let place = fitted.place(spot.at);
                let whole = place.map(f64::round);
                let off = (place[0] - whole[0]).hypot(place[1] - whole[1]);
                (off < FITTED && whole.iter().all(|number| number.abs() < 64.0)).then(|| (index, whole.map(|number| number as i32)))
            });
            places = near.collect();
            if places.len() < SPOTS_MIN {
                return None;
            }
        }
        let perspective = perspective?;
        let placed: Vec<(Spot, [i32; 2])> = spots
            .iter()
            .map(|&spot| {
                (
                    spot,
                    perspective.place(spot.at).map(|number| number.round().clamp(-64.0, 64.0) as i32),
                )
            })
            .collect();
        let window = |first: [i32; 2]| {
            let mut within: [Option<Spot>; LEDS] = [None; LEDS];
            for &(spot, [column, row]) in &placed {
                let [column, row] = [column - first[0], row - first[1]];
                if let (0..8, 0..8) = (column, row) {
                    let place = &mut within[row as usize * SIDE + column as usize];
                    if place.is_none_or(|other| other.weight < spot.weight) {
                        *place = Some(spot);
                    }
                }
            }
            within
        };
        let firsts = placed.iter().flat_map(|&(_, [column, row])| {
            let back = |at: i32| (0..SIDE as i32).map(move |by| at - by);
            back(column).flat_map(move |column| back(row).map(move |row| [column, row]))
        });
        let mut firsts: Vec<[i32; 2]> = firsts.collect();
        firsts.sort_unstable();
        firsts.dedup();
        // If whole rows at an edge are dark, several windows have equally many spots: then the LEDs that the spots name decide.
        let (_, first) = firsts
            .into_iter()
            .map(|first| {
                let within = window(first);
                ((within.iter().flatten().count(), agreement(&within)), first)
            })
            .max_by_key(|&(merit, _)| merit)?;
        Some(Self {
            perspective,
            first,
            spots: window(first),
        })
    }

    /// The level of each place in a picture: the mean of the pixels near the LED's measured or expected position.
    pub fn levels(&self, picture: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
        let level = |place: usize| {
            let at = self.place_px(place);
            let radius = (RADIUS * self.pitch_px(place)).max(0.71);
            let reach = |centre: f64, size: usize| {
                let from = (centre - radius).ceil().max(0.0) as usize;
                from..((centre + radius).floor().max(-1.0) + 1.0).min(size as f64) as usize
            };
            let pixels = reach(at[1], height).flat_map(|y| reach(at[0], width).map(move |x| (x, y)));
            let near = pixels.filter(|&(x, y)| (x as f64 - at[0]).hypot(y as f64 - at[1]) <= radius);
            let (sum, count) = near.fold((0.0, 0), |(sum, count), (x, y)| (sum + picture[y * width + x], count + 1));
            sum / count.max(1) as f32
        };
        (0..LEDS).map(level).collect()
    }

    /// The position of each LED, in pixels.
    pub fn places(&self) -> impl Iterator<Item = [f64; 2]> {
        (0..LEDS).map(|place| self.place_px(place))
    }

    fn place_px(&self, place: usize) -> [f64; 2] {
        self.spots[place].map_or_else(|| self.pixel(place), |spot| spot.at)
    }

    /// The places of LEDs that follow the walk.
    pub fn seen(&self) -> impl Iterator<Item = usize> {
        (0..LEDS).filter(|&place| self.spots[place].is_some())
    }

    /// The distance of each spot from its place, in pitches to the right and down.
    pub fn offsets(&self) -> [Option<[f32; 2]>; LEDS] {
        std::array::from_fn(|place| {
            self.spots[place].map(|spot| {
                let [column, row] = self.perspective.place(spot.at);
                let off = [
                    column - f64::from(self.first[0]) - (place % SIDE) as f64,
                    row - f64::from(self.first[1]) - (place / SIDE) as f64,
                ];
                off.map(|pitches| pitches as f32)
            })
        })
    }

    fn pixel_of(&self, column: f64, row: f64) -> [f64; 2] {
        self.perspective
            .pixel([column + f64::from(self.first[0]), row + f64::from(self.first[1])])
    }

    fn pixel(&self, place: usize) -> [f64; 2] {
        self.pixel_of((place % SIDE) as f64, (place / SIDE) as f64)
    }

    /// The distance to the nearer of the two next places.
    fn pitch_px(&self, place: usize) -> f64 {
        let (column, row) = ((place % SIDE) as f64, (place / SIDE) as f64);
        let here = self.pixel(place);
        let to = |there: [f64; 2]| (there[0] - here[0]).hypot(there[1] - here[1]);
        to(self.pixel_of(column + 1.0, row)).min(to(self.pixel_of(column, row + 1.0)))
    }
}

/// The number of spots that name the LED of their place, as bits or as complements, in the orientation with the most such spots.
fn agreement(spots: &[Option<Spot>; LEDS]) -> usize {
    let named = |orientation: Orientation, mask: usize| {
        let leds = (0..LEDS).filter(|&led| spots[orientation.place_of(led)].is_some_and(|spot| spot.code ^ mask == led));
        leds.count()
    };
    let all = Orientation::ALL
        .into_iter()
        .flat_map(|orientation| [0, (1 << PAIRS) - 1].map(|mask| named(orientation, mask)));
    all.max().unwrap_or(0)
}

/// The spots with their columns and rows relative to one of them, found by steps from neighbour to neighbour.
fn grown(spots: &[Spot]) -> Option<Vec<(usize, [i32; 2])>> {
    let distance = |one: [f64; 2], other: [f64; 2]| (one[0] - other[0]).hypot(one[1] - other[1]);
    let mut nearest: Vec<f64> = spots
        .iter()
        .enumerate()
        .map(|(index, spot)| {
            let others = spots.iter().enumerate().filter(|&(other, _)| other != index);
            others.map(|(_, other)| distance(spot.at, other.at)).fold(f64::INFINITY, f64::min)
        })
        .collect();
    nearest.sort_by(f64::total_cmp);
    let pitch = nearest[nearest.len() / 2];
    // The steps along rows and columns: of the steps of about one pitch, those that point most to the right, and down.
    let steps = |is_across: bool| {
        let pairs = spots
            .iter()
            .flat_map(|one| spots.iter().map(move |other| [other.at[0] - one.at[0], other.at[1] - one.at[1]]));
        let mut steps: Vec<[f64; 2]> = pairs
            .filter(|&[x, y]| (0.75 * pitch..1.3 * pitch).contains(&x.hypot(y)))
            .filter(|&[x, y]| if is_across { x >= y.abs() } else { y > x.abs() })
            .collect();
        // The median along each axis, because diagonals of a slanted lattice may be among the steps.
        let mut middle = |axis: usize| {
            steps.sort_by(|one, other| one[axis].total_cmp(&other[axis]));
            steps.get(steps.len() / 2).map(|step| step[axis])
        };
        Some([middle(0)?, middle(1)?])
    };
    let (across, down) = match (steps(true), steps(false)) {
        (Some(across), Some(down)) => (across, down),
        // A single row or column.
        (Some([x, y]), None) => ([x, y], [-y, x]),
        (None, Some([x, y])) => ([y, -x], [x, y]),
        (None, None) => return None,
    };
    let middle = [0, 1].map(|axis| spots.iter().map(|spot| spot.at[axis]).sum::<f64>() / spots.len() as f64);
    let seed = (0..spots.len()).min_by(|&one, &other| distance(spots[one].at, middle).total_cmp(&distance(spots[other].at, middle)))?;
    // Each spot keeps the steps that reached it, because perspective changes them slowly.
    let mut found: Vec<(usize, [i32; 2], [[f64; 2]; 2])> = vec![(seed, [0, 0], [across, down])];
    let mut is_found = vec![false; spots.len()];
    is_found[seed] = true;
    let mut next = 0;
    let mut reach = 1;
    // A longer step crosses one or two dark LEDs; it is tried only if no neighbour continues the lattice.
    while reach <= REACH {
        let Some(&(index, place, basis)) = found.get(next) else {
            (next, reach) = (0, reach + 1);
            continue;
        };
        next += 1;
        let before = found.len();
        for (axis, by) in [(0, reach), (0, -reach), (1, reach), (1, -reach)] {
            let step = basis[axis];
            let expected = [0, 1].map(|xy| spots[index].at[xy] + f64::from(by) * step[xy]);
            let candidates = (0..spots.len()).filter(|&other| !is_found[other]);
            let near = candidates.min_by(|&one, &other| distance(spots[one].at, expected).total_cmp(&distance(spots[other].at, expected)));
            let Some(near) = near.filter(|&near| distance(spots[near].at, expected) < NEAR * step[0].hypot(step[1])) else {
                continue;
            };
            let mut there = place;
            there[axis] += by;
            let mut adapted = basis;
            for xy in [0, 1] {
                let seen = (spots[near].at[xy] - spots[index].at[xy]) / f64::from(by);
                adapted[axis][xy] = (step[xy] + seen) / 2.0;
            }
            is_found[near] = true;
            found.push((near, there, adapted));
        }
        if reach > 1 && found.len() > before {
            (next, reach) = (before, 1);
        }
    }
    let places: Vec<(usize, [i32; 2])> = found.into_iter().map(|(index, place, _)| (index, place)).collect();
    // Four points determine a projective map, unless they are collinear.
    let is_flat = |axis: usize| places.iter().all(|(_, place)| place[axis] == places[0].1[axis]);
    (places.len() >= SPOTS_MIN && !is_flat(0) && !is_flat(1)).then_some(places)
}
