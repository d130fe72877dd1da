//! Splitting compared with counting, in a case for both.

use crate::statistics::SWARM;
use crate::sweep::{Results, Run, Shard, Summary, Sweep};

/// One setting with about one wrong bit in 700.
fn summary(rare_events: bool, frames: usize) -> Summary {
    let plan = format!(
        "frames = {frames}\nrare_events = {rare_events}\n[set]\neffects.noise = \"on\"\npose.distance_m = \
         70\n[grid]\nambient.illuminance_lx = [100]"
    );
    let sweep = Sweep::from_toml("a plan", &plan, &[]).unwrap().sweep;
    let mut results = Results::new(sweep.clone());
    let run = Run::new(&sweep, Shard::WHOLE, None).unwrap();
    assert!(run.advance(&mut results, |_| true).unwrap());
    results.summary(0)
}

#[test]
fn splitting_finds_the_rate_that_counting_finds() {
    let (counted, split) = (summary(false, 10_000), summary(true, 10 * SWARM));
    let deviation = |found: &Summary| (found.ber_95[1] / found.ber_95[0]).ln() / (2.0 * 1.96);
    let (of_count, of_split) = (deviation(&counted), deviation(&split));
    assert!(of_count < 0.1 && of_split < 0.25, "{of_count} {of_split}");
    let apart = (split.ber / counted.ber).ln() / of_count.hypot(of_split);
    assert!(apart.abs() < 4.0, "{apart} deviations: {split:?} {counted:?}");
    // The same number of counted frames would have given less information.
    let by_counting = counted.effective_errors / counted.bits as f64 * split.bits as f64;
    assert!(split.effective_errors > 5.0 * by_counting, "{split:?}");
}
