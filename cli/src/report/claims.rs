//! The report: each claim with its number, for the scene and for other readings of the paper.

use studies::reproduction::{Claim, ERRORS_ENOUGH, INTERPRETATIONS, PAPERS_DETECTOR, Study};

use super::document::Document;
use super::figure::Figure;
use crate::numbers::{number, with_interval};

/// The claims under one reading, with its name.
pub struct ReadingClaims {
    pub name: &'static str,
    /// The claims with complete data.
    pub claims: Vec<Claim>,
}

/// The report of a run.
pub fn report(study: &Study, command: &str, claims: &[Claim], readings: &[ReadingClaims], figures: &[Figure]) -> Document {
    let mut document = Document::new("The figures of Do & Yoo 2020, computed again");
    document.text(&format!(
        "Do & Yoo, \"The Necessity of LED to Ambient Light Ratio Optimization for Vehicular Optical Camera Communication\", Sensors \
         2020, 20, 292, section 4.4. Made by `{command}`."
    ));
    document.text(&frames(study));
    document.heading("Claims");
    document.text(
        "A claim of a trend is decided by its weakest step. It holds or fails if the whole 95 % interval of its number says so, and is \
         open otherwise.",
    );
    claims_table(&mut document, claims, readings);
    if !readings.is_empty() {
        other_readings(&mut document, claims, readings);
    }
    document.heading("Figures");
    for figure in figures {
        document.picture(figure.name, &figure.caption, &figure.drawing.svg);
    }
    document
}

/// Adds the claims under other readings of the paper.
fn other_readings(document: &mut Document, claims: &[Claim], readings: &[ReadingClaims]) {
    document.heading("The same under other readings");
    document.text(
        "Where the paper contradicts itself or is silent, each reading is a few scene keys. \"yes\": the claim holds; \"no\": it fails; \
         \"open\": the interval does not decide; with the number that decides. A tenth of the frames, fewer points.",
    );
    readings_table(document, claims, readings);
    document.list(INTERPRETATIONS.iter().map(|reading| {
        let settings = reading.overrides.join("`, `");
        format!("**{}**: {} (`{settings}`)", reading.name, reading.summary)
    }));
}

/// The distribution of the frames.
fn frames(study: &Study) -> String {
    let axes = &study.axes;
    let share = |points: usize| study.share(points);
    format!(
        "Seed {}. {} frames a figure, spread over its points: {} at each L2A of figure 14, {} at each interval of figure 17, {} at \
         each distance of figure 20, where figures share a point the larger number; for figure 21 at most {} at each L2A of the finer \
         search in each of {} cells, fewer where the best L2A is known to ±{} before; for figure 22 at most {} at each distance with \
         k-means and {} with each other detector, fewer where {} bits were wrong before. Each frame has random bits, a random \
         sub-pixel phase and a random reflectance of 0.3 to 0.5, in figure 22 a random interval and L2A, too. The paper draws the ambient light too; exposure and dimming follow \
         it, so that its frames do not depend on it.",
        study.seed,
        study.frames,
        share(axes.l2a.len()),
        share(axes.interval.len()),
        share(axes.distance_m.len()),
        study.search_frames(),
        axes.optimum_interval.len() * axes.optimum_distance_m.len(),
        study.tolerance,
        study.error_frames(PAPERS_DETECTOR),
        study.error_frames(""),
        ERRORS_ENOUGH,
    )
}

/// A verdict in words.
pub fn verdict(holds: Option<bool>) -> &'static str {
    match holds {
        Some(true) => "yes",
        Some(false) => "no",
        None => "open",
    }
}

fn claims_table(document: &mut Document, claims: &[Claim], readings: &[ReadingClaims]) {
    let head = ["figure", "claim", "quantity", "measured (95 %)", "holds", "otherwise under"];
    let row = |claim: &Claim| {
        vec![
            claim.figure.to_string(),
            claim.claim.clone(),
            claim.quantity.clone(),
            with_interval(claim.measured, claim.measured_95, number),
            format!("**{}**", verdict(claim.holds)),
            otherwise_under(claim, readings),
        ]
    };
    document.table(&head, claims.iter().map(row));
}

fn otherwise_under(claim: &Claim, readings: &[ReadingClaims]) -> String {
    let turned: Vec<String> = readings
        .iter()
        .filter_map(|judged| {
            let other = judged.claims.iter().find(|other| other.name == claim.name)?;
            let differs = other.holds.is_some() && other.holds != claim.holds;
            differs.then(|| format!("{} ({})", judged.name, verdict(other.holds)))
        })
        .collect();
    turned.join(", ")
}

fn readings_table(document: &mut Document, claims: &[Claim], readings: &[ReadingClaims]) {
    let mut head = vec!["claim", "as above"];
    head.extend(readings.iter().map(|judged| judged.name));
    let cell = |claim: &Claim| format!("{} {}", verdict(claim.holds), number(claim.measured));
    let row = |claim: &Claim| {
        let mut row = vec![format!("{} ({})", claim.claim, claim.figure), cell(claim)];
        row.extend(readings.iter().map(|judged| {
            let same = judged.claims.iter().find(|other| other.name == claim.name);
            same.map_or_else(|| "not computed".into(), cell)
        }));
        row
    };
    document.table(&head, claims.iter().map(row));
}
