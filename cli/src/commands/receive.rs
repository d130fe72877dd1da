//! `vocc receive`: messages from a sequence of frames.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use link::framing::{Event, SegmentOutcome};
use rx_pipeline::frame::Frame;
use rx_pipeline::locate::LocatorSettings;
use rx_pipeline::receiver::{Outcome, Receiver, ReceiverMemory, ReceiverSettings};
use sim::detectors::DetectorChoice;

use crate::options::{self, Shared, detector};
use crate::output::{self, Answer, line};
use crate::pictures;

/// The most pixels of a panel's bounding box.
const PANEL_PIXELS: usize = 160 * 160;

/// Arguments of `vocc receive`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A folder of frames (PNG, JPEG, PGM; in the order of their names), one frame, or `-` for raw grey bytes on standard input.
    #[arg(required = true)]
    sources: Vec<PathBuf>,
    /// Size of the raw frames on standard input.
    #[arg(long, value_name = "WxH", value_parser = size)]
    raw: Option<(usize, usize)>,
    /// Frames a second of the camera.
    #[arg(long, default_value_t = 100.0, value_name = "F")]
    fps: f32,
    /// Panels a second of the transmitter.
    #[arg(long, default_value_t = 100.0, value_name = "F")]
    symbol_rate: f32,
    /// best, ml, kmeans, kmeans-raw or otsu.
    #[arg(long, default_value = "best", value_parser = detector)]
    detector: DetectorChoice,
    /// Also print what each frame shows.
    #[arg(long)]
    bits: bool,
}

fn size(text: &str) -> Result<(usize, usize), String> {
    let parsed = text
        .split_once('x')
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    match parsed {
        Some((width, height)) if (1..=8192).contains(&width) && (1..=8192).contains(&height) => {
            Ok((width, height))
        }
        _ => Err(format!(
            "{text:?} is not WIDTHxHEIGHT of 1 to 8192 pixels each, such as 1920x1080"
        )),
    }
}

/// Reads all frames and prints the messages; exit status 1 where there was none.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    let mut reception = Reception::new(arguments, shared)?;
    if arguments.sources == [Path::new("-")] {
        let (width, height) = arguments
            .raw
            .context("frames on standard input have no size: give it with --raw WIDTHxHEIGHT")?;
        receive_raw(&mut reception, width, height)?;
    } else {
        let mut bad = 0;
        for path in frames_of(&arguments.sources)? {
            let taken = pictures::read_grey(&path).and_then(|image| {
                reception.take(&Frame::new(
                    image.as_raw(),
                    image.width() as usize,
                    image.height() as usize,
                )?)
            });
            if let Err(error) = taken {
                bad += 1;
                reception.lose(&output::explain(&error));
            }
        }
        let answer = reception.finish()?;
        ensure!(
            bad == 0,
            "{bad} of {} frames could not be used",
            reception.frames
        );
        return Ok(answer);
    }
    reception.finish()
}

/// The frames of folders, in the order of their names, and single files.
fn frames_of(sources: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut frames = Vec::new();
    for source in sources {
        ensure!(
            source.as_os_str() != "-",
            "standard input (-) cannot be mixed with files: give it alone"
        );
        if !source.is_dir() {
            frames.push(source.clone());
            continue;
        }
        let entries = std::fs::read_dir(source)
            .with_context(|| format!("cannot read the folder {}", source.display()))?;
        let mut inside = entries
            .map(|entry| Ok(entry?.path()))
            .collect::<std::io::Result<Vec<_>>>()
            .with_context(|| format!("cannot read the folder {}", source.display()))?;
        inside.retain(|path| {
            path.extension().is_some_and(|kind| {
                ["png", "jpg", "jpeg", "pgm"]
                    .iter()
                    .any(|known| kind.eq_ignore_ascii_case(known))
            })
        });
        ensure!(
            !inside.is_empty(),
            "the folder {} has no PNG, JPEG or PGM files",
            source.display()
        );
        inside.sort();
        frames.extend(inside);
    }
    Ok(frames)
}

fn receive_raw(reception: &mut Reception, width: usize, height: usize) -> anyhow::Result<()> {
    let mut input = std::io::stdin().lock();
    let mut grey = vec![0; width * height];
    loop {
        let mut filled = 0;
        while filled < grey.len() {
            match input
                .read(&mut grey[filled..])
                .context("cannot read standard input")?
            {
                0 => break,
                read => filled += read,
            }
        }
        match filled {
            0 => return Ok(()),
            all if all == grey.len() => reception.take(&Frame::new(&grey, width, height)?)?,
            part => {
                // What came before it is not lost.
                reception.finish()?;
                bail!(
                    "standard input ends inside a frame, after {part} of {} bytes: check --raw {width}x{height}",
                    grey.len()
                );
            }
        }
    }
}

/// A receiver and what it has had to say.
struct Reception<'a> {
    receiver: Receiver<PANEL_PIXELS, Box<ReceiverMemory<PANEL_PIXELS>>>,
    arguments: &'a Arguments,
    json: bool,
    frames: u64,
    messages: u64,
}

impl<'a> Reception<'a> {
    fn new(arguments: &'a Arguments, shared: &Shared) -> anyhow::Result<Self> {
        let settings = ReceiverSettings {
            locator: LocatorSettings::default(),
            method: options::untrained(arguments.detector)?,
            symbols_per_frame: arguments.symbol_rate / arguments.fps,
        };
        Ok(Self {
            receiver: Receiver::new(settings, Box::default())?,
            arguments,
            json: shared.json,
            frames: 0,
            messages: 0,
        })
    }

    fn take(&mut self, frame: &Frame) -> anyhow::Result<()> {
        let number = self.frames;
        self.frames += 1;
        let Outcome {
            reading,
            symbol,
            event,
        } = self.receiver.frame(number, frame);
        match &reading {
            Ok(reading) if self.arguments.bits => {
                let (bits, centre) = (
                    reading.detection.bits.to_string(),
                    reading.corners.centre_px(),
                );
                if self.json {
                    output::json(
                        &serde_json::json!({ "frame": number, "bits": bits, "symbol": symbol, "centre_px": centre, "confidence": reading.detection.confidence }),
                    )?;
                } else {
                    line(&format!(
                        "frame {number}: {bits} at ({:.2}, {:.2}) px",
                        centre[0], centre[1]
                    ))?;
                }
            }
            Ok(_) => {}
            Err(loss) => eprintln!("frame {number}: {loss}"),
        }
        self.messages += tell(&event, self.json)?;
        Ok(())
    }

    /// Counts a frame that cannot be used.
    fn lose(&mut self, why: &str) {
        eprintln!("frame {}: {why}", self.frames);
        self.frames += 1;
    }

    fn finish(&mut self) -> anyhow::Result<Answer> {
        let event = self.receiver.finish();
        self.messages += tell(&event, self.json)?;
        if self.messages > 0 {
            return Ok(Answer::Yes);
        }
        eprintln!("no message in {} frames", self.frames);
        Ok(Answer::No)
    }
}

/// Prints a message, and on standard error why a part of one was lost; how many messages there were.
fn tell(event: &Event<'_>, json: bool) -> anyhow::Result<u64> {
    match event {
        Event::Delivered(delivery) => {
            let text = String::from_utf8_lossy(delivery.message);
            let (first, last, corrected) = (
                delivery.first_stamp,
                delivery.last_stamp,
                delivery.corrected_bits,
            );
            if json {
                output::json(
                    &serde_json::json!({ "message": text, "first_frame": first, "last_frame": last, "corrected_bits": corrected }),
                )?;
            } else {
                line(&format!(
                    "{text:?} in frames {first} to {last}, {corrected} bits corrected"
                ))?;
            }
            return Ok(1);
        }
        Event::Rejected(why) => eprintln!("{why}"),
        Event::UnsupportedVersion(version) => eprintln!(
            "a transmitter of format version {version} was seen; this receiver reads version {}",
            link::framing::VERSION
        ),
        Event::Segment {
            header,
            outcome: SegmentOutcome::Failed(why),
            ..
        } => eprintln!(
            "segment {} could not be decoded: {why}; its repeats are waited for",
            header.segment
        ),
        _ => {}
    }
    Ok(0)
}
