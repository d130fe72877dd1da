//! What is received, as an [MCAP](https://mcap.dev) file, which Foxglove and the tools of ROS 2 open.
//!
//! | topic | type | what |
//! |---|---|---|
//! | `/camera/image` | `sensor_msgs/msg/CompressedImage` | each frame, as PNG |
//! | `/panel_0/outline` | `foxglove_msgs/msg/ImageAnnotations` | the panel's outline in the frame, and its bits |
//! | `/panel_0/pose` | `geometry_msgs/msg/PoseWithCovarianceStamped` | where it is before the camera, while that is known |
//! | `/panel_0/message` | `std_msgs/msg/String` | each message, with the frame in which it became whole |
//!
//! Further panels are `/panel_1` and so on. Poses are in the frame `camera`: x right, y down, z forward, as ROS has it of cameras (REP 103);
//! covariances of x, y, z in metres and of rotations about these axes in radians. Times are those of the frames, from the first one on.

mod ros;

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{WriteOptions, Writer};
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::Pose;
use rx_pipeline::receiver::Reading;

use crate::files::Growing;
use ros::Ros;

/// A file that frames, panels and messages are written into.
pub struct Recording {
    path: PathBuf,
    writer: Writer<NoSeek<BufWriter<Growing>>>,
    image: Channel,
    panels: Vec<Panel>,
    /// Of the frame at hand, in nanoseconds since the first.
    time_ns: u64,
}

/// A panel's channels.
struct Panel {
    outline: Channel,
    pose: Channel,
    message: Channel,
}

/// Where messages of one kind go.
struct Channel {
    id: u16,
    count: u32,
}

impl Recording {
    /// Begins a file for so many panels.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn create(path: &Path, panels: usize) -> anyhow::Result<Self> {
        let file = NoSeek::new(BufWriter::new(Growing::create(path)?));
        let options = WriteOptions::new().profile("ros2").compression(None);
        let mut writer = options.disable_seeking(true).create(file)?;
        let image = channel::<ros::CompressedImage>(&mut writer, "/camera/image")?;
        let panel = |number| {
            Ok(Panel {
                outline: channel::<ros::ImageAnnotations>(&mut writer, &format!("/panel_{number}/outline"))?,
                pose: channel::<ros::PoseWithCovarianceStamped>(&mut writer, &format!("/panel_{number}/pose"))?,
                message: channel::<ros::Text>(&mut writer, &format!("/panel_{number}/message"))?,
            })
        };
        let panels = (0..panels).map(panel).collect::<anyhow::Result<_>>()?;
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
        write(&mut self.writer, &mut self.image, self.time_ns, &image)
    }

    /// Takes what the frame at hand shows of a panel.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn reading(&mut self, panel: usize, reading: &Reading, pose: Option<&Pose>) -> anyhow::Result<()> {
        let header = self.header();
        let Some(panel) = self.panels.get_mut(panel) else {
            return Ok(());
        };
        let bits = reading.detection.bits.to_string();
        let outline = ros::ImageAnnotations::outline(header.stamp, &reading.corners, bits);
        write(&mut self.writer, &mut panel.outline, self.time_ns, &outline)?;
        if let Some(pose) = pose {
            let pose = ros::PoseWithCovarianceStamped::of(header, pose);
            write(&mut self.writer, &mut panel.pose, self.time_ns, &pose)?;
        }
        Ok(())
    }

    /// Takes a message that a panel's frame at hand has made whole.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn message(&mut self, panel: usize, text: &str) -> anyhow::Result<()> {
        let Some(panel) = self.panels.get_mut(panel) else {
            return Ok(());
        };
        let text = ros::Text { data: text };
        write(&mut self.writer, &mut panel.message, self.time_ns, &text)
    }

    /// Puts the file into its place.
    ///
    /// # Errors
    /// When not every byte can be kept; what was there before is untouched.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.writer.finish()?;
        let file = self.writer.into_inner().into_inner();
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
}

/// A channel for messages of one type.
fn channel<Message: Ros>(writer: &mut Writer<NoSeek<BufWriter<Growing>>>, topic: &str) -> anyhow::Result<Channel> {
    let schema = writer.add_schema(Message::NAME, "ros2msg", Message::DEFINITION.as_bytes())?;
    let id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new())?;
    Ok(Channel { id, count: 0 })
}

fn write<Message: Ros>(
    writer: &mut Writer<NoSeek<BufWriter<Growing>>>,
    channel: &mut Channel,
    time_ns: u64,
    message: &Message,
) -> anyhow::Result<()> {
    let header = MessageHeader {
        channel_id: channel.id,
        sequence: channel.count,
        log_time: time_ns,
        publish_time: time_ns,
    };
    channel.count += 1;
    let bytes = cdr::serialize::<_, _, cdr::CdrLe>(message, cdr::Infinite).context("a message cannot be written")?;
    Ok(writer.write_to_known_channel(&header, &bytes)?)
}
