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
pub enum Verdict {
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

/// Prints which effects a plan includes, and what the others could change; [`crate::commands::plan`] has more.
pub fn plan(plan: &Plan) -> anyhow::Result<()> {
    let included = plan.decisions.iter().filter(|decision| decision.included);
    let included: Vec<&str> = included.map(|decision| decision.effect).collect();
    line(&format!("effects: {}", included.join(", ")))?;
    line(&format!(
        "{} others left out: at most {:.4} grey levels before rounding (`vocc plan` says why)",
        plan.decisions.len() - included.len(),
        plan.left_out_grey()
    ))
}

/// A bit error rate with its 95 % interval, for so many errors of so many bits; where there were none, what that says.
pub fn rate(errors: u64, bits: u64, rate: f64, [low, high]: [f64; 2]) -> String {
    if errors > 0 || bits == 0 {
        return format!("{rate:.3e} (95 %: {low:.3e} to {high:.3e})");
    }
    // The rate at which as many bits come without an error in one of twenty runs.
    let alone = 1.0 - 0.05f64.powf(1.0 / bits as f64);
    format!("0 of {bits} bits: below {high:.1e} with 95 % if errors come by frames, {alone:.1e} if each bit stands alone")
}

#[derive(Serialize)]
struct EvaluationReport {
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
    let report = EvaluationReport {
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
        Some(seconds) => line(&format!("frames     {} in all, {seconds:.2} s of work", found.frames))?,
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
        line(&format!("bit errors {} of {}", found.bit_errors, found.bits))?;
        panel_errors(found)?;
    }
    let ber = if sweep.rare_events {
        rare_rate(found)
    } else {
        rate(found.bit_errors, found.bits, found.ber, found.ber_95)
    };
    line(&format!("BER        {ber}"))?;
    one_symbol(found)
}

/// The rate without frames across a change of symbols, where there are any: detectors compare by that.
fn one_symbol(found: &Summary) -> anyhow::Result<()> {
    let (Some(ber), Some(ber_95)) = (found.ber_one_symbol, found.ber_one_symbol_95) else {
        return Ok(());
    };
    let (Some(frames @ 1..), Some(wrong)) = (found.frames_across, found.bit_errors_across) else {
        return Ok(());
    };
    let (bits, bits_across) = (found.bits - 64 * frames, 64 * frames);
    line(&format!(
        "across     {frames} frames are exposed across a change of symbols: {wrong} of their {bits_across} bits are wrong"
    ))?;
    let elsewhere = rate(found.bit_errors - wrong, bits, ber, ber_95);
    line(&format!("elsewhere  BER {elsewhere}"))
}

/// A rate that swarms have reached, with its 95 % interval; where none has, that nothing is known.
fn rare_rate(found: &Summary) -> String {
    if found.bit_errors > 0 {
        let [low, high] = found.ber_95;
        return format!("{:.3e} (95 %: {low:.3e} to {high:.3e})", found.ber);
    }
    format!(
        "not known: of {} frames no swarm reached an error; give more --frames",
        found.frames
    )
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
            "bound      of panels with errors: no receiver is expected to have fewer, nor a BER below a 64th of their share. Of bit errors \
             it is none",
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_error_is_told_by_what_it_says() {
        let none = rate(0, 6_400_000, 0.0, [0.0, 3.0e-5]);
        assert!(none.starts_with("0 of 6400000 bits: below 3.0e-5"), "{none}");
        // The rule of three.
        assert!(none.contains("4.7e-7 if each bit stands alone"), "{none}");
        assert_eq!(rate(2, 200, 0.01, [0.002, 0.03]), "1.000e-2 (95 %: 2.000e-3 to 3.000e-2)");
        assert!(rate(0, 0, 0.0, [0.0, 1.0]).contains("1.000e0"));
    }
}
