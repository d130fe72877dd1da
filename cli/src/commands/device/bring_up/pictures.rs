//! Diagnoses a board from a camera's view of the test panels.

use std::path::Path;

use anyhow::{Context, ensure};
use link::panel::SIDE;
use reception::bring_up::{Activity, Film, FilmError, Finding, Kit, diagnose};
use reception::stream::Stream;
use serde_json::{Value, json};

use crate::frames::PixelArguments;
use crate::frames::files;
use crate::frames::film;
use crate::frames::foreign;
use crate::frames::picture::PictureReader;
use crate::options::SharedOptions;
use crate::output::{self, Verdict, line};
use crate::progress::Progress;
use crate::stop::{Input, stop};

/// Reads the frames twice: first to locate the panel, then to diagnose it.
pub fn run(source: &Path, kit: Kit, pixels: PixelArguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let name = source.display().to_string();
    ensure!(
        source.exists(),
        "there is no {name}: give a film, or a folder of its frames or of one picture for each test panel"
    );
    if let Some(advice) = foreign::advice(source) {
        anyhow::bail!(advice);
    }
    ensure!(
        source.is_dir() || film::is_one(source),
        "{name} is one picture: give a film, or a folder of its frames or of one picture for each test panel"
    );
    let mut progress = Progress::endless("frames");
    let mut frames = 0;
    let mut count = || {
        frames += 1;
        progress.done(frames);
    };
    let mut activity: Option<Activity> = None;
    each_frame(source, pixels, |grey, width| {
        count();
        activity.get_or_insert_with(|| Activity::new(width)).add(grey, width)
    })?;
    if stop().is_asked() {
        return Ok(Verdict::No);
    }
    let read = activity.map_or(Err(FilmError::Few(0)), |activity| activity.region());
    let reading = match read {
        Err(error) => Err(error),
        Ok(region) => {
            let mut film = Film::of(region);
            each_frame(source, pixels, |grey, _| {
                count();
                film.add(grey)
            })?;
            if stop().is_asked() {
                return Ok(Verdict::No);
            }
            film.read()
        }
    };
    drop(progress);
    match reading {
        Ok(reading) => report(&name, &diagnose(&reading), reading.ramp.is_some(), kit, shared),
        Err(why) => {
            if shared.json {
                output::json(&json!({ "source": name, "found": false, "why": why.to_string(), "duty_seen": false, "findings": [] }))?;
            } else {
                line(&format!("{name}: no panel: {why}"))?;
            }
            Ok(Verdict::No)
        }
    }
}

/// Passes each frame's grey and its width to `take`.
fn each_frame(source: &Path, pixels: PixelArguments, mut take: impl FnMut(&[u8], usize) -> Result<(), FilmError>) -> anyhow::Result<()> {
    let stop = stop();
    if !source.is_dir() {
        let (film, bytes) = film::Film::open(source, false)?;
        let input = Input::new(bytes, stop).context("cannot read the film")?;
        let mut stream = match Stream::open(input, None, pixels.channel.unwrap_or_default()) {
            Ok(stream) => stream,
            Err(error) if error.is_short() => return film.end().and(Err(error.into())),
            Err(error) => return Err(error.into()),
        };
        let (width, _) = stream.size();
        loop {
            match stream.next_frame() {
                Ok(Some(grey)) => take(grey, width)?,
                Ok(None) => break,
                // A request to stop has truncated the input.
                Err(_) if stop.is_asked() => return Ok(()),
                Err(error) => return Err(error.into()),
            }
        }
        return film.end();
    }
    let pictures = files::by_time(&[source.to_path_buf()])?.files;
    let mut reader = PictureReader::new(pixels, None);
    reader.settle_white(pictures.iter().map(|picture| picture.path.as_path()), stop);
    for picture in &pictures {
        if stop.is_asked() {
            break;
        }
        let grey = reader.read(&picture.path)?.image;
        take(grey.as_raw(), grey.width() as usize).with_context(|| picture.path.display().to_string())?;
    }
    Ok(())
}

fn report(name: &str, findings: &[Finding], is_duty_seen: bool, kit: Kit, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    if shared.json {
        let findings: Vec<Value> = findings.iter().map(|finding| as_json(finding, kit)).collect();
        output::json(&json!({ "source": name, "found": true, "why": null, "duty_seen": is_duty_seen, "findings": findings }))?;
    } else if findings.is_empty() {
        line(&format!(
            "{name}: all {} LEDs follow the test panels, each at its place",
            SIDE * SIDE
        ))?;
    }
    if !shared.json {
        if !is_duty_seen {
            line(&format!("{name}: duty: not seen; film the first two parts of the test completely"))?;
        }
        for finding in findings {
            line(&format!("{name}: {finding}"))?;
            line(&format!("  look at: {}", finding.wire(kit)))?;
        }
    }
    Ok(if findings.is_empty() { Verdict::Yes } else { Verdict::No })
}

fn as_json(finding: &Finding, kit: Kit) -> Value {
    let mut value = json!({
        "finding": finding.name(),
        "places": finding.places(),
        "what": finding.to_string(),
        "wire": finding.wire(kit),
    });
    match *finding {
        Finding::Turned(orientation) => {
            value["quarter_turns"] = orientation.quarter_turns().into();
            value["mirrored"] = orientation.is_mirrored().into();
        }
        Finding::ChainShifted(by) => value["by"] = by.into(),
        Finding::OffLattice(_, off) => value["off_pitches"] = json!(off),
        Finding::NothingFollows { is_lit } => value["lit"] = is_lit.into(),
        _ => {}
    }
    value
}
