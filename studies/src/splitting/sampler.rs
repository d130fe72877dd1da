//! Frames with a score, which measures how near an LED is to being misread, and moves above a level of that score.

use glam::DVec2;
use link::panel::{LEDS, PanelFrame};
use rand::Rng;
use rx_pipeline::features::Features;
use sim::camera::noise::PixelLaw;
use sim::scene::Scene;

use super::particle::{Particle, Window, part_of};
use crate::monte_carlo::{EvaluateError, Evaluator, Observation, Settings, Workspace};

/// Steps of each frame above a level before the next one.
const STEPS: usize = 4;
/// The weight of the features' score relative to one step of a log-likelihood ratio, which is rounded.
const FINE: f32 = 1e-3;

/// The score of a misread LED.
pub(super) const MISREAD: f32 = f32::INFINITY;

/// Draws, scores and moves frames.
pub(super) struct Sampler {
    evaluator: Evaluator,
    law: PixelLaw,
    centres: [DVec2; LEDS],
    radius_px: f64,
}

/// The memory of a thread; made once, reused for each swarm.
pub struct SplittingWorkspace {
    inner: Workspace,
    changed: Option<Particle>,
}

/// A frame and its score.
pub(super) type ScoredParticle = (Particle, f32);

impl Sampler {
    /// A sampler of `scene`'s first panel.
    ///
    /// # Errors
    /// If the scene cannot be evaluated, or has no noise.
    pub(super) fn new(scene: &Scene, settings: Settings) -> Result<Self, EvaluateError> {
        let evaluator = Evaluator::new(scene, settings)?;
        let renderer = evaluator.renderer();
        let noise = renderer.pixel_noise().ok_or(EvaluateError::NoNoise)?;
        let view = renderer.view();
        let centres = view.panels[0].ellipses.map(|ellipse| ellipse.centre);
        let pitch_px = (centres[LEDS - 1] - centres[0]).length() / (7.0 * 2f64.sqrt());
        Ok(Self {
            law: PixelLaw::new(noise),
            centres,
            // The cell, the rim of its gradient, and room for the phase.
            radius_px: 0.5 * pitch_px + 2.0,
            evaluator,
        })
    }

    /// The seed of the evaluation.
    pub(super) fn seed(&self) -> u64 {
        self.evaluator.settings().seed
    }

    /// Memory for a thread.
    pub(super) fn workspace(&self) -> SplittingWorkspace {
        SplittingWorkspace {
            inner: self.evaluator.workspace(),
            changed: None,
        }
    }

    /// A number of frames above a level: resampled from the present ones with equal frequency, then moved.
    pub(super) fn spread(
        &self,
        above: &[ScoredParticle],
        level: f32,
        count: usize,
        random: &mut impl Rng,
        workspace: &mut SplittingWorkspace,
    ) -> Result<Vec<ScoredParticle>, EvaluateError> {
        // Systematic, with a random start, so that all have equal chances.
        let first = random.next_u32() as usize % above.len();
        let mut spread = Vec::with_capacity(count);
        for member in 0..count {
            let mut scored = above[(first + member) % above.len()].clone();
            for _ in 0..STEPS {
                self.step(&mut scored, level, random, workspace)?;
            }
            spread.push(scored);
        }
        Ok(spread)
    }

    /// A frame drawn as for counting, with one selected LED.
    pub(super) fn draw(
        &self,
        seed: u64,
        frame: u64,
        random: &mut impl Rng,
        workspace: &mut SplittingWorkspace,
    ) -> Result<ScoredParticle, EvaluateError> {
        let inner = &mut workspace.inner;
        self.evaluator.draw_frame(seed, frame, None, &mut inner.shown);
        let pixels = inner.grey.len();
        let mut particle = Particle {
            moment: self.evaluator.renderer().moment(seed, frame),
            led: (frame % LEDS as u64) as usize,
            shown: inner.shown.clone(),
            noise: (0..pixels).map(|_| part_of(random)).collect(),
            light: vec![f32::NAN; pixels],
            grey: vec![0; pixels],
        };
        self.expose(&mut particle, workspace);
        let score = self.score(&particle, workspace)?;
        Ok((particle, score))
    }

    fn expose(&self, particle: &mut Particle, workspace: &mut SplittingWorkspace) {
        let canvas = &mut workspace.inner.canvas;
        self.evaluator.renderer().draw(&particle.moment, &particle.shown, canvas);
        particle.expose(canvas.values(), &self.law);
    }

    /// One step above `level`.
    fn step(
        &self,
        (particle, score): &mut ScoredParticle,
        level: f32,
        random: &mut impl Rng,
        workspace: &mut SplittingWorkspace,
    ) -> Result<(), EvaluateError> {
        let region = self.evaluator.region();
        let shaken_px = self.evaluator.renderer().shaken_px(&particle.moment);
        let shift_px = [shaken_px, particle.shown[0].shift_px].map(DVec2::from_array);
        let centre = self.centres[particle.led] + shift_px[0] + shift_px[1];
        let window = Window {
            centre: [centre.x - region.x as f64, centre.y - region.y as f64],
            radius: self.radius_px,
            region,
        };
        let mut changed = match workspace.changed.take() {
            Some(mut room) => {
                room.clone_from(particle);
                room
            }
            None => particle.clone(),
        };
        if changed.change(window, &self.law, random) {
            self.expose(&mut changed, workspace);
        }
        let its_score = self.score(&changed, workspace)?;
        if its_score >= level {
            std::mem::swap(particle, &mut changed);
            *score = its_score;
        }
        workspace.changed = Some(changed);
        Ok(())
    }

    /// The score of the LED: [`MISREAD`] if it is misread; otherwise higher the nearer it is to that.
    fn score(&self, particle: &Particle, workspace: &mut SplittingWorkspace) -> Result<f32, EvaluateError> {
        let inner = &mut workspace.inner;
        inner.shown.clone_from(&particle.shown);
        inner.moment = particle.moment;
        inner.grey.copy_from_slice(&particle.grey);
        let width = self.evaluator.region().width;
        self.evaluator.renderer().process(width, &mut inner.grey);
        let observed = self.evaluator.measure(inner)?;
        let (read, soft) = self.evaluator.detect_softly(&observed, inner)?;
        let Observation { bits, features, .. } = &observed;
        if read.led(particle.led) != bits.led(particle.led) {
            return Ok(MISREAD);
        }
        let by_features = nearness(features, read, particle.led);
        Ok(match soft {
            Some(soft) => FINE * by_features - f32::from(soft.0[particle.led]).abs(),
            None => by_features,
        })
    }
}

/// The position of a cell along the line from the mean of its own class to that of the other, from halfway, in standardised features,
/// relative to the means' distance; at most −0 if the nearer mean decides its class.
fn nearness(features: &Features, read: PanelFrame, led: usize) -> f32 {
    let axes = [&features.agr, &features.gri].map(|values| {
        let mean_where = |is_on: bool| {
            let of_class = (0..LEDS).filter(|&cell| read.led(cell) == is_on);
            let (sum, count) = of_class.fold((0.0, 0.0f32), |(sum, count), cell| (sum + values[cell], count + 1.0));
            sum / count.max(1.0)
        };
        let mean = values.iter().sum::<f32>() / LEDS as f32;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / LEDS as f32;
        let own = mean_where(read.led(led));
        let other = mean_where(!read.led(led));
        let scale = variance.max(1e-12);
        let apart = other - own;
        // Along the line between the means, from half-way.
        let along = (values[led] - 0.5 * (own + other)) * apart;
        (along / scale, apart * apart / scale)
    });
    let (along, apart) = (axes[0].0 + axes[1].0, axes[0].1 + axes[1].1);
    if apart > 0.0 { along / apart } else { -1.0 }
}
