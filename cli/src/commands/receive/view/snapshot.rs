//! A frame as the page shows it.

use std::time::Duration;

use reception::panel_pose::PanelPose;
use reception::{PanelReport, learnt};
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::frame::Frame;
use serde_json::{Value, json};

use super::super::report::reading_json;
use super::picture::{self, Region};

/// Maximum side of a frame's picture.
const FRAME_SIDE_MAX: usize = 960;
/// Maximum side of a panel's picture.
const PANEL_SIDE_MAX: usize = 320;

/// A frame and its readings. It is filled again and again, without an allocation for the pixels.
#[derive(Default)]
pub struct Snapshot {
    number: u64,
    size: [usize; 2],
    grey: Vec<u8>,
    panels: Vec<(PanelReport, PanelPose)>,
    details: Details,
}

/// The details of a whole frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Details {
    pub symbol_rate_hz: f32,
    /// From the frame to its output, of a live source.
    pub latency: Option<Duration>,
    /// Frames of the source that were dropped so far (count).
    pub dropped: u64,
    /// The camera as learnt so far.
    pub learnt: Option<CameraEstimate>,
}

impl Snapshot {
    /// Begins another frame.
    pub fn begin(&mut self, number: u64) {
        self.number = number;
        self.panels.clear();
    }

    pub fn add(&mut self, report: PanelReport, panel_pose: PanelPose) {
        self.panels.push((report, panel_pose));
    }

    /// Completes it with the frame's pixels.
    pub fn complete(&mut self, frame: &Frame, details: Details) {
        self.size = [frame.width(), frame.height()];
        self.grey.clear();
        frame.rows().for_each(|row| self.grey.extend_from_slice(row));
        self.details = details;
    }

    pub fn is_read(&self) -> bool {
        self.panels.iter().any(|(report, _)| report.reading.is_ok())
    }

    /// The frame as JSON: each panel as `--bits` prints it, with its corners and an enlarged picture, or the reason why it was not read.
    pub fn as_json(&self) -> Value {
        let panels: Vec<Value> = self
            .panels
            .iter()
            .map(|(report, panel_pose)| self.panel(report, panel_pose))
            .collect();
        let Details {
            symbol_rate_hz,
            latency,
            dropped,
            learnt,
        } = self.details;
        json!({
            "frame": self.number, "size_px": self.size, "panels": panels, "symbol_rate_hz": symbol_rate_hz,
            "latency_s": latency.map(|latency| latency.as_secs_f64()), "dropped": dropped,
            "camera": learnt.as_ref().map(learnt::as_json),
            "picture": picture::as_json(&self.grey, self.size, Region::of(self.size), FRAME_SIDE_MAX),
        })
    }

    fn panel(&self, report: &PanelReport, panel_pose: &PanelPose) -> Value {
        let reading = match &report.reading {
            Ok(reading) => reading,
            Err(loss) => return json!({ "panel": report.panel, "why": loss.to_string() }),
        };
        let corners = reading.corners.points();
        let close = Region::around(&corners, self.size);
        let mut told = reading_json(self.number, report, reading, panel_pose);
        told["corners_px"] = json!(corners);
        told["orientation"] = json!(report.orientation.map(|orientation| orientation.to_string()));
        told["picture"] = close
            .and_then(|close| picture::as_json(&self.grey, self.size, close, PANEL_SIDE_MAX))
            .into();
        told
    }
}
