//! Receives a live source.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use reception::USUAL_FPS;
use reception::colour::Channel;
use reception::stream::StreamError;

use super::film_clock::FilmClock;
use super::session::Session;
use super::{Arguments, explained};
use crate::frames::film::{self, Film};
use crate::frames::foreign;
use crate::frames::live::Live;
use crate::frames::secrets;
use crate::frames::waiting::{Format, Next, Waiting};
use crate::output::{self, Verdict};
use crate::stop::stop;

/// Interval between two checks of the stop flag.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// A source that is silent for this long is gone.
const SILENCE: Duration = Duration::from_secs(10);
/// Interval between two attempts to reconnect.
const TRY_EVERY: Duration = Duration::from_secs(1);
/// Bytes per read.
const PIECE: usize = 1 << 18;

/// Receives a live source until it ends or the user stops it; with `--live`, waits for a source that can come back.
pub fn receive(mut session: Session, live: &Live, arguments: &Arguments, channel: Channel) -> anyhow::Result<Verdict> {
    live.check()?;
    let stop = stop();
    let waits = arguments.live && live.returns();
    let mut incoming = Incoming::open(live, arguments, channel)?;
    let mut clock: Option<FilmClock> = None;
    let mut last = Instant::now();
    let mut gone: Option<Instant> = None;
    let end = loop {
        if stop.is_asked() || (!arguments.keeps() && output::is_unread() && session.has_message()) {
            break Ok(());
        }
        let end = match incoming.waiting.next(LOOK_EVERY) {
            Next::Begin(format) => match begin(&mut session, &mut clock, format) {
                Ok(()) => continue,
                Err(error) => break Err(error),
            },
            Next::Frame(frame) => {
                last = Instant::now();
                if let Some(gone) = gone.take() {
                    session.say(&format!("{} is back after {:.1} s", live.name(), gone.elapsed().as_secs_f64()));
                }
                if let Some(clock) = &mut clock {
                    clock.live(&mut session, &frame)?;
                }
                continue;
            }
            Next::Nothing => {
                session.idle();
                if !waits || clock.is_none() || !live.goes_silently() || last.elapsed() < SILENCE {
                    continue;
                }
                Err(anyhow::anyhow!("no data for {} s", SILENCE.as_secs()))
            }
            Next::End(end) => incoming.ended(end),
        };
        // An interrupt also ends ffmpeg.
        if stop.is_asked() {
            break Ok(());
        }
        if clock.is_none() {
            // Do not wait for a source that never existed: its name may be wrong.
            return end.and_then(|()| session.finish());
        }
        if !waits {
            break end;
        }
        if gone.is_none() {
            gone = Some(last);
            let why = end.err().map(|why| format!(" ({})", output::explain(&why)));
            session.say(&format!("{} is gone{}: waiting for it", live.name(), why.unwrap_or_default()));
        }
        incoming.close();
        match again(live, arguments, channel, &mut session) {
            Ok(Some(again)) => incoming = again,
            Ok(None) => break Ok(()),
            Err(error) => break Err(error),
        }
        last = Instant::now();
    };
    if let (Some(mut clock), false) = (clock, stop.is_asked()) {
        clock.finish(&mut session)?;
    }
    let answer = session.finish()?;
    end?;
    Ok(answer)
}

/// Sets the format of the following frames.
fn begin(session: &mut Session, clock: &mut Option<FilmClock>, Format { size, rate_hz }: Format) -> anyhow::Result<()> {
    match clock {
        Some(clock) => {
            clock.check_size(size)?;
            clock.resume(session)
        }
        None => {
            *clock = Some(FilmClock::new(None, size, rate_hz.unwrap_or(USUAL_FPS)));
            Ok(())
        }
    }
}

/// Reopens the source as soon as it may exist; `None` if the program stops first.
fn again<'a>(live: &'a Live, arguments: &Arguments, channel: Channel, session: &mut Session) -> anyhow::Result<Option<Incoming<'a>>> {
    loop {
        let begun = Instant::now();
        while begun.elapsed() < TRY_EVERY {
            if stop().is_asked() {
                return Ok(None);
            }
            session.idle();
            std::thread::sleep(LOOK_EVERY);
        }
        if live.check().is_ok() {
            return Incoming::open(live, arguments, channel).map(Some);
        }
    }
}

/// A source that another thread reads.
struct Incoming<'a> {
    live: &'a Live,
    /// The decoder, if ffmpeg decodes it.
    film: Option<Film>,
    waiting: Arc<Waiting>,
}

impl<'a> Incoming<'a> {
    fn open(live: &'a Live, arguments: &Arguments, channel: Channel) -> anyhow::Result<Self> {
        let waiting = Arc::new(Waiting::new(arguments.live));
        let opened = match live.is_decoded(arguments.raw) {
            true => Some(Film::open_live(live, &arguments.ffmpeg, arguments.verbose)?),
            false => None,
        };
        let (mut film, decoded) = opened.unzip();
        let times = film.as_mut().and_then(Film::take_times);
        // ffmpeg's output is not raw video.
        let (raw, open) = (arguments.raw.filter(|_| film.is_none()), arguments.open());
        let (filled, source) = (Arc::clone(&waiting), live.clone());
        let read = move || {
            // Opening a pipe blocks until it has a writer.
            let input: std::io::Result<Box<dyn Read>> = match (decoded, source) {
                (Some(frames), _) => Ok(frames as Box<dyn Read>),
                (None, Live::Pipe(path)) => File::open(path).map(|pipe| Box::new(pipe) as Box<dyn Read>),
                _ => Ok(Box::new(std::io::stdin())),
            };
            match input {
                Ok(input) => filled.fill(open(BufReader::with_capacity(PIECE, input), raw, channel), times),
                Err(error) => filled.end(Err(error.into())),
            }
        };
        std::thread::Builder::new().spawn(read).context("cannot read the source")?;
        Ok(Self { live, film, waiting })
    }

    /// The reason why the source ended.
    fn ended(&mut self, end: Result<(), StreamError>) -> anyhow::Result<()> {
        // The decoder's error states the reason for missing frames better.
        let is_short = end.as_ref().err().is_none_or(StreamError::is_short);
        let decoded = match self.film.take().filter(|_| is_short) {
            Some(film) => film
                .end()
                .map_err(|error| anyhow::anyhow!("{error:#}; check it with `ffprobe {}`", self.live.name())),
            None => Ok(()),
        };
        decoded.and(end.map_err(explained))
    }

    /// Stops reading the source.
    fn close(&mut self) {
        self.film = None;
        self.waiting.leave();
    }
}

impl Drop for Incoming<'_> {
    fn drop(&mut self) {
        self.close();
    }
}

/// The source for `--live`.
pub fn of(sources: &[std::path::PathBuf]) -> anyhow::Result<Live> {
    let [source] = sources else {
        anyhow::bail!("--live is for one source: give a camera, an address, a named pipe, a film or -");
    };
    if let Some(live) = Live::of(source) {
        return Ok(live);
    }
    if source == Path::new("-") {
        return Ok(Live::Input);
    }
    if let Some(advice) = foreign::address(source) {
        anyhow::bail!(advice);
    }
    ensure!(
        film::is_one(source) && !source.is_dir(),
        "{} is not live: give a camera, an address, a named pipe, a film or -, or omit --live",
        secrets::masked(&source.to_string_lossy())
    );
    File::open(source).with_context(|| format!("cannot read {}", source.display()))?;
    Ok(Live::Film(source.clone()))
}
