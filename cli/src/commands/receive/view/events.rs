//! The page's state, between the receiver and the browsers.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::snapshot::Snapshot;

/// Maximum number of different messages that a new page is shown.
const MESSAGES_MAX: usize = 64;
/// Maximum number of remarks that a new page is shown.
const REMARKS_MAX: usize = 16;
/// Minimum interval between two frames that are drawn.
const DRAW_EVERY: Duration = Duration::from_millis(60);

/// Everything to be shown.
#[derive(Default)]
pub struct Events {
    state: Mutex<State>,
    changed: Condvar,
    /// Number of frames so far.
    frames: AtomicU64,
}

#[derive(Default)]
struct State {
    /// A snapshot to fill.
    spare: Option<Box<Snapshot>>,
    /// The newest frame that has not been drawn.
    newest: Option<Box<Snapshot>>,
    is_drawing: bool,
    /// The last number of an event.
    number: u64,
    source: Option<Event>,
    messages: Vec<Message>,
    /// Messages so far (count).
    received: u64,
    remarks: VecDeque<(String, Event)>,
    frame: Option<Event>,
    /// Frames in which a panel was read (count).
    read: u64,
    latency: Value,
    end: Option<Event>,
    /// Open pages (count).
    watchers: usize,
    /// Whether any page was shown the end.
    is_end_seen: bool,
}

/// An event as browsers receive it, with its place in the order of events.
#[derive(Clone)]
struct Event {
    number: u64,
    text: Arc<str>,
}

/// A message of a panel, with the last report of it and of its proof.
struct Message {
    panel: Value,
    text: Value,
    hex: Value,
    times: u64,
    report: Value,
    proof: Value,
    event: Event,
}

/// The last event that a page has been shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct EventCursor(u64);

/// Events that are new to a page.
pub struct News {
    pub events: Vec<Arc<str>>,
    /// Whether it is the last.
    pub is_end: bool,
}

impl State {
    fn event(&mut self, name: &str, data: &Value) -> Event {
        self.numbered(as_text(name, data))
    }

    fn numbered(&mut self, text: Arc<str>) -> Event {
        self.number += 1;
        Event { number: self.number, text }
    }
}

/// An event as it is sent. JSON has no line ends in its texts.
fn as_text(name: &str, data: &Value) -> Arc<str> {
    format!("event: {name}\ndata: {data}\n\n").into()
}

impl Events {
    /// All locks are short: no picture is drawn or written as text, and nothing is sent, meanwhile.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    // The receiver.

    pub fn count(&self, frames: u64) {
        self.frames.store(frames, Ordering::Relaxed);
    }

    /// Makes a snapshot the newest and puts another one in its place, to be filled.
    pub fn put(&self, snapshot: &mut Box<Snapshot>) {
        self.change(|state| {
            state.read += u64::from(snapshot.is_read());
            let overtaken = state.newest.take().or_else(|| state.spare.take());
            state.newest = Some(std::mem::replace(snapshot, overtaken.unwrap_or_default()));
        });
    }

    /// Announces the source.
    pub fn source(&self, name: &str, is_live: bool, is_checked: bool) {
        self.change(|state| {
            let source = json!({ "name": name, "is_live": is_live, "is_checked": is_checked });
            state.source = Some(state.event("source", &source));
        });
    }

    /// Shows a message or the proof of one, as `--json` prints them.
    pub fn message(&self, report: &Value, is_proof: bool) {
        self.change(|state| {
            let [panel, text, hex] = ["panel", "message", "message_hex"].map(|key| report[key].clone());
            let known = state
                .messages
                .iter()
                .position(|message| message.panel == panel && message.text == text && message.hex == hex);
            // The last one is the newest.
            let mut message = known.map(|at| state.messages.remove(at)).unwrap_or_else(|| Message {
                panel,
                text,
                hex,
                times: 0,
                report: Value::Null,
                proof: Value::Null,
                event: Event {
                    number: 0,
                    text: "".into(),
                },
            });
            match is_proof {
                true => message.proof = report.clone(),
                // This message is not proven just because an earlier one with the same text was.
                false => {
                    (message.report, message.proof) = (report.clone(), Value::Null);
                    message.times += 1;
                    state.received += 1;
                }
            }
            let Message { times, report, proof, .. } = &message;
            let data = json!({ "times": times, "report": report, "proof": proof });
            message.event = state.event("message", &data);
            if state.messages.len() == MESSAGES_MAX {
                state.messages.remove(0);
            }
            state.messages.push(message);
        });
    }

    /// Shows a line that is also printed on standard error.
    pub fn remark(&self, text: &str) {
        self.change(|state| {
            state.remarks.retain(|(other, _)| other != text);
            if state.remarks.len() == REMARKS_MAX {
                state.remarks.pop_front();
            }
            let event = state.event("remark", &json!({ "text": text }));
            state.remarks.push_back((text.to_owned(), event));
        });
    }

    /// Keeps the latencies to show at the end.
    pub fn latency(&self, latency: &Value) {
        self.change(|state| state.latency = latency.clone());
    }

    /// Ends the events, with the reason if it is a fault.
    pub fn end(&self, why: Option<&str>) {
        self.change(|state| {
            let frames = self.frames.load(Ordering::Relaxed);
            let end = json!({
                "why": why, "frames": frames, "read": state.read, "messages": state.received, "latency": state.latency,
            });
            state.end = Some(state.event("end", &end));
        });
    }

    /// Waits until all open pages have been shown everything; whether they have.
    pub fn wait_for_pages(&self, patience: Duration) -> bool {
        let waited = self.changed.wait_timeout_while(self.lock(), patience, |state| state.watchers > 0);
        waited.unwrap_or_else(PoisonError::into_inner).0.watchers == 0
    }

    /// Whether a page was shown the end, within `patience`.
    pub fn is_end_seen(&self, patience: Duration) -> bool {
        let waited = self.changed.wait_timeout_while(self.lock(), patience, |state| !state.is_end_seen);
        waited.unwrap_or_else(PoisonError::into_inner).0.is_end_seen
    }

    // The thread that draws.

    /// Draws the newest frame again and again while a page is open.
    pub fn draw(&self) {
        loop {
            let nothing = |state: &mut State| state.newest.is_none() || state.watchers == 0;
            let mut state = self
                .changed
                .wait_while(self.lock(), nothing)
                .unwrap_or_else(PoisonError::into_inner);
            let Some(snapshot) = state.newest.take() else {
                continue;
            };
            state.is_drawing = true;
            drop(state);
            let begun = Instant::now();
            let text = as_text("frame", &snapshot.as_json());
            self.change(|state| {
                state.frame = Some(state.numbered(text));
                state.spare = Some(snapshot);
                state.is_drawing = false;
            });
            // Newer frames overtake this one meanwhile; the last one is drawn at once.
            let left = DRAW_EVERY.saturating_sub(begun.elapsed());
            let waited = self.changed.wait_timeout_while(self.lock(), left, |state| state.end.is_none());
            drop(waited);
        }
    }

    // The pages.

    /// Waits up to `patience` for something that was not shown yet, and marks it as shown.
    pub fn news(&self, shown: &mut EventCursor, patience: Duration) -> News {
        let until = Instant::now() + patience;
        let mut state = self.lock();
        loop {
            let is_new = |event: &&Event| event.number > shown.0;
            let mut events: Vec<&Event> = state.source.iter().filter(is_new).collect();
            events.extend(state.messages.iter().map(|message| &message.event).filter(is_new));
            events.extend(state.remarks.iter().map(|(_, event)| event).filter(is_new));
            events.extend(state.frame.iter().filter(is_new));
            // The last frame comes before the end.
            let is_whole = state.newest.is_none() && !state.is_drawing;
            let end = state.end.as_ref().filter(|_| is_whole);
            let left = until.saturating_duration_since(Instant::now());
            if events.is_empty() && end.is_none() && !left.is_zero() {
                state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
                continue;
            }
            events.sort_by_key(|event| event.number);
            events.extend(end);
            let is_end = end.is_some();
            let texts = events.iter().map(|event| Arc::clone(&event.text)).collect();
            shown.0 = events.iter().map(|event| event.number).fold(shown.0, u64::max);
            return News { events: texts, is_end };
        }
    }

    /// Counts an open page until the guard is dropped.
    pub fn watch(&self) -> Watcher<'_> {
        self.change(|state| state.watchers += 1);
        Watcher(self)
    }

    /// Marks the end as shown.
    pub fn see_end(&self) {
        self.change(|state| state.is_end_seen = true);
    }
}

/// An open page.
pub struct Watcher<'a>(&'a Events);

impl Drop for Watcher<'_> {
    fn drop(&mut self) {
        self.0.change(|state| state.watchers -= 1);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use rx_pipeline::frame::Frame;

    use super::*;

    fn texts(events: &Events, shown: &mut EventCursor) -> Vec<String> {
        let news = events.news(shown, Duration::ZERO);
        news.events.iter().map(|text| text.to_string()).collect()
    }

    #[test]
    fn buffers_are_used_again() {
        let events = Events::default();
        let mut filling = Box::<Snapshot>::default();
        let mut buffers = BTreeSet::new();
        for _ in 0..100 {
            buffers.insert(std::ptr::from_ref(&*filling));
            events.put(&mut filling);
        }
        assert_eq!(buffers.len(), 2);
    }

    #[test]
    fn a_page_that_takes_nothing_holds_nothing_up() {
        let events = Arc::new(Events::default());
        let drawn = Arc::clone(&events);
        std::thread::spawn(move || drawn.draw());
        let _watcher = events.watch();
        let mut filling = Box::<Snapshot>::default();
        let mut buffers = BTreeSet::new();
        for number in 0..10_000 {
            filling.begin(number);
            filling.complete(&Frame::new(&[90; 12], 4, 3).expect("a frame"), Default::default());
            buffers.insert(std::ptr::from_ref(&*filling));
            events.put(&mut filling);
        }
        // One is filled, one waits and one is drawn; a buffer that is freed may come again elsewhere.
        assert!(buffers.len() <= 4, "{} buffers", buffers.len());
    }

    #[test]
    fn a_page_is_shown_the_newest_messages_once() {
        let events = Events::default();
        let report = |number: usize| json!({ "panel": 0, "message": format!("line\nend {number}") });
        (0..2 * MESSAGES_MAX).for_each(|number| events.message(&report(number), false));
        let mut shown = EventCursor::default();
        let first = texts(&events, &mut shown);
        assert_eq!(first.len(), MESSAGES_MAX);
        assert!(first[0].contains(&format!("end {MESSAGES_MAX}\"")), "{}", first[0]);
        // One line each, whatever the text is.
        assert!(first.iter().all(|text| text.trim_end().lines().count() == 2));
        assert_eq!(texts(&events, &mut shown).len(), 0);
        // Messages that are no longer shown count, too.
        let all = Events::default();
        (0..2 * MESSAGES_MAX).for_each(|number| all.message(&report(number), false));
        all.end(None);
        let end = texts(&all, &mut EventCursor::default()).pop().expect("an end");
        assert!(end.contains(&format!("\"messages\":{}", 2 * MESSAGES_MAX)), "{end}");

        events.message(&report(MESSAGES_MAX + 1), false);
        events.message(
            &json!({ "panel": 0, "message": format!("line\nend {}", MESSAGES_MAX + 1), "verdict": "proven" }),
            true,
        );
        let again = texts(&events, &mut shown);
        assert_eq!(again.len(), 1);
        assert!(again[0].contains("\"times\":2") && again[0].contains("proven"), "{}", again[0]);

        (0..2 * REMARKS_MAX).for_each(|number| events.remark(&format!("remark {number}")));
        events.remark("remark 20");
        let remarks = texts(&events, &mut shown);
        assert_eq!(remarks.len(), REMARKS_MAX);
        assert!(remarks[REMARKS_MAX - 1].contains("remark 20"));
    }

    #[test]
    fn the_end_comes_after_the_last_frame() {
        let events = Arc::new(Events::default());
        let mut filling = Box::<Snapshot>::default();
        for number in 0..3 {
            filling.begin(number);
            filling.complete(&Frame::new(&[90; 12], 4, 3).expect("a frame"), Default::default());
            events.put(&mut filling);
        }
        events.end(None);
        let mut shown = EventCursor::default();
        // Nobody has watched, so nothing is drawn yet.
        let news = events.news(&mut shown, Duration::ZERO);
        assert!(news.events.is_empty() && !news.is_end);
        let drawn = Arc::clone(&events);
        std::thread::spawn(move || drawn.draw());
        let watcher = events.watch();
        let news = events.news(&mut shown, Duration::from_secs(60));
        assert!(news.is_end);
        let frame = news.events[0].strip_prefix("event: frame\ndata: ").expect("a frame");
        let frame: Value = serde_json::from_str(frame).expect("JSON");
        assert_eq!((&frame["frame"], &frame["size_px"]), (&2.into(), &json!([4, 3])));
        assert!(news.events[1].starts_with("event: end\n"), "{}", news.events[1]);
        assert!(!events.is_end_seen(Duration::ZERO));
        events.see_end();
        drop(watcher);
        assert!(events.wait_for_pages(Duration::from_secs(60)));
        assert!(events.is_end_seen(Duration::ZERO));
    }
}
