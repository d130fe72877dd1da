//! The same random frames at several ratios, in batches, so that the effect of chance can be estimated.

use crate::parallel::{map, threads, try_map_with};
use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::monte_carlo::{EvaluateError, Evaluation, Evaluator, Settings, Workspace};
use sim::random::{Purpose, stream};
use sim::scene::{L2a, Scene};

use super::criterion::Criterion;

const BATCHES: u64 = 64;
/// Approximate frames of a piece, the unit of saving: some seconds of the slowest detector.
pub(crate) const PIECE: u64 = 8192;
/// Greatest number of frames per thread: a quarter of a minute of that detector. Longer batches are done, and saved, in parts.
const PART: u64 = 2 * PIECE;
/// Frames of the first round; each further round doubles the total.
pub const FIRST_ROUND: u64 = 2048;
/// Resamples of the bootstrap.
pub(crate) const RESAMPLES: u64 = 1000;

/// The first frame of each round of a number of frames, and their end.
pub fn rounds(frames: u64) -> Vec<u64> {
    let ends = std::iter::successors(Some(FIRST_ROUND), |end| end.checked_mul(2));
    let inner = ends.take_while(|&end| end < frames);
    std::iter::once(0).chain(inner).chain([frames]).collect()
}

/// One ratio and its results, round by round, each in batches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// The LED-to-ambient ratio.
    pub l2a: f64,
    rounds: Vec<Vec<Evaluation>>,
}

impl Sample {
    /// One round of batches at a ratio.
    #[cfg(test)]
    pub fn of(l2a: f64, batches: Vec<Evaluation>) -> Self {
        let rounds = vec![batches];
        Self { l2a, rounds }
    }

    /// A batch of the first round.
    #[cfg(test)]
    pub fn batch_mut(&mut self, batch: usize) -> &mut Evaluation {
        &mut self.rounds[0][batch]
    }

    /// No frames at a ratio yet.
    pub(crate) fn none(l2a: f64) -> Self {
        let rounds = Vec::new();
        Self { l2a, rounds }
    }

    /// All of its frames.
    pub fn total(&self) -> Evaluation {
        merged(self.rounds.iter().flatten())
    }

    /// The batches of each round.
    pub(crate) fn batches(&self) -> impl Iterator<Item = &[Evaluation]> + Clone {
        self.rounds.iter().map(Vec::as_slice)
    }

    /// Rounds that are finished.
    pub fn rounds(&self) -> usize {
        self.rounds.len()
    }

    /// The first of its rounds.
    pub(crate) fn first(&self, rounds: usize) -> Self {
        Self {
            l2a: self.l2a,
            rounds: self.rounds.iter().take(rounds).cloned().collect(),
        }
    }

    /// Adds rounds, with a total of `frames` frames, up to `rounds_wanted`. Reuses pieces that an earlier run has finished, in its order;
    /// calls `tell` with each piece. The evaluator is made when it is needed.
    ///
    /// # Errors
    /// If it cannot be made, or is stopped.
    pub(crate) fn extend(
        &mut self,
        frames: u64,
        rounds_wanted: usize,
        known: &mut dyn Iterator<Item = Vec<Evaluation>>,
        mut tell: impl FnMut(&Piece),
        mut make: impl FnMut() -> Result<Evaluator, EvaluateError>,
    ) -> Result<(), EvaluateError> {
        let borders = rounds(frames);
        let mut evaluator = None;
        let have = self.rounds.len();
        for border in borders.windows(2).take(rounds_wanted).skip(have) {
            let round = Round {
                first: border[0],
                frames: border[1] - border[0],
            };
            let mut parts = Vec::new();
            while (parts.len() as u64) < round.parts() {
                let next = parts.len() as u64;
                let (piece, is_known) = match known.next() {
                    Some(piece) if round.has(next, &piece) => (piece, true),
                    _ => {
                        let evaluator = match &mut evaluator {
                            Some(evaluator) => evaluator,
                            none => none.insert(make()?),
                        };
                        (round.piece(next, evaluator)?, false)
                    }
                };
                tell(&Piece { batches: &piece, is_known });
                parts.extend(piece);
            }
            self.rounds.push(round.joined(&parts));
        }
        Ok(())
    }
}

/// A finished piece of a round: all of a small one.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a> {
    /// The results, batch by batch; of long batches part by part.
    pub batches: &'a Vec<Evaluation>,
    /// Whether an earlier run has finished it.
    pub is_known: bool,
}

impl Piece<'_> {
    /// Its frames.
    pub fn frames(&self) -> u64 {
        self.batches.iter().map(|batch| batch.errors.frames()).sum()
    }
}

fn merged<'a>(parts: impl Iterator<Item = &'a Evaluation>) -> Evaluation {
    let mut sum = Evaluation::default();
    parts.for_each(|part| sum.merge(part));
    sum
}

/// Points of ascending ratios. Frame k has the same bits, phase and reflectance at all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples(pub(super) Vec<Sample>);

impl Samples {
    /// The points, by ascending ratio.
    pub fn points(&self) -> &[Sample] {
        &self.0
    }

    /// Adds rounds at a ratio up to the wanted number.
    ///
    /// # Errors
    /// If the scene cannot be evaluated there.
    pub fn extend(&mut self, scene: &Scene, settings: Settings, l2a: f64, rounds_wanted: usize) -> Result<(), EvaluateError> {
        let known = &mut std::iter::empty();
        self.extend_from(scene, settings, l2a, rounds_wanted, known, |_| {})
    }

    /// The same, reusing pieces of rounds that an earlier run has finished, in its order; calls `tell` with each piece.
    pub(super) fn extend_from(
        &mut self,
        scene: &Scene,
        settings: Settings,
        l2a: f64,
        rounds_wanted: usize,
        known: &mut dyn Iterator<Item = Vec<Evaluation>>,
        tell: impl FnMut(&Piece),
    ) -> Result<(), EvaluateError> {
        let place = match self.0.binary_search_by(|point| point.l2a.total_cmp(&l2a)) {
            Ok(place) => place,
            Err(place) => {
                self.0.insert(place, Sample::none(l2a));
                place
            }
        };
        let evaluator = || Evaluator::new(&at_ratio(scene, l2a), settings);
        self.0[place].extend(settings.frames, rounds_wanted, known, tell, evaluator)
    }

    /// The points at some of the ratios, with their first rounds.
    pub fn picked(&self, l2a: &[f64], rounds: usize) -> Self {
        let wanted = self.0.iter().filter(|point| l2a.contains(&point.l2a));
        Self(wanted.map(|point| point.first(rounds)).collect())
    }

    /// The number of rounds common to the points at some ratios.
    pub fn common_rounds(&self, l2a: &[f64]) -> usize {
        let wanted = self.0.iter().filter(|point| l2a.contains(&point.l2a));
        wanted.map(Sample::rounds).min().unwrap_or(0)
    }

    /// The frames of several settings as those of one: batch by batch, at the common ratios and rounds.
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
                batches.zip(theirs.iter().flatten()).for_each(|(own, their)| own.merge(their));
                true
            });
        }
        pooled
    }

    /// The objective at each point; `None` if it is undefined at one of them.
    pub fn objectives(&self, criterion: Criterion) -> Option<Vec<f64>> {
        self.0.iter().map(|p| criterion.objective(&p.total())).collect()
    }

    /// The objective at each point in bootstrap resamples: one row for each resample in which it is defined at all points.
    ///
    /// Each round's batches are drawn from that round's with replacement, the same for all points. All points must hold as many rounds as
    /// the first.
    pub fn resampled(&self, criterion: Criterion, seed: u64) -> Vec<Vec<f64>> {
        let sizes: Vec<usize> = match self.0.first() {
            Some(point) => point.rounds.iter().map(Vec::len).collect(),
            None => return Vec::new(),
        };
        let resample = |drawn: Vec<usize>| {
            let objective = |point: &Sample| {
                let batches: Vec<&Evaluation> = point.rounds.iter().flatten().collect();
                let chosen = drawn.iter().map(|&batch| batches[batch]);
                criterion.objective(&merged(chosen))
            };
            self.0.iter().map(objective).collect()
        };
        let resampled: Vec<Option<_>> = of_resamples(&sizes, seed, resample);
        resampled.into_iter().flatten().collect()
    }
}

/// `of` the batches of each resample. Batches are numbered through all rounds, and those of a round are drawn from that round.
pub(crate) fn of_resamples<T: Send>(sizes: &[usize], seed: u64, of: impl Fn(Vec<usize>) -> T + Sync) -> Vec<T> {
    let draw = |number: usize| {
        let mut random = stream(seed, number as u64, Purpose::Resampling);
        let (mut drawn, mut start) = (Vec::new(), 0);
        for &size in sizes {
            drawn.extend((0..size).map(|_| start + random.random_range(0..size)));
            start += size;
        }
        drawn
    };
    map(0..RESAMPLES as usize, |number| of(draw(number)))
}

/// The scene with its panels driven to a ratio.
pub fn at_ratio(scene: &Scene, l2a: f64) -> Scene {
    let mut scene = scene.clone();
    scene.link.l2a = L2a::Ratio(l2a);
    scene
}

/// A round of frames in batches, long ones in parts.
struct Round {
    first: u64,
    frames: u64,
}

impl Round {
    fn batches(&self) -> u64 {
        self.frames.min(BATCHES)
    }

    fn parts_of_batch(&self) -> u64 {
        self.frames.div_ceil(self.batches()).div_ceil(PART)
    }

    fn parts(&self) -> u64 {
        self.batches() * self.parts_of_batch()
    }

    /// The first frame of a part.
    fn border(&self, part: u64) -> u64 {
        let before = u128::from(self.frames) * u128::from(part) / u128::from(self.parts());
        self.first + before as u64
    }

    /// Whether these may be its parts from `first` on.
    fn has(&self, first: u64, parts: &[Evaluation]) -> bool {
        let is_part =
            |(part, found): (u64, &Evaluation)| part < self.parts() && found.errors.frames() == self.border(part + 1) - self.border(part);
        !parts.is_empty() && (first..).zip(parts).all(is_part)
    }

    /// The next parts from `first` on: as many as a piece, with work for all threads.
    fn piece(&self, first: u64, evaluator: &Evaluator) -> Result<Vec<Evaluation>, EvaluateError> {
        let part_frames = self.frames.div_ceil(self.parts());
        let count = (PIECE / part_frames).max(1).next_multiple_of(threads() as u64);
        let frames_of = |part| self.border(part)..self.border(part + 1);
        let parts = first..self.parts().min(first + count);
        let evaluate = |workspace: &mut Workspace, part| evaluator.evaluate(frames_of(part), workspace);
        try_map_with(parts, || evaluator.workspace(), evaluate)
    }

    /// The batches from all parts.
    fn joined(&self, parts: &[Evaluation]) -> Vec<Evaluation> {
        let batches = parts.chunks(self.parts_of_batch() as usize);
        batches.map(|batch| merged(batch.iter())).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::detectors::DetectorChoice;
    use crate::stop::Stop;

    const SETTINGS: Settings = Settings::fast(3000, 5, DetectorChoice::KMeans);

    fn scene(distance_m: u32) -> Scene {
        let settings = [format!("pose.distance_m={distance_m}"), "panel.interval=0.5".into()];
        Scene::load("paper", &settings).unwrap()
    }

    fn samples(distance_m: u32, order: &[(f64, usize)]) -> Samples {
        let mut samples = Samples::default();
        for &(l2a, rounds) in order {
            samples.extend(&scene(distance_m), SETTINGS, l2a, rounds).unwrap();
        }
        samples
    }

    #[test]
    fn rounds_double_and_end_with_the_frames() {
        assert_eq!(rounds(100), [0, 100]);
        assert_eq!(rounds(2048), [0, 2048]);
        assert_eq!(rounds(10_000), [0, 2048, 4096, 8192, 10_000]);
        assert!(rounds(u64::MAX).len() < 60);
    }

    #[test]
    fn all_ratios_see_the_same_frames_whatever_was_asked_first() {
        let samples_one = samples(70, &[(1.0, 1), (2.0, 2), (1.0, 2)]);
        assert_eq!(samples_one, samples(70, &[(2.0, 2), (1.0, 2)]));
        let [one, two] = samples_one.points() else { panic!("two ratios") };
        for (a, b) in one.rounds.iter().flatten().zip(two.rounds.iter().flatten()) {
            assert_eq!((a.on.count(), a.off.count()), (b.on.count(), b.off.count()));
        }
        assert_eq!(one.total().errors.frames(), 3000);
        let counts: Vec<u64> = one.rounds.iter().flatten().map(|batch| batch.on.count()).collect();
        assert!(counts.windows(2).any(|pair| pair[0] != pair[1]), "or equal counts show nothing");
    }

    #[test]
    fn the_difference_of_two_ratios_is_known_better_than_either() {
        let resampled = samples(70, &[(2.0, 1), (2.2, 1)]).resampled(Criterion::B2w, 1);
        let spread = |of: &dyn Fn(&[f64]) -> f64| {
            let values: Vec<f64> = resampled.iter().map(|row| of(row)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
        };
        let (alone, difference) = (spread(&|row| row[0]), spread(&|row| row[1] - row[0]));
        // Independent frames would make it √2 times as uncertain as one of them.
        assert!(difference < alone / 2.0, "{difference} against {alone}");
    }

    #[test]
    fn pooled_settings_have_all_frames_of_what_is_common() {
        let (near, far) = (samples(60, &[(1.0, 1), (2.0, 2)]), samples(70, &[(2.0, 1), (3.0, 1)]));
        let pooled = Samples::pooled(&[&near, &far]);
        let [point] = pooled.points() else { panic!("one common ratio") };
        let mut both = near.picked(&[2.0], 1).points()[0].total();
        both.merge(&far.points()[0].total());
        assert_eq!((point.l2a, point.rounds()), (2.0, 1));
        assert_eq!(point.total().errors, both.errors);
        assert_eq!(Samples::pooled(&[]), Samples::default());
    }

    #[test]
    fn a_round_goes_on_from_any_piece_of_it() {
        let settings = Settings::fast(40_000, 5, DetectorChoice::KMeans);
        let extend = |known: Vec<Vec<Evaluation>>| {
            let (mut samples, mut pieces) = (Samples::default(), Vec::new());
            let heard = |piece: &Piece| pieces.push((piece.is_known, piece.batches.to_vec()));
            let known = &mut known.into_iter();
            samples.extend_from(&scene(70), settings, 1.0, usize::MAX, known, heard).unwrap();
            (samples, pieces)
        };
        let (whole, pieces) = extend(Vec::new());
        assert!(pieces.len() > whole.points()[0].rounds());
        let kept: Vec<_> = pieces.into_iter().map(|(_, batches)| batches).collect();
        // Up to the middle of the last round, and the first round in pieces of another size.
        let (first, others) = kept.split_first().unwrap();
        let (start, end) = first.split_at(5);
        let known = [start.to_vec(), end.to_vec()]
            .into_iter()
            .chain(others[..others.len() - 1].to_vec());
        let (resumed, pieces) = extend(known.collect());
        assert!(resumed == whole);
        let new = pieces.iter().filter(|(is_known, _)| !is_known).count();
        assert_eq!((new, pieces.len()), (1, kept.len() + 1));
        // A piece of another size is done again.
        assert!(extend(vec![others[others.len() - 1].clone()]).0 == whole);
    }

    #[test]
    fn no_part_of_a_round_takes_long() {
        for frames in [1, 100, 2048, 64 * PART, 64 * PART + 1, 100_000_000] {
            let round = Round { first: 7, frames };
            let lengths = (0..round.parts()).map(|part| round.border(part + 1) - round.border(part));
            let lengths: Vec<u64> = lengths.collect();
            assert_eq!(lengths.iter().sum::<u64>(), frames);
            assert!(lengths.iter().all(|frames| (1..=PART).contains(frames)));
            let mut part = Evaluation::default();
            part.errors.push(0);
            let batches = round.joined(&vec![part; lengths.len()]);
            assert_eq!(batches.len() as u64, round.batches());
            let parts = |batch: &Evaluation| batch.errors.frames() == round.parts_of_batch();
            assert!(batches.iter().all(parts));
        }
        let short = Round {
            first: 0,
            frames: 64 * PART,
        };
        assert_eq!(short.parts(), short.batches());
    }

    #[test]
    fn a_search_that_is_ended_keeps_nothing_half() {
        static ASKED: AtomicBool = AtomicBool::new(false);
        let settings = Settings {
            stop: Stop::at(&ASKED),
            ..SETTINGS
        };
        let (mut samples, known) = (Samples::default(), &mut std::iter::empty());
        let ended = samples.extend_from(&scene(70), settings, 1.0, 2, known, |_| {
            ASKED.store(true, Ordering::Relaxed);
        });
        assert!(matches!(ended, Err(EvaluateError::Stopped)), "{ended:?}");
        assert_eq!(samples.points()[0].rounds(), 1);
    }
}
