//! The effects that a scene needs, and why.

use serde::Serialize;

use crate::camera::curve::Curve;
use crate::effects::{self, About, Effect};
use crate::formation::Formation;
use crate::scene::Mode;
use crate::view::{LinearRange, View};

/// The decision on one effect.
#[derive(Clone, Debug, Serialize)]
pub struct Decision {
    /// The effect's name.
    pub effect: &'static str,
    /// A bound of the change from leaving it out, in unrounded grey levels.
    pub bound_grey: f64,
    /// The scene's tolerance.
    pub tolerance_grey: f64,
    /// The scene's setting.
    pub mode: Mode,
    /// Whether it is simulated.
    pub included: bool,
    /// The reason.
    pub why: String,
    /// The model and its source.
    pub model: &'static str,
    /// Its scene keys.
    pub keys: &'static [&'static str],
    /// Its cost, in words.
    pub cost: &'static str,
}

/// The decisions on all effects, in the order in which light meets them.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub struct Plan {
    /// The decisions.
    pub decisions: Vec<Decision>,
    /// The range of pixels' linear values, for any decisions; its blur and its curve are those of the plan.
    #[serde(skip)]
    pub range: LinearRange,
}

impl Plan {
    /// The plan for a scene.
    ///
    /// ```
    /// use sim::{plan::Plan, scene::Scene, view::View};
    /// let far = View::new(&Scene::load("paper", &["pose.distance_m=70".into()])?)?;
    /// assert!(Plan::of(&far).includes("atmosphere"));
    /// let near = View::new(&Scene::load("paper", &["pose.distance_m=30".into()])?)?;
    /// assert!(!Plan::of(&near).includes("atmosphere"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(view: &View) -> Self {
        let mut range = effects::linear_range(view);
        if !decide(effects::ENCODING, view, &range).included {
            range.curve = Curve::gamma(view.scene.camera.gamma);
        }
        if !decide(effects::LENS_BLUR, view, &range).included {
            range.sigma_px = 0.0;
        }
        let decide = |effect| decide(effect, view, &range);
        Self {
            decisions: effects::ALL.into_iter().map(decide).collect(),
            range,
        }
    }

    /// The same plan with one effect added or left out.
    pub fn toggled(&self, effect: &str) -> Self {
        let mut toggled = self.clone();
        for decision in &mut toggled.decisions {
            if decision.effect == effect {
                decision.included = !decision.included;
                decision.why = format!("not as planned: {}", decision.why);
            }
        }
        toggled
    }

    /// Whether the effect of that name is simulated.
    pub fn includes(&self, effect: &str) -> bool {
        self.included().any(|included| included == effect)
    }

    /// The names of the effects that are simulated.
    pub fn included(&self) -> impl Iterator<Item = &'static str> {
        let included = self.decisions.iter().filter(|decision| decision.included);
        included.map(|decision| decision.effect)
    }

    /// The sum of the bounds of the effects left out: no unrounded grey level is farther than this from the image with all effects.
    pub fn left_out_grey(&self) -> f64 {
        self.decisions
            .iter()
            .filter(|decision| !decision.included)
            .map(|decision| decision.bound_grey)
            .sum()
    }

    /// The image formation that the included effects make.
    pub(crate) fn formation(&self, view: &View) -> Formation {
        let gamma = Curve::gamma(view.scene.camera.gamma);
        let mut formation = Formation::plain(view.panels.len(), gamma);
        for effect in effects::ALL.iter().filter(|effect| self.includes(effect.about().name)) {
            effect.include(view, &mut formation);
        }
        formation
    }
}

fn decide(effect: &dyn Effect, view: &View, range: &LinearRange) -> Decision {
    let tolerance_grey = view.scene.effects.tolerance_grey;
    let bound_grey = effect.bound_grey(view, range);
    let About { name, model, keys, cost } = effect.about();
    let mode = view.scene.effects.mode(name);
    let (included, why) = match mode {
        Mode::On => (true, "the scene sets it on".to_string()),
        Mode::Off => (false, "the scene sets it off".to_string()),
        Mode::Auto if bound_grey > tolerance_grey => (true, format!("could change a pixel by {bound_grey:.3} > {tolerance_grey}")),
        Mode::Auto if bound_grey == 0.0 => (false, "nothing in the scene requires it".to_string()),
        Mode::Auto => (false, format!("changes no pixel by more than {bound_grey:.3} <= {tolerance_grey}")),
    };
    Decision {
        effect: name,
        bound_grey,
        tolerance_grey,
        mode,
        included,
        why,
        model,
        keys,
        cost,
    }
}
