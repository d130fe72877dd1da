//! Bit error rates too small to count, by splitting.
//!
//! An error of a well-read panel needs a rare combination of bits, sub-pixel phase and noise. Splitting climbs to it in steps that are each
//! likely (Kahn & Harris 1951). A [score](self#score) measures how near one LED is to being misread; *levels* of the score, each about five
//! times rarer than the one before, end at the misread LED itself.
//!
//! A **swarm** is 256 random frames, drawn as for counting, each with one selected LED. Those that reach the first level continue, copied
//! until there are as many as before. Each then takes some steps above the level: a step draws some of the frame's random numbers anew (the
//! noise of some pixels, a few bits, the phase), and is undone if the score then falls below the level. Such steps do not change the
//! distribution of the frames above the level (Metropolis et al. 1953). Then those that reach the next level continue, and so forth. The
//! product of the parts that continue, the last of them the misread part, is the swarm's estimate of the bit error rate.
//!
//! Its expectation is exactly the bit error rate, for any levels chosen beforehand and however slowly the steps mix (Del Moral 2004,
//! section 9.4.1; Cérou et al. 2012). Swarms are independent, so that their spread gives a valid interval, and any number of them can be
//! added up in shards. Frames of another seed determine the levels, by quantiles (Au & Beck 2001).
//!
//! # Score
//!
//! For detectors of features: the difference of the cell's distances to the means of its own class and of the other class, in the plane of
//! standardised AGR and GRI. For maximum likelihood: the log-likelihood ratio against the truth. The score guides the search; the
//! detector's own decision counts.
//!
//! # Why not importance sampling of the noise
//!
//! Drawing the noise from a distribution shifted towards the LED's other state needs a suitable shift, which depends on bits and phase: in
//! a rare combination of these a cell is so near the border that little noise is enough, and elsewhere it takes much. With one shift for
//! all, errors by another way are seldom drawn and weigh much, so that the spread of a sample says little about the truth. Splitting moves
//! bits, phase and noise together and needs no direction.
//!
//! ```
//! use sim::scene::Scene;
//! use studies::{detectors::DetectorChoice, monte_carlo::Settings, splitting::SplittingEvaluator};
//! let overrides = ["effects.noise=on", "ambient.illuminance_lx=50"].map(String::from);
//! let settings = Settings { random_reflectance: false, ..Settings::fast(256, 1, DetectorChoice::KMeans) };
//! let evaluator = SplittingEvaluator::new(&Scene::load("paper", &overrides)?, settings)?;
//! let errors = evaluator.chunk(0, &mut evaluator.workspace())?.rare;
//! assert_eq!(errors.swarms(), 1);
//! assert!(errors.rate() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod evaluator;
mod levels;
mod particle;
mod sampler;
#[cfg(test)]
mod tests;

pub use evaluator::SplittingEvaluator;
pub use sampler::SplittingWorkspace;
