//! `vocc receive`: messages from a sequence of frames.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use link::camera::Camera;
use link::framing::{Event, SegmentOutcome};
use rx_pipeline::frame::Frame;
use rx_pipeline::profile::{Profile, STAGES, Stage};
use rx_pipeline::receiver::{
    FrameSearch, Outcome, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory,
};
use studies::detectors::DetectorChoice;

use crate::options::{self, Shared};
use crate::output::{self, Answer, line};
use crate::streams::{SIDE_MAX, Stream};
use crate::{pictures, show};

/// The most panels followed at once.
const PANELS_MAX: usize = 4;
/// The most pixels of a panel's bounding box.
const PANEL_PIXELS: usize = 160 * 160;

/// Arguments of `vocc receive`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A folder of frames (PNG, JPEG, PGM; in the order of their names), one frame, or `-` for y4m or raw grey bytes on standard input.
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
    #[arg(long, default_value = "best")]
    detector: DetectorChoice,
    /// Also print what each frame shows.
    #[arg(long)]
    bits: bool,
    /// Panels to follow at once, each with its own message.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=PANELS_MAX as i64))]
    panels: u8,
    /// Draw what is seen in each frame into this folder: outline, cells and bits.
    #[arg(long, value_name = "DIR")]
    show: Option<PathBuf>,
    /// Exponent of the camera's encoding, 1 to 4.
    #[arg(long, default_value_t = Camera::default().gamma, value_name = "G")]
    gamma: f32,
    /// Standard deviation of the lens blur in pixels, 0.3 to 4.
    #[arg(long, default_value_t = Camera::default().blur_sigma_px, value_name = "PX")]
    blur: f32,
    /// Print how long each stage took, on standard error.
    #[arg(long)]
    profile: bool,
}

fn size(text: &str) -> Result<(usize, usize), String> {
    let parsed = text
        .split_once('x')
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    match parsed {
        Some((width, height))
            if (1..=SIDE_MAX).contains(&width) && (1..=SIDE_MAX).contains(&height) =>
        {
            Ok((width, height))
        }
        _ => Err(format!(
            "{text:?} is not WIDTHxHEIGHT of 1 to {SIDE_MAX} pixels each, such as 1920x1080"
        )),
    }
}

/// Reads all frames and prints the messages; exit status 1 where there was none.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    match arguments.panels {
        1 => receive::<1>(arguments, shared),
        2 => receive::<2>(arguments, shared),
        3 => receive::<3>(arguments, shared),
        _ => receive::<PANELS_MAX>(arguments, shared),
    }
}

fn receive<const PANELS: usize>(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    if let Some(folder) = &arguments.show {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    let mut reception = Reception::<PANELS>::new(arguments, shared)?;
    if arguments.sources == [Path::new("-")] {
        let mut stream = Stream::open(std::io::stdin().lock(), arguments.raw)?;
        let (width, height) = stream.size();
        loop {
            match stream.next_frame() {
                Ok(Some(grey)) => reception.take(&Frame::new(grey, width, height)?)?,
                Ok(None) => return reception.finish(),
                Err(error) => {
                    // What came before it is not lost.
                    reception.finish()?;
                    return Err(error);
                }
            }
        }
    }
    let mut bad = 0;
    for path in frames_of(&arguments.sources)? {
        let image = match pictures::read_grey(&path) {
            Ok(image) => image,
            Err(error) => {
                bad += 1;
                reception.lose(&output::explain(&error));
                continue;
            }
        };
        reception.take(&Frame::new(
            image.as_raw(),
            image.width() as usize,
            image.height() as usize,
        )?)?;
    }
    let answer = reception.finish()?;
    ensure!(
        bad == 0,
        "{bad} of {} frames could not be used",
        reception.frames
    );
    Ok(answer)
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

/// The receiver and what it has had to say.
struct Reception<'a, const PANELS: usize> {
    receiver: Option<Receiving<PANELS>>,
    settings: ReceiverSettings,
    arguments: &'a Arguments,
    json: bool,
    frames: u64,
    messages: u64,
    times: Times,
}

type Receiving<const PANELS: usize> = Receiver<
    PANEL_PIXELS,
    Box<ReceiverMemory<PANEL_PIXELS, PANELS>>,
    FrameSearch<Box<SearchMemory>, Vec<u8>>,
    PANELS,
>;

/// Frames that are kept to see what blinks.
const KEPT_FRAMES: usize = 2;

impl<'a, const PANELS: usize> Reception<'a, PANELS> {
    fn new(arguments: &'a Arguments, shared: &Shared) -> anyhow::Result<Self> {
        let settings = ReceiverSettings {
            camera: Camera {
                gamma: arguments.gamma,
                blur_sigma_px: arguments.blur,
                ..Camera::default()
            },
            method: options::untrained(arguments.detector)?,
            symbols_per_frame: arguments.symbol_rate / arguments.fps,
        };
        // Settings are refused before the first frame, not with it.
        receiver::<PANELS>(settings, 0)?;
        Ok(Self {
            receiver: None,
            settings,
            arguments,
            json: shared.json,
            frames: 0,
            messages: 0,
            times: Times::default(),
        })
    }

    fn take(&mut self, frame: &Frame) -> anyhow::Result<()> {
        let number = self.frames;
        self.frames += 1;
        if self.receiver.is_none() {
            self.receiver = Some(receiver(self.settings, frame.width() * frame.height())?);
        }
        let Some(receiver) = &mut self.receiver else {
            return Ok(());
        };
        let (arguments, json, messages) = (self.arguments, self.json, &mut self.messages);
        let mut told = Ok(());
        receiver.frame_each(number, frame, &mut self.times, |panel, outcome| {
            let done = report(arguments, json, number, panel, frame, &outcome);
            let said =
                tell(&outcome.event, panel, arguments.panels, json).map(|count| *messages += count);
            if told.is_ok() {
                told = done.and(said);
            }
        });
        told
    }

    /// Counts a frame that cannot be used.
    fn lose(&mut self, why: &str) {
        eprintln!("frame {}: {why}", self.frames);
        self.frames += 1;
    }

    fn finish(&mut self) -> anyhow::Result<Answer> {
        let (panels, json, messages) = (self.arguments.panels, self.json, &mut self.messages);
        let mut told = Ok(());
        if let Some(receiver) = &mut self.receiver {
            receiver.finish_each(|panel, event| {
                let said = tell(&event, panel, panels, json).map(|count| *messages += count);
                if told.is_ok() {
                    told = said;
                }
            });
        }
        told?;
        if self.arguments.profile {
            self.times.print();
        }
        if self.messages > 0 {
            return Ok(Answer::Yes);
        }
        eprintln!("no message in {} frames", self.frames);
        Ok(Answer::No)
    }
}

fn receiver<const PANELS: usize>(
    settings: ReceiverSettings,
    frame_pixels: usize,
) -> anyhow::Result<Receiving<PANELS>> {
    let search = FrameSearch::with_history(Box::default(), vec![0; KEPT_FRAMES * frame_pixels]);
    Ok(Receiver::new(settings, Box::default(), search)?)
}

/// Prints and draws what one frame shows of a panel, and on standard error why it shows nothing.
fn report(
    arguments: &Arguments,
    json: bool,
    number: u64,
    panel: usize,
    frame: &Frame,
    outcome: &Outcome,
) -> anyhow::Result<()> {
    let of_panel = if arguments.panels > 1 {
        format!(", panel {panel}")
    } else {
        String::new()
    };
    let reading = match &outcome.reading {
        Ok(reading) => reading,
        Err(loss) => {
            eprintln!("frame {number}{of_panel}: {loss}");
            return Ok(());
        }
    };
    if let Some(folder) = &arguments.show {
        show::reading(
            &folder.join(format!("frame-{number:06}-panel-{panel}.png")),
            frame,
            reading,
        )?;
    }
    if !arguments.bits {
        return Ok(());
    }
    let (bits, centre) = (
        reading.detection.bits.to_string(),
        reading.corners.centre_px(),
    );
    if json {
        return output::json(&serde_json::json!({
            "frame": number, "panel": panel, "bits": bits, "symbol": outcome.symbol, "centre_px": centre,
            "pitch_px": reading.corners.pitch_px(), "confidence": reading.detection.confidence,
        }));
    }
    line(&format!(
        "frame {number}{of_panel}: {bits} at ({:.2}, {:.2}) px",
        centre[0], centre[1]
    ))
}

/// How long each stage took in all, how often it ran, and how long at most.
#[derive(Default)]
struct Times {
    begun: Vec<Instant>,
    spent: [(Duration, u32, Duration); STAGES.len()],
}

impl Profile for Times {
    fn begins(&mut self, _: Stage) {
        self.begun.push(Instant::now());
    }

    fn ends(&mut self, stage: Stage) {
        let spent = self
            .begun
            .pop()
            .map(|begun| begun.elapsed())
            .unwrap_or_default();
        if let Some(index) = STAGES.iter().position(|&other| other == stage) {
            let (total, count, most) = &mut self.spent[index];
            (*total, *count, *most) = (*total + spent, *count + 1, spent.max(*most));
        }
    }
}

impl Times {
    fn print(&self) {
        eprintln!("stage      times  mean (us)  most (us)");
        for (stage, (total, count, most)) in STAGES.iter().zip(self.spent) {
            let mean = total.as_secs_f64() * 1e6 / f64::from(count.max(1));
            eprintln!(
                "{:<9} {count:>6} {mean:>10.1} {:>10.1}",
                format!("{stage:?}"),
                most.as_secs_f64() * 1e6
            );
        }
    }
}

/// Prints a message, and on standard error why a part of one was lost; how many messages there were.
fn tell(event: &Event<'_>, panel: usize, panels: u8, json: bool) -> anyhow::Result<u64> {
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
                    &serde_json::json!({ "message": text, "panel": panel, "first_frame": first, "last_frame": last, "corrected_bits": corrected }),
                )?;
            } else {
                let of_panel = if panels > 1 {
                    format!("panel {panel}: ")
                } else {
                    String::new()
                };
                line(&format!(
                    "{of_panel}{text:?} in frames {first} to {last}, {corrected} bits corrected"
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
