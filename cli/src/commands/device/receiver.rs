//! `vocc device` with a standalone receiver.

use std::io::{Read, Write};
use std::path::PathBuf;

use anyhow::{Context, ensure};
use link::signing;
use reception::bytes::hex_if_no_text;
use reception::keys::add_verdict;
use rx_pipeline::standalone::{self, CameraSettings, Request, Status};
use serde_json::{Value, json};

use crate::device::Client;
use crate::options::{Connection, Port, SharedOptions};
use crate::output::{self, Verdict, line};
use crate::pictures::write_png;

mod reading;
mod watch;

use reading::{asked_reading, reading_as_json, reading_in_short};
pub use watch::watch;

/// Arguments of `vocc device snapshot`.
#[derive(clap::Args)]
pub struct Snapshot {
    #[command(flatten)]
    port: Port,
    /// The PNG file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// A message received from the board.
struct Message {
    count: u32,
    bytes: Vec<u8>,
    age_ms: u64,
    frames: u32,
    corrected_bits: u32,
    verdict: signing::Verdict,
}

/// A whole picture.
struct Picture {
    frame: u64,
    size: [u16; 2],
    origin: [u16; 2],
    step: u8,
    grey: Vec<u8>,
}

/// Prints the receiver's state, its camera's settings, its last message and its reading.
pub fn status(client: Connection, port: &Port, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let name = port.name();
    let client = &mut client.receiver().with_context(|| name.clone())?;
    let mut values = as_json(&asked_status(client, &name)?);
    let camera = ask(client, &name, &Request::Camera, |answer| match answer {
        standalone::Answer::Camera(camera) => Some(camera),
        _ => None,
    })?;
    values["camera"] = camera_as_json(&camera);
    let message = asked_message(client, &name)?;
    values["message"] = message_as_json(&message);
    let reading = asked_reading(client, &name)?;
    values["reading"] = if shared.json {
        reading_as_json(reading.as_ref())
    } else {
        reading.as_ref().map(reading_in_short).into()
    };
    values["port"] = name.into();
    values["board"] = client.identity().board.clone().into();
    values["firmware"] = client.identity().firmware.clone().into();
    if shared.json {
        output::json(&values)?;
        return Ok(Verdict::Yes);
    }
    for (key, value) in values.as_object().into_iter().flatten() {
        let value = match value {
            Value::String(text) => text.clone(),
            Value::Null => "none".into(),
            other => other.to_string(),
        };
        line(&format!("{key:<16} {value}"))?;
    }
    Ok(Verdict::Yes)
}

/// The symbol rate that the receiver expects, after setting it if `wanted`.
pub fn rate(client: Connection, port: &Port, wanted: Option<f64>) -> anyhow::Result<f64> {
    let name = port.name();
    set_rate(&mut client.receiver().with_context(|| name.clone())?, &name, wanted)
}

fn set_rate<P: Read + Write>(client: &mut Client<P>, port: &str, wanted: Option<f64>) -> anyhow::Result<f64> {
    if let Some(hz) = wanted {
        let millihertz = (hz * 1e3).round();
        ensure!(
            (1.0..=f64::from(u32::MAX)).contains(&millihertz),
            "{hz} symbols a second cannot be read: give at least 0.001, and at most the frame rate of the receiver's camera"
        );
        let request = Request::SetSymbolRate {
            millihertz: millihertz as u32,
        };
        ask(client, port, &request, |answer| (answer == standalone::Answer::Done).then_some(()))?;
    }
    Ok(f64::from(asked_status(client, port)?.symbol_millihertz) / 1e3)
}

/// Writes the camera's picture.
pub fn snapshot(arguments: &Snapshot, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let Snapshot { port, out } = arguments;
    let mut client = port.greet_receiver()?;
    let picture = fetch(&mut client, &port.name())?;
    let [width, height] = picture.size.map(usize::from);
    write_png(out, &picture.grey, width, height)?;
    if shared.json {
        output::json(&json!({
            "file": out,
            "frame": picture.frame,
            "width": width,
            "height": height,
            "origin": picture.origin,
            "step": picture.step,
        }))?;
    } else {
        let [x, y] = picture.origin;
        line(&format!(
            "{}: {width} × {height} pixels of frame {}, from column {x} and row {y} on, every {}",
            out.display(),
            picture.frame,
            if picture.step == 1 {
                "one".into()
            } else {
                format!("{}th", picture.step)
            },
        ))?;
    }
    Ok(Verdict::Yes)
}

/// Fetches a picture in parts; restarts if another one has replaced it.
fn fetch<P: Read + Write>(client: &mut Client<P>, port: &str) -> anyhow::Result<Picture> {
    const ATTEMPTS: usize = 4;
    for _ in 0..ATTEMPTS {
        let mut picture: Option<Picture> = None;
        loop {
            let offset = picture.as_ref().map_or(0, |picture| picture.grey.len());
            let request = Request::Picture { offset: offset as u32 };
            let part = ask(client, port, &request, |answer| match answer {
                standalone::Answer::Picture(part) if part.offset == request_offset(&request) => Some(Picture {
                    frame: part.frame,
                    size: part.size,
                    origin: part.origin,
                    step: part.step,
                    grey: part.bytes.to_vec(),
                }),
                _ => None,
            })?;
            let is_end = part.grey.is_empty();
            let whole = picture.get_or_insert_with(|| Picture { grey: Vec::new(), ..part });
            if whole.frame != part.frame || whole.size != part.size {
                break;
            }
            whole.grey.extend(part.grey);
            let [width, height] = whole.size.map(usize::from);
            if whole.grey.len() == width * height {
                return picture.context("there is a picture");
            }
            ensure!(
                !is_end && whole.grey.len() < width * height,
                "{port}: the parts of the picture do not add up to its size: update the older side"
            );
        }
    }
    anyhow::bail!("{port}: the picture changed during the transfer, {ATTEMPTS} times: use a faster connection")
}

fn request_offset(request: &Request) -> u32 {
    match request {
        Request::Picture { offset } => *offset,
        _ => 0,
    }
}

fn asked_status<P: Read + Write>(client: &mut Client<P>, port: &str) -> anyhow::Result<Status> {
    ask(client, port, &Request::Status, |answer| match answer {
        standalone::Answer::Status(status) => Some(status),
        _ => None,
    })
}

fn asked_message<P: Read + Write>(client: &mut Client<P>, port: &str) -> anyhow::Result<Message> {
    ask(client, port, &Request::Message, |answer| match answer {
        standalone::Answer::Message(message) => Some(Message {
            count: message.count,
            bytes: message.bytes.to_vec(),
            age_ms: message.age_ms,
            frames: message.frames,
            corrected_bits: message.corrected_bits,
            verdict: message.verdict,
        }),
        _ => None,
    })
}

fn ask<P: Read + Write, R>(
    client: &mut Client<P>,
    port: &str,
    request: &Request,
    read: impl Fn(standalone::Answer<'_>) -> Option<R>,
) -> anyhow::Result<R> {
    client.ask(request, read).with_context(|| port.to_owned())
}

fn state(status: &Status) -> &'static str {
    if status.is_following { "following" } else { "searching" }
}

fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) if !text.chars().any(char::is_control) => text.into(),
        _ => bytes.escape_ascii().to_string(),
    }
}

/// A status line for `watch`.
fn short(status: &Status) -> String {
    let counters = &status.counters;
    format!(
        "{:>8.1} s  {}  confidence {:.3}  {} frames, {} read, {} missed, {} cut short  {} messages  {:.1} ms a frame{}",
        status.uptime_ms as f64 / 1e3,
        state(status),
        status.confidence,
        counters.frames,
        counters.readings,
        counters.passed_by,
        counters.cut_short,
        counters.messages,
        f64::from(status.frame_us) / 1e3,
        status
            .trouble
            .map(|trouble| format!("  fault: {}", trouble.fault))
            .unwrap_or_default(),
    )
}

fn as_json(status: &Status) -> Value {
    let counters = &status.counters;
    json!({
        "uptime_s": status.uptime_ms as f64 / 1e3,
        "state": state(status),
        "fault": status.trouble.map(|trouble| trouble.fault.to_string()),
        "fault_since_s": status.trouble.map(|trouble| trouble.since_ms as f64 / 1e3),
        "was_reset": status.was_reset,
        "corners_px": status.corners,
        "confidence": status.confidence,
        "symbol_rate_hz": f64::from(status.symbol_millihertz) / 1e3,
        "frame_us": status.frame_us,
        "longest_frame_us": status.longest_us,
        "stack_bytes": status.stack_bytes,
        "frames": counters.frames,
        "passed_by": counters.passed_by,
        "cut_short": counters.cut_short,
        "readings": counters.readings,
        "found": counters.found,
        "lost": counters.lost,
        "messages": counters.messages,
        "corrected_bits": counters.corrected_bits,
        "camera_starts": counters.starts,
        "requests": counters.requests,
        "bad_frames": counters.bad_frames,
    })
}

fn camera_as_json(camera: &CameraSettings) -> Value {
    json!({
        "size_px": camera.size,
        "frames_hz": 1e6 / f64::from(camera.period_us),
        "exposure_lines": camera.lines,
        "exposure_s": f64::from(camera.exposure_us) * 1e-6,
        "gain": 1u32.checked_shl(camera.gain_log2.into()),
        "bright_grey": camera.levels[0],
        "dark_grey": camera.levels[1],
    })
}

fn message_as_json(message: &Message) -> Value {
    if message.count == 0 {
        return Value::Null;
    }
    let mut told = json!({
        "count": message.count,
        "text": text(&message.bytes),
        "age_s": message.age_ms as f64 / 1e3,
        "frames": message.frames,
        "corrected_bits": message.corrected_bits,
    });
    add_verdict(&mut told, &message.verdict);
    if let Some(hex) = hex_if_no_text(&message.bytes) {
        told["message_hex"] = hex.into();
    }
    told
}

#[cfg(test)]
mod tests;
