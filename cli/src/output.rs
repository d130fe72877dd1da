//! What goes to standard output, and what is told beside it on standard error.

use std::io::Write;

use serde::Serialize;
use sim::accuracy::Level;
use sim::plan::Plan;
use studies::detectors::DetectorChoice;
use studies::monte_carlo;
use studies::sweep::{Results, Summary};

use crate::numbers::two_decimals;

/// How a command that did its work ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Exit status 0.
    Yes,
    /// Exit status 1.
    No,
}

/// An error and its causes, each said once.
pub fn explain(error: &anyhow::Error) -> String {
    error
        .chain()
        .map(ToString::to_string)
        .fold(String::new(), |text, cause| match text.contains(&cause) {
            _ if text.is_empty() => cause,
            true => text,
            false => format!("{text}: {cause}"),
        })
}

/// Whether nobody reads any more what is printed.
pub fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>())
        .any(|cause| cause.kind() == std::io::ErrorKind::BrokenPipe)
}

/// Whether what was printed found a reader; one who has left is no fault.
pub fn is_read(printed: anyhow::Result<()>) -> anyhow::Result<bool> {
    match printed {
        Err(error) if is_broken_pipe(&error) => Ok(false),
        printed => printed.map(|()| true),
    }
}

/// Tells something on standard error. If nobody listens, that is no reason to end.
pub fn tell(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints one line.
pub fn line(text: &str) -> anyhow::Result<()> {
    Ok(writeln!(std::io::stdout(), "{text}")?)
}

/// Prints one line of JSON.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    line(&serde_json::to_string(value)?)
}

/// Prints a plan as a table.
pub fn plan(plan: &Plan) -> anyhow::Result<()> {
    line("effect           bound (grey)  simulated  why")?;
    for decision in &plan.decisions {
        let simulated = if decision.included { "yes" } else { "no" };
        line(&format!(
            "{:<16} {:>12.4}  {simulated:<9}  {}",
            decision.effect, decision.bound_grey, decision.why
        ))?;
    }
    line(&format!(
        "left out in all: at most {:.4} grey levels before rounding",
        plan.left_out_grey()
    ))
}

#[derive(Serialize)]
struct Evaluated {
    #[serde(flatten)]
    summary: Summary,
    seconds: Option<f64>,
    seed: u64,
    level: Level,
    plan: Plan,
}

/// Prints the outcome of the evaluation of one scene; `seconds` where it is known how long it took.
pub fn evaluation(results: &Results, seconds: Option<f64>, as_json: bool) -> anyhow::Result<()> {
    let sweep = results.sweep();
    let view = monte_carlo::view(&sweep.scene, sweep.random_reflectance)?;
    let report = Evaluated {
        summary: results.summary(0),
        seconds,
        seed: sweep.seed,
        level: sweep.level,
        plan: Plan::of(&view),
    };
    if as_json {
        return json(&report);
    }
    plan(&report.plan)?;
    let found = &report.summary;
    match seconds {
        Some(seconds) => line(&format!(
            "frames     {} in all, {seconds:.2} s of work",
            found.frames
        ))?,
        None => line(&format!("frames     {}", found.frames))?,
    }
    if sweep.rare_events {
        line(&format!(
            "swarms     {} reached errors, worth {:.0} counted ones",
            found.bit_errors, found.effective_errors
        ))?;
    } else {
        line(&format!("Bvar       {}", two_decimals(found.bvar)))?;
        line(&format!("Wvar       {}", two_decimals(found.wvar)))?;
        line(&format!("B2W        {}", two_decimals(found.b2w)))?;
        line(&format!(
            "bit errors {} of {}",
            found.bit_errors, found.bits
        ))?;
        panel_errors(found)?;
    }
    line(&format!(
        "BER        {:.3e} (95 %: {:.3e} to {:.3e})",
        found.ber, found.ber_95[0], found.ber_95[1]
    ))
}

/// Panels with errors, and what a genie's are a bound of.
fn panel_errors(found: &Summary) -> anyhow::Result<()> {
    let (Some(wrong), Some([low, high])) = (found.panel_errors, found.panel_error_rate_95) else {
        return Ok(());
    };
    line(&format!(
        "panels     {wrong} of {} with errors (95 %: {low:.3e} to {high:.3e})",
        found.frames
    ))?;
    if found.detector == DetectorChoice::Genie.name() {
        line(
            "bound      of panels with errors: no receiver is expected to have fewer, nor a BER below a 64th of their share. Of bit errors it is none",
        )?;
    }
    Ok(())
}
