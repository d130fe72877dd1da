//! `vocc plan`: the effects that a scene requires and their cost; or the advice on a transmitter for a camera.

mod signalling;

use std::ffi::OsString;

use serde::Serialize;
use sim::accuracy::Level;
use sim::cost::{self, Cost};
use sim::plan::Decision;
use sim::renderer::Renderer;
use sim::timing::system_clock;

use crate::options::SharedOptions;
use crate::output::{self, Verdict};

/// Arguments of `vocc plan`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file; paper without it.
    scene: Option<OsString>,
    #[command(flatten)]
    signalling: signalling::Options,
}

/// A decision with the measured cost of including the effect.
#[derive(Serialize)]
struct Row<'a> {
    #[serde(flatten)]
    decision: &'a Decision,
    /// Nanoseconds per frame.
    cost_ns: f64,
    /// The cost relative to a planned frame.
    cost_frames: f64,
}

/// Prints the plan.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let scene = arguments.scene.as_deref();
    if let Some(camera) = arguments.signalling.camera() {
        return arguments.signalling.run(scene, camera, shared);
    }
    let renderer = Renderer::new(&shared.scene(scene.unwrap_or("paper".as_ref()))?, Level::Fast)?;
    let costs = cost::measure(&renderer, cost::BUDGET, system_clock);
    let rows = renderer.plan().decisions.iter().zip(&costs);
    if shared.json {
        for (decision, cost) in rows {
            output::json(&Row {
                decision,
                cost_ns: cost.ns,
                cost_frames: cost.frames,
            })?;
        }
        return Ok(Verdict::Yes);
    }
    output::line("effect           bound (grey)  simulated  cost (frames)     (µs)  why")?;
    for (decision, cost) in rows {
        output::line(&row(decision, cost))?;
    }
    output::line(&format!(
        "left out in all: at most {:.4} grey levels before rounding",
        renderer.plan().left_out_grey()
    ))?;
    output::line("cost: of including the effect, measured now (below 0: without it a frame takes longer);")?;
    output::line("a frame is the panels' part of the picture, drawn and read out as planned")?;
    Ok(Verdict::Yes)
}

/// Rounds to a fraction of one, and turns −0 into 0.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts + 0.0
}

fn row(decision: &Decision, cost: &Cost) -> String {
    format!(
        "{:<16} {:>12.4}  {:<9}  {:>13.2} {:>8.1}  {}",
        decision.effect,
        decision.bound_grey,
        if decision.included { "yes" } else { "no" },
        rounded(cost.frames, 100.0),
        rounded(cost.ns * 1e-3, 10.0),
        decision.why
    )
}
