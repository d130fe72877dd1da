//! `vocc receive`: messages from a sequence of frames.

mod diagnosis;
mod places;
mod rates;
mod reception;
mod report;
mod stage_times;

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use rx_pipeline::frame::Frame;
use studies::detectors::DetectorChoice;

use crate::camera::CameraArguments;
use crate::frames::PixelArguments;
use crate::frames::files::{self, FrameFile};
use crate::frames::picture::PictureReader;
use crate::frames::stream::{SIDE_MAX, Stream};
use crate::options::Shared;
use crate::output::{self, Answer};
use crate::outputs;
use crate::stop::{Input, stop};

use rates::Rates;
use reception::Reception;

/// The most panels followed at once.
const PANELS_MAX: usize = 4;

/// Arguments of `vocc receive`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A folder of frames (PNG, JPEG, PGM; in the order of their names), one frame, or `-` for y4m or raw grey bytes on standard input.
    #[arg(required = true)]
    sources: Vec<PathBuf>,
    /// Size of the raw frames on standard input.
    #[arg(long, value_name = "WxH", value_parser = size)]
    raw: Option<(usize, usize)>,
    /// Frames a second of the camera; by default those that a y4m stream tells, else 100.
    #[arg(long, value_name = "F")]
    fps: Option<f32>,
    /// Panels a second of the transmitter. Where it is not told, 90 as the Pico shows, and what else is usual, is tried.
    #[arg(long, value_name = "F")]
    symbol_rate: Option<f32>,
    /// best, ml, kmeans, kmeans-raw or otsu.
    #[arg(long, default_value = "best")]
    detector: DetectorChoice,
    /// Also print what each frame shows; JSON has the symbol's number, too, counted by --symbol-rate, or by the rate found once it is.
    #[arg(long)]
    bits: bool,
    /// Panels to follow at once, each with its own message.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=PANELS_MAX as i64))]
    panels: u8,
    /// Draw what is seen in each frame into this folder: outline, cells and bits.
    #[arg(long, value_name = "DIR")]
    show: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    pixels: PixelArguments,
    /// Write what was learnt of the camera into this file, for --camera.
    #[arg(long, value_name = "FILE")]
    save_camera: Option<PathBuf>,
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

impl Arguments {
    /// Symbols a second to go by, with a camera of `fps` frames a second.
    fn rate_hz(&self, fps: f32) -> f32 {
        self.symbol_rate.unwrap_or_else(|| rates::usual(fps))
    }

    /// Those to try beside.
    fn rates(&self, fps: f32) -> Rates {
        Rates::beside(self.rate_hz(fps), fps, self.symbol_rate.is_some())
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
    let is_stream = arguments.sources == [Path::new("-")];
    let files = if is_stream {
        Vec::new()
    } else {
        files::of(&arguments.sources)?
    };
    if let Some(folder) = &arguments.show {
        let mut folders = files.iter().filter_map(|file| file.path.parent());
        ensure!(
            !folders.any(|other| outputs::is_same(other, folder)),
            "{} holds frames that are read, and pictures of them would be taken for more: name another folder",
            folder.display()
        );
        crate::files::check(&folder.join("frame-000000-panel-0.png"))?;
    }
    outputs::check(
        arguments.save_camera.clone(),
        files
            .iter()
            .map(|file| file.path.clone())
            .chain(arguments.camera.file()),
    )?;
    let stop = stop();
    let total = (!is_stream).then_some(files.len() as u64);
    let told = arguments.camera.told(arguments.pixels)?;
    let mut reception = Reception::<PANELS>::new(arguments, told, shared, total)?;
    if is_stream {
        let channel = told.pixels.channel.unwrap_or_default();
        let input = Input::new(std::io::stdin(), stop).context("cannot read standard input")?;
        let mut stream = Stream::open(input, arguments.raw, channel)?;
        let (width, height) = stream.size();
        if let Some(rate) = stream.rate() {
            reception.by_default(rate)?;
        }
        loop {
            match stream.next_frame() {
                Ok(Some(grey)) => reception.take_next(&Frame::new(grey, width, height)?)?,
                Ok(None) => return reception.finish(),
                // Its end was cut off by whoever has asked to stop.
                Err(_) if stop.is_asked() => return reception.finish(),
                Err(error) => {
                    // What came before it is not lost.
                    reception.finish()?;
                    return Err(error);
                }
            }
        }
    }
    let mut pictures = PictureReader::new(told.pixels, told.encoding);
    let mut bad = 0;
    for FrameFile { path, number } in &files {
        if stop.is_asked() {
            return reception.finish();
        }
        let image = pictures.read(path).and_then(|image| {
            reception.check_size((image.width() as usize, image.height() as usize))?;
            Ok(image)
        });
        let image = match image {
            Ok(image) => image,
            Err(error) => {
                bad += 1;
                reception.lose(*number, &output::explain(&error));
                continue;
            }
        };
        if pictures.deep_white() > 0 {
            reception.is_deep();
        }
        let (width, height) = (image.width() as usize, image.height() as usize);
        reception.take(*number, &Frame::new(image.as_raw(), width, height)?)?;
    }
    let answer = reception.finish()?;
    ensure!(
        bad == 0,
        "{bad} of {} frames could not be used",
        files.len()
    );
    Ok(answer)
}
