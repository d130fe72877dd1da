//! The measured cost of each effect: the time of a frame with it relative to that of one without it.
//!
//! A frame is the part of the sensor lit by panels, drawn and read out, as in a Monte Carlo study. All other effects follow the plan, so
//! that each cost is that of one effect in this scene, included or not. Costs do not add up, because an effect may make another more or
//! less expensive: with a blur, for example, LEDs are drawn by a few chords rather than pixel by pixel.

use std::time::Duration;

use link::panel::PanelFrame;
use rand::Rng;

use crate::random::{Purpose, stream};
use crate::renderer::canvas::Canvas;
use crate::renderer::{PanelExposure, Renderer};
use crate::timing::{Clock, Work, by_turns};

/// The cost of one effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// The effect's name.
    pub effect: &'static str,
    /// Nanoseconds a frame; negative if a frame without it takes longer.
    pub ns: f64,
    /// The effect's time in frames of the plan.
    pub frames: f64,
}

/// The total measuring time for each effect: with less, costs vary more.
pub const BUDGET: Duration = Duration::from_millis(30);

/// Frames in a cycle, each with its own bits and sub-pixel position.
const FRAMES: u64 = 16;

/// The costs of all effects in the renderer's scene, each measured for about `budget`, in the order of the plan.
///
/// ```
/// use std::time::Duration;
/// use sim::{accuracy::Level, cost, effects, renderer::Renderer, scene::Scene, timing};
///
/// let renderer = Renderer::new(&Scene::load("paper", &[])?, Level::Fast)?;
/// let costs = cost::measure(&renderer, Duration::from_millis(1), timing::system_clock);
/// assert!(costs.iter().map(|cost| cost.effect).eq(effects::names()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn measure(renderer: &Renderer, budget: Duration, clock: Clock) -> Vec<Cost> {
    let decisions = renderer.plan().decisions.iter();
    let cost = |effect, included| {
        let other = renderer.toggled(effect);
        let [planned, toggled] = [renderer, &other].map(warm);
        let ns = by_turns(&mut [planned, toggled], usize::MAX, budget, clock);
        let ratio = median(ns[1].iter().zip(&ns[0]).map(|(other, own)| other / own));
        let frames = if included { 1.0 - ratio } else { ratio - 1.0 };
        Cost {
            effect,
            ns: frames * median(ns[0].iter().copied()),
            frames,
        }
    };
    decisions.map(|decision| cost(decision.effect, decision.included)).collect()
}

/// Frames of a renderer, one after another. The first is already drawn, so that one-time work is done.
fn warm(renderer: &Renderer) -> Work<'_> {
    let mut canvas = Canvas::new(renderer.lit_region());
    let mut grey = vec![0; canvas.values().len()];
    let frames: Vec<_> = (0..FRAMES).map(|frame| (frame, shown(renderer, frame))).collect();
    let mut turn = 0;
    let mut work = move || {
        let (frame, shown) = &frames[turn % frames.len()];
        turn += 1;
        renderer.draw(&renderer.moment(1, *frame), shown, &mut canvas);
        renderer.read_out(1, *frame, &canvas, &mut grey);
    };
    work();
    Box::new(work)
}

fn shown(renderer: &Renderer, frame: u64) -> Vec<PanelExposure> {
    let mut random = stream(1, frame, Purpose::Bits);
    let shift_px = [frame as f64 / FRAMES as f64; 2];
    let panels = 0..renderer.view().panels.len();
    panels
        .map(|index| PanelExposure {
            symbols: std::array::from_fn(|_| PanelFrame::from_bits(random.next_u64())),
            shift_px,
            ..renderer.steady(index, PanelFrame::default())
        })
        .collect()
}

/// The median; 0 if there are no values.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::Level;
    use crate::effects;
    use crate::scene::Scene;
    use crate::timing::system_clock;

    fn renderer(preset: &str) -> Renderer {
        let small = ["camera.width_px=320".into(), "camera.height_px=240".into()];
        Renderer::new(&Scene::load(preset, &small).unwrap(), Level::Fast).unwrap()
    }

    #[test]
    fn every_effect_has_a_cost() {
        for preset in ["paper", "night", "fog"] {
            let costs = measure(&renderer(preset), Duration::ZERO, system_clock);
            let names: Vec<_> = costs.iter().map(|cost| cost.effect).collect();
            assert_eq!(names, effects::names());
            for cost in costs {
                assert!(cost.ns.is_finite() && cost.frames.is_finite(), "{preset}: {cost:?}");
            }
        }
    }

    #[test]
    fn one_effect_is_toggled_and_no_other() {
        let renderer = renderer("night");
        let planned: Vec<_> = renderer.plan().included().collect();
        for name in effects::names() {
            let toggled = renderer.toggled(name);
            for decision in &toggled.plan().decisions {
                let was = planned.contains(&decision.effect);
                assert_eq!(decision.included != was, decision.effect == name, "{name}");
            }
            // Toggling twice restores the plan.
            let again = toggled.toggled(name);
            assert!(again.plan().included().eq(planned.iter().copied()), "{name}");
        }
    }

    #[test]
    fn an_image_without_its_blur_is_another() {
        let renderer = renderer("paper");
        let greys = [&renderer, &renderer.toggled("blur")].map(|renderer| {
            let mut canvas = Canvas::new(renderer.lit_region());
            renderer.draw(&renderer.moment(1, 0), &shown(renderer, 0), &mut canvas);
            canvas.values().iter().fold(0.0f32, |most, &value| most.max(value))
        });
        // An LED has its full brightness without blur, and less than half of that with blur.
        assert!(greys[1] > 2.0 * greys[0], "{greys:?}");
    }
}
