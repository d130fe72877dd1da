//! The report: each claim against its number, under the scene and under other readings of the paper.

use studies::reproduction::Claim;
use studies::reproduction::INTERPRETATIONS;
use studies::reproduction::PAPERS_DETECTOR;
use studies::reproduction::{ERRORS_ENOUGH, Study};

use crate::report::document::{Block, Document};
use crate::report::figure::Figure;

/// The claims under one reading, and the name of that reading.
pub struct Judged {
    /// The reading's name.
    pub name: &'static str,
    /// The claims whose data are there.
    pub claims: Vec<Claim>,
}

/// The report of a run.
pub fn report(
    study: &Study,
    command: &str,
    claims: &[Claim],
    readings: &[Judged],
    figures: &[Figure],
) -> Document {
    let mut document = Document::new("The figures of Do & Yoo 2020, computed again");
    document.text(format!(
        "Do & Yoo, \"The Necessity of LED to Ambient Light Ratio Optimization for Vehicular Optical Camera Communication\", Sensors 2020, 20, 292, section 4.4. Made by `{command}`."
    ));
    document.text(frames(study));
    document.heading("Claims");
    document.text("A claim of a trend is decided by its weakest step. It holds or fails if the whole 95 % interval of its number says so, and is open otherwise.");
    document.push(claims_table(claims, readings));
    if !readings.is_empty() {
        other_readings(&mut document, claims, readings);
    }
    document.heading("Figures");
    for figure in figures {
        document.push(Block::Picture {
            name: figure.name.into(),
            caption: figure.caption.clone(),
            svg: figure.svg.clone(),
        });
    }
    document
}

/// The claims under other readings of the paper.
fn other_readings(document: &mut Document, claims: &[Claim], readings: &[Judged]) {
    document.heading("The same under other readings");
    document.text("Where the paper contradicts itself or is silent, each reading is a few scene keys. \"yes\": the claim holds; \"no\": it fails; \"open\": the interval does not tell; with the number that decides. A tenth of the frames, fewer points.");
    document.push(readings_table(claims, readings));
    let described = INTERPRETATIONS.iter().map(|reading| {
        let settings = reading.overrides.join("`, `");
        format!("**{}**: {} (`{settings}`)", reading.name, reading.summary)
    });
    document.push(Block::List(described.collect()));
    document.text("Readings that no scene key gives were tried for the trend of figure 21 with the distance: discs by pixel centres, cut blurs, gamma or clipping before the blur, other cells and gradients, features frame by frame. `cargo run --release -p vocc-studies --example distance_trend` prints what comes of each; docs/reproduction.md sums it up.");
}

/// How the frames are spread.
fn frames(study: &Study) -> String {
    let axes = &study.axes;
    let share = |points: usize| study.share(points);
    format!(
        "Seed {}. {} frames a figure, spread over its points: {} at each L2A of figure 14, {} at each interval of figure 17, {} at each distance of figure 20, where figures share a point the larger number; for figure 21 at most {} at each L2A of the finer search in each of {} cells, fewer where the best L2A is known to ±{} before; for figure 22 at most {} at each distance with k-means and {} with each other detector, fewer where {} bits were wrong before. Each frame has random bits, a random sub-pixel phase and a random reflectance of 0.3 to 0.5. The paper draws the ambient light too; exposure and dimming follow it, so that its frames do not depend on it.",
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

/// A verdict as a word.
pub fn verdict(holds: Option<bool>) -> &'static str {
    match holds {
        Some(true) => "yes",
        Some(false) => "no",
        None => "open",
    }
}

fn claims_table(claims: &[Claim], readings: &[Judged]) -> Block {
    let row = |claim: &Claim| {
        vec![
            claim.figure.to_string(),
            claim.claim.clone(),
            claim.quantity.clone(),
            format!(
                "{} ({} to {})",
                number(claim.measured),
                number(claim.measured_95[0]),
                number(claim.measured_95[1])
            ),
            format!("**{}**", verdict(claim.holds)),
            depends_on(claim, readings),
        ]
    };
    Block::Table {
        head: [
            "figure",
            "claim",
            "quantity",
            "measured (95 %)",
            "holds",
            "depends on",
        ]
        .map(String::from)
        .to_vec(),
        rows: claims.iter().map(row).collect(),
    }
}

/// What a claim depends on: in words, and by the readings that turn it.
fn depends_on(claim: &Claim, readings: &[Judged]) -> String {
    let turned: Vec<String> = readings
        .iter()
        .filter_map(|judged| {
            let other = judged
                .claims
                .iter()
                .find(|other| other.name == claim.name)?;
            let differs = other.holds.is_some() && other.holds != claim.holds;
            differs.then(|| format!("{} ({})", judged.name, verdict(other.holds)))
        })
        .collect();
    if turned.is_empty() {
        return claim.depends_on.into();
    }
    format!(
        "{}. Otherwise under {}",
        claim.depends_on,
        turned.join(", ")
    )
}

fn readings_table(claims: &[Claim], readings: &[Judged]) -> Block {
    let mut head = vec!["claim".to_string(), "as above".to_string()];
    head.extend(readings.iter().map(|judged| judged.name.to_string()));
    let cell = |claim: &Claim| format!("{} {}", verdict(claim.holds), number(claim.measured));
    let row = |claim: &Claim| {
        let mut row = vec![format!("{} ({})", claim.claim, claim.figure), cell(claim)];
        row.extend(readings.iter().map(|judged| {
            let same = judged.claims.iter().find(|other| other.name == claim.name);
            same.map_or_else(|| "not computed".into(), cell)
        }));
        row
    };
    Block::Table {
        head,
        rows: claims.iter().map(row).collect(),
    }
}

/// A number to three significant digits.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "?".into();
    }
    let magnitude = if value == 0.0 {
        0
    } else {
        value.abs().log10().floor() as i32
    };
    let digits = (2 - magnitude).clamp(0, 6) as usize;
    format!("{value:.digits$}").replace('-', "−")
}
