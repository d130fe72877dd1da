//! Bit errors over distance with the best L2A and with a random one (figure 22 of Do & Yoo 2020).
//!
//! In both sets each frame's interval is drawn from [`STEPS`] values, spread evenly over 0.5 to 2. In the one set the ratio is the best for
//! that interval, in the other it is drawn uniformly from 0.2 to 4. All random properties of frames are independent, so that the interval
//! of their error rate covers all of them. Both sets have the same intervals, bits, phases and reflectances.

use crate::parallel::{try_map, try_map_with};
use serde::{Deserialize, Serialize};

use super::operating_point::OperatingPoint;
use super::pieces::Pieces;
use crate::monte_carlo::{EvaluateError, Evaluator, Settings, Workspace};
use crate::statistics::FrameErrors;
use sim::random::{Purpose, stream, uniform};
use sim::scene::Scene;

/// The intervals of Table 1 of Do & Yoo 2020.
pub const INTERVALS: [f64; 2] = [0.5, 2.0];
/// The ratios of Table 1.
pub const RATIOS: [f64; 2] = [0.2, 4.0];
/// Values of the interval. Their steps of 0.023 are finer than the error rate resolves.
pub const STEPS: usize = 64;
/// Frames between two checks of the number of errors.
const ROUND: u64 = 512;

/// The dimming of the panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dimming {
    /// To the best ratio for its interval.
    Best,
    /// To any ratio.
    Random,
}

/// One of the two sets at one distance.
pub struct Set<'a, B> {
    /// The scene; its interval, distance and ratio are varied.
    pub scene: &'a Scene,
    /// The distance in metres.
    pub distance_m: f64,
    /// The dimming.
    pub dimming: Dimming,
    /// The best ratio for an interval.
    pub best: B,
    /// The numbers of intervals and ratios at which a detector is trained: a frame is read with the nearest training.
    pub learnt_at: [usize; 2],
}

/// The middle of one of `count` even steps over a range.
fn middle([low, high]: [f64; 2], step: usize, count: usize) -> f64 {
    low + (high - low) * (step as f64 + 0.5) / count as f64
}

/// The step, of `count` even ones, that contains a share from 0 to 1.
fn step(share: f64, count: usize) -> usize {
    ((share * count as f64) as usize).min(count - 1)
}

impl<B: Fn(f64) -> f64 + Sync> Set<'_, B> {
    fn at(&self, interval: f64, l2a: f64) -> Scene {
        let at = OperatingPoint {
            interval,
            distance_m: self.distance_m,
            l2a,
        };
        at.scene(self.scene)
    }

    /// The step of a frame's interval, the share of the range of ratios below its own, and its ratio.
    fn drawn(&self, seed: u64, frame: u64) -> (usize, f64, f64) {
        let mut random = stream(seed, frame, Purpose::Setting);
        let (place, share) = (step(uniform(&mut random), STEPS), uniform(&mut random));
        let l2a = match self.dimming {
            Dimming::Best => (self.best)(middle(INTERVALS, place, STEPS)),
            Dimming::Random => RATIOS[0] + (RATIOS[1] - RATIOS[0]) * share,
        };
        (place, share, l2a)
    }

    /// For each interval one reader, or for trained detectors one per training ratio.
    fn readers(&self, settings: Settings) -> Result<Vec<Vec<Evaluator>>, EvaluateError> {
        if !settings.detector.looks_back() {
            let reader = |place| {
                Ok(vec![Evaluator::new(
                    &self.at(middle(INTERVALS, place, STEPS), RATIOS[1]),
                    settings,
                )?])
            };
            return try_map(0..STEPS, reader);
        }
        let [intervals, ratios] = match (self.learnt_at, self.dimming) {
            ([intervals, ratios], Dimming::Best) => [intervals * ratios, 1],
            (learnt_at, Dimming::Random) => learnt_at,
        };
        let teacher = |place: usize| {
            let interval = middle(INTERVALS, place / ratios, intervals);
            let l2a = match self.dimming {
                Dimming::Best => (self.best)(interval),
                Dimming::Random => middle(RATIOS, place % ratios, ratios),
            };
            Evaluator::new(&self.at(interval, l2a), settings)
        };
        let teachers = try_map(0..intervals * ratios, teacher)?;
        let taught = |place| {
            let scene = self.at(middle(INTERVALS, place, STEPS), RATIOS[1]);
            let first = place * intervals / STEPS * ratios;
            let teachers = teachers[first..first + ratios].iter();
            teachers.map(|teacher| Evaluator::taught(&scene, teacher)).collect()
        };
        try_map(0..STEPS, taught)
    }

    /// Counts bit errors: in as many frames as in `settings`, rounded up to whole rounds, or until there are `enough`.
    ///
    /// It continues from finished rounds, to which it adds; calls `tell` with them from time to time.
    ///
    /// # Errors
    /// If the scene cannot be seen or measured, the detector cannot be trained, or [`Settings::stop`] ended it.
    pub fn count(
        &self,
        settings: Settings,
        enough: u64,
        pieces: &mut Pieces,
        mut tell: impl FnMut(&Pieces),
    ) -> Result<FrameErrors, EvaluateError> {
        let readers = self.readers(settings)?;
        let read = |room: &mut Option<(usize, Workspace)>, frame: u64| -> Result<FrameErrors, EvaluateError> {
            let (place, share, l2a) = self.drawn(settings.seed, frame);
            let reader = &readers[place][step(share, readers[place].len())];
            let workspace = match room {
                Some((known, workspace)) if *known == place => workspace,
                other => &mut other.insert((place, reader.workspace())).1,
            };
            workspace.l2a = Some(l2a);
            Ok(reader.evaluate(frame..frame + 1, workspace)?.errors)
        };
        while pieces.errors.frames() < settings.frames && pieces.errors.errors() < enough {
            let done = pieces.errors.frames();
            let mut round: Vec<u64> = (done..done + ROUND).collect();
            // Successive frames of one interval need one workspace.
            round.sort_by_key(|&frame| self.drawn(settings.seed, frame).0);
            let round = try_map_with(round, || None, read)?;
            round.iter().for_each(|errors| pieces.errors.merge(errors));
            tell(pieces);
        }
        Ok(std::mem::take(&mut pieces.errors))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detectors::DetectorChoice;

    fn scene() -> Scene {
        Scene::load("paper", &[]).unwrap()
    }

    fn at_70_m(scene: &Scene, dimming: Dimming) -> Set<'_, impl Fn(f64) -> f64 + Sync> {
        Set {
            scene,
            distance_m: 70.0,
            dimming,
            best: |interval| 2.0 * interval,
            learnt_at: [3, 2],
        }
    }

    #[test]
    fn every_frame_has_a_setting_of_its_own_and_both_sets_the_same_intervals() {
        let scene = scene();
        let [best, random] = [Dimming::Best, Dimming::Random].map(|dimming| {
            let set = at_70_m(&scene, dimming);
            (0..4000).map(|frame| set.drawn(1, frame)).collect::<Vec<_>>()
        });
        let mean = |of: &dyn Fn(&(usize, f64, f64)) -> f64| random.iter().map(of).sum::<f64>() / 4000.0;
        assert!((mean(&|drawn| drawn.0 as f64) - 31.5).abs() < 1.0);
        assert!((mean(&|drawn| drawn.2) - 2.1).abs() < 0.06);
        assert!(
            random
                .iter()
                .all(|drawn| drawn.0 < STEPS && (RATIOS[0]..RATIOS[1]).contains(&drawn.2))
        );
        for (b, r) in best.iter().zip(&random) {
            assert!(b.0 == r.0 && b.2 == 2.0 * middle(INTERVALS, b.0, STEPS));
        }
    }

    /// A frame with another ratio than the prepared scene equals one prepared for that ratio.
    #[test]
    fn a_frame_is_that_of_a_scene_of_its_interval_and_ratio() {
        let scene = scene();
        let set = at_70_m(&scene, Dimming::Random);
        let settings = Settings::fast(512, 1, DetectorChoice::KMeans);
        let counted = set.count(settings, u64::MAX, &mut Pieces::default(), |_| {}).unwrap();
        let one_by_one = |frame: u64| {
            let (place, _, l2a) = set.drawn(1, frame);
            let evaluator = Evaluator::new(&set.at(middle(INTERVALS, place, STEPS), l2a), settings).unwrap();
            let room = &mut evaluator.workspace();
            evaluator.evaluate(frame..frame + 1, room).unwrap().errors.errors()
        };
        let errors: u64 = (0..512).map(one_by_one).sum();
        assert!(
            errors > 50 && errors.abs_diff(counted.errors()) <= errors / 20,
            "{errors} {counted:?}"
        );
    }

    #[test]
    fn what_learns_reads_by_what_it_knows_of_the_nearest_setting() {
        let scene = scene();
        for dimming in [Dimming::Best, Dimming::Random] {
            let set = at_70_m(&scene, dimming);
            let rate = |detector| {
                let settings = Settings::fast(512, 1, detector);
                set.count(settings, u64::MAX, &mut Pieces::default(), |_| {}).unwrap().rate()
            };
            let [fisher, kmeans] = [DetectorChoice::Fisher, DetectorChoice::KMeans].map(rate);
            assert!(fisher < 2.0 * kmeans + 0.002, "{dimming:?}: {fisher} {kmeans}");
        }
    }

    #[test]
    fn a_count_ends_at_its_frames_or_at_its_errors() {
        let scene = scene();
        let set = at_70_m(&scene, Dimming::Random);
        let count = |frames, errors| {
            let settings = Settings::fast(frames, 1, DetectorChoice::KMeans);
            set.count(settings, errors, &mut Pieces::default(), |_| {}).unwrap()
        };
        let all = count(1000, u64::MAX);
        assert_eq!(all.frames(), 1024, "two rounds");
        assert!(all.errors() > 100);
        assert_eq!(count(600, 1).frames(), 512);
        assert_eq!(count(0, 1).frames(), 0);
    }

    /// The error rate of many frames of another seed, and how often the intervals of few frames hold it.
    #[test]
    fn intervals_hold_what_is_drawn_with_the_frames() {
        let scene = scene();
        let set = at_70_m(&scene, Dimming::Random);
        let count = |frames, seed| {
            let settings = Settings::fast(frames, seed, DetectorChoice::KMeans);
            set.count(settings, u64::MAX, &mut Pieces::default(), |_| {}).unwrap()
        };
        let truth = count(100_000, 1000).rate();
        let held = (1..=20).filter(|&seed| {
            let [low, high] = count(512, seed).interval_95();
            (low..=high).contains(&truth)
        });
        let held = held.count();
        assert!(held >= 18, "{held} of 20 hold {truth}");
    }
}
