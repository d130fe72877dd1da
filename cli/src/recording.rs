//! What is received, as an [MCAP](https://mcap.dev) file, which Foxglove and the tools of ROS 2 open.
//!
//! | topic | type | what |
//! |---|---|---|
//! | `/camera/image` | `sensor_msgs/msg/CompressedImage` | each frame, as PNG |
//! | `/panel_0/outline` | `foxglove_msgs/msg/ImageAnnotations` | the panel's outline in the frame, and its bits |
//! | `/panel_0/pose` | `geometry_msgs/msg/PoseWithCovarianceStamped` | where it is before the camera, while that is known |
//! | `/panel_0/message` | `std_msgs/msg/String` | each message, with the frame in which it became whole |
//! | `/panel_0/message_bytes` | `std_msgs/msg/UInt8MultiArray` | its bytes, of which a text need not hold all |
//!
//! Further panels are `/panel_1` and so on. Poses are in the frame `camera`: x right, y down, z forward, as ROS has it of cameras (REP 103);
//! covariances of x, y, z in metres and of rotations about these axes in radians. Times are those of the frames, from the first one on.

mod mcap;
mod ros;

use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::Pose;
use rx_pipeline::receiver::Reading;

use self::mcap::{Schema, Writer};
use crate::files::Growing;
use ros::Ros;

/// A file that frames, panels and messages are written into.
pub struct Recording {
    path: PathBuf,
    writer: Writer<BufWriter<Growing>>,
    image: u16,
    panels: Vec<Panel>,
    /// Of the frame at hand, in nanoseconds since the first.
    time_ns: u64,
}

/// A panel's channels.
struct Panel {
    outline: u16,
    pose: u16,
    message: u16,
    bytes: u16,
}

impl Recording {
    /// Begins a file for so many panels.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path, panels: usize) -> anyhow::Result<Self> {
        let mut writer = Writer::new(BufWriter::new(Growing::create(path)?))?;
        let image = channel::<ros::CompressedImage>(&mut writer, "/camera/image");
        let panels = (0..panels)
            .map(|number| Panel {
                outline: channel::<ros::ImageAnnotations>(&mut writer, &format!("/panel_{number}/outline")),
                pose: channel::<ros::PoseWithCovarianceStamped>(&mut writer, &format!("/panel_{number}/pose")),
                message: channel::<ros::Text>(&mut writer, &format!("/panel_{number}/message")),
                bytes: channel::<ros::Bytes>(&mut writer, &format!("/panel_{number}/message_bytes")),
            })
            .collect();
        Ok(Self {
            path: path.into(),
            writer,
            image,
            panels,
            time_ns: 0,
        })
    }

    /// Takes a frame that was taken `time_s` after the first.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn frame(&mut self, time_s: f64, frame: &Frame) -> anyhow::Result<()> {
        self.time_ns = (time_s * 1e9).max(0.0) as u64;
        let pixels: Vec<u8> = frame.rows().flatten().copied().collect();
        let mut data = Vec::new();
        let size = [frame.width(), frame.height()].map(|side| side as u32);
        PngEncoder::new_with_quality(&mut data, CompressionType::Fast, FilterType::Sub).write_image(
            &pixels,
            size[0],
            size[1],
            ExtendedColorType::L8,
        )?;
        let image = ros::CompressedImage {
            header: self.header(),
            format: "png",
            data,
        };
        self.write(self.image, &image)
    }

    /// Takes what the frame at hand shows of a panel.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn reading(&mut self, panel: usize, reading: &Reading, pose: Option<&Pose>) -> anyhow::Result<()> {
        let header = self.header();
        let Some(&Panel {
            outline, pose: channel, ..
        }) = self.panels.get(panel)
        else {
            return Ok(());
        };
        let bits = reading.detection.bits.to_string();
        self.write(outline, &ros::ImageAnnotations::outline(header.stamp, &reading.corners, bits))?;
        match pose {
            Some(pose) => self.write(channel, &ros::PoseWithCovarianceStamped::of(header, pose)),
            None => Ok(()),
        }
    }

    /// Takes a message that a panel's frame at hand has made whole.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn message(&mut self, panel: usize, message: &[u8]) -> anyhow::Result<()> {
        let Some(&Panel { message: text, bytes, .. }) = self.panels.get(panel) else {
            return Ok(());
        };
        let data = &String::from_utf8_lossy(message);
        self.write(text, &ros::Text { data })?;
        self.write(bytes, &ros::Bytes::of(message))
    }

    /// Puts the file into its place.
    ///
    /// # Errors
    /// When not every byte can be kept; what was there before is untouched.
    pub fn finish(self) -> anyhow::Result<()> {
        let file = self.writer.finish()?;
        let file = file.into_inner().map_err(std::io::IntoInnerError::into_error)?;
        Ok(file.keep()?)
    }

    /// What its errors are about.
    pub fn about(&self) -> String {
        format!("cannot write {}", self.path.display())
    }

    fn header(&self) -> ros::Header {
        ros::Header::at(self.time_ns)
    }

    fn write(&mut self, channel: u16, message: &impl Ros) -> anyhow::Result<()> {
        let bytes = cdr::serialize::<_, _, cdr::CdrLe>(message, cdr::Infinite).context("a message cannot be written")?;
        Ok(self.writer.message(channel, self.time_ns, &bytes)?)
    }
}

/// A channel for messages of one type.
fn channel<Message: Ros>(writer: &mut Writer<BufWriter<Growing>>, topic: &str) -> u16 {
    let (name, definition) = (Message::NAME, Message::DEFINITION);
    writer.channel(topic, Schema { name, definition })
}
