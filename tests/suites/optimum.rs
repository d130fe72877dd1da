//! The best LED-to-ambient ratio: a small seeded matrix, a prototype's results, and the shipped table.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use link::l2a_table::L2aTable;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::optimum::{Optimum, Search, optimum};
use studies::reach::ReachSearch;
use studies::table::{AtPlace, LeastRegret, ReachSurvey, Survey, TableFile};

const INTERVALS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
/// Distances of the matrix, in metres.
const DISTANCES_M: [f64; 3] = [40.0, 55.0, 70.0];

fn best(interval: f64, distance_m: f64, search: &Search) -> Optimum {
    let settings = [format!("panel.interval={interval}"), format!("pose.distance_m={distance_m}")];
    let scene = Scene::load("paper", &settings).expect("a valid scene");
    optimum(&scene, search).expect("an optimum")
}

/// The best of 256 frames per ratio, searched once for all tests.
fn best_of_few(interval: f64, distance_m: f64) -> Optimum {
    static FOUND: Mutex<Vec<([f64; 2], Optimum)>> = Mutex::new(Vec::new());
    let mut found = FOUND.lock().expect("nobody panics");
    if let Some((_, best)) = found.iter().find(|(place, _)| *place == [interval, distance_m]) {
        return best.clone();
    }
    let search = Search {
        frames: 256,
        ..Search::default()
    };
    let best = best(interval, distance_m, &search);
    found.push(([interval, distance_m], best.clone()));
    best
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// Compares all numbers of a few hundred frames per cell with stored ones. After an intended change of physics, drawing, features or
/// search, update them with `UPDATE=1 cargo test -p vocc-tests --test optimum`, and review the difference.
#[test]
fn the_small_matrix_is_what_it_was() {
    let mut csv = String::from("interval,distance_m,l2a,low,high,bvar,wvar,b2w,fisher,bit_errors\n");
    for interval in INTERVALS {
        for distance_m in DISTANCES_M {
            let found = best_of_few(interval, distance_m);
            let at_one = found.grid.points()[4].total();
            let variances = at_one.distinguishability();
            csv += &format!(
                "{interval},{distance_m},{:.4},{:.4},{:.4},{:.3},{:.4},{:.4},{:.4},{}\n",
                found.l2a,
                found.l2a_95[0],
                found.l2a_95[1],
                variances.bvar,
                variances.wvar,
                variances.b2w.expect("features that vary"),
                variances.fisher.expect("features that vary"),
                at_one.errors.errors()
            );
        }
    }
    let path = data("optimum.csv");
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, &csv).expect("a file");
    }
    let before = std::fs::read_to_string(&path).expect("the numbers of before");
    assert_eq!(csv, before, "{} is of seed 1", path.display());
}

/// A prototype's best ratios, from 30 frames per cell and a grid of 0.25 to 0.5.
#[test]
fn the_best_ratios_are_a_prototypes_to_a_step_or_two() {
    for (interval, distance_m, theirs) in [
        (0.5, 40.0, 1.25),
        (0.5, 70.0, 1.5),
        (1.0, 50.0, 2.0),
        (1.0, 70.0, 2.5),
        (1.5, 50.0, 3.0),
        (2.0, 70.0, 4.0),
    ] {
        let ours = best_of_few(interval, distance_m).l2a;
        assert!(
            (ours - theirs).abs() <= 0.35,
            "interval {interval}, {distance_m} m: {ours} against {theirs}"
        );
    }
}

/// The interval of a rendered scene shrinks with the square root of the frames.
#[test]
fn sixteen_times_the_frames_quarter_the_interval() {
    const SEEDS: u64 = 2;
    let width = |frames| {
        let of_seed = |seed| {
            let search = Search {
                frames,
                seed,
                ..Search::default()
            };
            let [low, high] = best(0.5, 70.0, &search).l2a_95;
            high - low
        };
        (1..=SEEDS).map(of_seed).sum::<f64>() / SEEDS as f64
    };
    let ratio = width(512) / width(8192);
    // The width from 64 batches has an uncertainty of about a sixth.
    assert!((3.0..5.3).contains(&ratio), "seeds 1 to {SEEDS}: {ratio}");
}

/// A table's file, by its name within the repository.
fn table(name: &str) -> TableFile {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    TableFile::read(&root.join(name)).expect("a table's file")
}

fn shipped_file() -> TableFile {
    table("link/shipped_table.toml")
}

/// The tables from which the shipped one is made, with their names.
fn scenes() -> Vec<(String, TableFile)> {
    let names = shipped_file().regret.record.expect("a table of least regret").tables;
    let named = names.into_iter().map(|name| (name.clone(), table(&name)));
    named.collect()
}

#[test]
fn the_shipped_table_is_what_its_file_says_and_that_what_the_scenes_say() {
    let file = shipped_file();
    assert_eq!(file.ratios.table().expect("a finished table"), L2aTable::shipped());
    let made = TableFile::of_least_regret(&scenes()).expect("a table");
    assert_eq!(made.to_toml().expect("a text"), file.to_toml().expect("a text"));
    assert_eq!(
        file.regret.entries.len(),
        file.ratios.illuminance_lx.len() * file.ratios.interval.len()
    );
}

#[test]
fn the_shipped_table_knows_what_it_says() {
    let file = shipped_file();
    assert_eq!(file.unknown().count(), 0);
    for entry in &file.regret.entries {
        let [low, high] = entry.l2a_95;
        assert!(high - low < 0.3 * entry.l2a || entry.is_flat, "{entry:?}");
    }
    for (name, scene) in scenes() {
        for entry in &scene.reach.entries {
            assert_eq!(entry.lost_at_m, None, "{name}: {entry:?}");
        }
    }
}

/// A ratio with which a panel is read farther than it is found gains nothing.
#[test]
fn no_reach_counts_beyond_the_distance_at_which_a_panel_is_found() {
    let (_, by_ml) = scenes().into_iter().find(|(name, _)| name.ends_with("ml.toml")).expect("one by ml");
    for entry in by_ml.reach.entries.iter().filter(|entry| entry.illuminance_lx == 16_000.0) {
        let found_m = by_ml.found_at_m(entry.interval).expect("a scene");
        // Without that, all ratios below the one that is read farthest would lose something.
        assert!(entry.best_reach_m > 1.2 * found_m, "{entry:?}");
        let regret = by_ml.regret_at(entry.place()).expect("a search");
        assert_eq!([regret.best_m(), regret.reach_m(entry.best_l2a).expect("in range")], [found_m; 2]);
        assert_eq!(regret.loss(0.8 * entry.best_l2a), Some(0.0), "{entry:?}");
    }
}

/// The search that produced a table.
fn survey_of(file: &TableFile) -> ReachSurvey {
    let record = file.reach.record.clone().expect("a search");
    ReachSurvey {
        search: ReachSearch {
            raw_error_rate: record.raw_error_rate,
            range: record.range,
            frames: record.frames,
            tolerance: record.tolerance,
            choice: record.choice,
            seed: record.seed,
            random_reflectance: record.random_reflectance,
            detector: record.detector.parse().expect("a detector"),
            level: record.level,
            ..ReachSearch::default()
        },
        demand: record.demand,
        bounds: record.bounds,
        illuminance_lx: file.ratios.illuminance_lx.clone(),
        interval: file.ratios.interval.clone(),
    }
}

/// Repeats one entry each at night, dusk and day: k-means has the same reach, and the ratio is the same.
#[test]
fn three_entries_of_the_shipped_table_come_out_again() {
    let shipped = shipped_file();
    for place in [[50.0, 0.5], [300.0, 1.0], [16_000.0, 2.0]] {
        let again = scenes().into_iter().map(|(_, file)| {
            let survey = survey_of(&file);
            if survey.search.detector != DetectorChoice::KMeans {
                return file;
            }
            let scene = file.scene.expect("a scene");
            let mut again = TableFile::of(&survey, &scene);
            let found = survey.find(&scene, place, Vec::new(), |_| {});
            let (entry, points) = found.expect("a reach").expect("to the end");
            again.add(entry, points);
            again
        });
        let again: Vec<TableFile> = again.collect();
        let found = LeastRegret::over(&again, place).expect("a ratio");
        let shipped = shipped.regret.entry(place).expect("an entry");
        let [low, high] = shipped.l2a_95;
        assert!((low..=high).contains(&found.l2a), "{found:?}, shipped: {shipped:?}");
    }
}

/// With a quarter of the frames the best detector has the same reach at dusk.
#[test]
fn what_the_best_detector_reaches_comes_out_again() {
    let place = [300.0, 1.0];
    let by_ml = |file: &TableFile| survey_of(file).search.detector == DetectorChoice::MaximumLikelihood;
    let scenes = scenes().into_iter().map(|(_, file)| file);
    let file = scenes.into_iter().find(by_ml).expect("one by ml");
    let mut survey = survey_of(&file);
    survey.search.frames /= 4;
    let scene = file.scene.as_ref().expect("a scene");
    let found = survey.find(scene, place, Vec::new(), |_| {});
    let (found, _) = found.expect("a reach").expect("to the end");
    let before = file.reach.entry(place);
    let [low, high] = before.expect("an entry").best_reach_m_95;
    let [found_low, found_high] = found.best_reach_m_95;
    // The file keeps five digits; a reach limited by the LEDs' spacing in the image is known more precisely.
    let rounded = 1e-4 * low;
    assert!(
        low - rounded <= found_high && found_low <= high + rounded,
        "{found:?}, before: {before:?}"
    );
}
