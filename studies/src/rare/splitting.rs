//! Swarms of frames that climb from level to level.

use glam::DVec2;
use link::panel::{LEDS, PanelFrame};
use rand::Rng;
use rx_pipeline::features::Features;

use super::RareErrors;
use super::levels;
use super::particle::{Particle, Window, part_of};
use crate::evaluate::{CHUNK, EvaluateError, Evaluation, Evaluator, Reading, Settings, Workspace};
use sim::camera::noise::PixelLaw;
use sim::random::{Purpose, stream};
use sim::scene::Scene;

/// Frames of a swarm.
pub const SWARM: usize = CHUNK as usize;
/// Steps that each frame takes above a level before the next.
const STEPS: usize = 4;
/// What the score of the features is worth beside one step of a log-likelihood ratio, which is rounded.
const FINE: f32 = 1e-3;

/// The score of a misread LED.
pub(super) const MISREAD: f32 = f32::INFINITY;

/// Evaluates swarms.
pub struct RareEvaluator {
    evaluator: Evaluator,
    law: PixelLaw,
    centres: [DVec2; LEDS],
    radius_px: f64,
    /// Ascending; the last is that of a misread LED.
    levels: Vec<f32>,
}

/// What a thread needs; made once, reused for each swarm.
pub struct RareWorkspace {
    inner: Workspace,
    changed: Option<Particle>,
}

/// A frame and its score.
pub(super) type Scored = (Particle, f32);

impl RareEvaluator {
    /// Prepares an evaluation of `scene`'s first panel, and chooses the levels.
    ///
    /// # Errors
    /// When the scene cannot be evaluated, or simulates no noise.
    pub fn new(scene: &Scene, settings: Settings) -> Result<Self, EvaluateError> {
        let evaluator = Evaluator::new(scene, settings)?;
        let renderer = evaluator.renderer();
        let noise = renderer.pixel_noise().ok_or(EvaluateError::NoNoise)?;
        let view = renderer.view();
        let centres = view.panels[0].ellipses.map(|ellipse| ellipse.centre);
        let pitch_px = (centres[LEDS - 1] - centres[0]).length() / (7.0 * 2f64.sqrt());
        let mut rare = Self {
            law: PixelLaw::new(noise),
            centres,
            // The cell, the rim of its gradient, and room for the phase.
            radius_px: 0.5 * pitch_px + 2.0,
            levels: Vec::new(),
            evaluator,
        };
        rare.levels = levels::choose(&rare)?;
        Ok(rare)
    }

    /// The levels of the score, ascending; the last is that of a misread LED, infinity.
    pub fn levels(&self) -> &[f32] {
        &self.levels
    }

    /// Room to work on swarms in.
    pub fn workspace(&self) -> RareWorkspace {
        RareWorkspace {
            inner: self.evaluator.workspace(),
            changed: None,
        }
    }

    /// Evaluates swarm `chunk`, as [`Evaluator::chunk`] does frames.
    ///
    /// # Errors
    /// When a frame cannot be measured.
    pub fn chunk(
        &self,
        chunk: u64,
        workspace: &mut RareWorkspace,
    ) -> Result<Evaluation, EvaluateError> {
        let seed = self.evaluator.settings().seed;
        let mut rare = RareErrors::default();
        rare.push(self.swarm(seed, chunk, workspace)?);
        Ok(Evaluation {
            rare,
            ..Evaluation::default()
        })
    }

    /// What a swarm finds the rate to be.
    fn swarm(
        &self,
        seed: u64,
        number: u64,
        workspace: &mut RareWorkspace,
    ) -> Result<f64, EvaluateError> {
        let random = &mut stream(seed, number, Purpose::Splitting);
        let mut swarm = (0..CHUNK)
            .map(|member| self.draw(seed, number * CHUNK + member, random, workspace))
            .collect::<Result<Vec<_>, _>>()?;
        let mut rate = 1.0;
        for (place, &level) in self.levels.iter().enumerate() {
            let above: Vec<Scored> = swarm.into_iter().filter(|(_, s)| *s >= level).collect();
            rate *= above.len() as f64 / SWARM as f64;
            if above.is_empty() || place + 1 == self.levels.len() {
                break;
            }
            swarm = self.spread(&above, level, SWARM, random, workspace)?;
        }
        Ok(rate)
    }

    /// So many frames above a level from some that are there: each as often as any, then moved.
    pub(super) fn spread(
        &self,
        above: &[Scored],
        level: f32,
        count: usize,
        random: &mut impl Rng,
        workspace: &mut RareWorkspace,
    ) -> Result<Vec<Scored>, EvaluateError> {
        // Systematic: beginning anywhere, so that none has more of a chance.
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

    /// A frame as counting draws it, looked at at one LED.
    pub(super) fn draw(
        &self,
        seed: u64,
        frame: u64,
        random: &mut impl Rng,
        workspace: &mut RareWorkspace,
    ) -> Result<Scored, EvaluateError> {
        let inner = &mut workspace.inner;
        self.evaluator.draw_frame(seed, frame, &mut inner.shown);
        let pixels = inner.grey.len();
        let mut particle = Particle {
            frame,
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

    fn expose(&self, particle: &mut Particle, workspace: &mut RareWorkspace) {
        let canvas = &mut workspace.inner.canvas;
        let renderer = self.evaluator.renderer();
        let moment = renderer.moment(particle.frame);
        renderer.draw(&moment, &particle.shown, canvas);
        particle.expose(canvas.values(), &self.law);
    }

    /// One step above `level`.
    fn step(
        &self,
        (particle, score): &mut Scored,
        level: f32,
        random: &mut impl Rng,
        workspace: &mut RareWorkspace,
    ) -> Result<(), EvaluateError> {
        let region = self.evaluator.region();
        let centre = self.centres[particle.led] + DVec2::from_array(particle.shown[0].shift_px);
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

    /// How near the LED is to being misread: [`MISREAD`] if it is, else the higher the nearer.
    fn score(
        &self,
        particle: &Particle,
        workspace: &mut RareWorkspace,
    ) -> Result<f32, EvaluateError> {
        let inner = &mut workspace.inner;
        inner.shown.clone_from(&particle.shown);
        inner.grey.copy_from_slice(&particle.grey);
        let reading = self.evaluator.measure(particle.frame, inner)?;
        let (read, soft) = self
            .evaluator
            .detect_softly(particle.frame, &reading, inner)?;
        let Reading { bits, features, .. } = &reading;
        if read.led(particle.led) != bits.led(particle.led) {
            return Ok(MISREAD);
        }
        let by_features = nearness(features, read, particle.led);
        Ok(match soft {
            Some(soft) => FINE * by_features - f32::from(soft.0[particle.led]).abs(),
            None => by_features,
        })
    }

    pub(super) fn evaluator(&self) -> &Evaluator {
        &self.evaluator
    }
}

/// How much nearer a cell is to the mean of the other class than to that of its own, in standardised features, as a part of
/// the means' distance; at most −0 where they are told by that.
fn nearness(features: &Features, read: PanelFrame, led: usize) -> f32 {
    let axes = [&features.agr, &features.gri].map(|values| {
        let mean_where = |is_on: bool| {
            let of_class = (0..LEDS).filter(|&cell| read.led(cell) == is_on);
            let (sum, count) = of_class.fold((0.0, 0.0f32), |(sum, count), cell| {
                (sum + values[cell], count + 1.0)
            });
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
