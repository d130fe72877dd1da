//! The same random frames at several ratios, kept in batches so that what chance did can be told.

use rand::RngExt;
use rayon::prelude::*;

use crate::evaluate::{EvaluateError, Evaluation, Evaluator, Settings};
use crate::random::{Purpose, stream};
use crate::scene::{L2a, Scene};

use super::criterion::Criterion;

/// Batches of a round.
const BATCHES: u64 = 64;
/// Frames of the first round; each further one doubles their number.
pub const FIRST_ROUND: u64 = 2048;
/// Resamples of the bootstrap.
const RESAMPLES: u64 = 1000;

/// The first frame of each round of a number of frames, and their end.
pub fn rounds(frames: u64) -> Vec<u64> {
    let ends = std::iter::successors(Some(FIRST_ROUND), |end| end.checked_mul(2));
    let inner = ends.take_while(|&end| end < frames);
    std::iter::once(0).chain(inner).chain([frames]).collect()
}

/// One ratio and what came out at it, round by round, each in batches.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The LED-to-ambient ratio.
    pub l2a: f64,
    rounds: Vec<Vec<Evaluation>>,
}

impl Point {
    /// All of its frames.
    pub fn total(&self) -> Evaluation {
        merged(self.rounds.iter().flatten())
    }

    /// Rounds that are finished.
    pub fn rounds(&self) -> usize {
        self.rounds.len()
    }
}

fn merged<'a>(parts: impl Iterator<Item = &'a Evaluation>) -> Evaluation {
    let mut sum = Evaluation::default();
    parts.for_each(|part| sum.merge(part));
    sum
}

/// Points of ascending ratios. Frame k has the same bits, phase and reflectance at all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples(pub(super) Vec<Point>);

impl Samples {
    /// The points, by ascending ratio.
    pub fn points(&self) -> &[Point] {
        &self.0
    }

    /// Adds rounds at a ratio until as many are there as asked for; tells `progress` of the frames of each round.
    ///
    /// # Errors
    /// When the scene cannot be evaluated there.
    pub fn extend(
        &mut self,
        scene: &Scene,
        settings: Settings,
        l2a: f64,
        rounds_wanted: usize,
        mut progress: impl FnMut(u64) -> bool,
    ) -> Result<bool, EvaluateError> {
        let place = match self.0.binary_search_by(|point| point.l2a.total_cmp(&l2a)) {
            Ok(place) => place,
            Err(place) => {
                let rounds = Vec::new();
                self.0.insert(place, Point { l2a, rounds });
                place
            }
        };
        let have = self.0[place].rounds.len();
        let borders = rounds(settings.frames);
        if have >= rounds_wanted.min(borders.len() - 1) {
            return Ok(true);
        }
        let evaluator = Evaluator::new(&at_ratio(scene, l2a), settings)?;
        for border in borders.windows(2).take(rounds_wanted).skip(have) {
            self.0[place]
                .rounds
                .push(round(&evaluator, border[0]..border[1])?);
            if !progress(border[1] - border[0]) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The points at some of the ratios, with their first rounds.
    pub fn picked(&self, l2a: &[f64], rounds: usize) -> Self {
        let wanted = self.0.iter().filter(|point| l2a.contains(&point.l2a));
        Self(
            wanted
                .map(|point| Point {
                    l2a: point.l2a,
                    rounds: point.rounds.iter().take(rounds).cloned().collect(),
                })
                .collect(),
        )
    }

    /// Rounds that all the points at some ratios have.
    pub fn common_rounds(&self, l2a: &[f64]) -> usize {
        let wanted = self.0.iter().filter(|point| l2a.contains(&point.l2a));
        wanted.map(Point::rounds).min().unwrap_or(0)
    }

    /// Several settings' frames as those of one: batch by batch, at the ratios and in the rounds that all have.
    pub fn pooled(settings: &[&Self]) -> Self {
        let Some((first, others)) = settings.split_first() else {
            return Self::default();
        };
        let mut pooled = (*first).clone();
        for other in others {
            pooled.0.retain_mut(|point| {
                let Ok(place) = other.0.binary_search_by(|p| p.l2a.total_cmp(&point.l2a)) else {
                    return false;
                };
                let theirs = &other.0[place].rounds;
                point.rounds.truncate(theirs.len());
                let batches = point.rounds.iter_mut().flatten();
                batches
                    .zip(theirs.iter().flatten())
                    .for_each(|(own, their)| own.merge(their));
                true
            });
        }
        pooled
    }

    /// The objective at each point.
    pub fn objectives(&self, criterion: Criterion) -> Vec<f64> {
        self.0
            .iter()
            .map(|p| criterion.objective(&p.total()))
            .collect()
    }

    /// The objective at each point as it might have come out as well: one row a resample.
    ///
    /// Each round's batches are drawn from that round's with replacement, the same for all points. All points must hold as many
    /// rounds as the first.
    pub fn resampled(&self, criterion: Criterion, seed: u64) -> Vec<Vec<f64>> {
        let sizes: Vec<usize> = match self.0.first() {
            Some(point) => point.rounds.iter().map(Vec::len).collect(),
            None => return Vec::new(),
        };
        let resample = |number| {
            let mut random = stream(seed, number, Purpose::Resampling);
            let drawn: Vec<Vec<usize>> = sizes
                .iter()
                .map(|&size| (0..size).map(|_| random.random_range(0..size)).collect())
                .collect();
            let objective = |point: &Point| {
                let batches = point.rounds.iter().zip(&drawn);
                let chosen =
                    batches.flat_map(|(round, drawn)| drawn.iter().map(|&batch| &round[batch]));
                criterion.objective(&merged(chosen))
            };
            self.0.iter().map(objective).collect()
        };
        (0..RESAMPLES).into_par_iter().map(resample).collect()
    }
}

/// The scene with its panels driven to a ratio.
pub fn at_ratio(scene: &Scene, l2a: f64) -> Scene {
    let mut scene = scene.clone();
    scene.link.l2a = L2a::Ratio(l2a);
    scene
}

/// A round of frames, in batches.
fn round(
    evaluator: &Evaluator,
    frames: std::ops::Range<u64>,
) -> Result<Vec<Evaluation>, EvaluateError> {
    let count = frames.end - frames.start;
    let batches = count.min(BATCHES);
    let border = |batch: u64| {
        frames.start + (u128::from(count) * u128::from(batch) / u128::from(batches)) as u64
    };
    (0..batches)
        .into_par_iter()
        .map_init(
            || evaluator.workspace(),
            |workspace, batch| evaluator.evaluate(border(batch)..border(batch + 1), workspace),
        )
        .collect()
}
