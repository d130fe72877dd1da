//! The reading of a receiver's last frame.

use std::io::{Read, Write};

use link::panel::LLR_STEP;
use rx_pipeline::standalone::{Answer, Request, WireReading};
use serde_json::{Value, json};

use super::ask;
use crate::device::Client;

/// The last reading of the panel; `None` while no panel is seen.
pub fn asked_reading<P: Read + Write>(client: &mut Client<P>, port: &str) -> anyhow::Result<Option<WireReading>> {
    ask(client, port, &Request::Reading, |answer| match answer {
        Answer::Reading(reading) => Some(reading),
        _ => None,
    })
}

/// The reading for scripts: soft values are ln(P(On)/P(Off)), LED by LED in the order of the bits.
pub fn reading_as_json(reading: Option<&WireReading>) -> Value {
    reading.map_or(Value::Null, |reading| {
        let soft = reading.soft.as_flattened().iter();
        json!({
            "frame": reading.frame,
            "bits": format!("{:016x}", reading.bits),
            "soft": soft.map(|&llr| f32::from(llr) * LLR_STEP).collect::<Vec<_>>(),
            "two_symbols": reading.is_mixed,
            "corners_px": reading.corners,
            "confidence": reading.confidence,
            "range_pitches": reading.range_pitches,
            "range_m": reading.range_m(),
        })
    })
}

/// The reading in one line, for `watch`.
pub fn reading_in_short(reading: &WireReading) -> String {
    let range = match reading.range_m() {
        Some(range_m) => format!("{range_m:.2} m"),
        None => format!("{:.1} times the distance between LEDs", reading.range_pitches),
    };
    format!(
        "frame {}: {:016x}, {:.3} sure{}, {range} away",
        reading.frame,
        reading.bits,
        reading.confidence,
        if reading.is_mixed { ", two symbols" } else { "" },
    )
}
