//! The frequency and phase that explain the sightings.

use super::history::{FRAMES, Sighting};
use super::waveform::{PHASES, SHAPES, WAVEFORMS};
use crate::detect::limited_to;
use link::panel::SoftPanel;

/// A frame with less contrast is blind: its bits count as erased (share of the greatest contrast).
pub const BLIND: f32 = 0.08;
/// Minimum noise of a frame's modulation (share of its root mean square). Lower: differences that the shapes do not explain cost more.
const NOISE: f32 = 0.08;
/// Maximum cost of a frame with an unexpected modulation (nats), because it may have caught two symbols.
pub(super) const ODD: f32 = 3.0;
/// Maximum cost of a pair of frames of one symbol whose signs contradict the carrier (nats).
const CONTRARY: f32 = 5.0;
/// Cost of such a pair per unit of the product of their contrasts, whose maximum is 1 (nats).
const CONTRARY_SLOPE: f32 = 12.0;

/// The sign that a frame shows of a symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ShownSign {
    /// The symbol.
    Symbol,
    /// Its complement.
    Complement,
    /// Neither: the carrier spends equal parts of the exposure in both.
    Nothing,
}

/// A carrier: frequency, phase and waveform.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Cycles a frame period.
    pub frequency: f64,
    /// The phase at `time` (cycles).
    pub phase: f64,
    /// The time of `phase` (frame periods).
    pub time: f64,
    /// The number of the waveform's shape.
    pub shape: usize,
    /// The logarithm of its likelihood (nats).
    pub score: f32,
    /// Margin in log-likelihood over every carrier that gives frames other signs (nats).
    pub sure: f32,
}

impl Fit {
    /// Cycles since the phase was 0, from 0 to 1.
    fn phase_at(&self, time: f64) -> f64 {
        let cycles = self.frequency * (time - self.time) + self.phase;
        cycles - libm::floor(cycles)
    }

    /// Contrast in the frame at that time: how much longer a 1 is lit than a 0, at most 1; negative for the complement.
    pub fn contrast_at(&self, time: f64) -> f32 {
        WAVEFORMS[self.shape][step(self.phase_at(time))]
    }

    /// The sightings at the carrier's frequency.
    pub fn on<'a>(&self, sightings: &'a [Sighting]) -> AtFrequency<'a> {
        AtFrequency::new(sightings, self.time, self.frequency)
    }

    /// The phase in steps of a cycle.
    pub fn phase_step(&self) -> u8 {
        step(self.phase) as u8
    }

    /// The sign that the frame at that time shows.
    pub fn shown_at(&self, time: f64) -> ShownSign {
        let contrast = self.contrast_at(time);
        if contrast.abs() < BLIND {
            ShownSign::Nothing
        } else if contrast < 0.0 {
            ShownSign::Complement
        } else {
            ShownSign::Symbol
        }
    }

    /// The soft values of a symbol from those of the frame at that time, no surer than the sign.
    pub fn signed(&self, time: f64, seen: &SoftPanel) -> SoftPanel {
        let symbol = match self.shown_at(time) {
            ShownSign::Nothing => return SoftPanel::ERASED,
            ShownSign::Complement => seen.flipped(u64::MAX),
            ShownSign::Symbol => *seen,
        };
        limited_to(&symbol, self.sure)
    }

    /// The share of frames in which the signs of two carriers differ, up to one common sign.
    pub fn differs(&self, other: &Self, sightings: &[Sighting]) -> f32 {
        let is_other = |sighting: &&Sighting| self.contrast_at(sighting.time) * other.contrast_at(sighting.time) < 0.0;
        let others = sightings.iter().filter(is_other).count();
        others.min(sightings.len() - others) as f32 / sightings.len().max(1) as f32
    }

    /// The same carrier with its phase given at another time.
    pub fn moved_to(self, time: f64) -> Self {
        Self {
            phase: self.phase_at(time),
            time,
            ..self
        }
    }
}

/// The step of a phase from 0 to 1.
pub(super) fn step(phase: f64) -> usize {
    (phase * PHASES as f64 + 0.5) as usize % PHASES
}

/// Sightings with their phases at one frequency.
pub(super) struct AtFrequency<'a> {
    sightings: &'a [Sighting],
    /// The phase of each sighting, relative to the phase at `time`.
    phases: [u8; FRAMES],
    pub frequency: f64,
    pub time: f64,
}

impl<'a> AtFrequency<'a> {
    pub fn new(sightings: &'a [Sighting], time: f64, frequency: f64) -> Self {
        let mut phases = [0; FRAMES];
        for (phase, sighting) in phases.iter_mut().zip(sightings) {
            let cycles = frequency * (sighting.time - time);
            *phase = step(cycles - libm::floor(cycles)) as u8;
        }
        Self {
            sightings,
            phases,
            frequency,
            time,
        }
    }

    /// The log-likelihood of that phase and shape (nats).
    pub fn score(&self, phase: u8, shape: usize) -> f32 {
        -self.losses(phase, shape).sum::<f32>()
    }

    /// The cost of each sighting with that phase and shape (nats).
    pub fn losses(&self, phase: u8, shape: usize) -> impl Iterator<Item = f32> {
        let shape = &WAVEFORMS[shape];
        let contrast = move |i: usize| shape[usize::from(self.phases[i].wrapping_add(phase))];
        let (mut cross, mut squares, mut seen) = (0.0, 0.0, 0.0);
        for (i, sighting) in self.sightings.iter().enumerate() {
            let expected = contrast(i);
            cross += sighting.modulation * expected.abs();
            squares += expected * expected;
            seen += sighting.modulation * sighting.modulation;
        }
        let full = cross / f32::max(squares, 1e-3);
        let unit = 1.0 / (NOISE * libm::sqrtf(seen / self.sightings.len().max(1) as f32)).max(f32::MIN_POSITIVE);
        self.sightings.iter().enumerate().map(move |(i, sighting)| {
            let expected = contrast(i);
            let off = unit * (sighting.modulation - full * expected.abs());
            let odd = (0.5 * off * off).min(ODD);
            let of_pair = sighting
                .pair
                .and_then(|(before, is_reversed)| Some((i.checked_sub(before.into())?, is_reversed)));
            let contrary = of_pair.map_or(0.0, |(before, is_reversed)| {
                let product = expected * contrast(before);
                let wrong = if is_reversed { product } else { -product };
                (CONTRARY_SLOPE * wrong).clamp(0.0, CONTRARY)
            });
            odd + contrary
        })
    }

    /// The most likely of some shapes and phases (steps of 1/256 cycle) at this frequency.
    pub fn best(&self, shapes: core::ops::Range<usize>, phases: impl Iterator<Item = u8> + Clone) -> Fit {
        let mut best = (f32::NEG_INFINITY, 0, 0);
        for shape in shapes {
            for phase in phases.clone() {
                let score = self.score(phase, shape);
                if score > best.0 {
                    best = (score, phase, shape);
                }
            }
        }
        let (score, phase, shape) = best;
        Fit {
            frequency: self.frequency,
            phase: f64::from(phase) / PHASES as f64,
            time: self.time,
            shape,
            score,
            sure: f32::INFINITY,
        }
    }
}

/// The log-likelihood of a still panel (nats): all sightings have one contrast, and none is the complement of another.
pub(super) fn still_score(sightings: &[Sighting]) -> f32 {
    -still_losses(sightings, mean_modulation(sightings)).sum::<f32>()
}

/// The cost of each sighting if the panel is still and its bits modulate this share of the light (nats).
pub(super) fn still_losses(sightings: &[Sighting], modulation: f32) -> impl Iterator<Item = f32> {
    let unit = 1.0 / (NOISE * modulation).max(f32::MIN_POSITIVE);
    sightings.iter().map(move |sighting| {
        let off = unit * (sighting.modulation - modulation);
        let contrary = if matches!(sighting.pair, Some((_, true))) { CONTRARY } else { 0.0 };
        (0.5 * off * off).min(ODD) + contrary
    })
}

/// The mean share of the light that the bits modulate.
pub(super) fn mean_modulation(sightings: &[Sighting]) -> f32 {
    sightings.iter().map(|sighting| sighting.modulation).sum::<f32>() / sightings.len().max(1) as f32
}

pub(super) const ALL_SHAPES: core::ops::Range<usize> = 0..SHAPES;
