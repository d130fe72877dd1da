//! The TOML file that describes a sweep.
//!
//! ```toml
#![doc = include_str!("example.toml")]
//! ```

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::{Axis, MOST_SHARDS, Sweep, SweepError};
use crate::detectors::DetectorChoice;
use sim::accuracy::Level;
use sim::scene::{Scene, SceneError, parse_value};

/// A plan with all keys and their meaning.
pub const EXAMPLE: &str = include_str!("example.toml");

/// A sweep as its file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanFile {
    /// The sweep.
    pub sweep: Sweep,
    /// Whether the file names the seed.
    pub names_seed: bool,
    /// The division of the sweep, if fixed.
    pub division: Option<Division>,
}

/// The division of a sweep into shards when it was submitted to a cluster: a shard then stays the same even if the rule of division
/// changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Division {
    /// The number of shards.
    pub shards: u64,
    /// The expected frames of each cell.
    pub expected_frames: Vec<u64>,
}

/// Why a plan cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// Not TOML, a key that does not exist, or a value of the wrong type.
    #[error("plan {name}: {source}")]
    Parse {
        /// The file.
        name: String,
        /// The place and the fault.
        source: Box<toml::de::Error>,
    },
    /// The plan's scene, or what it sets there.
    #[error("plan {name}: {source}")]
    Scene {
        /// The file.
        name: String,
        /// The cause.
        source: Box<SceneError>,
    },
    /// There is no grid.
    #[error(
        "plan {name}: the grid is empty: give [grid] at least one key, such as pose.distance_m = [30, 50]; one setting alone is for vocc \
         evaluate"
    )]
    EmptyGrid {
        /// The file.
        name: String,
    },
    /// A key of the grid is not a list.
    #[error("plan {name}: the grid's key {key} is {value}: give a list of values, such as {key} = [1, 2]")]
    NoList {
        /// The file.
        name: String,
        /// The key.
        key: String,
        /// The value.
        value: String,
    },
    /// A key is both set and varied.
    #[error("the key {key} is set and in the grid of plan {name}: remove one of them")]
    SetAndVaried {
        /// The file.
        name: String,
        /// The key.
        key: String,
    },
    /// A key is repeated, perhaps once in quotes.
    #[error("plan {name}: the key {key} is listed twice: remove one")]
    DoubledKey {
        /// The file.
        name: String,
        /// The key.
        key: String,
    },
    /// The number of frames is missing.
    #[error("plan {name}: it has no end: give frames, or bits under [stop]")]
    NoEnd {
        /// The file.
        name: String,
    },
    /// The division is of another plan.
    #[error("plan {name}: the division has {found} expected frames for {cells} cells: take [division] away")]
    Division {
        /// The file.
        name: String,
        /// Numbers in it.
        found: usize,
        /// Cells of the grid.
        cells: usize,
    },
    /// The division has no shards, or too many.
    #[error("plan {name}: [division] shards = {shards}: give 1 to {MOST_SHARDS}, or take [division] away")]
    Shards {
        /// The file.
        name: String,
        /// Its shards.
        shards: u64,
    },
    /// The described sweep is invalid.
    #[error("plan {name}: {source}")]
    Sweep {
        /// The file.
        name: String,
        /// The cause.
        source: Box<SweepError>,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanRecord {
    #[serde(default = "paper")]
    scene: Value,
    #[serde(default = "kmeans")]
    detectors: Vec<DetectorChoice>,
    frames: Option<u64>,
    seed: Option<u64>,
    #[serde(default)]
    random_reflectance: bool,
    #[serde(default)]
    level: Level,
    #[serde(default)]
    rare_events: bool,
    #[serde(default)]
    stop: Stop,
    #[serde(default)]
    set: Table,
    #[serde(default)]
    grid: Table,
    division: Option<Division>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stop {
    errors: Option<u64>,
    bits: Option<u64>,
}

fn paper() -> Value {
    Value::String("paper".into())
}

fn kmeans() -> Vec<DetectorChoice> {
    vec![DetectorChoice::KMeans]
}

impl Sweep {
    /// The sweep in the TOML `text`, called `name` in errors; `overrides` as in [`Scene::load`] apply after the plan's settings.
    ///
    /// # Errors
    /// The fault, its place, the allowed values and the remedy.
    pub fn from_toml(name: &str, text: &str, overrides: &[String]) -> Result<PlanFile, PlanError> {
        let name = name.to_string();
        let parse_error = |fault: toml::de::Error| PlanError::Parse {
            name: name.clone(),
            source: Box::new(fault),
        };
        let written: PlanRecord = toml::from_str(text).map_err(parse_error)?;
        let scene = written.scene().map_err(|fault| PlanError::Scene {
            name: name.clone(),
            source: Box::new(fault),
        })?;
        let mut set: Vec<String> = keyed(&name, &written.set)?
            .into_iter()
            .map(|(key, value)| format!("{key}={}", as_override(value)))
            .collect();
        set.extend_from_slice(overrides);
        let scene = scene.with("[set]", &set).map_err(|fault| PlanError::Scene {
            name: name.clone(),
            source: Box::new(fault),
        })?;
        let sweep = Self {
            scene,
            grid: axes(&name, &written.grid)?,
            detectors: written.detectors,
            frames: match (written.frames, written.stop.bits) {
                (None, None) => return Err(PlanError::NoEnd { name }),
                (frames, bits) => frames.unwrap_or(u64::MAX).min(bits.map_or(u64::MAX, |bits| bits.div_ceil(64))),
            },
            stop_errors: written.stop.errors,
            seed: written.seed.unwrap_or(1),
            random_reflectance: written.random_reflectance,
            level: written.level,
            rare_events: written.rare_events,
            camera: None,
        };
        if let Some(axis) = sweep.grid.iter().find(|axis| names(&set, &axis.key)) {
            let key = axis.key.clone();
            return Err(PlanError::SetAndVaried { name, key });
        }
        let checked = sweep.check_description();
        checked.map_err(|fault| PlanError::Sweep {
            name: name.clone(),
            source: Box::new(fault),
        })?;
        if let Some(division) = &written.division {
            let (shards, found) = (division.shards, division.expected_frames.len());
            if !(1..=MOST_SHARDS).contains(&shards) {
                return Err(PlanError::Shards { name, shards });
            }
            if found != sweep.cells() {
                let cells = sweep.cells();
                return Err(PlanError::Division { name, found, cells });
            }
        }
        Ok(PlanFile {
            sweep,
            names_seed: written.seed.is_some(),
            division: written.division,
        })
    }
}

impl PlanFile {
    /// The expected frames of each cell, if fixed.
    pub fn expected_frames(&self) -> Option<&[u64]> {
        let division = self.division.as_ref()?;
        Some(&division.expected_frames)
    }

    /// The plan as a self-contained file, with its scene written out.
    ///
    /// # Errors
    /// If a number, such as a seed above 2⁶³, cannot be written in TOML.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let sweep = &self.sweep;
        let mut grid = Table::new();
        for Axis { key, values } in &sweep.grid {
            let values = values.iter().map(|text| parse_value(text)).collect();
            grid.insert(key.clone(), Value::Array(values));
        }
        toml::to_string(&PlanRecord {
            scene: Value::try_from(&sweep.scene)?,
            detectors: sweep.detectors.clone(),
            frames: Some(sweep.frames),
            seed: Some(sweep.seed),
            random_reflectance: sweep.random_reflectance,
            level: sweep.level,
            rare_events: sweep.rare_events,
            stop: Stop {
                errors: sweep.stop_errors,
                bits: None,
            },
            set: Table::new(),
            grid,
            division: self.division.clone(),
        })
    }
}

impl PlanRecord {
    fn scene(&self) -> Result<Scene, SceneError> {
        match &self.scene {
            Value::String(name) => Scene::load(name, &[]),
            table => {
                let parsed: Result<Scene, _> = table.clone().try_into();
                let scene = parsed.map_err(|fault| SceneError::Parse {
                    name: "[scene]".into(),
                    source: Box::new(fault),
                })?;
                scene.with("[scene]", &[])
            }
        }
    }
}

/// The grid's keys in alphabetical order, the first the slowest.
fn axes(name: &str, grid: &Table) -> Result<Vec<Axis>, PlanError> {
    let axes: Vec<Axis> = keyed(name, grid)?
        .into_iter()
        .map(|(key, value)| match value {
            Value::Array(values) => Ok(Axis {
                key,
                values: values.iter().map(as_override).collect(),
            }),
            other => Err(PlanError::NoList {
                name: name.into(),
                key,
                value: other.to_string(),
            }),
        })
        .collect::<Result<_, _>>()?;
    if axes.is_empty() {
        return Err(PlanError::EmptyGrid { name: name.into() });
    }
    Ok(axes)
}

/// The values of nested tables by their dotted keys, without the blanks that quotes may hold.
///
/// # Errors
/// If a key is repeated: TOML distinguishes `a.b` from `"a.b"`.
fn keyed<'a>(name: &str, table: &'a Table) -> Result<Vec<(String, &'a Value)>, PlanError> {
    let mut keyed: Vec<(String, &Value)> = Vec::new();
    for (key, value) in flat(table) {
        let key = key.split('.').map(str::trim).collect::<Vec<_>>().join(".");
        if keyed.iter().any(|(known, _)| *known == key) {
            let name = name.into();
            return Err(PlanError::DoubledKey { name, key });
        }
        keyed.push((key, value));
    }
    Ok(keyed)
}

/// The values of nested tables, with their keys joined by dots, in the order of the file.
fn flat(table: &Table) -> Vec<(String, &Value)> {
    let mut found = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(inner) => {
                let inner = flat(inner).into_iter();
                found.extend(inner.map(|(rest, value)| (format!("{key}.{rest}"), value)));
            }
            value => found.push((key.clone(), value)),
        }
    }
    found
}

/// A value in the form of `--set KEY=`: a word without quotes if it stays the same word.
fn as_override(value: &Value) -> String {
    match value {
        Value::String(word) if parse_value(word) == *value => word.clone(),
        value => value.to_string(),
    }
}

fn names(overrides: &[String], key: &str) -> bool {
    let keys = overrides.iter().filter_map(|text| text.split_once('='));
    keys.into_iter().any(|(named, _)| named.trim() == key)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> String {
        match Sweep::from_toml("p.toml", text, &[]) {
            Ok(plan) => format!("none: {plan:?}"),
            Err(error) => error.to_string(),
        }
    }

    const PLAN: &str = r#"
        scene = "night"
        detectors = ["kmeans", "best"]
        frames = 1000
        seed = 7
        [stop]
        errors = 100
        bits = 32_000
        [set]
        link.l2a = 1.5
        [grid]
        pose.distance_m = [30, 50.5]
        "panel.interval" = [1]
        link.contrast = ["eq10", "exposure"]
    "#;

    #[test]
    fn a_plan_is_every_combination() {
        let plan = Sweep::from_toml("p.toml", PLAN, &["link.phase=0.25".into()]).unwrap();
        let sweep = &plan.sweep;
        assert_eq!((sweep.frames, sweep.cells()), (500, 8));
        assert_eq!(sweep.scene.link.phase, 0.25);
        assert_eq!(
            sweep.name_of(7),
            "7 (link.contrast=exposure, panel.interval=1, pose.distance_m=50.5, best)"
        );
        let scene = sweep.scene_of(6).unwrap();
        assert_eq!((scene.pose.distance_m, scene.panels[0].interval), (50.5, 1.0));
        assert_eq!(scene.link.l2a, sim::scene::L2a::Ratio(1.5));
        assert_eq!(sweep.cell(6).detector, DetectorChoice::KMeans);
    }

    #[test]
    fn the_example_has_every_key_but_the_division() {
        let plan = Sweep::from_toml("the example", EXAMPLE, &[]).unwrap();
        plan.sweep.check().unwrap();
        let keys: Table = toml::from_str(EXAMPLE).unwrap();
        let all: Table = toml::from_str(&plan.to_toml().unwrap()).unwrap();
        let missing: Vec<&String> = all.keys().filter(|key| !keys.contains_key(*key)).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn what_is_written_out_is_the_same_plan() {
        let mut plan = Sweep::from_toml("p.toml", PLAN, &[]).unwrap();
        plan.division = Some(Division {
            shards: 3,
            expected_frames: vec![500; 8],
        });
        let written = plan.to_toml().unwrap();
        assert_eq!(Sweep::from_toml("again", &written, &[]).unwrap(), plan);
        let lost = written.replace("expected_frames = [500, ", "expected_frames = [");
        assert!(fault(&lost).contains("7 expected frames for 8 cells"), "{}", fault(&lost));
        for shards in ["0", "1000001"] {
            let odd = written.replace("shards = 3", &format!("shards = {shards}"));
            let fault = fault(&odd);
            assert!(fault.contains(&format!("shards = {shards}: give 1 to 1000000")), "{fault}");
        }
    }

    #[test]
    fn faults_say_what_is_wrong() {
        let grid = "\n[grid]\npose.distance_m = [50]";
        let with = |text: &str| fault(&format!("{text}{grid}"));
        assert!(with("frames = 10\nframse = 3").contains("framse"));
        assert!(fault("frames = 10").contains("grid is empty"));
        assert!(fault("frames = 10\n[grid]").contains("grid is empty"));
        assert!(fault("frames = 10\n[grid]\npose.distance_m = []").contains("no values"));
        assert!(fault("frames = 10\n[grid]\npose.distance_m = 50").contains("list"));
        assert!(fault("frames = 10\n[grid]\npose.distance_m = [50, 50]").contains("twice"));
        for same in ["50, 50.0", "1_000, 1e3", "0, -0.0", "0.5, 5e-1"] {
            let plan = format!("frames = 10\n[grid]\npose.distance_m = [{same}]");
            assert!(fault(&plan).contains("twice"), "{same}");
        }
        for same in ["\"pose.distance_m\"", "\" pose.distance_m\"", "\"pose . distance_m\""] {
            let grid = format!("frames = 10\n[grid]\n{same} = [30]\npose.distance_m = [50]");
            assert!(fault(&grid).contains("is listed twice"), "{same}");
            let set = format!("[set]\n{same} = 30\npose.distance_m = 50");
            assert!(fault(&format!("frames = 10\n{set}\n[grid]\nlink.l2a = [1]")).contains("is listed twice"));
            let both = format!("frames = 10\n[set]\n{same} = 30{grid}");
            assert!(!fault(&both).starts_with("none"), "{same}");
        }
        let lines = "frames = 10\n[set]\npose.distance_m = \"5\\nlink.l2a=3\"\n[grid]\nlink.phase = [0.5]";
        assert!(fault(lines).contains("one line"), "{}", fault(lines));
        assert!(with("").contains("it has no end"));
        assert!(with("frames = 0").contains("frames = 0"));
        assert!(with("frames = -4").contains("-4"));
        assert!(with("frames = 10\ndetectors = []").contains("no detectors"));
        assert!(with("frames = 10\ndetectors = [\"wizard\"]").contains("kmeans-raw"));
        assert!(with("frames = 10\ndetectors = [\"ml\", \"ml\"]").contains("ml is listed twice"));
        assert!(with("frames = 10\nlevel = \"reference\"").contains("fine or fast"));
        assert!(with("frames = 10\nscene = \"no-such\"").contains("paper-18mm"));
        assert!(with("frames = 10\nscene = 3").contains("[scene]"));
        assert!(with("frames = 10\nscene.pose.distance_cm = 3").contains("distance_cm"));
        assert!(with("frames = 10\n[stop]\nerrors = 0").contains("stop.errors = 0"));
        assert!(with("frames = 10\n[set]\npose.distance_m = 3").contains("remove one"));
        assert!(with("frames = 10\n[set]\npose.distance_cm = 3").contains("distance_cm"));
        let many: Vec<String> = (0..400).map(|k| k.to_string()).collect();
        let many = many.join(", ");
        let grid = format!("frames = 10\n[grid]\npose.x_m = [{many}]\npose.y_m = [{many}]");
        assert!(fault(&grid).contains("100000 cells"));
    }

    #[test]
    fn a_grid_of_keys_or_values_that_are_none_names_the_cell() {
        let check = |grid: &str| {
            let text = format!("frames = 10\n[grid]\n{grid}");
            let plan = Sweep::from_toml("p.toml", &text, &[]).unwrap();
            plan.sweep.check().unwrap_err().to_string()
        };
        let fault = check("pose.distance_cm = [1]");
        assert!(fault.contains("distance_m") && fault.contains("cell 0"), "{fault}");
        let fault = check("pose.distance_m = [50, -3]");
        assert!(fault.contains("cell 1") && fault.contains("0.5 to 2000"), "{fault}");
        // The cell of 2000 in [50, 2000] stays empty.
        let fault = check("pose.distance_m = [1000, 2000]");
        assert!(fault.contains("px apart"), "{fault}");
    }
}
