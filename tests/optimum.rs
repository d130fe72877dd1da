//! The best LED-to-ambient ratio: a small seeded matrix in digits, a prototype's, and the table that is shipped.

use std::path::{Path, PathBuf};

use link::l2a_table::L2aTable;
use sim::scene::Scene;
use studies::optimum::{Optimum, Search, optimum};
use studies::reach::ReachSearch;
use studies::table::{ReachSurvey, TableFile};

/// Intervals of the matrix.
const INTERVALS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
/// Distances of the matrix, in metres.
const DISTANCES_M: [f64; 3] = [40.0, 55.0, 70.0];

fn best(interval: f64, distance_m: f64, search: &Search) -> Optimum {
    let settings = [
        format!("panel.interval={interval}"),
        format!("pose.distance_m={distance_m}"),
    ];
    let scene = Scene::load("paper", &settings).expect("a valid scene");
    optimum(&scene, search).expect("an optimum")
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data")
        .join(name)
}

/// Every number of a few hundred frames a cell, as they are today. Whoever changes the physics, the drawing, the features or the search
/// on purpose writes the new ones with `UPDATE=1 cargo test -p vocc-tests --test optimum`, and looks at the difference.
#[test]
fn the_small_matrix_is_what_it_was() {
    let search = Search {
        frames: 256,
        ..Search::default()
    };
    let mut csv =
        String::from("interval,distance_m,l2a,low,high,bvar,wvar,b2w,fisher,bit_errors\n");
    for interval in INTERVALS {
        for distance_m in DISTANCES_M {
            let found = best(interval, distance_m, &search);
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

/// A prototype's best ratios, of 30 frames a cell and a grid of 0.25 to 0.5.
#[test]
fn the_best_ratios_are_a_prototypes_to_a_step_or_two() {
    let search = Search {
        frames: 256,
        ..Search::default()
    };
    for (interval, distance_m, theirs) in [
        (0.5, 40.0, 1.25),
        (0.5, 70.0, 1.5),
        (1.0, 50.0, 2.0),
        (1.0, 70.0, 2.5),
        (1.5, 50.0, 3.0),
        (2.0, 70.0, 4.0),
    ] {
        let ours = best(interval, distance_m, &search).l2a;
        assert!(
            (ours - theirs).abs() <= 0.35,
            "interval {interval}, {distance_m} m: {ours} against {theirs}"
        );
    }
}

/// The interval of a rendered scene shrinks as the root of the frames.
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
    // A width of 64 batches is known to about a sixth.
    assert!((3.0..5.3).contains(&ratio), "seeds 1 to {SEEDS}: {ratio}");
}

fn shipped_file() -> TableFile {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../link/shipped_table.toml");
    TableFile::read(&path).expect("the file that the shipped table is made from")
}

#[test]
fn the_shipped_table_is_what_its_file_says() {
    let file = shipped_file();
    assert_eq!(
        file.ratios.table().expect("a finished table"),
        L2aTable::shipped()
    );
    for entry in &file.reach_entries {
        let ratios = &file.ratios;
        let row = ratios
            .illuminance_lx
            .iter()
            .position(|&e| e == entry.illuminance_lx)
            .expect("a row");
        let column = ratios
            .interval
            .iter()
            .position(|&i| i == entry.interval)
            .expect("a column");
        let carried = ratios.l2a[row][column];
        assert!(
            (carried - entry.l2a).abs() <= 1e-3,
            "{entry:?} but {carried}"
        );
    }
    assert_eq!(
        file.reach_entries.len(),
        file.ratios.illuminance_lx.len() * file.ratios.interval.len()
    );
}

#[test]
fn the_shipped_table_knows_what_it_says() {
    let file = shipped_file();
    assert_eq!(file.unknown().count(), 0);
    for entry in &file.reach_entries {
        let [low, high] = entry.l2a_95;
        assert!(high - low < 0.3 * entry.l2a || entry.is_flat, "{entry:?}");
        assert_eq!(entry.lost_at_m, None, "{entry:?}");
    }
}

/// One by night, one at dusk and one by day.
#[test]
fn three_entries_of_the_shipped_table_come_out_again() {
    let file = shipped_file();
    let (scene, record) = (file.scene.clone(), file.reach.clone());
    let (scene, record) = (scene.expect("a scene"), record.expect("a search"));
    let survey = ReachSurvey {
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
    };
    for (illuminance_lx, interval) in [(50.0, 0.5), (300.0, 1.0), (16_000.0, 2.0)] {
        let shipped = file
            .reach_entry(illuminance_lx, interval)
            .expect("an entry");
        let found = survey.entry(&scene, illuminance_lx, interval, &[], |_| {});
        let (found, _) = found.expect("a reach");
        let [low, high] = shipped.l2a_95;
        assert!(
            (low..=high).contains(&found.l2a),
            "{found:?}, shipped: {shipped:?}"
        );
    }
}
