//! The levels of the score: found by subset simulation on frames of another seed.

use crate::parallel::try_map_with;

use super::sampler::{MISREAD, Sampler, ScoredParticle, SplittingWorkspace};
use crate::monte_carlo::EvaluateError;
use crate::statistics::RARER;
use sim::random::{Purpose, stream};

/// Frames of each level, in parts with their own random numbers. As many as a swarm has: four times as many find no better levels.
const PARTS: usize = 25;
const FRAMES: usize = 10 * PARTS;
/// The most levels: rates down to 10⁻²⁰.
const MOST_LEVELS: usize = 30;
/// XOR mask from the seed of an evaluation to that of these frames.
const LEVELS_SEED: u64 = 0x6c65_7665_6c73;

/// Ascending levels, each reached by about one in five of the frames above the one before; the last is [`MISREAD`].
pub(super) fn choose(sampler: &Sampler) -> Result<Vec<f32>, EvaluateError> {
    let seed = sampler.seed() ^ LEVELS_SEED;
    let in_parts = |round: usize, above: Option<(&[ScoredParticle], f32)>| {
        let part = |workspace: &mut SplittingWorkspace, part: usize| {
            let mut random = stream(seed, (round * PARTS + part) as u64, Purpose::Splitting);
            let mine = part * (FRAMES / PARTS)..(part + 1) * (FRAMES / PARTS);
            match above {
                Some((above, level)) => sampler.spread(above, level, mine.len(), &mut random, workspace),
                None => mine.map(|frame| sampler.draw(seed, frame as u64, &mut random, workspace)).collect(),
            }
        };
        let parts: Result<Vec<Vec<ScoredParticle>>, EvaluateError> = try_map_with(0..PARTS, || sampler.workspace(), part);
        parts.map(|parts| parts.into_iter().flatten().collect::<Vec<_>>())
    };
    let mut swarm = in_parts(0, None)?;
    let mut levels: Vec<f32> = Vec::new();
    while levels.len() + 1 < MOST_LEVELS {
        swarm.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        let level = swarm[FRAMES / RARER - 1].1;
        // If no frame moves any more, more levels would not help.
        if level == MISREAD || levels.last().is_some_and(|last| level <= *last) {
            break;
        }
        levels.push(level);
        let above = &swarm[..swarm.partition_point(|(_, score)| *score >= level)];
        swarm = in_parts(levels.len(), Some((above, level)))?;
    }
    levels.push(MISREAD);
    Ok(levels)
}
