//! Shards, interruptions and stopping rules compared with one run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use properties::prelude::*;

use super::*;
use crate::monte_carlo::ChunkProgress;
use crate::stop::Stop;

/// Cells, some with enough errors soon and some never.
fn sweep(frames: u64, stop_errors: Option<u64>) -> Sweep {
    let text = format!(
        "frames = {frames}\ndetectors = [\"otsu\", \"kmeans\"]\n[set]\neffects.noise = \"on\"\npose.distance_m = \
         70\n[grid]\nambient.illuminance_lx = [50, 20000]"
    );
    let mut sweep = Sweep::from_toml("a plan", &text, &[]).unwrap().sweep;
    sweep.stop_errors = stop_errors;
    sweep
}

fn rare_events(frames: u64) -> Sweep {
    let text = format!(
        "frames = {frames}\nrare_events = true\ndetectors = [\"otsu\"]\n[set]\neffects.noise = \"on\"\npose.distance_m = \
         70\n[grid]\nambient.illuminance_lx = [20, 50]"
    );
    Sweep::from_toml("a plan", &text, &[]).unwrap().sweep
}

fn run(sweep: &Sweep, shard: Shard) -> Results {
    run_expecting(sweep, shard, None)
}

fn run_expecting(sweep: &Sweep, shard: Shard, expected: Option<&[u64]>) -> Results {
    let mut results = Results::new(sweep.clone());
    let done = Run::new(sweep, shard, expected)
        .and_then(|run| run.advance(&mut results, |_| true))
        .unwrap();
    assert!(done);
    results
}

fn merged(parts: impl IntoIterator<Item = Results>) -> Result<Results, ResultsError> {
    let mut parts = parts.into_iter();
    let mut merged = parts.next().unwrap();
    parts.try_for_each(|part| merged.merge(&part))?;
    merged.finish()
}

properties! {
    #![cases(6)]
    #[test]
    fn shards_in_any_order_are_one_run_byte_for_byte(
        stop in prop_oneof![Just(None), (1u64..9000).prop_map(Some)],
        order in (1u64..9).prop_flat_map(|count| Just((0..count).collect::<Vec<_>>()).prop_shuffle()),
    ) {
        let sweep = sweep(5000, stop);
        let whole = run(&sweep, Shard::WHOLE);
        let count = order.len() as u64;
        let expected = sweep.expected_frames().unwrap();
        let shard = |index| Shard::new(index, count).unwrap();
        let parts = order.into_iter().map(|index| run_expecting(&sweep, shard(index), Some(&expected)));
        let merged = merged(parts).unwrap();
        prop_assert_eq!(merged.to_json().unwrap(), whole.to_json().unwrap());
        prop_assert_eq!(merged.to_csv(), whole.to_csv());
    }
}

#[test]
fn swarms_add_up_from_shards_and_files() {
    let sweep = rare_events(1000);
    let whole = run(&sweep, Shard::WHOLE);
    let total = whole.total(1);
    assert_eq!((total.rare.swarms(), total.errors.frames()), (4, 0));
    assert!(total.rare.rate() > 0.0);
    let parts = (0..3).map(|index| {
        let part = run(&sweep, Shard::new(index, 3).unwrap());
        Results::from_json(&part.to_json().unwrap()).unwrap()
    });
    let merged = merged(parts).unwrap();
    assert_eq!(merged.to_json().unwrap(), whole.to_json().unwrap());
    for (swarms, word) in [("18446744073709551615", "swarms"), ("2", "256 frames")] {
        let damaged = whole.to_json().unwrap();
        let damaged = damaged.replacen("\"swarms\":1,", &format!("\"swarms\":{swarms},"), 1);
        let fault = Results::from_json(&damaged).map_err(|fault| fault.to_string());
        assert!(fault.as_ref().is_err_and(|text| text.contains(word)), "{fault:?}");
    }
    // No features were measured.
    let summary = whole.summary(0);
    assert_eq!([summary.bvar, summary.wvar, summary.b2w], [None; 3]);
    assert!(whole.to_csv().lines().nth(1).unwrap().contains(",,,"));
}

#[test]
fn levels_are_kept_as_soon_as_they_are_chosen_and_until_their_cell_is_done() {
    let sweep = rare_events(600);
    let whole = run(&sweep, Shard::WHOLE);
    let engine = Run::new(&sweep, Shard::WHOLE, None).unwrap();
    let mut begun = Results::new(sweep.clone());
    let mut news = 0;
    let ended = engine.advance(&mut begun, |_| {
        news += 1;
        news < 2
    });
    assert!(!ended.unwrap());
    let kept = begun.to_json().unwrap();
    assert!(kept.contains("\"levels\"") && begun.chunks_of(0) == 0, "{kept}");
    let mut resumed = Results::from_json(&kept).unwrap();
    assert_eq!(resumed, begun);
    let mut other = begun.clone();
    other.keep_levels(0, &[]);
    for results in [&mut resumed, &mut other] {
        assert!(engine.advance(results, |_| true).unwrap());
    }
    assert_eq!(resumed.to_json().unwrap(), whole.to_json().unwrap());
    // Existing levels are reused: without any, only counting would work.
    assert_ne!(other.total(0), whole.total(0));
    assert_eq!(other.total(1), whole.total(1));
}

#[test]
fn cells_end_where_they_have_enough_and_no_sooner() {
    let sweep = sweep(8000, Some(300));
    let results = run(&sweep, Shard::WHOLE);
    let (mut early, mut late) = (0, 0);
    for cell in 0..sweep.cells() {
        let ChunkProgress::Done(end) = results.standing(cell) else {
            panic!("cell {cell} is not done")
        };
        assert_eq!(results.chunks_of(cell), end);
        let errors = results.total(cell).errors;
        if errors.frames() < sweep.frames {
            early += 1;
            assert!(errors.errors() >= 300, "cell {cell}: {}", errors.errors());
        } else {
            late += 1;
        }
    }
    assert!(early > 0 && late > 0, "{early} ended early, {late} did not");
}

#[test]
fn interruptions_change_nothing() {
    let sweep = sweep(3000, Some(500));
    let whole = run(&sweep, Shard::WHOLE);
    let mut results = Results::new(sweep.clone());
    let engine = Run::new(&sweep, Shard::WHOLE, None).unwrap();
    let mut interruptions = 0;
    loop {
        let mut steps = 0;
        let done = engine.advance(&mut results, |_| {
            steps += 1;
            steps < 2
        });
        // As if the program had ended and started again.
        results = Results::from_json(&results.to_json().unwrap()).unwrap();
        if done.unwrap() {
            break;
        }
        interruptions += 1;
    }
    assert!(interruptions > 2, "{interruptions}");
    assert_eq!(results, whole);
}

#[test]
fn a_stop_at_any_moment_changes_nothing() {
    let sweep = sweep(3000, Some(500));
    let whole = run(&sweep, Shard::WHOLE);
    let mut results = Results::new(sweep.clone());
    let mut stops = 0;
    loop {
        // The first stop comes before the run, however long a thread waits.
        let flag: &AtomicBool = Box::leak(Box::new(AtomicBool::new(stops == 0)));
        let engine = Run::new(&sweep, Shard::WHOLE, None).unwrap();
        let timer = std::thread::spawn(move || {
            // Later each time, so that some chunk is finished at last.
            std::thread::sleep(Duration::from_millis(5 * stops));
            flag.store(true, Ordering::Relaxed);
        });
        let stopping = engine.until(Stop::at(flag));
        let is_done = stopping.advance(&mut results, |_| true).unwrap();
        timer.join().unwrap();
        if is_done {
            break;
        }
        stops += 1;
    }
    assert!(stops > 0);
    assert_eq!(results, whole);
}

#[test]
fn missing_doubled_and_foreign_shards_are_refused() {
    let sweep = sweep(1500, None);
    let part = |index| run(&sweep, Shard::new(index, 3).unwrap());
    let (a, b, c) = (part(0), part(1), part(2));
    let fault = |parts: Vec<&Results>| {
        let parts = parts.into_iter().cloned();
        merged(parts).unwrap_err().to_string()
    };
    assert!(fault(vec![&a, &c]).contains("missing"));
    assert!(fault(vec![&a, &b, &c, &b]).contains("once"));
    let mut other = sweep.clone();
    (other.seed, other.level) = (2, sim::accuracy::Level::Fine);
    let fault = fault(vec![&a, &b, &Results::new(other)]);
    assert!(fault.contains("seed, level"), "{fault}");
}

#[test]
fn damaged_files_are_refused() {
    let sweep = sweep(300, None);
    let text = run(&sweep, Shard::WHOLE).to_json().unwrap();
    let fault = |text: &str| Results::from_json(text).unwrap_err().to_string();
    for length in [0, 1, 10, text.len() / 2, text.len() - 1] {
        assert!(fault(&text[..length]).contains("not whole results"));
    }
    let format = text.replacen("\"format\":3", "\"format\":1", 1);
    assert!(fault(&format).contains("format 1"), "{}", fault(&format));
    let version = concat!("\"version\":\"", env!("CARGO_PKG_VERSION"), "\"");
    let version = text.replacen(version, "\"version\":\"0.0.7\"", 1);
    assert!(fault(&version).contains("version 0.0.7"));
    let cell = text.replacen("{\"cell\":1,", "{\"cell\":99,", 1);
    assert!(fault(&cell).contains("cell 99"), "{}", fault(&cell));
    let doubled = text.replacen("{\"cell\":1,", "{\"cell\":0,", 1);
    assert!(fault(&doubled).contains("once"), "{}", fault(&doubled));
    let frames = text.replacen("\"errors\":[", "\"errors\":[18446744073709551615,", 1);
    assert!(fault(&frames).contains("damaged"), "{}", fault(&frames));
    let beyond = text.replacen("\"first_chunk\":1,", "\"first_chunk\":7,", 1);
    assert!(fault(&beyond).contains("up to chunk 8"), "{}", fault(&beyond));
    let huge = text.replacen("\"frames\":300", "\"frames\":0", 1);
    assert!(fault(&huge).contains("frames = 0"), "{}", fault(&huge));
}

#[test]
fn results_that_were_edited_are_refused() {
    let mut noisy = sweep(300, None);
    noisy.scene = noisy.scene.with("a test", &["pose.distance_m=40".into()]).unwrap();
    let text = run(&noisy, Shard::WHOLE).to_json().unwrap();
    let without_errors = "\"errors\":[256]";
    assert!(text.contains(without_errors), "{text}");
    let edited = |counts: &str| text.replacen(without_errors, &format!("\"errors\":{counts}"), 1);
    let fault = |text: &str| Results::from_json(text).unwrap_err().to_string();
    for counts in ["[0]", "[255]", "[]", "[257]"] {
        let fault = fault(&edited(counts));
        assert!(fault.contains("damaged"), "{counts}: {fault}");
    }
    // The counts add up, but are others.
    let moved = edited("[255,1]");
    assert!(fault(&moved).contains("checksum"), "{}", fault(&moved));
    let (checked, checksum) = text.split_once(",\"checksum\"").unwrap();
    let bare = format!("{checked}}}");
    assert!(fault(&bare).contains("checksum"), "{checksum}");
    // The format before had none; its results are written with one.
    let before = bare.replacen("\"format\":3", "\"format\":2", 1);
    assert_eq!(Results::from_json(&before).unwrap().to_json().unwrap(), text);
    let before = before.replacen(without_errors, "\"errors\":[0]", 1);
    assert!(fault(&before).contains("do not add up"), "{}", fault(&before));
    // Blanks do not matter.
    let spaced = text.replace("\":", "\": ");
    assert_eq!(Results::from_json(&spaced).unwrap().to_json().unwrap(), text);
}

#[test]
fn parts_of_unequal_cells_take_about_equally_long() {
    let text = "frames = 100000\ndetectors = [\"otsu\", \"ml\"]\n[grid]\npose.distance_m = [30, 70]";
    let sweep = Sweep::from_toml("a plan", text, &[]).unwrap().sweep;
    let costs = sweep.check().unwrap();
    let of = |index| {
        let shard = Shard::new(index, 4).unwrap();
        let work = Run::new(&sweep, shard, None).unwrap().work().to_vec();
        let chunks = |work: &Work| (work.chunks.end - work.chunks.start) as f64;
        work.iter().map(|work| chunks(work) * costs[work.cell]).sum::<f64>()
    };
    let times: Vec<f64> = (0..4).map(of).collect();
    let mean = times.iter().sum::<f64>() / 4.0;
    assert!(times.iter().all(|time| (time / mean - 1.0).abs() < 0.01), "{times:?}");
}

#[test]
fn a_cell_that_cannot_be_read_says_why_and_the_others_go_on() {
    // Readable, less than 1 px, less than 1.5 px from LED to LED, and off the sensor.
    let text = "frames = 600\ndetectors = [\"otsu\"]\n[grid]\npose.distance_m = [50, 400, 170]\npose.x_m = [0, 100]";
    let sweep = Sweep::from_toml("a plan", text, &[]).unwrap().sweep;
    let whole = run(&sweep, Shard::WHOLE);
    let whole = whole.finish().unwrap();
    let why = |cell| whole.summary(cell).why_empty.unwrap_or_default();
    assert!(why(0).is_empty() && whole.summary(0).frames == 600);
    assert!(why(1).contains("the sensor has"), "{}", why(1));
    assert!(why(2).contains("at least 1 px"), "{}", why(2));
    assert!(why(4).contains("at least 1.5 px"), "{}", why(4));
    let table = whole.to_csv();
    let columns: Vec<usize> = table
        .lines()
        .map(|line| line.split("\"").next().unwrap().matches(',').count())
        .collect();
    assert!(columns.iter().all(|&count| count == columns[0]), "{table}");
    assert_eq!(Results::from_json(&whole.to_json().unwrap()).unwrap(), whole);
    let expected = sweep.expected_frames().unwrap();
    let parts = (0..3).map(|index| run_expecting(&sweep, Shard::new(index, 3).unwrap(), Some(&expected)));
    assert_eq!(merged(parts).unwrap().to_json().unwrap(), whole.to_json().unwrap());
}

#[test]
fn a_sweep_of_nothing_that_can_be_seen_is_refused() {
    let text = "frames = 600\n[grid]\npose.distance_m = [400, 500]";
    let sweep = Sweep::from_toml("a plan", text, &[]).unwrap().sweep;
    assert!(sweep.check().unwrap_err().to_string().contains("at least 1 px"));
}
