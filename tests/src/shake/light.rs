//! Light that changes across a panel and from frame to frame.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::FPS;

/// How the light changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Not at all.
    Steady,
    /// A low sun veils one side of the panel, more or less every 0.03 to 0.2 s: up to twice the ambient light.
    Veil,
    /// Shadows with sharp edges cross the panel. They pass 10 to 60 % of the ambient light.
    Shadows,
    /// The exposure jumps every 0.03 to 0.2 s, by up to two stops from the usual one.
    Jumps,
}

/// The light over a film.
pub(super) struct Sky {
    veil: Option<Veil>,
    shadows: Option<Shadows>,
    /// The gain of each frame's exposure.
    gains: Vec<f64>,
}

/// Light that a lens scatters, brightest at a point.
struct Veil {
    at: [f64; 2],
    reach_px: f64,
    /// Its light in each frame, relative to white.
    light: Vec<f64>,
}

/// Stripes of shadow that move.
struct Shadows {
    along: [f64; 2],
    speed_px_s: f64,
    /// Begin, end and transmittance of each stripe.
    stripes: Vec<[f64; 3]>,
    period_px: f64,
}

impl Sky {
    /// Draws the light of a film whose panel is `panel_px` wide, under ambient light `level`.
    pub fn draw(random: &mut ChaCha8Rng, light: Light, frames: usize, panel_px: f64, level: f64) -> Self {
        let veil = (light == Light::Veil).then(|| {
            let towards: f64 = random.random_range(0.0..TAU);
            let away = panel_px * random.random_range(0.3..1.2);
            let reach_px = panel_px * random.random_range(0.4..1.2);
            let most = level * random.random_range(0.3..2.0);
            Veil {
                at: [away * towards.cos(), away * towards.sin()],
                reach_px,
                light: held(random, frames, |random| most * random.random_range(0.0..1.0)),
            }
        });
        let shadows = (light == Light::Shadows).then(|| {
            let towards: f64 = random.random_range(0.0..TAU);
            let speed_px_s = panel_px * random.random_range(0.5..10.0);
            let stripes = (0..6).map(|i| {
                let begin = panel_px * (f64::from(i) + random.random_range(0.0..0.4));
                [
                    begin,
                    begin + panel_px * random.random_range(0.05..0.6),
                    random.random_range(0.1..0.6),
                ]
            });
            Shadows {
                along: [towards.cos(), towards.sin()],
                speed_px_s,
                stripes: stripes.collect(),
                period_px: 6.0 * panel_px,
            }
        });
        let gains = if light == Light::Jumps {
            held(random, frames, |random| random.random_range(-2.0f64..2.0).exp2())
        } else {
            vec![1.0; frames]
        };
        Self { veil, shadows, gains }
    }

    /// The transmittance of shadows at a point, in px from the panel's centre, at a time.
    pub fn shade(&self, [x, y]: [f64; 2], at_s: f64) -> f64 {
        let Some(shadows) = &self.shadows else { return 1.0 };
        let along = shadows.along[0] * x + shadows.along[1] * y + shadows.speed_px_s * at_s;
        let along = along.rem_euclid(shadows.period_px);
        let stripe = shadows.stripes.iter().find(|[begin, end, _]| (*begin..*end).contains(&along));
        stripe.map_or(1.0, |stripe| stripe[2])
    }

    /// The veil's light at a point, in px from the panel's centre, in a frame.
    pub fn veil(&self, [x, y]: [f64; 2], frame: usize) -> f64 {
        let veil = self.veil.as_ref();
        veil.map_or(0.0, |veil| {
            let away = (x - veil.at[0]).hypot(y - veil.at[1]);
            veil.light[frame] * (-away / veil.reach_px).exp()
        })
    }

    /// The gain of a frame's exposure.
    pub fn gain(&self, frame: usize) -> f64 {
        self.gains[frame]
    }
}

/// A value that stays for 0.03 to 0.2 s.
fn held(random: &mut ChaCha8Rng, frames: usize, mut draw: impl FnMut(&mut ChaCha8Rng) -> f64) -> Vec<f64> {
    let mut values = Vec::with_capacity(frames);
    while values.len() < frames {
        let value = draw(random);
        let until = values.len() + (FPS * random.random_range(0.03..0.2)) as usize;
        values.resize(until.min(frames), value);
    }
    values
}
