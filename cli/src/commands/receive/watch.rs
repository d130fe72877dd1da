//! Reports on the camera and the panels, in the recording.

use std::time::{Duration, Instant};

use reception::diagnostics::Diagnostics;
use reception::{PanelEvent, PanelReport, Reception};

use super::report::Report;

/// Collects the counts of the reports.
pub struct Watch {
    diagnostics: Diagnostics,
    /// Arrival time of the last frame; `None` before the first.
    last: Option<Instant>,
}

impl Watch {
    pub fn new(camera: &str) -> Self {
        Self {
            diagnostics: Diagnostics::new(camera),
            last: None,
        }
    }

    /// Counts a frame.
    pub fn frame(&mut self, panels: &[PanelReport]) {
        self.diagnostics.count(panels);
        self.last = Some(Instant::now());
    }

    /// Counts an unusable frame.
    pub fn unusable(&mut self) {
        self.diagnostics.count_unusable(1);
    }

    /// Counts the events after the last frame.
    pub fn event(&mut self, panel: usize, event: &PanelEvent) {
        self.diagnostics.count_event(panel, event);
    }

    /// Records a report on a frame if one is due, with the frames dropped before it and its latency.
    pub fn record(&mut self, report: &mut Report, reception: &Reception, dropped: u64, latency: Option<Duration>) {
        let diagnostics = &mut self.diagnostics;
        diagnostics.count_dropped(dropped);
        latency.into_iter().for_each(|latency| diagnostics.add_latency(latency));
        let Some(time_ns) = report.recorded_ns() else { return };
        if let Some(statuses) = diagnostics.report_if_due(time_ns, reception.learnt_each()) {
            report.record(|recording| recording.diagnostics(&statuses));
        }
    }

    /// Records a report while no frame arrives, if one is due.
    pub fn silence(&mut self, report: &mut Report) {
        let since = self.last.map(|last| last.elapsed());
        if let Some(statuses) = since.and_then(|since| self.diagnostics.report_silence(since)) {
            report.record(|recording| recording.silence(&statuses));
        }
    }

    /// Records a report on all frames.
    pub fn finish(&mut self, report: &mut Report, reception: &Reception) {
        let diagnostics = &mut self.diagnostics;
        if let Some(time_ns) = report.recorded_ns().filter(|_| !diagnostics.is_empty()) {
            let statuses = diagnostics.report(time_ns, reception.learnt_each());
            report.record(|recording| recording.diagnostics(&statuses));
        }
    }
}
