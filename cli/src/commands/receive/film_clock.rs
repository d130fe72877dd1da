//! Numbers a film's frames by their time stamps: films have gaps, and phones do not keep their rate.

use std::sync::mpsc::RecvTimeoutError;
use std::time::Instant;

use anyhow::Result;
use reception::{ReceptionError, Stamp};
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::CARRIER_GAP_MAX;

use super::session::Session;
use crate::frames::film::{FrameTime, FrameTimes};
use crate::frames::stamps::numbered;
use crate::frames::waiting::{LiveFrame, Moment};
use crate::stop::stop;

/// Frames that determine the usual frame period.
const FIRST_FRAMES: usize = 16;
/// Maximum bytes held for it.
const FIRST_BYTES: usize = 128 << 20;
/// Containers state the frame rate, or a multiple of it that all times fit. It is the frame rate if the usual step is shorter than this
/// many periods.
const STEP_MAX: f64 = 1.5;
/// A live source's clock that has stood still for this many frames is ignored.
const STUCK_MAX: usize = 16;
/// A live source's clock that advances this much more than real time was set forward.
const JUMP_S: f64 = 1.0;

const STUCK: &str = "the clock of the live source stands still: from here on its frames are numbered by their arrival";
const ALL_AT_ONCE: &str = "all frames of the live source have one time: they are numbered by their arrival";

/// Passes a film's frames to a session, each with its stamp.
pub struct FilmClock {
    /// `None` once ffmpeg reports no more times, and for live sources, whose frames carry their times.
    times: Option<FrameTimes>,
    /// Whether frames lack times.
    is_untimed: bool,
    size: (usize, usize),
    /// Frames per second from the film's header.
    rate_hz: f64,
    /// The first frames, held until their rate is known.
    held: Vec<(Vec<u8>, Moment)>,
    pace: Option<Pace>,
}

impl FilmClock {
    /// A clock for frames of this size and the times of a film; `rate_hz` is from its header.
    pub fn new(times: Option<FrameTimes>, size: (usize, usize), rate_hz: f32) -> Self {
        Self {
            times,
            is_untimed: false,
            size,
            rate_hz: rate_hz.into(),
            held: Vec::new(),
            pace: None,
        }
    }

    /// Processes the next frame of a film.
    pub fn frame(&mut self, session: &mut Session, grey: &[u8]) -> Result<()> {
        let time = match self.times.as_mut().map_or(Ok(None), |times| times.next(stop())) {
            Ok(time) => time,
            Err(why) => {
                self.times = None;
                self.is_untimed = true;
                if why == RecvTimeoutError::Timeout && !stop().is_asked() {
                    session.say("ffmpeg reports no more frame times: from here on frames are assumed to be evenly spaced");
                }
                None
            }
        };
        let moment = Moment { time, ..Moment::default() };
        self.take(session, grey, moment)
    }

    /// Processes the next frame of a live source.
    pub fn live(&mut self, session: &mut Session, frame: &LiveFrame) -> Result<()> {
        self.is_untimed |= frame.moment.time.is_none();
        self.take(session, &frame.grey, frame.moment)
    }

    fn take(&mut self, session: &mut Session, grey: &[u8], moment: Moment) -> Result<()> {
        if let Some(pace) = &mut self.pace {
            return pace.give(session, grey, moment, self.size);
        }
        self.held.push((grey.to_vec(), moment));
        let most = (FIRST_BYTES / grey.len().max(1)).clamp(2, FIRST_FRAMES);
        if self.is_untimed || self.held.len() >= most {
            self.begin(session)?;
        }
        Ok(())
    }

    /// Checks that a frame has the size of those before.
    pub fn check_size(&self, size: (usize, usize)) -> Result<()> {
        let film = self.size;
        Ok((size == film).then_some(()).ok_or(ReceptionError::Size { size, film })?)
    }

    /// Continues with a new source of the same camera: the next frame's number follows from its arrival.
    pub fn resume(&mut self, session: &mut Session) -> Result<()> {
        if self.pace.is_none() {
            self.begin(session)?;
        }
        if let Some(pace) = &mut self.pace {
            pace.resumes = true;
        }
        Ok(())
    }

    /// Flushes the held frames if the film ended before its rate was known, and reports how many frames were skipped.
    pub fn finish(&mut self, session: &mut Session) -> Result<()> {
        if self.pace.is_none() {
            self.begin(session)?;
        }
        session.say_doubled(self.pace.as_ref().map_or(0, |pace| pace.doubled));
        Ok(())
    }

    fn begin(&mut self, session: &mut Session) -> Result<()> {
        let told: Vec<FrameTime> = self.held.iter().filter_map(|(_, moment)| moment.time).collect();
        let is_live = self.held.iter().any(|(_, moment)| moment.arrival.is_some());
        let mut pace = Pace::of(&told, self.rate_hz);
        if told.len() > 1 && told.iter().all(|time| time.time_s == told[0].time_s) {
            if is_live {
                session.say(ALL_AT_ONCE);
                pace.ignores_times = true;
            } else {
                session.say("all frames of the film have one time: they are assumed to be evenly spaced");
                self.times = None;
                self.held.iter_mut().for_each(|(_, moment)| moment.time = None);
            }
        }
        session.set_usual_fps(pace.rate_hz as f32)?;
        for (grey, moment) in self.held.drain(..) {
            pace.give(session, &grey, moment, self.size)?;
        }
        self.pace = Some(pace);
        Ok(())
    }
}

/// Converts times to stamps.
#[derive(Debug)]
struct Pace {
    rate_hz: f64,
    /// The time of frame number 0.
    from_s: f64,
    /// The time and the number of the last frame.
    last: Option<(f64, u64)>,
    /// Arrival time of the last frame of a live source.
    last_came: Option<Instant>,
    /// Whether the next frame starts a new time base.
    resumes: bool,
    /// Frames with the time of the frame before (count).
    doubled: usize,
    /// The number of these since the last other frame.
    stuck: usize,
    /// Whether a live source's clock stands still, so that frames are numbered by their arrival.
    ignores_times: bool,
    /// The arrival and the number that further frames are numbered from.
    arrived: Option<(Instant, u64)>,
}

impl Pace {
    /// A pace from the first frames' times and the rate in the film's header.
    fn of(told: &[FrameTime], header_hz: f64) -> Self {
        let mut steps_s: Vec<f64> = told.windows(2).map(|pair| pair[1].time_s - pair[0].time_s).collect();
        steps_s.retain(|&step_s| step_s > 0.0);
        steps_s.sort_by(f64::total_cmp);
        let told_hz = told.first().and_then(|time| time.rate_hz).unwrap_or(header_hz);
        let usual_s = steps_s.get(steps_s.len() / 2).copied();
        Self {
            rate_hz: usual_s.filter(|usual_s| usual_s * told_hz > STEP_MAX).map_or(told_hz, f64::recip),
            from_s: 0.0,
            last: None,
            last_came: None,
            resumes: false,
            doubled: 0,
            stuck: 0,
            ignores_times: false,
            arrived: None,
        }
    }

    fn give(&mut self, session: &mut Session, grey: &[u8], mut moment: Moment, (width, height): (usize, usize)) -> Result<()> {
        if !self.ignores_times && self.is_stuck(&moment) {
            session.say(STUCK);
            self.ignores_times = true;
        }
        if self.ignores_times {
            moment.time = None;
        }
        match self.stamp(&moment) {
            Some(stamp) => session.frame(stamp, &Frame::new(grey, width, height)?, &moment),
            None => Ok(()),
        }
    }

    /// Counts frames with the time of the frame before; returns whether a live source has shown too many of them.
    fn is_stuck(&mut self, moment: &Moment) -> bool {
        let repeats = moment.time.zip(self.last).is_some_and(|(time, (last_s, _))| time.time_s == last_s);
        self.stuck = if repeats { self.stuck + 1 } else { 0 };
        self.stuck > STUCK_MAX && moment.arrival.is_some()
    }

    /// The stamp of a frame of a live source whose clock stands still. Frames that arrive together are consecutive: a connection delays
    /// and bundles them, so that a late arrival gives no information about the exposure time within its period.
    fn stamp_by_arrival(&mut self, came: Option<Instant>, gap: u64) -> Stamp {
        let next = self.last.map_or(0, |(_, last)| last.saturating_add(gap));
        let periods = came.map_or(0.0, |came| {
            let (from, number) = *self.arrived.get_or_insert((came, next));
            number as f64 + came.saturating_duration_since(from).as_secs_f64() * self.rate_hz
        });
        let (number, _) = numbered(periods, next);
        self.last = Some((f64::NAN, number));
        Stamp::of(number)
    }

    /// A frame's stamp; `None` if it repeats the time of the frame before.
    fn stamp(&mut self, moment: &Moment) -> Option<Stamp> {
        let time = moment.time;
        let came = moment.arrival.map(|arrival| arrival.at);
        let last_came = std::mem::replace(&mut self.last_came, came);
        let resumes = std::mem::take(&mut self.resumes);
        // A reopened source exposes at another phase: a gap discards what was learnt about the carrier.
        let gap = if resumes { CARRIER_GAP_MAX as u64 + 1 } else { 1 };
        if self.ignores_times {
            return Some(self.stamp_by_arrival(came, gap.saturating_add(moment.after_dropped)));
        }
        let Some((last_s, last)) = self.last else {
            self.from_s = time.map_or(0.0, |time| time.time_s);
            self.last = Some((self.from_s, 0));
            return Some(Stamp::of(0));
        };
        let follows_s = last_s + (1 + moment.after_dropped) as f64 / self.rate_hz;
        let (time_s, tick_s) = time.map_or((follows_s, 0.0), |time| (time.time_s, time.tick_s));
        if time_s == last_s && !resumes {
            self.doubled += 1;
            return None;
        }
        let mut next = last.saturating_add(gap);
        let waited_s = came
            .zip(last_came)
            .map(|(came, last)| came.saturating_duration_since(last).as_secs_f64());
        let is_ahead = waited_s.is_some_and(|waited_s| time.is_some() && time_s - last_s > waited_s + JUMP_S);
        if resumes || is_ahead || time_s < last_s {
            // The clock was set or replaced: number the next frame by the real time that passed.
            next = next.max(last.saturating_add((waited_s.unwrap_or_default() * self.rate_hz).round() as u64));
            self.from_s = time_s - next as f64 / self.rate_hz;
        }
        let (number, late) = numbered((time_s - self.from_s) * self.rate_hz, next);
        self.last = Some((time_s, number));
        // A deviation within one tick is rounding.
        let is_on_time = late.abs() <= tick_s * self.rate_hz;
        Some(Stamp {
            number,
            late: if is_on_time { 0.0 } else { late },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::waiting::Arrival;
    use std::time::Duration;

    /// Frames at multiples of a tick, of a film that states a rate.
    fn times(ticks: &[i32], tick_s: f64, rate_hz: f64) -> Vec<FrameTime> {
        let time = |&tick: &i32| FrameTime {
            time_s: f64::from(tick) * tick_s,
            tick_s,
            rate_hz: Some(rate_hz),
        };
        ticks.iter().map(time).collect()
    }

    fn stamps(times: &[FrameTime]) -> (f64, Vec<(u64, f64)>) {
        let mut pace = Pace::of(times, 25.0);
        let moment = |&time: &FrameTime| Moment {
            time: Some(time),
            ..Moment::default()
        };
        let stamps = times.iter().filter_map(|time| pace.stamp(&moment(time)));
        let stamps = stamps.map(|stamp| (stamp.number, (100.0 * stamp.late).round() / 100.0)).collect();
        (pace.rate_hz, stamps)
    }

    #[test]
    fn a_steady_film_is_on_time_whatever_its_times_are_rounded_to() {
        // 30 frames a second, in milliseconds.
        let ticks: Vec<i32> = (0..100).map(|k| (f64::from(k) * 1e3 / 30.0).round() as i32).collect();
        let (rate_hz, stamps) = stamps(&times(&ticks, 1e-3, 30.0));
        assert_eq!(rate_hz, 30.0);
        assert!(stamps.iter().enumerate().all(|(k, &stamp)| stamp == (k as u64, 0.0)), "{stamps:?}");
    }

    #[test]
    fn gaps_and_unsteady_frames_are_counted_by_their_times() {
        let ticks = [0, 40, 80, 126, 160, 160, 200, 600_200, 600_240];
        let (rate_hz, found) = stamps(&times(&ticks, 1e-3, 25.0));
        assert_eq!(rate_hz, 25.0);
        let expected = [
            (0, 0.0),
            (1, 0.0),
            (2, 0.0),
            (3, 0.15),
            (4, 0.0),
            (5, 0.0),
            (15_005, 0.0),
            (15_006, 0.0),
        ];
        assert_eq!(found, expected);
        // A container's time base is not a frame rate.
        let (rate_hz, found) = stamps(&times(&ticks, 1e-3, 1000.0));
        assert_eq!((rate_hz, found), (25.0, expected.to_vec()));
    }

    #[test]
    fn a_clock_that_is_set_back_goes_on() {
        let (_, found) = stamps(&times(&[1000, 1040, 1080, 0, 40, 120], 1e-3, 25.0));
        assert_eq!(found, [(0, 0.0), (1, 0.0), (2, 0.0), (3, 0.0), (4, 0.0), (6, 0.0)]);
    }

    #[test]
    fn a_live_sources_clock_may_stand_still() {
        let begun = Instant::now();
        let mut pace = Pace::of(&times(&[7, 7], 1e-3, 25.0), 25.0);
        pace.ignores_times = true;
        let mut number = |came_ms: u64, after_dropped| {
            let arrival = Arrival {
                at: begun + Duration::from_millis(came_ms),
                unix: Duration::ZERO,
            };
            let stamp = pace.stamp(&Moment {
                time: None,
                arrival: Some(arrival),
                after_dropped,
            });
            stamp.map(|stamp| (stamp.number, stamp.late))
        };
        for (came_ms, after_dropped, expected) in [
            (0, 0, 0),
            (40, 0, 1),
            // Late within its period, then two in a bundle.
            (95, 0, 2),
            (160, 0, 4),
            (160, 0, 5),
            (200, 0, 6),
            // Three were lost on the way, and then four dropped here.
            (400, 0, 10),
            (400, 4, 15),
            (640, 0, 16),
        ] {
            assert_eq!(number(came_ms, after_dropped), Some((expected, 0.0)), "at {came_ms} ms");
        }
    }

    #[test]
    fn a_live_sources_clock_that_stops_is_noticed() {
        let mut pace = Pace::of(&times(&[0, 40], 1e-3, 25.0), 25.0);
        let moment = |tick: i32, arrival| Moment {
            time: Some(times(&[tick], 1e-3, 25.0)[0]),
            arrival,
            after_dropped: 0,
        };
        let mut is_stuck = |tick, arrival| {
            let is_stuck = pace.is_stuck(&moment(tick, arrival));
            pace.stamp(&moment(tick, arrival));
            is_stuck
        };
        for tick in (0..40).chain([40; STUCK_MAX]).chain([41]).chain([42; STUCK_MAX]) {
            assert!(!is_stuck(tick, Some(Arrival::now())), "{tick}");
        }
        // A film's frames do not arrive.
        assert!(!is_stuck(42, None));
        assert!(is_stuck(42, Some(Arrival::now())));
    }

    #[test]
    fn frames_without_times_follow_one_another() {
        let mut pace = Pace::of(&[], 25.0);
        let stamps = (0..3).filter_map(|_| pace.stamp(&Moment::default()));
        assert_eq!(stamps.collect::<Vec<_>>(), [0, 1, 2].map(Stamp::of));
    }

    #[test]
    fn a_live_sources_clock_may_jump_and_be_another() {
        let begun = Instant::now();
        let mut pace = Pace::of(&times(&[0, 40, 80], 1e-3, 25.0), 25.0);
        let mut stamp = |came_ms: u64, tick: Option<i32>, after_dropped| {
            let moment = Moment {
                time: tick.map(|tick| times(&[tick], 1e-3, 25.0)[0]),
                arrival: Some(Arrival {
                    at: begun + Duration::from_millis(came_ms),
                    unix: Duration::ZERO,
                }),
                after_dropped,
            };
            pace.resumes |= tick == Some(7);
            pace.stamp(&moment)
                .map(|stamp| (stamp.number, (100.0 * stamp.late).round() / 100.0))
        };
        for (came_ms, tick, after_dropped, number) in [
            (0, Some(0), 0, 0),
            (45, Some(40), 0, 1),
            // A gap, and then a burst of frames.
            (2045, Some(2040), 0, 51),
            (2045, Some(2080), 0, 52),
            // The clock set forward by an hour, and back.
            (2125, Some(3_602_160), 0, 54),
            (2160, Some(3_602_200), 0, 55),
            (2200, Some(2240), 0, 56),
            // Another source after ten seconds: its clock restarts, or continues.
            (12_200, Some(7), 0, 306),
            (12_240, Some(47), 0, 307),
            // Without times, dropped frames count.
            (12_240, None, 0, 308),
            (12_240, None, 4, 313),
            // Another source at once.
            (12_280, Some(7), 0, 378),
            (12_320, Some(47), 0, 379),
        ] {
            assert_eq!(stamp(came_ms, tick, after_dropped), Some((number, 0.0)), "at {came_ms} ms");
        }
    }
}
