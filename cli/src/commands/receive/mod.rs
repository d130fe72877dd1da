//! `vocc receive`: messages from a sequence of frames.

mod applies;
mod film_clock;
mod latency;
mod live;
mod places;
mod report;
mod session;
mod stage_times;
mod view;
mod watch;

use std::io::BufRead;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use reception::colour::Channel;
use reception::stream::{SIDE_MAX, Stream, StreamError};
use reception::{PANELS_MAX, Stamp, USUAL_FPS};
use rx_pipeline::frame::Frame;
use studies::detectors::DetectorChoice;

use crate::camera::{CameraArguments, CameraHints};
use crate::frames::PixelArguments;
use crate::frames::files::{self, FrameFile, Frames};
use crate::frames::film::{self, Film, FrameTimes};
use crate::frames::foreign;
use crate::frames::live::Live;
use crate::frames::picture::{GreyPicture, PictureReader};
use crate::frames::secrets;
use crate::frames::waiting::Moment;
use crate::keys::TrustArguments;
use crate::options::{SharedOptions, number_in};
use crate::output::{self, Hex, Verdict};
use crate::outputs;
use crate::pose::PanelArguments;
use crate::recording::{FOXGLOVE_PORT, RecordingArguments};
use crate::show;
use crate::stop::{Input, stop};

use film_clock::FilmClock;
use session::Session;
use view::{ViewArguments, ViewPage};

/// Arguments of `vocc receive`.
#[derive(clap::Args)]
#[command(group = clap::ArgGroup::new("recordings").multiple(true))]
pub struct Arguments {
    /// A film (if ffmpeg is installed), a folder of frames (PNG, JPEG, PGM; in the order of their names, frame2 before frame10, and
    /// without those that begin with a dot), single frames, or `-` for y4m or raw grey bytes on standard input. Live, by ffmpeg: a camera
    /// (/dev/video0, v4l2:/dev/video0), an address (rtsp://, udp://, tcp://, http://) or a named pipe.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Never fall behind: drop frames if newer ones have arrived, and count them. If a camera, an address or a named pipe disappears,
    /// wait for it. Play a film at its own pace.
    #[arg(long)]
    live: bool,
    /// Options of ffmpeg for a live source, such as "-input_format mjpeg -video_size 1280x720 -framerate 60" for a camera.
    #[arg(
        long,
        default_value = "",
        hide_default_value = true,
        value_name = "OPTIONS",
        allow_hyphen_values = true
    )]
    ffmpeg: String,
    /// Print ffmpeg's command on standard error.
    #[arg(long)]
    verbose: bool,
    /// Size of the raw frames on standard input, or in a named pipe.
    #[arg(long, value_name = "WxH", value_parser = size)]
    raw: Option<(usize, usize)>,
    /// Read each frame of a film as one picture, even if the film is flagged as interlaced and its first frames do not show that they are
    /// single pictures, such as 25 pictures a second in 50i.
    #[arg(long)]
    progressive: bool,
    /// Frames a second of the camera. Default: those of the film or the y4m stream, otherwise 100. If the folder has a file timestamps.csv
    /// (lines of a frame's name or number, a comma, and its time in seconds), its times are used instead.
    #[arg(long, value_name = "F", value_parser = per_second)]
    fps: Option<f32>,
    /// Symbols a second of the transmitter. Without it, 90, the Pico's rate, and other usual rates are tried.
    #[arg(long, value_name = "F", value_parser = per_second)]
    symbol_rate: Option<f32>,
    /// best, ml, kmeans, kmeans-raw or otsu.
    #[arg(long, default_value = "best")]
    detector: DetectorChoice,
    /// Also print the bits that each frame shows. JSON adds the symbol's number, counted by --symbol-rate, or by the rate once it is found.
    #[arg(long)]
    bits: bool,
    /// Panels to follow at once, each with its own message.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=PANELS_MAX as i64))]
    panels: u8,
    /// Draw the panel in each frame into this folder: outline, cells and bits.
    #[arg(long, value_name = "DIR")]
    show: Option<PathBuf>,
    #[command(flatten)]
    view: ViewArguments,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    pixels: PixelArguments,
    #[command(flatten)]
    panel: PanelArguments,
    /// Write frames, outlines, poses, messages and diagnostics into this MCAP file, which Foxglove and the tools of ROS 2 open.
    #[arg(long, value_name = "FILE.mcap", group = "recordings")]
    mcap: Option<PathBuf>,
    /// Serve the same to Foxglove, at ws://127.0.0.1:PORT (0: any free port), for this computer alone.
    #[arg(
        long,
        value_name = "PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = FOXGLOVE_PORT,
        group = "recordings"
    )]
    foxglove: Option<u16>,
    #[command(flatten)]
    recorded: RecordingArguments,
    /// Write the bytes of all messages into this file, one message after another.
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    hex: Hex,
    #[command(flatten)]
    trusting: TrustArguments,
    /// Write the learnt camera parameters into this file, for --camera.
    #[arg(long, value_name = "FILE")]
    save_camera: Option<PathBuf>,
    /// Print the run time of each stage on standard error.
    #[arg(long)]
    profile: bool,
}

impl Arguments {
    /// Whether any option writes a file, shows a page or serves.
    fn keeps(&self) -> bool {
        let kept = [&self.show, &self.mcap, &self.save_camera, &self.out];
        let served = self.view.is_asked() || self.foxglove.is_some();
        kept.iter().any(|path| path.is_some()) || self.trusting.counters().is_some() || served
    }

    /// How to open a stream.
    fn open<R: BufRead>(&self) -> Open<R> {
        match self.progressive {
            true => Stream::open_progressive,
            false => Stream::open,
        }
    }
}

type Open<R> = fn(R, Option<(usize, usize)>, Channel) -> Result<Stream<R>, StreamError>;

fn size(text: &str) -> Result<(usize, usize), String> {
    let parsed = text
        .split_once('x')
        .and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    match parsed {
        Some((width, height)) if (1..=SIDE_MAX).contains(&width) && (1..=SIDE_MAX).contains(&height) => Ok((width, height)),
        _ => Err(format!(
            "{text:?} is not WIDTHxHEIGHT of 1 to {SIDE_MAX} pixels each, such as 1920x1080"
        )),
    }
}

/// Parses a rate of frames or symbols.
fn per_second(text: &str) -> Result<f32, String> {
    number_in(text, 0.001..=100_000.0, "a second")
}

/// The origin of the frames.
enum Source<'a> {
    Input,
    Film(&'a Path),
    Files(Frames),
    Live(Live),
}

impl<'a> Source<'a> {
    fn of(arguments: &'a Arguments) -> anyhow::Result<Self> {
        let sources = &arguments.sources[..];
        if arguments.live {
            return live::of(sources).map(Self::Live);
        }
        if let [source] = sources {
            if let Some(live) = Live::of(source) {
                return Ok(Self::Live(live));
            }
            if let Some(advice) = foreign::advice(source) {
                bail!(advice);
            }
        } else if let Some(alone) = sources
            .iter()
            .find(|source| Live::of(source).is_some() || foreign::address(source).is_some())
        {
            bail!(
                "{} is live or an address, and cannot be combined with other sources: give it alone",
                secrets::masked(&alone.to_string_lossy())
            );
        }
        Ok(match sources {
            [source] if source == Path::new("-") => Self::Input,
            [source] if film::is_one(source) && !source.is_dir() => Self::Film(source),
            sources => Self::Files(files::by_time(sources)?),
        })
    }

    /// The files to read.
    fn files(&self) -> Vec<PathBuf> {
        match self {
            Self::Input | Self::Live(Live::Input | Live::Address(_)) => Vec::new(),
            Self::Film(film) => vec![film.to_path_buf()],
            Self::Live(Live::Camera(path) | Live::Pipe(path) | Live::Film(path)) => vec![path.clone()],
            Self::Files(frames) => frames.files.iter().map(|file| file.path.clone()).collect(),
        }
    }

    fn name(&self) -> String {
        match self {
            Self::Input => Live::Input.name(),
            Self::Film(path) => path.display().to_string(),
            Self::Files(frames) => match &frames.files[..] {
                [one] => one.path.display().to_string(),
                [first, .., last] => format!("{} to {}", first.path.display(), last.path.display()),
                [] => String::new(),
            },
            Self::Live(live) => live.name(),
        }
    }

    /// The number of frames, if known.
    fn frames(&self) -> Option<u64> {
        match self {
            Self::Input | Self::Film(_) | Self::Live(_) => None,
            Self::Files(frames) => Some(frames.files.len() as u64),
        }
    }
}

/// Reads all frames and prints the messages; exit status 1 if there was none.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let view = arguments.view.open(&arguments.sources)?;
    let answer = receive(arguments, shared, view.as_ref());
    if let Some(view) = view {
        view.end(&answer);
    }
    answer
}

fn receive(arguments: &Arguments, shared: &SharedOptions, view: Option<&ViewPage>) -> anyhow::Result<Verdict> {
    let source = Source::of(arguments)?;
    applies::check(arguments, &source)?;
    let read = source.files();
    if let Some(folder) = &arguments.show {
        let files = if let Source::Files(frames) = &source {
            &frames.files[..]
        } else {
            &[]
        };
        outputs::check_drawings(folder, [show::in_frame(0, 0)], files.iter().map(|file| file.path.as_path()))?;
    }
    outputs::check(
        [&arguments.save_camera, &arguments.mcap, &arguments.out]
            .into_iter()
            .flatten()
            .cloned()
            .chain(arguments.trusting.counters()),
        read.into_iter().chain(arguments.camera.file()).chain(arguments.trusting.file()),
    )?;
    let hints = arguments.camera.hints(arguments.pixels)?;
    let is_live = matches!(source, Source::Live(_));
    let is_checked = arguments.trusting.file().is_some();
    let feed = view.map(|view| view.serve(&source.name(), is_live, is_checked)).transpose()?;
    let session = Session::new(arguments, hints, shared, source.frames(), is_live, feed)?;
    let channel = hints.pixels.channel.unwrap_or_default();
    let open = arguments.open();
    match source {
        Source::Input => {
            let input = Input::new(std::io::stdin(), stop()).context("cannot read the stream")?;
            let stream = open(input, arguments.raw, channel).map_err(explained)?;
            // The stream may be endless: if nobody reads the output and no file is written, stop after one message.
            let enough = |session: &Session| !arguments.keeps() && output::is_unread() && session.has_message();
            receive_stream(session, stream, None, enough, || Ok(()))
        }
        Source::Film(path) => {
            let (mut film, frames) = Film::open(path, arguments.verbose)?;
            let input = Input::new(frames, stop()).context("cannot read the film")?;
            match open(input, None, channel) {
                Ok(stream) => {
                    if film::is_bare(path) && arguments.fps.is_none() {
                        session.say(&format!("{} does not state its frame rate: give it with --fps", path.display()));
                    }
                    receive_stream(session, stream, film.take_times(), |_| false, || film.end())
                }
                // The decoder's error states the reason for missing frames better.
                Err(error) if error.is_short() => film.end().and(Err(error.into())),
                Err(error) => Err(explained(error)),
            }
        }
        Source::Files(frames) => receive_files(session, &frames, hints),
        Source::Live(live) => live::receive(session, &live, arguments, channel),
    }
}

/// Explains a stream error, with the option that helps.
fn explained(error: StreamError) -> anyhow::Error {
    match error {
        StreamError::Interlaced { .. } => anyhow::anyhow!(
            "{error}. If only its flag says so, and each frame is one picture, such as 25 pictures a second in 50i, give --progressive"
        ),
        error => error.into(),
    }
}

/// Receives a stream to its end or until there is `enough`, its frames by `times` if available, and then checks with `ended` that the
/// source ended without error.
fn receive_stream(
    mut session: Session,
    mut stream: Stream<impl BufRead>,
    times: Option<FrameTimes>,
    enough: impl Fn(&Session) -> bool,
    ended: impl FnOnce() -> anyhow::Result<()>,
) -> anyhow::Result<Verdict> {
    let stop = stop();
    let (width, height) = stream.size();
    let rate = stream.rate();
    if stream.is_flagged() {
        session.say("the film is flagged as interlaced, and its frames are read as whole pictures");
    }
    let mut clock = times.map(|times| FilmClock::new(Some(times), (width, height), rate.unwrap_or(USUAL_FPS)));
    if let (Some(rate), None) = (rate, &clock) {
        session.set_usual_fps(rate)?;
    }
    let end = loop {
        if enough(&session) {
            break Ok(());
        }
        match stream.next_frame() {
            Ok(Some(grey)) => match &mut clock {
                Some(clock) => clock.frame(&mut session, grey)?,
                None => session.next_frame(&Frame::new(grey, width, height)?)?,
            },
            Ok(None) => break Ok(()),
            // A stop request truncated the stream.
            Err(_) if stop.is_asked() => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    // Frames before an error are kept.
    if let (Some(mut clock), false) = (clock, stop.is_asked()) {
        clock.finish(&mut session)?;
    }
    let answer = session.finish()?;
    ended().and(end.map_err(Into::into))?;
    Ok(answer)
}

/// Receives one file after another.
fn receive_files(mut session: Session, frames: &Frames, hints: CameraHints) -> anyhow::Result<Verdict> {
    let stop = stop();
    if let Some(rate) = frames.rate {
        session.set_stamped_fps(rate, frames.doubled)?;
    }
    let mut pictures = PictureReader::new(hints.pixels, hints.encoding);
    pictures.settle_white(frames.files.iter().map(|file| file.path.as_path()), stop);
    let mut bad = 0;
    for FrameFile { path, number, late } in &frames.files {
        if stop.is_asked() {
            return session.finish();
        }
        let picture = pictures.read(path).and_then(|picture| {
            let size = (picture.image.width() as usize, picture.image.height() as usize);
            session.check(size, picture.samples)?;
            Ok(picture)
        });
        let GreyPicture { image, remark, .. } = match picture {
            Ok(picture) => picture,
            Err(error) => {
                bad += 1;
                session.skip(*number, &output::explain(&error));
                continue;
            }
        };
        if let Some(remark) = remark {
            session.say(&remark);
        }
        let (width, height) = (image.width() as usize, image.height() as usize);
        let stamp = Stamp {
            number: *number,
            late: *late,
        };
        session.frame(stamp, &Frame::new(image.as_raw(), width, height)?, &Moment::default())?;
    }
    let answer = session.finish()?;
    ensure!(bad == 0, "{bad} of {} frames could not be used", frames.files.len());
    Ok(answer)
}
