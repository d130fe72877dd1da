//! Assigns frames to steps by the changes between frames alone, because neither the camera's clock nor the time of the start is known.
//!
//! Successive frames that are alike form a run. Thirteen successive runs are the steps that name the LEDs if each panel of the six pairs
//! differs from its complement wherever there is an LED. In any other thirteen runs, one pair in two leaves an LED unchanged. The steps
//! that dim may look alike; their frames then follow from the time at which these steps end.

use super::{CODES, PAIRS, RAMP};
use rx_pipeline::detect::otsu_threshold;

/// Minimum number of frames in a run, unless each step has one frame.
const RUN_MIN: usize = 3;
/// Minimum share of the mean change per pair that all pairs have in common.
const AGREEMENT_MIN: f32 = 0.3;
/// Minimum change of a pair, relative to the mean pair: a pair with a panel that was not shown has half.
const PAIR_MIN: f32 = 0.7;

/// Maximum error in the end of the steps that dim, in steps.
const ENDS_OFF_MAX: f32 = 1.5;

/// The pictures of the steps: for each, the mean of the frames that show it.
#[derive(Clone, Debug, PartialEq)]
pub struct StepPictures {
    /// The pictures of the steps that name the LEDs.
    pub codes: Vec<Vec<f32>>,
    /// The pictures of the steps that dim; none if the frames end before.
    pub ramp: Option<Vec<Vec<f32>>>,
}

/// Frames from `start` to before `end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    start: usize,
    end: usize,
}

/// Finds the steps among `frames`, each of which has the levels of the same pixels; none if the frames do not contain them.
pub fn align(frames: &[Vec<f32>]) -> Option<StepPictures> {
    let singles = (0..frames.len()).map(|start| Run { start, end: start + 1 }).collect();
    [runs(frames), singles]
        .into_iter()
        .filter_map(|runs| best(frames, &runs))
        .max_by(|one, other| one.0.total_cmp(&other.0))
        .map(|(_, aligned)| aligned)
}

/// The steps in `runs`, and how well they agree.
fn best(frames: &[Vec<f32>], runs: &[Run]) -> Option<(f32, StepPictures)> {
    let pictures: Vec<Vec<f32>> = runs.iter().map(|run| mean(frames, run.inner())).collect();
    let windows = pictures.windows(CODES).enumerate();
    let (changed, first) = windows
        .filter(|(_, codes)| are_whole(&codes[1..]))
        .map(|(first, codes)| (all_changed(&codes[1..]), first))
        .max_by(|one, other| one.0.total_cmp(&other.0))?;
    let codes = &pictures[first..first + CODES];
    let agreement = changed / mean_changed(&codes[1..]);
    if agreement.is_nan() || agreement < AGREEMENT_MIN {
        return None;
    }
    let (begin, end) = (runs[first + 1].start, runs[first + CODES - 1].end);
    let step = (end - begin) as f32 / (2 * PAIRS) as f32;
    let ramp = ramp_runs(&runs[first + CODES..], end, step).map(|run| (run.end <= frames.len()).then(|| mean(frames, run)));
    let aligned = StepPictures {
        codes: codes.to_vec(),
        ramp: ramp.into_iter().collect(),
    };
    Some((agreement, aligned))
}

/// The frames of the steps that dim, after frame `start`. Each step has a run of its own, unless some look alike: then each has a fifth of
/// the time until the end of that run which ends closest to the expected end.
fn ramp_runs(runs: &[Run], start: usize, step: f32) -> [Run; RAMP.len()] {
    let steps = |frames: usize| frames as f32 / step;
    let is_step = |run: &Run| (0.5..1.6).contains(&steps(run.end - run.start));
    if let Some(each) = runs.first_chunk()
        && each.iter().all(is_step)
    {
        return each.map(Run::inner);
    }
    let meant = RAMP.len() as f32;
    let off = |run: &Run| (steps(run.end - start) - meant).abs();
    let last = runs.iter().min_by(|one, other| off(one).total_cmp(&off(other)));
    let step = match last.filter(|last| off(last) < ENDS_OFF_MAX) {
        Some(last) => (last.end - start) as f32 / meant,
        None => step,
    };
    std::array::from_fn(|index| {
        let at = |steps: f32| (start as f32 + (index as f32 + steps) * step) as usize;
        Run {
            start: at(0.3),
            end: at(0.7).max(at(0.3) + 1),
        }
    })
}

impl Run {
    /// The run without its first and last frame, which may show two steps, if it has enough frames.
    fn inner(self) -> Self {
        match self.end - self.start {
            4.. => Self {
                start: self.start + 1,
                end: self.end - 1,
            },
            _ => self,
        }
    }
}

/// Runs of successive frames that are alike. Two runs that look the same are one run with a disturbance in between.
fn runs(frames: &[Vec<f32>]) -> Vec<Run> {
    let changes: Vec<f32> = frames.windows(2).map(|pair| difference(&pair[0], &pair[1])).collect();
    let limit = limit(&changes);
    let mut runs: Vec<Run> = Vec::new();
    let mut start = 0;
    for end in 1..=frames.len() {
        if changes.get(end - 1).is_some_and(|&change| change <= limit) {
            continue;
        }
        let run = Run { start, end };
        start = end;
        if run.end - run.start < RUN_MIN {
            continue;
        }
        match runs.last_mut() {
            Some(last) if difference(&mean(frames, last.inner()), &mean(frames, run.inner())) <= limit => last.end = run.end,
            _ => runs.push(run),
        }
    }
    runs
}

/// The change between frames that separates steps from noise: a threshold of the changes' logarithms.
fn limit(changes: &[f32]) -> f32 {
    let most = changes.iter().copied().fold(0.0, f32::max);
    let mut logs: Vec<f32> = changes.iter().map(|&change| (change + 1e-3 * most).ln()).collect();
    logs.sort_by(f32::total_cmp);
    otsu_threshold(&logs).map_or(most, |[below, above]| ((below + above) / 2.0).exp() - 1e-3 * most)
}

/// The mean change of a pixel.
fn difference(one: &[f32], other: &[f32]) -> f32 {
    let changes = one.iter().zip(other).map(|(one, other)| (one - other).abs());
    changes.sum::<f32>() / one.len().max(1) as f32
}

fn mean(frames: &[Vec<f32>], run: Run) -> Vec<f32> {
    let shown = &frames[run.start..run.end];
    let mut sum = vec![0.0; shown[0].len()];
    for frame in shown {
        for (sum, pixel) in sum.iter_mut().zip(frame) {
            *sum += pixel / shown.len() as f32;
        }
    }
    sum
}

/// The change of a pixel in each of the pairs.
fn pair_changes(codes: &[Vec<f32>], pixel: usize) -> impl Iterator<Item = f32> {
    codes.chunks_exact(2).map(move |pair| (pair[0][pixel] - pair[1][pixel]).abs())
}

/// The sum over all pixels of the change that all pairs have in common.
fn all_changed(codes: &[Vec<f32>]) -> f32 {
    let pixels = 0..codes[0].len();
    pixels.map(|pixel| pair_changes(codes, pixel).fold(f32::INFINITY, f32::min)).sum()
}

/// Whether each pair changes about as much as the others, because each LED changes in all of them.
fn are_whole(codes: &[Vec<f32>]) -> bool {
    let mean = mean_changed(codes);
    codes.chunks_exact(2).all(|pair| {
        let changed: f32 = pair[0].iter().zip(&pair[1]).map(|(one, other)| (one - other).abs()).sum();
        changed >= PAIR_MIN * mean
    })
}

/// The sum over all pixels of the mean change in a pair.
fn mean_changed(codes: &[Vec<f32>]) -> f32 {
    let pixels = 0..codes[0].len();
    pixels.map(|pixel| pair_changes(codes, pixel).sum::<f32>() / PAIRS as f32).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bring_up::walk;
    use link::panel::{LEDS, PanelFrame};

    fn levels(panel: PanelFrame, share: u8) -> Vec<f32> {
        panel.shares().map(|on| 10.0 + on * f32::from(share)).to_vec()
    }

    /// Panels of a message, each different.
    fn message(count: u64) -> impl Iterator<Item = Vec<f32>> {
        // SplitMix64.
        (1..=count).map(|number| {
            let bits = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            levels(PanelFrame::from_bits(bits ^ bits >> 31), 255)
        })
    }

    /// A film: panels of a message, the walk with `frames` frames a step (with a frame of two steps in between if `is_mixed`), and a
    /// message again.
    fn film(frames: usize, is_mixed: bool) -> Vec<Vec<f32>> {
        let mut film: Vec<Vec<f32>> = message(40).collect();
        for step in walk() {
            let picture = levels(step.panel, step.share);
            if let (true, Some(before)) = (is_mixed, film.last()) {
                film.push(before.iter().zip(&picture).map(|(one, other)| 0.3 * one + 0.7 * other).collect());
            }
            film.extend(std::iter::repeat_n(picture, frames));
        }
        film.extend(message(30));
        film
    }

    fn shown() -> (Vec<Vec<f32>>, Vec<Vec<f32>>) {
        let steps: Vec<Vec<f32>> = walk().map(|step| levels(step.panel, step.share)).collect();
        (steps[..CODES].to_vec(), steps[CODES..CODES + RAMP.len()].to_vec())
    }

    #[test]
    fn the_steps_are_found_between_messages_at_any_frame_rate() {
        let (codes, ramp) = shown();
        for (frames, is_mixed) in [(15, false), (14, true), (4, true), (50, true)] {
            let aligned = align(&film(frames, is_mixed)).unwrap();
            for (found, meant) in aligned.codes.iter().zip(&codes).chain(aligned.ramp.unwrap().iter().zip(&ramp)) {
                assert!(difference(found, meant) < 1e-3, "{frames} frames a step");
            }
        }
    }

    #[test]
    fn a_clock_that_is_unsteady_finds_the_steps_that_dim() {
        let (codes, ramp) = shown();
        for is_dimmed in [true, false] {
            let mut film: Vec<Vec<f32>> = message(40).collect();
            let steps = walk().take(CODES + RAMP.len());
            for (number, step) in steps.enumerate() {
                let frames = if number < CODES { 30 } else { 24 };
                let share = if is_dimmed { step.share } else { 255 };
                film.extend(std::iter::repeat_n(levels(step.panel, share), frames));
            }
            film.extend(message(12));
            let aligned = align(&film).unwrap();
            assert_eq!(aligned.codes.len(), codes.len());
            for (found, meant) in aligned.ramp.unwrap().iter().zip(&ramp) {
                let meant = if is_dimmed { meant } else { &ramp[RAMP.len() - 1] };
                assert!(difference(found, meant) < 1e-3, "dimmed: {is_dimmed}");
            }
        }
    }

    #[test]
    fn a_picture_of_each_step_is_enough() {
        let (codes, ramp) = shown();
        let aligned = align(&film(1, false)).unwrap();
        assert_eq!(aligned.codes, codes);
        assert_eq!(aligned.ramp, Some(ramp));
    }

    #[test]
    fn a_film_that_ends_behind_the_codes_has_no_ramp() {
        let film: Vec<Vec<f32>> = film(10, false).into_iter().take(40 + 10 * CODES + 15).collect();
        let aligned = align(&film).unwrap();
        assert_eq!((aligned.codes, aligned.ramp), (shown().0, None));
    }

    /// A board may have been too slow for the step and so shows a dark panel with the next one.
    #[test]
    fn a_pair_of_which_one_panel_is_lost_is_no_walk() {
        let film: Vec<Vec<f32>> = film(10, false);
        let last = 40 + 10 * (CODES - 1);
        let lost: Vec<Vec<f32>> = film.iter().take(last).chain(&film[last + 10..last + 20]).cloned().collect();
        assert!(align(&film[..last + 20]).is_some());
        assert!(align(&lost).is_none());
    }

    #[test]
    fn messages_alone_and_nothing_at_all_are_no_walk() {
        let messages: Vec<Vec<f32>> = message(500).collect();
        let slow: Vec<Vec<f32>> = message(100).flat_map(|picture| std::iter::repeat_n(picture, 4)).collect();
        for frames in [messages, slow, vec![vec![0.0; LEDS]; 300], vec![vec![]; 20], vec![]] {
            assert!(align(&frames).is_none());
        }
    }

    #[test]
    fn a_flaw_in_a_step_does_not_end_it() {
        let mut film = film(20, false);
        film[40 + 25].iter_mut().for_each(|level| *level += 200.0);
        let aligned = align(&film).unwrap();
        assert!(difference(&aligned.codes[5], &shown().0[5]) < 1e-3);
    }
}
