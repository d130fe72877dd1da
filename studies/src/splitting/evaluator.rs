//! Swarms of frames that climb from level to level.

use sim::random::{Purpose, stream};
use sim::scene::Scene;

use super::levels;
use super::sampler::{Sampler, ScoredParticle, SplittingWorkspace};
use crate::monte_carlo::{CHUNK, EvaluateError, Evaluation, Settings};
use crate::statistics::{RareErrors, SWARM};

// A swarm is a chunk of frames.
const _: () = assert!(SWARM as u64 == CHUNK);

/// Evaluates swarms.
pub struct SplittingEvaluator {
    sampler: Sampler,
    /// In ascending order; the last is that of a misread LED.
    levels: Vec<f32>,
}

impl SplittingEvaluator {
    /// Prepares an evaluation of `scene`'s first panel, and chooses the levels.
    ///
    /// # Errors
    /// If the scene cannot be evaluated, or has no noise.
    pub fn new(scene: &Scene, settings: Settings) -> Result<Self, EvaluateError> {
        Self::with_levels(scene, settings, None)
    }

    /// As [`SplittingEvaluator::new`], with earlier levels for this scene and these settings, because choosing them takes as long as a
    /// swarm.
    ///
    /// # Errors
    /// As [`SplittingEvaluator::new`].
    pub fn with_levels(scene: &Scene, settings: Settings, levels: Option<&[f32]>) -> Result<Self, EvaluateError> {
        let sampler = Sampler::new(scene, settings)?;
        let levels = match levels {
            Some(levels) => levels.to_vec(),
            None => levels::choose(&sampler)?,
        };
        Ok(Self { sampler, levels })
    }

    /// The levels of the score, ascending; the last is that of a misread LED, infinity.
    pub fn levels(&self) -> &[f32] {
        &self.levels
    }

    /// Memory for a thread.
    pub fn workspace(&self) -> SplittingWorkspace {
        self.sampler.workspace()
    }

    /// Evaluates swarm `chunk`, as [`crate::monte_carlo::Evaluator::chunk`] does frames.
    ///
    /// # Errors
    /// If a frame cannot be measured.
    pub fn chunk(&self, chunk: u64, workspace: &mut SplittingWorkspace) -> Result<Evaluation, EvaluateError> {
        let seed = self.sampler.seed();
        let mut rare = RareErrors::default();
        rare.push(self.swarm(seed, chunk, workspace)?);
        Ok(Evaluation {
            rare,
            ..Evaluation::default()
        })
    }

    /// A swarm's estimate of the rate.
    fn swarm(&self, seed: u64, number: u64, workspace: &mut SplittingWorkspace) -> Result<f64, EvaluateError> {
        let random = &mut stream(seed, number, Purpose::Splitting);
        let mut swarm = (0..CHUNK)
            .map(|member| self.sampler.draw(seed, number * CHUNK + member, random, workspace))
            .collect::<Result<Vec<_>, _>>()?;
        let mut rate = 1.0;
        for (place, &level) in self.levels.iter().enumerate() {
            let above: Vec<ScoredParticle> = swarm.into_iter().filter(|(_, s)| *s >= level).collect();
            rate *= above.len() as f64 / SWARM as f64;
            if above.is_empty() || place + 1 == self.levels.len() {
                break;
            }
            swarm = self.sampler.spread(&above, level, SWARM, random, workspace)?;
        }
        Ok(rate)
    }
}
