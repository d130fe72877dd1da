//! Reports on how frames arrive and how well panels are read, in the terms of ROS diagnostics.
//!
//! | status | OK | WARN | ERROR |
//! |---|---|---|---|
//! | `vocc: camera` | frames arrive | frames were dropped or unusable since the last report | no frame for three seconds |
//! | `vocc: panel 0` | it is read | it is followed, but read in less than half of the frames since the last report, or LEDs are broken | no panel is followed |
//!
//! A report is due with the first frame, once a second, when a panel is found or given up, and while the source is silent. Its values count
//! from the beginning, except `latency_s`, the longest since the last report.

use std::collections::BTreeMap;
use std::time::Duration;

use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::receiver::Loss;

use crate::event::PanelEvent;
use crate::reception::PanelReport;
use crate::{learnt, loss};

/// Interval between two reports while nothing changes.
const REPORT_EVERY: Duration = Duration::from_secs(1);
/// A source without a frame for this long is silent.
const SILENCE: Duration = Duration::from_secs(3);
/// Minimum share of the frames since the last report in which a panel is read, without a warning.
const READ_MIN: f64 = 0.5;

/// A level, by its number in `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Normal.
    Ok = 0,
    /// Degraded.
    Warn = 1,
    /// Not working.
    Error = 2,
}

/// The status of the camera or of a panel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// The level.
    pub level: Level,
    /// The subject: `vocc: camera`, `vocc: panel 0`.
    pub name: String,
    /// The reason for the level.
    pub message: String,
    /// The camera's name, or `panel_0`.
    pub hardware_id: String,
    /// Values such as counts, each with its key.
    pub values: Vec<(String, String)>,
}

impl Status {
    fn value(&mut self, key: impl Into<String>, value: impl ToString) {
        self.values.push((key.into(), value.to_string()));
    }
}

/// Counts of a reception, from which reports are made.
///
/// ```
/// use reception::diagnostics::{Diagnostics, Level};
/// let mut diagnostics = Diagnostics::new("camera");
/// diagnostics.count(&[]);
/// let report = diagnostics.report_if_due(0, &[]).expect("the first frame is reported");
/// assert_eq!((report[0].level, &report[0].message[..]), (Level::Ok, "frames arrive"));
/// assert_eq!(diagnostics.report_if_due(999_999_999, &[]), None);
/// ```
#[derive(Debug)]
pub struct Diagnostics {
    camera: String,
    frames: u64,
    dropped: u64,
    unusable: u64,
    panels: Vec<Panel>,
    latency: Option<Duration>,
    reported: Option<Reported>,
    /// The last whole second of silence that was reported.
    silent_s: Option<u64>,
}

/// The last report.
#[derive(Debug)]
struct Reported {
    time_ns: u64,
    followed: Vec<bool>,
    failures: u64,
}

/// Counts of one panel.
#[derive(Debug, Default)]
struct Panel {
    is_followed: bool,
    read: u64,
    lost: BTreeMap<&'static str, u64>,
    last_loss: Option<Loss>,
    messages: u64,
    broken: u64,
    /// Frames read and lost at the last report.
    before: [u64; 2],
}

impl Panel {
    /// Counts a frame, which was read if there is no loss.
    fn count(&mut self, loss: Option<&Loss>) {
        match loss {
            None => {
                if !self.is_followed {
                    // Frames before it was found do not count as lost.
                    self.before = self.frames();
                }
                self.is_followed = true;
                self.read += 1;
            }
            Some(why) => {
                // After other losses, a panel that is followed is still followed.
                self.is_followed &= !matches!(why, Loss::Locate(_) | Loss::NoPlace | Loss::Lost(_));
                *self.lost.entry(loss::name(why)).or_default() += 1;
                self.last_loss = Some(*why);
            }
        }
    }

    /// Frames in which it was read, and in which it was lost.
    fn frames(&self) -> [u64; 2] {
        [self.read, self.lost.values().sum()]
    }

    fn status(&self, number: usize) -> Status {
        let [read, lost] = self.frames();
        let [read_since, lost_since] = [read - self.before[0], lost - self.before[1]];
        let frames_since = read_since + lost_since;
        let broken = learnt::leds(self.broken);
        let why = self.last_loss.map_or_else(String::new, |why| format!(": {why}"));
        let mut level = Level::Ok;
        let mut message = format!("read in {read_since} of {frames_since} frames");
        if !self.is_followed {
            level = Level::Error;
            message = format!("no panel is followed{why}");
        } else if (read_since as f64) < READ_MIN * frames_since as f64 {
            level = Level::Warn;
            message += &why;
        }
        if self.is_followed && !broken.is_empty() {
            level = Level::Warn;
            message += &format!("; broken LEDs: {}", broken.len());
        }
        let mut status = Status {
            level,
            name: format!("vocc: panel {number}"),
            message,
            hardware_id: format!("panel_{number}"),
            values: Vec::new(),
        };
        status.value("frames_read", read);
        status.value("frames_lost", lost);
        for (name, count) in &self.lost {
            status.value(format!("lost_{name}"), count);
        }
        status.value("messages", self.messages);
        let broken: Vec<String> = broken.iter().map(usize::to_string).collect();
        status.value("broken_leds", broken.join(", "));
        status
    }
}

impl Diagnostics {
    /// Diagnostics of a camera of that name, without counts.
    pub fn new(camera: impl Into<String>) -> Self {
        Self {
            camera: camera.into(),
            frames: 0,
            dropped: 0,
            unusable: 0,
            panels: Vec::new(),
            latency: None,
            reported: None,
            silent_s: None,
        }
    }

    /// Counts a frame and its panels.
    pub fn count(&mut self, reports: &[PanelReport]) {
        self.frames += 1;
        for report in reports {
            self.panel(report.panel).count(report.reading.as_ref().err());
            report.events.iter().for_each(|event| self.count_event(report.panel, event));
        }
    }

    /// Counts a message that was completed after the last frame; other events are not counted.
    pub fn count_event(&mut self, panel: usize, event: &PanelEvent) {
        self.panel(panel).messages += u64::from(matches!(event, PanelEvent::Message(_)));
    }

    /// Counts frames that were dropped.
    pub fn count_dropped(&mut self, frames: u64) {
        self.dropped = self.dropped.saturating_add(frames);
    }

    /// Counts unusable frames.
    pub fn count_unusable(&mut self, frames: u64) {
        self.unusable = self.unusable.saturating_add(frames);
    }

    /// Adds the latency of a frame.
    pub fn add_latency(&mut self, latency: Duration) {
        self.latency = self.latency.max(Some(latency));
    }

    /// Whether nothing was counted.
    pub fn is_empty(&self) -> bool {
        self.frames == 0
    }

    /// A report at the time of the last frame, if one is due, with the estimates of each panel.
    pub fn report_if_due(&mut self, time_ns: u64, learnt: &[Option<CameraEstimate>]) -> Option<Vec<Status>> {
        self.is_due(time_ns).then(|| self.report(time_ns, learnt))
    }

    /// A report at the time of the last frame.
    pub fn report(&mut self, time_ns: u64, learnt: &[Option<CameraEstimate>]) -> Vec<Status> {
        for (panel, learnt) in self.panels.iter_mut().zip(learnt) {
            panel.broken = learnt.as_ref().map_or(0, |learnt| learnt.broken);
        }
        let failures = self.failures();
        let (level, message) = match failures - self.reported.as_ref().map_or(0, |reported| reported.failures) {
            0 => (Level::Ok, "frames arrive".into()),
            new => (
                Level::Warn,
                format!("frames that were dropped or unusable since the last report: {new}"),
            ),
        };
        let mut statuses = vec![self.camera(level, message)];
        statuses.extend(self.panels.iter().enumerate().map(|(number, panel)| panel.status(number)));
        for panel in &mut self.panels {
            panel.before = panel.frames();
        }
        self.latency = None;
        self.silent_s = None;
        self.reported = Some(Reported {
            time_ns,
            followed: self.followed().collect(),
            failures,
        });
        statuses
    }

    /// A report of a source from which no frame has come for some time, if one is due. It has the status of the camera alone.
    pub fn report_silence(&mut self, since: Duration) -> Option<Vec<Status>> {
        let silent_s = since.as_secs();
        if since < SILENCE || self.silent_s.is_some_and(|before| silent_s <= before) {
            return None;
        }
        self.silent_s = Some(silent_s);
        Some(vec![self.camera(Level::Error, format!("no frame for {silent_s} s"))])
    }

    fn is_due(&self, time_ns: u64) -> bool {
        self.silent_s.is_some()
            || self.reported.as_ref().is_none_or(|reported| {
                u128::from(time_ns.abs_diff(reported.time_ns)) >= REPORT_EVERY.as_nanos()
                    || !self.followed().eq(reported.followed.iter().copied())
            })
    }

    fn followed(&self) -> impl Iterator<Item = bool> {
        self.panels.iter().map(|panel| panel.is_followed)
    }

    fn failures(&self) -> u64 {
        self.dropped.saturating_add(self.unusable)
    }

    fn panel(&mut self, number: usize) -> &mut Panel {
        if self.panels.len() <= number {
            self.panels.resize_with(number + 1, Panel::default);
        }
        &mut self.panels[number]
    }

    fn camera(&self, level: Level, message: String) -> Status {
        let mut status = Status {
            level,
            name: "vocc: camera".into(),
            message,
            hardware_id: self.camera.clone(),
            values: Vec::new(),
        };
        status.value("frames", self.frames);
        status.value("frames_dropped", self.dropped);
        status.value("frames_unusable", self.unusable);
        if let Some(latency) = self.latency {
            status.value("latency_s", latency.as_secs_f64());
        }
        status
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rx_pipeline::receiver::TrackError;

    const COASTING: Loss = Loss::Coasting {
        missed: 1,
        patience: 9,
        why: TrackError::OutOfFrame,
    };

    /// Counts a frame of panel 0.
    fn count(diagnostics: &mut Diagnostics, loss: Option<Loss>) {
        diagnostics.count(&[]);
        diagnostics.panel(0).count(loss.as_ref());
    }

    fn levels(report: &[Status]) -> Vec<Level> {
        report.iter().map(|status| status.level).collect()
    }

    fn value<'a>(status: &'a Status, key: &str) -> Option<&'a str> {
        let found = status.values.iter().find(|(name, _)| name == key);
        found.map(|(_, value)| &value[..])
    }

    #[test]
    fn a_report_is_due_once_a_second_and_when_a_panel_comes_or_goes() {
        let mut diagnostics = Diagnostics::new("front");
        let mut reports = Vec::new();
        // 100 frames a second: no panel, a panel, which coasts for a moment and is given up.
        for k in 0..400_u64 {
            let loss = match k {
                0..10 => Some(Loss::NoPlace),
                150 => Some(COASTING),
                350.. => Some(Loss::Lost(TrackError::OutOfFrame)),
                _ => None,
            };
            count(&mut diagnostics, loss);
            if let Some(report) = diagnostics.report_if_due(k * 10_000_000, &[]) {
                reports.push((k, report[1].level));
            }
        }
        let expected = [
            (0, Level::Error),
            (10, Level::Ok),
            (110, Level::Ok),
            (210, Level::Ok),
            (310, Level::Ok),
            (350, Level::Error),
        ];
        assert_eq!(reports, expected);
        let last = diagnostics.report(4_000_000_000, &[]);
        assert_eq!(value(&last[0], "frames"), Some("400"));
        assert_eq!(value(&last[1], "frames_read"), Some("339"));
        assert_eq!(value(&last[1], "frames_lost"), Some("61"));
        for (reason, count) in [("lost_no_place", "10"), ("lost_coasting", "1"), ("lost_given_up", "50")] {
            assert_eq!(value(&last[1], reason), Some(count));
        }
    }

    #[test]
    fn a_panel_that_is_rarely_read_and_frames_that_are_lost_are_warnings() {
        let mut diagnostics = Diagnostics::new("front");
        count(&mut diagnostics, None);
        assert_eq!(levels(&diagnostics.report(0, &[])), [Level::Ok, Level::Ok]);
        [None, Some(COASTING), Some(COASTING)]
            .into_iter()
            .for_each(|loss| count(&mut diagnostics, loss));
        diagnostics.count_dropped(2);
        diagnostics.count_unusable(1);
        diagnostics.add_latency(Duration::from_millis(30));
        diagnostics.add_latency(Duration::from_millis(20));
        let report = diagnostics.report(1, &[]);
        assert_eq!(levels(&report), [Level::Warn, Level::Warn]);
        assert_eq!(report[0].message, "frames that were dropped or unusable since the last report: 3");
        assert_eq!(value(&report[0], "latency_s"), Some("0.03"));
        assert!(report[1].message.starts_with("read in 1 of 3 frames: coasting, frame 1 of 9"));
        count(&mut diagnostics, None);
        let report = diagnostics.report(2, &[]);
        assert_eq!(levels(&report), [Level::Ok, Level::Ok]);
        assert_eq!(
            (value(&report[0], "frames_dropped"), value(&report[0], "latency_s")),
            (Some("2"), None)
        );
    }

    #[test]
    fn a_silent_source_is_an_error_once_a_second_until_a_frame_comes() {
        let mut diagnostics = Diagnostics::new("front");
        count(&mut diagnostics, None);
        diagnostics.report(0, &[]);
        let silent = |diagnostics: &mut Diagnostics, ms| {
            let report = diagnostics.report_silence(Duration::from_millis(ms));
            report.map(|report| (levels(&report), report[0].message.clone()))
        };
        let error = |seconds: u64| Some((vec![Level::Error], format!("no frame for {seconds} s")));
        for (ms, expected) in [(2_999, None), (3_000, error(3)), (3_990, None), (4_010, error(4))] {
            assert_eq!(silent(&mut diagnostics, ms), expected);
        }
        count(&mut diagnostics, None);
        let report = diagnostics.report_if_due(1, &[]).expect("a frame after silence is reported");
        assert_eq!(levels(&report), [Level::Ok, Level::Ok]);
        assert_eq!(diagnostics.report_if_due(2, &[]), None);
    }
}
