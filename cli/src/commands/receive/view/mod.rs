//! `--view`: a page on this computer that shows the reception.
//!
//! The receiver hands each frame over in a buffer that is used again, under a lock that is never held while a picture is drawn or sent. One
//! thread draws the newest frame while a page is open, at most 16 a second, and one thread a connection sends it as Server-Sent
//! Events:
//!
//! | event | data |
//! |---|---|
//! | `source` | `name`, `is_live`, and `is_checked`: whether signatures are checked |
//! | `frame` | its number; `panels`, each as `--bits --json` prints it, or `why` it was not read; pictures; the `camera` as learnt |
//! | `message` | `report` and `proof`, as `--json` prints them, and `times`, the number of times that the message arrived |
//! | `remark` | `text`, as on standard error |
//! | `end` | `frames`, those in which a panel was `read`, `messages` and `latency`; `why`, if it is a fault |
//!
//! The page is the Receive tab of the project's own page (`page/web/receive.html` and the scripts that show the reception), linked into
//! `page` here. That page feeds the tab from a receiver in WebAssembly; this one feeds it from the events, and computes nothing.
//!
//! The server listens on 127.0.0.1 alone, answers GET alone, and refuses requests of another host or origin.

mod events;
mod picture;
mod request;
mod server;
mod snapshot;

use std::io::IsTerminal;
use std::net::{Ipv4Addr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use reception::PanelReport;
use reception::panel_pose::PanelPose;
use rx_pipeline::frame::Frame;
use serde_json::Value;

use crate::output::{self, Verdict};
use crate::stop::stop;

use events::Events;
pub use snapshot::Details;
use snapshot::Snapshot;

/// Maximum time for open pages to take the last events.
const LAST_EVENTS: Duration = Duration::from_secs(5);
/// The same after Ctrl-C.
const LAST_EVENTS_STOPPED: Duration = Duration::from_millis(200);
/// Interval between two checks of the stop flag.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Whether, and where, to serve the page.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ViewArguments {
    /// Show what is received on a page for browsers on this computer: the picture with the panel's outline, its bits, messages, pose and
    /// latency. Standard error has its address. --view=8080 sets the port; otherwise a free one is used.
    #[arg(
        long,
        value_name = "PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0",
        value_parser = port
    )]
    view: Option<u16>,
}

/// Parses a port, or an address on this computer.
fn port(text: &str) -> Result<u16, String> {
    let digits = text.strip_prefix("127.0.0.1:").unwrap_or(text);
    digits.parse().map_err(|_| {
        format!(
            "the page is on 127.0.0.1 alone: give a port from 1 to {}, or 0 for a free one",
            u16::MAX
        )
    })
}

impl ViewArguments {
    /// Whether the page is asked for.
    pub fn is_asked(&self) -> bool {
        self.view.is_some()
    }

    /// Takes the page's port, if the page is asked for.
    pub fn open(&self, sources: &[PathBuf]) -> anyhow::Result<Option<ViewPage>> {
        let Some(port) = self.view else {
            return Ok(None);
        };
        let is_port = |source: &&PathBuf| source.to_str().is_some_and(|text| text.parse::<u16>().is_ok()) && !source.exists();
        if let Some(port) = sources.iter().find(is_port) {
            bail!("there is no source {0}: write --view={0} if it is the page's port", port.display());
        }
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).with_context(|| {
            format!("cannot serve the page at 127.0.0.1:{port}: choose another port with --view=PORT, or a free one with --view")
        })?;
        let port = listener.local_addr().context("cannot serve the page")?.port();
        Ok(Some(ViewPage {
            listener,
            port,
            events: Arc::default(),
        }))
    }
}

/// The page's place.
pub struct ViewPage {
    listener: TcpListener,
    port: u16,
    events: Arc<Events>,
}

impl ViewPage {
    /// Serves the page, prints its address, and returns the receiver's side of it.
    pub fn serve(&self, source: &str, is_live: bool, is_checked: bool) -> anyhow::Result<Feed> {
        self.events.source(source, is_live, is_checked);
        let served = self.listener.try_clone();
        let served = served.and_then(|listener| server::serve(listener, self.port, Arc::clone(&self.events)));
        served.context("cannot serve the page")?;
        output::tell(format_args!("view: {}", self.address()));
        Ok(Feed {
            events: Arc::clone(&self.events),
            filling: Box::default(),
        })
    }

    fn address(&self) -> String {
        format!("http://{}/", request::host(self.port))
    }

    /// Gives open pages the time to take the last events. A person at a terminal may not have opened the page yet: that is waited for.
    pub fn end(self, answer: &anyhow::Result<Verdict>) {
        let stop = stop();
        self.events.end(answer.as_ref().err().map(output::explain).as_deref());
        let until = Instant::now() + LAST_EVENTS;
        while !stop.is_asked() && Instant::now() < until && !self.events.wait_for_pages(LOOK_EVERY) {}
        if stop.is_asked() {
            self.events.wait_for_pages(LAST_EVENTS_STOPPED);
        }
        if answer.is_err() || !std::io::stderr().is_terminal() || self.events.is_end_seen(Duration::ZERO) {
            return;
        }
        output::tell(format_args!("all is received: open {} to see it, or press Ctrl-C", self.address()));
        while !stop.is_asked() && !self.events.is_end_seen(LOOK_EVERY) {}
    }
}

/// The receiver's side of the page.
pub struct Feed {
    events: Arc<Events>,
    filling: Box<Snapshot>,
}

impl Feed {
    /// Begins a frame. The first one has number 0.
    pub fn begin(&mut self, number: u64) {
        self.events.count(number.saturating_add(1));
        self.filling.begin(number);
    }

    /// Shows a panel of this frame.
    pub fn panel(&mut self, report: PanelReport, panel_pose: &PanelPose) {
        self.filling.add(report, panel_pose.clone());
    }

    /// Shows the frame.
    pub fn frame(&mut self, frame: &Frame, details: Details) {
        self.filling.complete(frame, details);
        self.events.put(&mut self.filling);
    }

    /// Shows a message or the proof of one, as `--json` prints them.
    pub fn message(&self, report: &Value, is_proof: bool) {
        self.events.message(report, is_proof);
    }

    /// Shows a line of standard error.
    pub fn remark(&self, text: &str) {
        self.events.remark(text);
    }

    /// Shows the latencies at the end.
    pub fn latency(&self, latency: &Value) {
        self.events.latency(latency);
    }
}
