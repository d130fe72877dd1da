//! A small run, interrupted, finished and drawn.

use std::sync::atomic::AtomicBool;

use super::*;
use clap::Parser;

/// Errors of a few frames; the times are meaningless.
fn tiny() -> Checkpoint {
    Checkpoint::new(Run::new(Scale::TINY))
}

#[test]
fn parts_are_measured_kept_drawn_and_not_measured_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = Arguments {
        out: folder.path().into(),
        quick: true,
        parts: vec!["decoder".into()],
        resume: false,
    };
    let path = folder.path().join(CHECKPOINT);
    let mut checkpoint = tiny();
    checkpoint.missing = arguments.parts.clone();
    static ASKED: AtomicBool = AtomicBool::new(true);
    assert!(!measure(&mut checkpoint.clone(), &path, Stop::at(&ASKED)).expect("nothing to do"));
    assert!(measure(&mut checkpoint, &path, Stop::NEVER).expect("measured"));
    write(&checkpoint, &arguments, folder.path()).expect("drawn");
    let again = Arguments {
        parts: Vec::new(),
        resume: true,
        ..arguments
    };
    let resumed = begin(&again, Run::new(Scale::TINY), &path).expect("written");
    assert_eq!(resumed.parts, checkpoint.parts);
    assert_eq!(resumed.missing.len(), PARTS.len() - 1);
    assert!(begin(&again, Run::new(Scale::FULL), &path).is_err());
    let page = std::fs::read_to_string(folder.path().join("accuracy.md")).expect("a page");
    for part in &checkpoint.parts {
        assert!(page.contains(&format!("![accuracy/{0}](accuracy/{0}.png)", part.name)));
        let image = std::fs::read(folder.path().join(format!("{}.png", part.name))).expect("a plot");
        assert!(image.starts_with(b"\x89PNG"));
        let numbers = std::fs::read_to_string(folder.path().join(format!("{}.csv", part.name))).expect("numbers");
        let points: usize = part.diagrams.iter().map(|diagram| diagram.points.len()).sum();
        let mut numbers = csv::Reader::from_reader(numbers.as_bytes());
        let rows: Result<Vec<_>, _> = numbers.records().collect();
        assert_eq!(rows.expect("as many cells as the head").len(), points);
        for diagram in &part.diagrams {
            let defaults = diagram.points.iter().filter(|point| point.is_default).count();
            let baselines = diagram.points.iter().filter(|point| point.is_baseline).count();
            assert!(defaults >= 1 && baselines == 1, "{}", diagram.title);
        }
    }
}

#[test]
fn the_published_page_is_that_of_its_points() {
    let docs = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs"));
    let points = std::fs::read_to_string(docs.join(FOLDER).join(CHECKPOINT)).expect("the published points");
    let checkpoint: Checkpoint = crate::checksum::from_json(&points).expect("unchanged points");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join(FOLDER)).expect("a folder");
    let arguments = Arguments {
        out: folder.path().into(),
        quick: false,
        parts: Vec::new(),
        resume: true,
    };
    write(&checkpoint, &arguments, &folder.path().join(FOLDER)).expect("drawn");
    let page = |folder: &Path| std::fs::read_to_string(folder.join("accuracy.md")).expect("a page");
    assert!(
        page(folder.path()) == page(docs),
        "docs/accuracy.md is not that of its points: vocc accuracy --out docs --resume"
    );
    // The reader's choice stands before everything else.
    let page = page(docs);
    let (choice, rest) = page.split_once("![").expect("a picture");
    assert!(rest.starts_with("accuracy/summary]"));
    for part in &checkpoint.parts {
        assert!(choice.contains(&format!("[{}](#", part.title)), "{}", part.title);
    }
}

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    arguments: Arguments,
}

#[test]
fn a_part_that_is_none_is_refused_with_the_names_of_those_that_are() {
    let parsed = Command::try_parse_from(["accuracy", "--out", "x", "--part", "weather"]);
    let message = parsed.err().expect("refused").to_string();
    assert!(message.contains("renderer") && message.contains("decoder"), "{message}");
}
