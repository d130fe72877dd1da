//! 64 Gaussian spots on an affine lattice, fitted to a window of the frame by least squares.
//!
//! The model in linear light is b + Σ aₖ·exp(−|p − pₖ|²/2s²), with pₖ = c + (column − 3.5)·**column** + (row − 3.5)·**row**. A difference
//! in light counts by the grey levels that it makes. Brightnesses aₖ, background b, the six numbers of the lattice and s are
//! fitted together (Levenberg 1944; Marquardt 1963).

use super::candidate::Window;
use super::light::Light;
use crate::frame::Frame;
use link::panel::{LEDS, SIDE};
use nalgebra::{SMatrix, SVector};

/// An affine lattice of 8×8 spots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    /// The panel's centre in pixels.
    pub centre: [f32; 2],
    /// From one LED to the next in its row.
    pub column: [f32; 2],
    /// From one LED to the next in its column.
    pub row: [f32; 2],
    /// Standard deviation of a spot in pixels.
    pub sigma: f32,
}

/// A fitted lattice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub lattice: Lattice,
    /// Root mean square residual in grey levels.
    pub residual_grey: f32,
}

/// Centre, column step, row step (x and y each), spot width.
const SHAPE: usize = 7;
const BACKGROUND: usize = LEDS;
const UNKNOWNS: usize = LEDS + 1 + SHAPE;
type Normal = SMatrix<f32, UNKNOWNS, UNKNOWNS>;
type Unknowns = SVector<f32, UNKNOWNS>;

/// Spots end here, in standard deviations: 0.2 % of their height is left.
const REACH: f32 = 3.5;
/// Pixels along one side of the square that a spot is computed in.
const SPOT_PX: usize = 24;
/// A fit that makes the spots wider than this runs away.
const MAX_SIGMA_PX: f32 = 3.0;
const MIN_SIGMA_PX: f32 = 0.4;
const MAX_STEPS: usize = 20;
/// The fit has settled once a step improves the sum of squares by less than this share.
const SETTLED: f32 = 3e-4;
/// How often the lattice may be moved by a row or column.
const MAX_MOVES: usize = 4;

/// The lattice near `start` that fits best.
pub(super) fn fit(
    frame: &Frame<'_>,
    window: Window,
    light: &Light,
    background: u8,
    start: Lattice,
) -> Option<Fit> {
    let mut best = Spots::new(start, light.of(background)).refined(frame, window, light)?;
    for _ in 0..MAX_MOVES {
        let Some(moved) = best.moved_to_the_light(frame, window, light) else {
            break;
        };
        match moved.refined(frame, window, light) {
            Some(refined) if refined.squares < best.squares => best = refined,
            _ => break,
        }
    }
    Some(Fit {
        lattice: best.lattice,
        residual_grey: libm::sqrtf(best.squares / best.pixels.max(1) as f32),
    })
}

impl Lattice {
    /// The corner LEDs: top left, top right, bottom right, bottom left.
    pub fn corners(&self) -> [[f32; 2]; 4] {
        let last = (SIDE - 1) as f32;
        [[0.0, 0.0], [last, 0.0], [last, last], [0.0, last]]
            .map(|[column, row]| self.position(column, row))
    }

    /// The eight lattices that lie one row, one column or both away.
    pub fn neighbours(self) -> impl Iterator<Item = Self> {
        let steps = [-1.0, 0.0, 1.0]
            .into_iter()
            .flat_map(|row| [-1.0, 0.0, 1.0].map(|column| (column, row)));
        steps
            .filter(|&step| step != (0.0, 0.0))
            .map(move |(column, row)| Self {
                centre: self.position(MIDDLE + column, MIDDLE + row),
                ..self
            })
    }

    fn position(&self, column: f32, row: f32) -> [f32; 2] {
        let (column, row) = (column - MIDDLE, row - MIDDLE);
        core::array::from_fn(|axis| {
            self.centre[axis] + column * self.column[axis] + row * self.row[axis]
        })
    }

    fn pitch(&self) -> [f32; 2] {
        [self.column, self.row].map(|[x, y]| libm::hypotf(x, y))
    }

    /// The lattice with the spots that a blur of `sigma_px` makes of discs half a pitch wide and of square pixels.
    pub fn blurred(self, sigma_px: f32) -> Self {
        let disc = self.pitch()[0].min(self.pitch()[1]) / 8.0;
        let sigma = libm::sqrtf(sigma_px * sigma_px + disc * disc + 1.0 / 12.0);
        Self {
            sigma: sigma.clamp(MIN_SIGMA_PX, 0.9 * MAX_SIGMA_PX),
            ..self
        }
    }

    /// Whether it may be a square panel seen at up to 45° from the side, up to 30° turned, and no more blurred than can be
    /// read.
    fn is_plausible(&self) -> bool {
        let [across, down] = self.pitch();
        let sheared =
            (self.column[0] * self.row[0] + self.column[1] * self.row[1]) / (across * down);
        let turned = libm::fabsf(libm::atan2f(self.column[1], self.column[0]));
        (0.7..=1.43).contains(&(across / down))
            && sheared.abs() < 0.3
            && turned < 0.52
            && self.sigma < MAX_SIGMA_PX.min(1.1 * across.min(down))
    }
}

const MIDDLE: f32 = (SIDE - 1) as f32 / 2.0;

/// The model with all its unknowns.
#[derive(Clone)]
struct Spots {
    lattice: Lattice,
    background: f32,
    amplitude: [f32; LEDS],
    squares: f32,
    pixels: u32,
}

/// One spot's profile along x and along y, over the pixels of its square.
#[derive(Clone, Copy)]
struct Profile {
    start: [i32; 2],
    centre: [f32; 2],
    along: [[f32; SPOT_PX]; 2],
    length: [i32; 2],
}

impl Profile {
    fn new(centre: [f32; 2], sigma: f32) -> Self {
        let reach = REACH * sigma;
        let start = centre.map(|c| libm::ceilf(c - reach) as i32);
        let length = core::array::from_fn(|axis| {
            let end = libm::floorf(centre[axis] + reach) as i32;
            end.saturating_sub(start[axis])
                .saturating_add(1)
                .clamp(0, SPOT_PX as i32)
        });
        let along = core::array::from_fn(|axis| {
            core::array::from_fn(|i| {
                let offset = (start[axis] as f32 + i as f32 - centre[axis]) / sigma;
                libm::expf(-0.5 * offset * offset)
            })
        });
        Self {
            start,
            centre,
            along,
            length,
        }
    }

    /// The profile's value along `axis` at a pixel; `None` beyond its reach.
    fn at(&self, axis: usize, pixel: i32) -> Option<f32> {
        let index = pixel.saturating_sub(self.start[axis]);
        if index < 0 || index >= self.length[axis] {
            return None;
        }
        self.along[axis].get(index as usize).copied()
    }
}

/// The linearised problem around a model.
struct Linearised {
    normal: Normal,
    gradient: Unknowns,
    squares: f32,
    pixels: u32,
}

/// The derivatives of one pixel's light that are not 0.
struct Derivatives {
    index: [usize; UNKNOWNS],
    value: [f32; UNKNOWNS],
    count: usize,
}

impl Derivatives {
    fn push(&mut self, index: usize, value: f32) {
        if let (Some(i), Some(v)) = (
            self.index.get_mut(self.count),
            self.value.get_mut(self.count),
        ) {
            (*i, *v) = (index, value);
            self.count += 1;
        }
    }
}

impl Spots {
    fn new(lattice: Lattice, background: f32) -> Self {
        Self {
            lattice,
            background,
            amplitude: [0.0; LEDS],
            squares: f32::INFINITY,
            pixels: 0,
        }
    }

    /// Follows the slope to the best fit near by.
    fn refined(mut self, frame: &Frame<'_>, window: Window, light: &Light) -> Option<Self> {
        // First the brightnesses alone: without them nothing tells where a spot should go.
        let start = self.linearised(frame, window, light);
        self = self.stepped(
            &start,
            Damping {
                brightness: 1e-3,
                shape: 1e9,
            },
        )?;
        let mut here = self.linearised(frame, window, light);
        let mut damping = 0.03;
        for _ in 0..MAX_STEPS {
            let next = self.stepped(
                &here,
                Damping {
                    brightness: 1e-4 + 0.1 * damping,
                    shape: damping,
                },
            )?;
            let there = next.linearised(frame, window, light);
            if there.squares < here.squares {
                let settled = here.squares - there.squares < SETTLED * here.squares;
                (self, here) = (next, there);
                self.lattice.is_plausible().then_some(())?;
                damping = (damping * 0.2).max(1e-5);
                if settled {
                    break;
                }
            } else {
                damping *= 6.0;
                if damping > 1e4 {
                    break;
                }
            }
        }
        (self.squares, self.pixels) = (here.squares, here.pixels);
        here.squares.is_finite().then_some(self)
    }

    /// The normal equations of the weighted residuals, in grey levels.
    fn linearised(&self, frame: &Frame<'_>, window: Window, light: &Light) -> Linearised {
        let sigma = self.lattice.sigma;
        let profiles = self.profiles();
        let mut sums = Linearised {
            normal: Normal::zeros(),
            gradient: Unknowns::zeros(),
            squares: 0.0,
            pixels: 0,
        };
        for (y, row) in window.rows(frame) {
            let mut near = heapless::Vec::<(usize, f32), LEDS>::new();
            near.extend(
                profiles
                    .iter()
                    .enumerate()
                    .filter_map(|(led, p)| Some((led, p.at(1, y as i32)?))),
            );
            for (x, &grey) in (window.x.0..).zip(row) {
                let weight = light.weight(grey);
                if weight == 0.0 {
                    continue;
                }
                let mut derivatives = Derivatives {
                    index: [0; UNKNOWNS],
                    value: [0.0; UNKNOWNS],
                    count: 0,
                };
                let mut model = self.background;
                let mut shape = [0.0; SHAPE];
                for &(led, along_y) in &near {
                    let Some(along_x) = profiles[led].at(0, x as i32) else {
                        continue;
                    };
                    let spot = along_x * along_y;
                    let height = self.amplitude[led] * spot;
                    let [cx, cy] = profiles[led].centre;
                    let (dx, dy) = ((x as f32 - cx) / sigma, (y as f32 - cy) / sigma);
                    let (column, row) =
                        ((led % SIDE) as f32 - MIDDLE, (led / SIDE) as f32 - MIDDLE);
                    let (slope_x, slope_y) = (height * dx, height * dy);
                    let terms = [
                        slope_x,
                        slope_y,
                        column * slope_x,
                        column * slope_y,
                        row * slope_x,
                        row * slope_y,
                        height * (dx * dx + dy * dy),
                    ];
                    for (sum, term) in shape.iter_mut().zip(terms) {
                        *sum += term;
                    }
                    model += height;
                    derivatives.push(led, weight * spot);
                }
                derivatives.push(BACKGROUND, weight);
                if derivatives.count > 1 {
                    for (i, slope) in shape.into_iter().enumerate() {
                        derivatives.push(LEDS + 1 + i, weight * slope / sigma);
                    }
                }
                sums.add(&derivatives, weight * (light.of(grey) - model));
            }
        }
        sums
    }

    fn profiles(&self) -> [Profile; LEDS] {
        core::array::from_fn(|led| {
            let centre = self
                .lattice
                .position((led % SIDE) as f32, (led / SIDE) as f32);
            Profile::new(centre, self.lattice.sigma)
        })
    }

    /// One damped step from here.
    fn stepped(&self, here: &Linearised, damping: Damping) -> Option<Self> {
        let mut normal = here.normal;
        let brightest = (0..LEDS)
            .map(|led| normal[(led, led)])
            .fold(f32::MIN_POSITIVE, f32::max);
        for i in 0..UNKNOWNS {
            let factor = if i <= BACKGROUND {
                damping.brightness
            } else {
                damping.shape
            };
            // Spots outside the window have no equation of their own: they stay as dark as they are.
            normal[(i, i)] += factor * normal[(i, i)].max(1e-3 * brightest);
        }
        let step = normal.cholesky()?.solve(&here.gradient);
        let mut next = self.clone();
        for (amplitude, step) in next.amplitude.iter_mut().zip(step.iter()) {
            *amplitude += step;
        }
        next.background += step[BACKGROUND];
        let shape = |i: usize| step[LEDS + 1 + i];
        let lattice = &mut next.lattice;
        for axis in 0..2 {
            lattice.centre[axis] += shape(axis);
            lattice.column[axis] += shape(2 + axis);
            lattice.row[axis] += shape(4 + axis);
        }
        lattice.sigma = (lattice.sigma + shape(6)).clamp(MIN_SIGMA_PX, MAX_SIGMA_PX);
        let usable = |value: f32| value.abs() < 1e5;
        let finite =
            lattice.corners().iter().flatten().all(|&c| usable(c)) && usable(next.background);
        (finite && next.amplitude.iter().all(|&a| usable(a))).then_some(next)
    }

    /// The lattice one row or column further if what lies there is brighter than its own last row or column on the
    /// other side.
    fn moved_to_the_light(&self, frame: &Frame<'_>, window: Window, light: &Light) -> Option<Self> {
        let sides: [([f32; 2], f32, f32); 4] = [
            (self.lattice.column, -1.0, 7.0),
            (self.lattice.column, 1.0, 0.0),
            (self.lattice.row, -1.0, 7.0),
            (self.lattice.row, 1.0, 0.0),
        ];
        let mut best: Option<(f32, [f32; 2])> = None;
        for (side, &(step, direction, opposite)) in sides.iter().enumerate() {
            let beyond = if direction < 0.0 { -1.0 } else { SIDE as f32 };
            let along = |i: usize, line: f32| {
                if side < 2 {
                    [line, i as f32]
                } else {
                    [i as f32, line]
                }
            };
            let outside: f32 = (0..SIDE)
                .map(|i| self.light_left_at(along(i, beyond), frame, window, light))
                .sum();
            let inside: f32 = (0..SIDE)
                .map(|i| {
                    let [column, row] = along(i, opposite).map(|c| c as usize);
                    self.amplitude[SIDE * row + column]
                })
                .sum();
            let gain = outside - inside;
            if gain > 0.0 && best.is_none_or(|(most, _)| gain > most) {
                best = Some((gain, step.map(|s| s * direction)));
            }
        }
        let (_, [dx, dy]) = best?;
        let [x, y] = self.lattice.centre;
        Some(Self::new(
            Lattice {
                centre: [x + dx, y + dy],
                ..self.lattice
            },
            self.background,
        ))
    }

    /// The brightness of a spot that would explain the light above the background at a place outside the lattice, of which the
    /// lattice's own spots are taken off.
    fn light_left_at(
        &self,
        [column, row]: [f32; 2],
        frame: &Frame<'_>,
        window: Window,
        light: &Light,
    ) -> f32 {
        let spot = Profile::new(self.lattice.position(column, row), self.lattice.sigma);
        let (mut product, mut square) = (0.0, 0.0);
        for (y, pixels) in window.rows(frame) {
            let Some(along_y) = spot.at(1, y as i32) else {
                continue;
            };
            for (x, &grey) in (window.x.0..).zip(pixels) {
                let Some(along_x) = spot.at(0, x as i32) else {
                    continue;
                };
                let height = along_x * along_y;
                product += height * (light.of(grey) - self.light_at(x as f32, y as f32));
                square += height * height;
            }
        }
        if square > 0.0 { product / square } else { 0.0 }
    }

    fn light_at(&self, x: f32, y: f32) -> f32 {
        let sharpness = 0.5 / (self.lattice.sigma * self.lattice.sigma);
        let spots = self.amplitude.iter().enumerate().map(|(led, amplitude)| {
            let [cx, cy] = self
                .lattice
                .position((led % SIDE) as f32, (led / SIDE) as f32);
            let distance = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) * sharpness;
            if distance < REACH * REACH {
                amplitude * libm::expf(-distance)
            } else {
                0.0
            }
        });
        self.background + spots.sum::<f32>()
    }
}

/// What is added to the normal equations' diagonal, relative to it.
#[derive(Clone, Copy)]
struct Damping {
    brightness: f32,
    shape: f32,
}

impl Linearised {
    fn add(&mut self, derivatives: &Derivatives, residual: f32) {
        let index = derivatives.index.get(..derivatives.count).unwrap_or(&[]);
        for (i, (&row, &a)) in index.iter().zip(&derivatives.value).enumerate() {
            self.gradient[row] += a * residual;
            // Indices rise, so this is the lower triangle, column by column: all that the factorisation reads.
            for (&below, &b) in index[i..].iter().zip(&derivatives.value[i..]) {
                self.normal[(below, row)] += a * b;
            }
        }
        self.squares += residual * residual;
        self.pixels += 1;
    }
}
