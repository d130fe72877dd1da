//! A whole run of few points, interrupted, finished and drawn.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::*;
use studies::reproduction::Axes;
use studies::stop::Stop;

fn stopped_after(time: Duration) -> Stop {
    let flag: &AtomicBool = Box::leak(Box::new(AtomicBool::new(time.is_zero())));
    std::thread::spawn(move || {
        std::thread::sleep(time);
        flag.store(true, Ordering::Relaxed);
    });
    Stop::at(flag)
}

fn small() -> Study {
    let scene = Scene::load("paper", &[]).expect("a preset");
    let axes = Axes {
        l2a: vec![0.2, 2.0, 4.0],
        interval: vec![1.0, 1.5, 2.0],
        distance_m: vec![30.0, 70.0],
        optimum_interval: vec![1.0],
        optimum_distance_m: vec![50.0],
        error_distance_m: vec![50.0, 70.0],
        learnt_at: [6, 4],
        detectors: vec!["kmeans", "otsu"],
    };
    Study {
        axes,
        ..Study::new(scene, Extent::Quick, 1000, 1)
    }
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("vocc-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

#[test]
fn an_interrupted_run_keeps_what_is_finished_and_goes_on() {
    let parts = |stop| {
        [Part {
            name: "",
            study: Study { stop, ..small() },
        }]
    };
    let uninterrupted = parts(Stop::NEVER);
    let study = &uninterrupted[0].study;
    let run = |seed| Run::new(&study.scene, 1000, true, seed);
    let folder = folder("interrupted");
    let path = folder.join(CHECKPOINT);
    Checkpoint::new(run(1)).write(&path).expect("a file");
    assert!(Checkpoint::read(&path, &run(2)).is_err());
    let mut interruptions = 0;
    let again = loop {
        let mut checkpoint = Checkpoint::read(&path, &run(1)).expect("what was written");
        // Each attempt runs longer, so that some task finishes. The first is stopped before it begins.
        let after = Duration::from_millis(if interruptions == 0 { 0 } else { 1 << interruptions });
        if compute(&parts(stopped_after(after)), &mut checkpoint, &path).expect("work") {
            break checkpoint;
        }
        if interruptions == 0 {
            let claims = checkpoint.findings.get("").map(|findings| judge(study, findings));
            assert_eq!(claims.unwrap_or_default(), [], "no curve is finished");
        }
        interruptions += 1;
    };
    assert!(interruptions > 2, "{interruptions}");
    let mut whole = Checkpoint::new(run(1));
    assert!(compute(&uninterrupted, &mut whole, &path).expect("work"));
    assert_eq!(again.findings, whole.findings);
    drawn(study, &whole.findings[""], &folder);
    std::fs::remove_dir_all(&folder).expect("cleared");
}

/// Checks every figure: as many rows of numbers as points.
fn drawn(study: &Study, findings: &Findings, folder: &Path) {
    let figures = figures(study, findings).expect("figures");
    let rows = |name: &str| {
        let figure = figures.iter().find(|figure| figure.name == name);
        let figure = figure.unwrap_or_else(|| panic!("no {name}"));
        let cells: Vec<usize> = figure.csv.lines().map(|line| line.split(',').count()).collect();
        assert!(cells.iter().all(|&n| n == cells[0]), "{name}: {cells:?}");
        figure.save(folder).expect("files");
        let image = std::fs::read(folder.join(format!("{name}.png"))).expect("a picture");
        assert!(image.starts_with(b"\x89PNG"));
        cells.len() - 1
    };
    assert_eq!(rows("figure-13"), 3 * 10 * 64);
    assert_eq!(rows("figure-16"), 4 * 10 * 64);
    assert_eq!(rows("figure-19"), 3 * 10 * 64);
    assert_eq!([rows("figure-14"), rows("figure-17"), rows("figure-20")], [3, 3, 2]);
    assert_eq!([rows("figure-21"), rows("figure-22")], [1, 4]);
    assert_eq!(rows("figure-22-detectors"), 8);
    assert!(rows("figure-08") > 5 * 50);
    for name in ["figure-12", "figure-15", "figure-18"] {
        assert!(rows(name) > 3 * 20 * 20, "{name}");
    }
    let report = claims::report(study, "vocc figures", &judge(study, findings), &[], &figures);
    assert_eq!(report.html().matches("<svg").count(), 13);
    assert!(report.markdown().contains("figure-22-detectors.png"));
}
