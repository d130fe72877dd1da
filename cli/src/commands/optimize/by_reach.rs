//! The best ratio by the reach of messages.

use anyhow::ensure;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::reach::{Choice, Demand, ReachSearch};
use studies::table::{Bounds, ReachSurvey};

use super::Arguments;
use super::places::search;
use crate::options::SharedOptions;
use crate::output::Verdict;
use crate::report;
use crate::stop::stop;

/// Maximum frames per ratio and distance: by default, and with `--quick`.
const FRAMES: [u64; 2] = [4096, 512];
/// Relative half-width of the interval that ends a search: by default, and with `--quick`.
const TOLERANCE: [f64; 2] = [0.05, 0.2];

/// Options of a search by reach.
#[derive(clap::Args)]
#[command(next_help_heading = "With --criterion reach")]
pub struct Options {
    /// Bytes of the message to deliver, 1 to 1024. Default: 48.
    #[arg(long, value_name = "N")]
    message_bytes: Option<usize>,
    /// The time limit of delivery in seconds, up to 60. Default: 1.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    within: Option<f64>,
    /// The share of messages to deliver in that time, 0.5 to 0.99. Default: 0.95.
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    probability: Option<f64>,
    /// The ratio to choose among those that lose at most 1 % of the reach: margin (their middle, the default), least-light or best.
    #[arg(long, value_parser = choice, value_name = "WHICH")]
    choose: Option<Choice>,
    /// Minimum mean luminous intensity of the panel straight ahead, cd.
    #[arg(long, value_name = "CD", value_parser = candela, allow_negative_numbers = true)]
    min_cd: Option<f64>,
    /// Maximum mean luminous intensity of the panel straight ahead, cd.
    #[arg(long, value_name = "CD", value_parser = candela, allow_negative_numbers = true)]
    max_cd: Option<f64>,
    /// Both limits of a lamp: rear-position, rear-position-variable, stop, stop-variable or daytime-running (UN Regulation No. 148).
    #[arg(long, value_parser = Bounds::of_lamp, conflicts_with_all = ["min_cd", "max_cd"])]
    lamp: Option<Bounds>,
}

fn choice(text: &str) -> Result<Choice, String> {
    match text {
        "margin" => Ok(Choice::Margin),
        "least-light" => Ok(Choice::LeastLight),
        "best" => Ok(Choice::Best),
        _ => Err(format!("no choice {text:?}: choose margin, least-light or best")),
    }
}

fn candela(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(candela) if candela > 0.0 && candela.is_finite() => Ok(candela),
        _ => Err("give a number of candela above 0".into()),
    }
}

impl Options {
    /// Whether any of these options is given.
    pub fn is_given(&self) -> bool {
        self.message_bytes.is_some()
            || self.within.is_some()
            || self.probability.is_some()
            || self.choose.is_some()
            || self.bounds() != Bounds::default()
    }

    fn bounds(&self) -> Bounds {
        let own = Bounds {
            min_cd: self.min_cd,
            max_cd: self.max_cd,
        };
        self.lamp.unwrap_or(own)
    }

    fn demand(&self) -> Demand {
        let usual = Demand::default();
        Demand {
            message_bytes: self.message_bytes.unwrap_or(usual.message_bytes),
            within_s: self.within.unwrap_or(usual.within_s),
            probability: self.probability.unwrap_or(usual.probability),
        }
    }
}

impl Arguments {
    fn by_reach(&self, shared: &SharedOptions, scene: &Scene) -> anyhow::Result<ReachSurvey> {
        ensure!(
            self.distances.is_none() && self.yaws.is_none() && self.rule.is_none(),
            "--criterion reach takes no --distances, --yaws or --rule, because it searches all distances at the scene's own yaw (--set \
             pose.yaw_deg=…): omit them"
        );
        let demand = self.reach.demand();
        let mut survey = ReachSurvey {
            search: ReachSearch {
                range: self.range()?,
                frames: self.frames.unwrap_or(FRAMES[usize::from(self.quick)]),
                tolerance: self.tolerance.unwrap_or(TOLERANCE[usize::from(self.quick)]),
                choice: self.reach.choose.unwrap_or_default(),
                seed: shared.seed,
                random_reflectance: !self.fixed_reflectance,
                detector: self.detector.unwrap_or(DetectorChoice::KMeans),
                level: self.level,
                stop: stop(),
                ..ReachSearch::default()
            },
            demand,
            bounds: self.reach.bounds(),
            illuminance_lx: self.illuminances(scene),
            interval: self.intervals.clone(),
        };
        survey.check(scene)?;
        let rate_hz = scene.link.symbol_rate_hz;
        survey.search.raw_error_rate = match scene.link.waveform()?.is_still() {
            true => demand.raw_error_rate(rate_hz, shared.seed)?,
            false => demand.raw_error_rate_with_carrier(rate_hz, shared.seed)?,
        };
        Ok(survey)
    }
}

/// Searches, prints and writes.
pub fn run(arguments: &Arguments, shared: &SharedOptions, scene: &Scene) -> anyhow::Result<Verdict> {
    let survey = arguments.by_reach(shared, scene)?;
    search(arguments, &survey, scene, shared.json, report::table::draw)
}
