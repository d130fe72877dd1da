//! `vocc device watch` with a receiver: a line at each interval, and each message and each verdict once, as it arrives.

use std::io::{Read, Write};
use std::mem;
use std::time::{Duration, Instant};

use anyhow::Context;
use link::signing;
use reception::keys::add_verdict;
use rx_pipeline::standalone::{Status, WireReading};
use serde_json::{Value, json};
use studies::stop::Stop;

use super::reading::{asked_reading, reading_as_json, reading_in_short};
use super::{Message, as_json, asked_message, asked_status, message_as_json, short, text};
use crate::commands::device::Watch;
use crate::device::Client;
use crate::options::{Connection, SharedOptions};
use crate::output::{self, Verdict, line};
use crate::stop::stop;

/// Interval between checks for messages: shorter than the time in which another one can be completed.
const POLL: Duration = Duration::from_millis(250);
/// Interval between checks for a stop.
const NAP: Duration = Duration::from_millis(50);

/// Prints a line about the receiver at each interval, and each message and each verdict once, as it arrives. Earlier ones are not printed.
pub fn watch(client: Connection, arguments: &Watch, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let Watch { port, count, readings, .. } = arguments;
    let (stop, name) = (stop(), port.name());
    let client = &mut client.receiver().with_context(|| name.clone())?;
    let mut status = asked_status(client, &name)?;
    let mut news = MessageLog::since(&status, &asked_message(client, &name)?);
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
    match item {
        Item::Message(message, missed) => {
            if *missed > 0 {
                line(&format!("{missed} messages were missed before the next one: they came too fast"))?;
            }
            line(&format!("message {}: {}", message.count, text(&message.bytes)))
        }
        Item::Verdict(message) => line(&format!("verdict on message {}: {}", message.count, message.verdict)),
    }
}

/// A requested reading is printed at each interval; it is null while no panel is seen.
fn tell_json(status: &Status, item: Option<&Item>, reading: Option<&Option<WireReading>>) -> anyhow::Result<()> {
    let mut values = as_json(status);
    if let Some(reading) = reading {
        values["reading"] = reading_as_json(reading.as_ref());
    }
    values["message"] = Value::Null;
    match item {
        Some(Item::Message(message, missed)) => {
            values["message"] = message_as_json(message);
            values["message"]["missed"] = (*missed).into();
        }
        Some(Item::Verdict(message)) => {
            values["proof"] = json!({ "count": message.count });
            add_verdict(&mut values["proof"], &message.verdict);
        }
        None => {}
    }
    output::json(&values)
}

/// A new message or verdict.
pub(super) enum Item {
    /// A message, and the number of messages between the last printed one and this one, which the receiver no longer keeps.
    Message(Message, u32),
    /// Another verdict on the message that was printed last.
    Verdict(Message),
}

/// Keeps track of printed messages, by their numbers, and of the last verdict.
pub(super) struct MessageLog {
    count: u32,
    verdict: signing::Verdict,
    uptime_ms: u64,
}

impl MessageLog {
    /// The state for a receiver whose present message is old.
    pub fn since(status: &Status, message: &Message) -> Self {
        Self {
            count: message.count,
            verdict: message.verdict,
            uptime_ms: status.uptime_ms,
        }
    }

    /// The new message, if there is one, or the new verdict.
    pub fn fetch<P: Read + Write>(&mut self, client: &mut Client<P>, port: &str, status: &Status) -> anyhow::Result<Option<Item>> {
        if status.uptime_ms < self.uptime_ms {
            // The receiver has restarted and counts from 1.
            self.count = 0;
        }
        self.uptime_ms = status.uptime_ms;
        if status.counters.messages == 0 {
            return Ok(None);
        }
        // Another message may have arrived by the time of this answer.
        let message = asked_message(client, port)?;
        let count = mem::replace(&mut self.count, message.count);
        let verdict = mem::replace(&mut self.verdict, message.verdict);
        Ok(match message.count {
            0 => None,
            now if now != count => Some(Item::Message(message, now.saturating_sub(count).saturating_sub(1))),
            _ => (message.verdict != verdict).then_some(Item::Verdict(message)),
        })
    }
}
