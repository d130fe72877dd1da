//! Bit error rates too small to count, by splitting.
//!
//! An error of a panel that is read well takes a rare meeting of bits, sub-pixel phase and noise. Splitting climbs to it in steps that are
//! each likely (Kahn & Harris 1951). How near one LED is to being misread is a [score](self#score); *levels* of the
//! score, each about five times rarer than the one before, end at the misread LED itself.
//!
//! A **swarm** is 256 random frames as counting draws them, with one LED each that is looked at. Those that reach the first
//! level go on, copied until there are as many as before. Each then takes some steps above the level: a step draws some
//! of the frame's random numbers anew (the noise of some pixels, a few bits, the phase), and is taken back where that
//! falls below the level. Such steps leave the law of the frames above the level as it is (Metropolis et al. 1953). Then those that reach
//! the next level go on, and so forth. The product of the parts that go on, the last of them the part that is misread, is the swarm's
//! estimate of the bit error rate.
//!
//! Its expectation is the bit error rate, exactly, for any levels that were chosen beforehand and however slowly the
//! steps mix (Del Moral 2004, section 9.4.1; Cérou et al. 2012). Swarms are independent, so that their spread gives an honest interval, and
//! any number of them can be added up in shards. The levels are chosen by frames of another seed, by quantiles (Au & Beck 2001).
//!
//! # Score
//!
//! For detectors of features: how much nearer the cell is to the mean of the other class than to its own, in the plane of standardised AGR
//! and GRI. For maximum likelihood: the log-likelihood ratio that speaks against the truth. The score guides; what counts
//! is the detector's own decision.
//!
//! # Why not importance sampling of the noise
//!
//! Drawing the noise from a law shifted towards the LED's other state needs a shift that suits. Which one does depends on bits and
//! phase: where their meeting is a rare one, a cell stands so near the border that little noise is enough, and elsewhere it takes
//! much. Under one shift for all, errors that come by another way than the one shifted for are seldom drawn and weigh much, so that
//! the spread of a sample says little of the truth. Splitting moves in bits, phase and noise together and needs no direction.
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
