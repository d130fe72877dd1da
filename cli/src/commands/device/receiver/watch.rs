//! `vocc device watch` with a receiver: a line at each interval, and each message once, as it arrives.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use anyhow::Context;
use rx_pipeline::standalone::{Status, WireReading};
use serde_json::Value;
use studies::stop::Stop;

use super::reading::{asked_reading, reading_as_json, reading_in_short};
use super::{Message, as_json, asked_message, asked_status, message_as_json, short, text};
use crate::commands::device::Watch;
use crate::device::Client;
use crate::options::{Connection, Shared};
use crate::output::{self, Verdict, line};
use crate::stop::stop;

/// Interval between checks for messages: shorter than the time in which another one can be completed.
const POLL: Duration = Duration::from_millis(250);
/// Interval between checks for a stop.
const NAP: Duration = Duration::from_millis(50);

/// Prints a line about the receiver at each interval, and each message once, as it arrives. Earlier messages are not printed.
pub fn watch(client: Connection, arguments: &Watch, shared: &Shared) -> anyhow::Result<Verdict> {
    let Watch { port, count, readings, .. } = arguments;
    let (stop, name) = (stop(), port.name());
    let client = &mut client.receiver().with_context(|| name.clone())?;
    let mut status = asked_status(client, &name)?;
    let mut news = News::since(&status);
    let mut told = 0;
    while !stop.is_asked() && !output::is_unread() && count.is_none_or(|count| told < count) {
        let due = Instant::now() + arguments.interval();
        let item = news.fetch(client, &name, &status)?;
        let reading = readings.then(|| asked_reading(client, &name)).transpose()?;
        if shared.json {
            tell_json(&status, item.as_ref(), reading.as_ref())?;
        } else {
            line(&short(&status))?;
            let reading = reading.iter().flatten();
            reading.map(reading_in_short).try_for_each(|told| line(&told))?;
            item.iter().try_for_each(tell)?;
        }
        told += 1;
        while *count != Some(told) && pause(&stop, due) {
            status = asked_status(client, &name)?;
            match news.fetch(client, &name, &status)? {
                Some(item) if shared.json => tell_json(&status, Some(&item), None)?,
                Some(item) => tell(&item)?,
                None => {}
            }
        }
        if *count != Some(told) && !stop.is_asked() {
            status = asked_status(client, &name)?;
        }
    }
    Ok(Verdict::Yes)
}

/// Waits until the next check for messages; returns whether that is before `due` and no stop was requested.
fn pause(stop: &Stop, due: Instant) -> bool {
    let until = due.min(Instant::now() + POLL);
    while !stop.is_asked() {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return until < due;
        }
        std::thread::sleep(NAP.min(left));
    }
    false
}

fn tell(item: &Item) -> anyhow::Result<()> {
    let Item { message, missed } = item;
    if *missed > 0 {
        line(&format!("{missed} messages came before the next one, too fast to be told"))?;
    }
    line(&format!("message {}: {}", message.count, text(&message.bytes)))
}

/// If the reading was requested, it is printed at each interval, as none while no panel is seen.
fn tell_json(status: &Status, item: Option<&Item>, reading: Option<&Option<WireReading>>) -> anyhow::Result<()> {
    let mut values = as_json(status);
    if let Some(reading) = reading {
        values["reading"] = reading_as_json(reading.as_ref());
    }
    values["message"] = item.map_or(Value::Null, |item| {
        let mut message = message_as_json(&item.message);
        message["missed"] = item.missed.into();
        message
    });
    output::json(&values)
}

/// A new message.
pub(super) struct Item {
    pub message: Message,
    /// Messages between the last printed one and this one, which the receiver no longer keeps.
    pub missed: u32,
}

/// Keeps track of printed messages, by their numbers.
pub(super) struct News {
    count: u32,
    uptime_ms: u64,
}

impl News {
    /// The state for a receiver whose present messages are old.
    pub fn since(status: &Status) -> Self {
        Self {
            count: status.counters.messages,
            uptime_ms: status.uptime_ms,
        }
    }

    /// The new message, if there is one.
    pub fn fetch<P: Read + Write>(&mut self, client: &mut Client<P>, port: &str, status: &Status) -> anyhow::Result<Option<Item>> {
        if status.uptime_ms < self.uptime_ms {
            // The receiver has restarted and counts from 1.
            self.count = 0;
        }
        self.uptime_ms = status.uptime_ms;
        if [0, self.count].contains(&status.counters.messages) {
            return Ok(None);
        }
        // Another message may have arrived by the time of this answer.
        let message = asked_message(client, port)?;
        let missed = message.count.saturating_sub(self.count).saturating_sub(1);
        self.count = message.count;
        Ok((message.count > 0).then_some(Item { message, missed }))
    }
}
