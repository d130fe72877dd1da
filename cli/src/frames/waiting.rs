//! A short queue of frames that have arrived but have not been read.

use std::collections::VecDeque;
use std::io::BufRead;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use reception::stream::{Stream, StreamError};

use super::film::{FrameTime, FrameTimes};
use crate::stop::stop;

/// Maximum length of the queue.
const WAITING_MAX: usize = 4;
/// Stamps within this distance of the wall clock are from that clock.
const SAME_CLOCK_S: f64 = 60.0;

/// The time of a frame's arrival.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    pub at: Instant,
    /// By the wall clock, seconds since 1970.
    pub unix: Duration,
}

impl Arrival {
    pub fn now() -> Self {
        Self {
            at: Instant::now(),
            // A clock that was never set may be before 1970.
            unix: SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default(),
        }
    }
}

/// The times of a frame's exposure and arrival.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// From the source, if it provides times.
    pub time: Option<FrameTime>,
    /// For live sources.
    pub arrival: Option<Arrival>,
    /// Number of frames dropped before it.
    pub after_dropped: u64,
}

impl Moment {
    /// Transit time of the frame, if the source's clock is the wall clock.
    pub fn on_the_way(&self) -> Option<Duration> {
        let taken_s = self.time?.time_s;
        let way_s = self.arrival?.unix.as_secs_f64() - taken_s;
        // Two clocks may differ slightly.
        (way_s.abs() <= SAME_CLOCK_S).then(|| Duration::from_secs_f64(way_s.max(0.0)))
    }

    /// Wall-clock time of its exposure, otherwise of its arrival.
    pub fn unix(&self) -> Option<Duration> {
        let came = self.arrival?.unix;
        Some(came.saturating_sub(self.on_the_way().unwrap_or_default()))
    }
}

/// A frame of a live source.
#[derive(Clone, Debug)]
pub struct LiveFrame {
    pub grey: Vec<u8>,
    pub moment: Moment,
}

/// A source's format, known before the first frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Format {
    pub size: (usize, usize),
    /// Frames per second, if known.
    pub rate_hz: Option<f32>,
}

/// The next event of a source.
#[derive(Debug)]
pub enum Next {
    /// The source is open, with this format.
    Begin(Format),
    Frame(LiveFrame),
    /// Nothing arrived in the given time.
    Nothing,
    /// The source has ended.
    End(Result<(), StreamError>),
}

/// A queue of frames between two threads.
pub struct Waiting {
    state: Mutex<State>,
    changed: Condvar,
    /// Whether new frames replace old ones; otherwise the producer blocks.
    drops: bool,
}

#[derive(Default)]
struct State {
    format: Option<Format>,
    frames: VecDeque<LiveFrame>,
    /// Number of frames dropped since the last one queued.
    dropped: u64,
    end: Option<Result<(), StreamError>>,
    /// The consumer has left.
    is_left: bool,
}

impl Waiting {
    pub fn new(drops: bool) -> Self {
        Self {
            state: Mutex::default(),
            changed: Condvar::new(),
            drops,
        }
    }

    /// Queues all frames of a stream.
    pub fn fill<R: BufRead>(&self, opened: Result<Stream<R>, StreamError>, mut times: Option<FrameTimes>) {
        let end = opened.and_then(|mut stream| {
            let (size, rate_hz) = (stream.size(), stream.rate());
            self.change(|state| state.format = Some(Format { size, rate_hz }));
            while let Some(grey) = stream.next_frame()? {
                let (grey, arrival) = (grey.to_vec(), Arrival::now());
                let told = times.as_mut().map(|times| times.next(stop()));
                if matches!(told, Some(Err(_))) {
                    times = None;
                }
                let moment = Moment {
                    time: told.and_then(Result::ok).flatten(),
                    arrival: Some(arrival),
                    after_dropped: 0,
                };
                let is_wanted = self.put(LiveFrame { grey, moment });
                if !is_wanted {
                    break;
                }
            }
            Ok(())
        });
        self.end(end);
    }

    /// Marks the end of the source.
    pub fn end(&self, end: Result<(), StreamError>) {
        self.change(|state| state.end = Some(end));
    }

    /// Queues a frame; returns whether more frames are wanted.
    fn put(&self, mut frame: LiveFrame) -> bool {
        let mut state = self.lock();
        while !self.drops && state.frames.len() >= WAITING_MAX && !state.is_left {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.frames.len() >= WAITING_MAX {
            // Drop all, so that the frames between two gaps are consecutive.
            let dropped: u64 = state.frames.drain(..).map(|old| 1 + old.moment.after_dropped).sum();
            state.dropped += dropped;
        }
        frame.moment.after_dropped = std::mem::take(&mut state.dropped);
        state.frames.push_back(frame);
        self.changed.notify_all();
        !state.is_left
    }

    /// Takes the next event from the queue, waiting up to `patience`.
    pub fn next(&self, patience: Duration) -> Next {
        let is_empty = |state: &mut State| state.format.is_none() && state.frames.is_empty() && state.end.is_none();
        let waited = self.changed.wait_timeout_while(self.lock(), patience, is_empty);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner).0;
        if let Some(format) = state.format.take() {
            return Next::Begin(format);
        }
        let next = match state.frames.pop_front() {
            Some(frame) => Next::Frame(frame),
            None => state.end.take().map_or(Next::Nothing, Next::End),
        };
        self.changed.notify_all();
        next
    }

    /// Stops consuming.
    pub fn leave(&self) {
        self.change(|state| state.is_left = true);
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use reception::colour::Channel;

    /// Frames of one pixel with their number as grey level.
    fn film(frames: u8) -> Vec<u8> {
        let frames = (0..frames).flat_map(|number| [b"FRAME\n".as_slice(), &[number]].concat());
        b"YUV4MPEG2 W1 H1 F30:1 Cmono\n".iter().copied().chain(frames).collect()
    }

    fn fill(waiting: &Waiting, film: &[u8]) {
        waiting.fill(Stream::open(film, None, Channel::Grey), None);
    }

    /// The number of each frame taken, and the drop count before it.
    fn taken(waiting: &Waiting) -> Vec<(u8, u64)> {
        let mut taken = Vec::new();
        loop {
            match waiting.next(Duration::from_secs(60)) {
                Next::Begin(format) => assert_eq!((format.size, format.rate_hz), ((1, 1), Some(30.0))),
                Next::Frame(frame) => taken.push((frame.grey[0], frame.moment.after_dropped)),
                Next::End(Ok(())) => return taken,
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn old_frames_make_room_for_new_ones_and_are_counted() {
        let waiting = Waiting::new(true);
        fill(&waiting, &film(11));
        assert_eq!(taken(&waiting), [(8, 8), (9, 0), (10, 0)]);
    }

    #[test]
    fn no_frame_is_dropped_where_new_ones_can_wait() {
        let waiting = Waiting::new(false);
        let taken = std::thread::scope(|scope| {
            scope.spawn(|| fill(&waiting, &film(100)));
            taken(&waiting)
        });
        assert_eq!(taken, (0..100).map(|number| (number, 0)).collect::<Vec<_>>());
    }

    #[test]
    fn who_fills_ends_when_nobody_takes_any_more() {
        let waiting = Waiting::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| fill(&waiting, &film(100)));
            waiting.leave();
        });
        assert!(matches!(waiting.next(Duration::ZERO), Next::Begin(_)));
    }

    #[test]
    fn a_sources_clock_counts_where_it_is_the_wall_clock() {
        let came_s = 1_800_000_000.0;
        let moment = |time_s| Moment {
            time: Some(FrameTime {
                time_s,
                tick_s: 1e-6,
                rate_hz: None,
            }),
            arrival: Some(Arrival {
                at: Instant::now(),
                unix: Duration::from_secs_f64(came_s),
            }),
            after_dropped: 0,
        };
        for (time_s, on_the_way_s, taken_s) in [
            (came_s - 0.25, Some(0.25), came_s - 0.25),
            (came_s + 0.25, Some(0.0), came_s),
            (12.0, None, came_s),
        ] {
            let moment = moment(time_s);
            assert_eq!(moment.on_the_way().map(|way| way.as_secs_f64()), on_the_way_s);
            assert_eq!(moment.unix().map(|unix| unix.as_secs_f64()), Some(taken_s));
        }
    }

    #[test]
    fn nothing_comes_of_a_source_that_is_silent() {
        let waiting = Waiting::new(true);
        assert!(matches!(waiting.next(Duration::ZERO), Next::Nothing));
        fill(&waiting, b"");
        assert!(matches!(waiting.next(Duration::ZERO), Next::End(Err(StreamError::Empty))));
    }
}
