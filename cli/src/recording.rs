//! Recordings as [MCAP](https://mcap.dev) files, which Foxglove and the tools of ROS 2 open.
//!
//! | topic | type | content |
//! |---|---|---|
//! | `/camera/image` | `sensor_msgs/msg/CompressedImage` | each frame, as PNG |
//! | `/camera/camera_info` | `sensor_msgs/msg/CameraInfo` | with each frame, if the camera's calibration is known |
//! | `/diagnostics` | `diagnostic_msgs/msg/DiagnosticArray` | the camera and each panel: see [`reception::diagnostics`] |
//! | `/panel_0/outline` | `foxglove_msgs/msg/ImageAnnotations` | the panel's outline in the frame, and its bits |
//! | `/panel_0/pose` | `geometry_msgs/msg/PoseWithCovarianceStamped` | the panel's pose, while it is known |
//! | `/panel_0/message` | `std_msgs/msg/String` | each message, at the frame that completed it |
//! | `/panel_0/message_bytes` | `std_msgs/msg/UInt8MultiArray` | its bytes, which need not be text |
//! | `/panel_0/verdict` | `std_msgs/msg/String` | with `--trust`, the verdict on the message before |
//!
//! Further panels are `/panel_1` and so on. Poses are in the frame `camera`, or that of `--frame-id`: x right, y down, z forward, as for
//! cameras in ROS (REP 103); covariances of x, y, z in metres and of rotations about these axes in radians.
//!
//! A film's times are those of its frames, with the first at 0 or at `--start`. A live source's times are those of the wall clock: from the
//! source if it uses that clock, otherwise the frame's arrival. A live recording is readable with one second of delay as
//! `FILE.mcap.active`, which becomes `FILE.mcap` at the end.
//!
//! The same channels can be served to Foxglove, in addition to the recording or instead of it.

mod files;
mod foxglove;
mod mcap;
mod ros;

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use reception::diagnostics::Status;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Lens, Pose};
use rx_pipeline::receiver::FrameReading;

use self::files::Files;
pub use self::foxglove::PORT as FOXGLOVE_PORT;
use self::foxglove::Server;
use self::mcap::Schema;
use crate::frames::waiting::Arrival;
use ros::Ros;

/// Maximum duration of a live recording that can be lost.
const KEEP_EVERY: Duration = Duration::from_secs(1);
/// Maximum time of a first frame: the stamps of ROS 2 end in 2038.
const START_MAX_S: f64 = i32::MAX as f64;

/// How a recording is made.
#[derive(Clone, Debug, clap::Args)]
pub struct RecordingArguments {
    /// The frame of reference of the recording's images and poses.
    #[arg(long, default_value = "camera", value_name = "NAME", requires = "recordings")]
    frame_id: String,
    /// Time of a film's first frame in seconds since 1970, so that the recording merges with others. Default: 0. Live sources
    /// have their own times.
    #[arg(long, value_name = "UNIX_S", requires = "recordings", value_parser = start)]
    start: Option<Duration>,
    /// Maximum size of a recording's file in bytes, with suffix k, M or G for thousands, millions or billions, such as 200M: FILE.mcap,
    /// then FILE-0001.mcap and so on, each complete. A larger frame has a file of its own.
    #[arg(long, value_name = "BYTES", requires = "mcap", value_parser = files::max_size)]
    max_size: Option<u64>,
}

impl RecordingArguments {
    /// Time of a film's first frame, if given.
    pub fn start(&self) -> Option<Duration> {
        self.start
    }

    /// The frame of reference, which names the camera.
    pub fn frame_id(&self) -> &str {
        &self.frame_id
    }
}

/// Parses seconds since 1970: decimals to the nanosecond, which an `f64` does not hold.
fn start(text: &str) -> Result<Duration, String> {
    let start_s = text.parse().ok().filter(|start_s| (0.0..=START_MAX_S).contains(start_s));
    let start_s = start_s.ok_or_else(|| format!("give 0 to {START_MAX_S} seconds, as printed by `date +%s.%N`"))?;
    let (seconds, decimals) = text.split_once('.').unwrap_or((text, ""));
    Ok(match (seconds.parse(), format!("{decimals:0<9.9}").parse()) {
        (Ok(seconds), Ok(nanoseconds)) => Duration::new(seconds, nanoseconds),
        _ => Duration::from_secs_f64(start_s),
    })
}

/// A recording of frames, panels and messages: into files, for Foxglove, or both.
pub struct Recording {
    files: Option<Files>,
    server: Option<Server>,
    image: u16,
    /// Created with the first frame whose lens is known.
    camera_info: Option<u16>,
    panels: Vec<Panel>,
    diagnostics: u16,
    arguments: RecordingArguments,
    /// Time of the current frame.
    time_ns: u64,
    /// Time of the last flush; `None` for a film.
    kept: Option<Instant>,
}

/// A panel's channels.
struct Panel {
    outline: u16,
    pose: u16,
    message: u16,
    bytes: u16,
    /// `None` if signatures are not checked.
    verdict: Option<u16>,
}

impl Recording {
    /// A recording into files from `path` on, for Foxglove at `port`, or both; `None` if neither is asked for. Files of a live one can be
    /// read while they grow.
    pub fn open(
        path: Option<&Path>,
        port: Option<u16>,
        panels: usize,
        with_verdicts: bool,
        arguments: &RecordingArguments,
        is_live: bool,
    ) -> anyhow::Result<Option<Self>> {
        let files = path.map(|path| Files::create(path, arguments.max_size, is_live)).transpose()?;
        let server = port.map(Server::at).transpose()?;
        if files.is_none() && server.is_none() {
            return Ok(None);
        }
        let kept = (is_live && files.is_some()).then(Instant::now);
        let mut recording = Self {
            files,
            server,
            image: 0,
            camera_info: None,
            panels: Vec::new(),
            diagnostics: 0,
            arguments: arguments.clone(),
            time_ns: 0,
            kept,
        };
        recording.image = recording.channel_of::<ros::CompressedImage>("/camera/image");
        for number in 0..panels {
            let panel = Panel {
                outline: recording.channel_of::<ros::ImageAnnotations>(&format!("/panel_{number}/outline")),
                pose: recording.channel_of::<ros::PoseWithCovarianceStamped>(&format!("/panel_{number}/pose")),
                message: recording.channel_of::<ros::Text>(&format!("/panel_{number}/message")),
                bytes: recording.channel_of::<ros::Bytes>(&format!("/panel_{number}/message_bytes")),
                verdict: with_verdicts.then(|| recording.channel_of::<ros::Text>(&format!("/panel_{number}/verdict"))),
            };
            recording.panels.push(panel);
        }
        recording.diagnostics = recording.channel_of::<ros::DiagnosticArray>("/diagnostics");
        recording.server.as_ref().map_or(Ok(()), Server::open)?;
        Ok(Some(recording))
    }

    /// Adds a channel for messages of one type. Files and server use the same channel numbers.
    fn channel_of<Message: Ros>(&mut self, topic: &str) -> u16 {
        let schema = Schema {
            name: Message::NAME,
            definition: Message::DEFINITION,
        };
        let served = self.server.as_ref().map(|server| server.channel(topic, &schema));
        let written = self.files.as_mut().map(|files| files.channel(topic, schema));
        written.or(served).unwrap_or_default()
    }

    /// Whether messages of a channel are needed.
    fn is_wanted(&self, channel: u16) -> bool {
        self.files.is_some() || self.server.as_ref().is_some_and(|server| server.is_wanted(channel))
    }

    /// Records a frame taken `time_s` after the first, or `unix` since 1970, and its lens if known.
    pub fn frame(&mut self, time_s: f64, unix: Option<Duration>, frame: &Frame, lens: Option<&Lens>) -> anyhow::Result<()> {
        if let Some(files) = &mut self.files {
            files.end_frame()?;
        }
        self.keep_up()?;
        self.time_ns = match unix {
            Some(unix) => unix.as_nanos() as u64,
            None => (self.arguments.start.unwrap_or_default().as_nanos() as u64) + (time_s * 1e9).round().max(0.0) as u64,
        };
        let size = [frame.width(), frame.height()].map(|side| side as u32);
        if self.is_wanted(self.image) {
            self.image(frame, size)?;
        }
        let Some(lens) = lens else {
            return Ok(());
        };
        let channel = self.camera_info;
        let channel = channel.unwrap_or_else(|| self.channel_of::<ros::CameraInfo>("/camera/camera_info"));
        self.camera_info = Some(channel);
        let camera_info = self.encoded(&ros::CameraInfo::of(self.header(), size, lens))?;
        self.put(channel, &camera_info)
    }

    fn image(&mut self, frame: &Frame, size: [u32; 2]) -> anyhow::Result<()> {
        let pixels: Vec<u8> = frame.rows().flatten().copied().collect();
        let mut data = Vec::new();
        PngEncoder::new_with_quality(&mut data, CompressionType::Fast, FilterType::Sub).write_image(
            &pixels,
            size[0],
            size[1],
            ExtendedColorType::L8,
        )?;
        let header = self.header();
        let format = "mono8; png compressed";
        let image = self.encoded(&ros::CompressedImage { header, format, data })?;
        self.put(self.image, &image)
    }

    /// Flushes a live recording if the interval has passed.
    pub fn keep_up(&mut self) -> anyhow::Result<()> {
        if let Some(kept) = &mut self.kept
            // Before the first frame there is nothing to flush.
            && self.time_ns > 0
            && kept.elapsed() >= KEEP_EVERY
        {
            *kept = Instant::now();
            if let Some(files) = &mut self.files {
                files.keep()?;
            }
        }
        Ok(())
    }

    /// Records a panel's reading in the current frame.
    pub fn reading(&mut self, panel: usize, reading: &FrameReading, pose: Option<&Pose>) -> anyhow::Result<()> {
        let Some(&Panel {
            outline, pose: channel, ..
        }) = self.panels.get(panel)
        else {
            return Ok(());
        };
        let bits = reading.detection.bits.to_string();
        let stamp = self.header().stamp;
        self.write(outline, &ros::ImageAnnotations::outline(stamp, &reading.corners, bits))?;
        match pose {
            Some(pose) => {
                let pose = self.encoded(&ros::PoseWithCovarianceStamped::of(self.header(), pose))?;
                self.put(channel, &pose)
            }
            None => Ok(()),
        }
    }

    /// Records a message that the current frame completed.
    pub fn message(&mut self, panel: usize, message: &[u8]) -> anyhow::Result<()> {
        let Some(&Panel { message: text, bytes, .. }) = self.panels.get(panel) else {
            return Ok(());
        };
        let data = &String::from_utf8_lossy(message);
        self.write(text, &ros::Text { data })?;
        self.write(bytes, &ros::Bytes::of(message))
    }

    /// Records the verdict on a panel's last message.
    pub fn verdict(&mut self, panel: usize, verdict: &str) -> anyhow::Result<()> {
        match self.panels.get(panel).and_then(|panel| panel.verdict) {
            Some(channel) => self.write(channel, &ros::Text { data: verdict }),
            None => Ok(()),
        }
    }

    /// Time of the current frame, in nanoseconds.
    pub fn time_ns(&self) -> u64 {
        self.time_ns
    }

    /// Records the status of the camera and the panels, at the current frame.
    pub fn diagnostics(&mut self, statuses: &[Status]) -> anyhow::Result<()> {
        let report = self.encoded(&ros::DiagnosticArray::of(self.header(), statuses))?;
        self.put(self.diagnostics, &report)
    }

    /// Records the status of a live source that is silent, at the time of the wall clock.
    pub fn silence(&mut self, statuses: &[Status]) -> anyhow::Result<()> {
        self.time_ns = Arrival::now().unix.as_nanos() as u64;
        self.diagnostics(statuses)
    }

    /// Renames the file into place.
    ///
    /// # Errors
    /// If not every byte can be written; a previous file is then unchanged, and also if no frame of a live source came.
    pub fn finish(&mut self) -> anyhow::Result<()> {
        match self.files.take() {
            Some(files) if self.kept.is_none() || self.time_ns > 0 => files.finish(),
            _ => Ok(()),
        }
    }

    /// Continues without files; returns whether anything is left to do.
    pub fn drop_files(&mut self) -> bool {
        self.kept = None;
        self.files.take().is_some() && self.server.is_some()
    }

    /// Context for its errors.
    pub fn about(&self) -> String {
        match &self.files {
            Some(files) => format!("cannot write {}", files.path().display()),
            None => "cannot serve Foxglove".into(),
        }
    }

    fn header(&self) -> ros::Header<'_> {
        ros::Header::at(self.time_ns, &self.arguments.frame_id)
    }

    fn encoded(&self, message: &impl Ros) -> anyhow::Result<Vec<u8>> {
        cdr::serialize::<_, _, cdr::CdrLe>(message, cdr::Infinite).context("a message cannot be written")
    }

    fn put(&mut self, channel: u16, encoded: &[u8]) -> anyhow::Result<()> {
        if let Some(server) = &self.server {
            server.message(channel, self.time_ns, encoded);
        }
        match &mut self.files {
            Some(files) => files.message(channel, self.time_ns, encoded),
            None => Ok(()),
        }
    }

    fn write(&mut self, channel: u16, message: &impl Ros) -> anyhow::Result<()> {
        let encoded = self.encoded(message)?;
        self.put(channel, &encoded)
    }
}
