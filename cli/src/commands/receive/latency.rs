//! Latency from a frame to its output, by stage.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::frames::waiting::Moment;

/// Bins per factor of two. A median is off by at most 2.2 %.
const BINS_AN_OCTAVE: f64 = 16.0;
/// Maximum error factor of a median.
#[cfg(test)]
const MEDIAN_FACTOR: f64 = 1.022;
/// Number of bins: up to 2⁴⁴ ns, nearly five hours.
const BINS: usize = 44 * 16;

/// Median and maximum of any number of durations, in constant memory.
#[derive(Clone, Debug)]
struct Durations {
    bins: Vec<u64>,
    count: u64,
    worst: Duration,
}

impl Default for Durations {
    fn default() -> Self {
        Self {
            bins: vec![0; BINS],
            count: 0,
            worst: Duration::ZERO,
        }
    }
}

impl Durations {
    fn add(&mut self, duration: Duration) {
        let bin = (duration.as_nanos().max(1) as f64).log2() * BINS_AN_OCTAVE;
        self.bins[(bin as usize).min(BINS - 1)] += 1;
        self.count += 1;
        self.worst = self.worst.max(duration);
    }

    fn median_s(&self) -> f64 {
        let mut below = 0;
        let middle = self.bins.iter().position(|count| {
            below += count;
            2 * below >= self.count
        });
        let middle_ns = ((middle.unwrap_or_default() as f64 + 0.5) / BINS_AN_OCTAVE).exp2();
        (middle_ns * 1e-9).min(self.worst.as_secs_f64())
    }

    fn as_json(&self) -> Value {
        match self.count {
            0 => Value::Null,
            _ => json!({ "median_s": self.median_s(), "worst_s": self.worst.as_secs_f64() }),
        }
    }

    fn as_text(&self) -> String {
        format!("{:.1} ms ({:.1})", 1e3 * self.median_s(), 1e3 * self.worst.as_secs_f64())
    }
}

/// Latency of a live source's frames. The stages of each frame add up to its time to text.
#[derive(Clone, Debug, Default)]
pub struct Latency {
    to_text: Durations,
    /// From the source's stamp to the arrival here, if the source's clock is the wall clock: camera, network and ffmpeg.
    source: Durations,
    /// From the arrival until the frame is taken from the queue.
    queue: Durations,
    /// Finding the panel, reading its bits, and output.
    reading: Durations,
    /// Symbols to messages.
    decoding: Durations,
    dropped: u64,
}

impl Latency {
    /// Adds a frame whose output is complete now: when its processing began, and the decoding time. Returns its latency; `None` for a
    /// film.
    pub fn add(&mut self, moment: &Moment, begun: Instant, decoding: Duration) -> Option<Duration> {
        self.dropped += moment.after_dropped;
        let arrival = moment.arrival?;
        let here = begun.elapsed();
        let queue = begun.saturating_duration_since(arrival.at);
        let source = moment.on_the_way();
        source.into_iter().for_each(|source| self.source.add(source));
        self.queue.add(queue);
        self.reading.add(here.saturating_sub(decoding));
        self.decoding.add(decoding);
        let to_text = source.unwrap_or_default() + queue + here;
        self.to_text.add(to_text);
        Some(to_text)
    }

    /// Time since a frame was taken, or since its arrival if that is unknown; `None` for a film.
    pub fn since(moment: &Moment) -> Option<Duration> {
        Some(moment.arrival?.at.elapsed() + moment.on_the_way().unwrap_or_default())
    }

    /// Whether any frame of a live source was added.
    pub fn is_known(&self) -> bool {
        self.to_text.count > 0
    }

    /// Dropped frames (count).
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    pub fn as_json(&self) -> Value {
        json!({
            "to_text": self.to_text.as_json(), "source": self.source.as_json(), "queue": self.queue.as_json(),
            "reading": self.reading.as_json(), "decoding": self.decoding.as_json(),
        })
    }

    pub fn as_text(&self) -> String {
        let from = if self.source.count > 0 { "stamp" } else { "arrival" };
        let source = match self.source.count {
            0 => String::new(),
            _ => format!("source {}, ", self.source.as_text()),
        };
        format!(
            "latency, median (and worst) of {} frames: {} from {from} to text: {source}queue {}, reading {}, decoding {}",
            self.to_text.count,
            self.to_text.as_text(),
            self.queue.as_text(),
            self.reading.as_text(),
            self.decoding.as_text()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::waiting::Arrival;

    #[test]
    fn medians_are_as_near_as_is_said() {
        for scale_ns in [1, 700, 40_000, 3_000_000, 12_345_678_901] {
            let mut durations = Durations::default();
            (1..=1001).for_each(|k| durations.add(Duration::from_nanos(scale_ns * k)));
            let median_s = 501.0 * scale_ns as f64 * 1e-9;
            let factor = durations.median_s() / median_s;
            assert!((1.0 / MEDIAN_FACTOR..MEDIAN_FACTOR).contains(&factor), "{scale_ns} ns: {factor}");
            assert_eq!(durations.worst, Duration::from_nanos(scale_ns * 1001));
        }
        let mut one = Durations::default();
        one.add(Duration::MAX);
        one.add(Duration::ZERO);
        assert!(one.median_s() < 2e-9);
    }

    #[test]
    fn parts_add_up() {
        let mut latency = Latency::default();
        assert!(!latency.is_known());
        let arrival = Arrival::now();
        let begun = arrival.at + Duration::from_millis(3);
        while begun.elapsed() < Duration::from_millis(5) {}
        let moment = Moment {
            arrival: Some(arrival),
            after_dropped: 7,
            ..Moment::default()
        };
        latency.add(&moment, begun, Duration::from_millis(1));
        let parts = [&latency.queue, &latency.reading, &latency.decoding].map(|part| part.worst);
        assert_eq!(latency.to_text.worst, parts.iter().sum());
        assert_eq!((parts[0], parts[2]), (Duration::from_millis(3), Duration::from_millis(1)));
        assert_eq!(latency.dropped(), 7);
        assert_eq!(latency.as_json()["source"], Value::Null);
    }
}
