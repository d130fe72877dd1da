//! Each message is printed once, with a simulated receiver whose messages change from one status to the next.

use super::super::watch::{Item, MessageLog};
use super::*;
use link::serial::{FrameReader, Hello, Kind, encode, wire_length};
use link::signing::Verdict;
use rx_pipeline::standalone::{ANSWER_MAX, Counters, PART_MAX, REQUEST_MAX};

/// Its running time in s, and its messages since the start; one with `!` is known to be unsigned.
type Moment = (u64, &'static [&'static str]);

struct Scripted {
    moments: VecDeque<Moment>,
    now: Moment,
    /// The state between a status and the request for the message that follows.
    between: Option<Moment>,
    reader: FrameReader<REQUEST_MAX>,
    output: VecDeque<u8>,
}

impl Scripted {
    fn answer(&mut self, sequence: u32, request: Request) {
        if request == Request::Status {
            self.now = self.moments.pop_front().unwrap_or(self.now);
        } else if let Some(between) = self.between.take_if(|_| request == Request::Message && !self.now.1.is_empty()) {
            self.now = between;
        }
        let (uptime_s, messages) = self.now;
        let count = messages.len() as u32;
        let answer = match request {
            Request::Hello => standalone::Answer::Hello(Hello {
                schema: standalone::SCHEMA,
                firmware: "1",
                board: "receiver-script",
                chunk_max: PART_MAX as u16,
                message_max: 0,
            }),
            Request::Status => standalone::Answer::Status(Status {
                uptime_ms: 1000 * uptime_s,
                is_following: true,
                trouble: None,
                was_reset: false,
                corners: None,
                confidence: 1.0,
                symbol_millihertz: 9_000,
                frame_us: 0,
                longest_us: 0,
                stack_bytes: 0,
                counters: Counters {
                    messages: count,
                    ..Counters::default()
                },
            }),
            Request::Message => standalone::Answer::Message(standalone::Message {
                count,
                bytes: messages.last().map_or(&[], |text| text.trim_end_matches('!').as_bytes()),
                age_ms: 0,
                frames: 0,
                corrected_bits: 0,
                verdict: match messages.last() {
                    Some(text) if text.ends_with('!') => Verdict::Unsigned,
                    _ => Verdict::Unproven,
                },
            }),
            other => panic!("{other:?}"),
        };
        let mut wire = [0; wire_length(ANSWER_MAX)];
        self.output.extend(encode(Kind::Answer, sequence, &answer, &mut wire).unwrap());
    }
}

impl Write for Scripted {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        for &byte in bytes {
            let asked = self.reader.push(byte).and_then(|frame| {
                let frame = frame.unwrap();
                let request = frame.message(Kind::Request).ok()?;
                Some((frame.sequence(), request))
            });
            if let Some((sequence, request)) = asked {
                self.answer(sequence, request);
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Read for Scripted {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        if self.output.is_empty() {
            return Err(ErrorKind::TimedOut.into());
        }
        self.output.read(bytes)
    }
}

/// The output at each moment: a message's text, and the number of missed messages before it, or a verdict.
fn told(moments: &[Moment], between: Option<Moment>) -> Vec<Option<(String, u32)>> {
    let port = Scripted {
        moments: moments.iter().copied().collect(),
        now: (0, &[]),
        between,
        reader: FrameReader::new(),
        output: VecDeque::new(),
    };
    let mut client = Client::greet(port, Duration::from_secs(1), 5).unwrap();
    let mut status = asked_status(&mut client, "p").unwrap();
    let mut news = MessageLog::since(&status, &asked_message(&mut client, "p").unwrap());
    let mut told = Vec::new();
    for moment in 0..moments.len() {
        if moment > 0 {
            status = asked_status(&mut client, "p").unwrap();
        }
        let item = news.fetch(&mut client, "p", &status).unwrap();
        told.push(item.map(|item| match item {
            Item::Message(message, missed) => (text(&message.bytes), missed),
            Item::Verdict(message) => (message.verdict.to_string(), 0),
        }));
    }
    told
}

fn new(text: &str, missed: u32) -> Option<(String, u32)> {
    Some((text.into(), missed))
}

#[test]
fn each_message_is_told_once_as_it_comes() {
    let moments: &[Moment] = &[
        (10, &[]),
        (11, &["fog"]),
        (12, &["fog"]),
        (13, &["fog"]),
        (14, &["fog", "fog"]),
        (15, &["fog", "fog", "ice"]),
        (16, &["fog", "fog", "ice"]),
    ];
    let expected = [None, new("fog", 0), None, None, new("fog", 0), new("ice", 0), None];
    assert_eq!(told(moments, None), expected);
}

/// Messages from before the watch began are not new.
#[test]
fn earlier_messages_are_not_told() {
    let moments: &[Moment] = &[(10, &["old"]), (11, &["old"]), (12, &["old", "new"])];
    assert_eq!(told(moments, None), [None, None, new("new", 0)]);
}

#[test]
fn messages_that_were_too_fast_are_counted() {
    let moments: &[Moment] = &[(10, &["a"]), (11, &["a", "b", "c", "d"])];
    assert_eq!(told(moments, None), [None, new("d", 2)]);
    // Another message arrives between the two answers: it is printed once.
    let moments: &[Moment] = &[(10, &[]), (11, &["a"]), (12, &["a", "b"])];
    let expected = [None, new("b", 1), None];
    assert_eq!(told(moments, Some((11, &["a", "b"]))), expected);
}

/// The verdict comes after its message, once; that on an earlier message is not new.
#[test]
fn each_verdict_is_told_once_as_it_comes() {
    let moments: &[Moment] = &[
        (10, &["fog!"]),
        (11, &["fog!", "ice"]),
        (12, &["fog!", "ice!"]),
        (13, &["fog!", "ice!"]),
    ];
    assert_eq!(told(moments, None), [None, new("ice", 0), new("unsigned", 0), None]);
}

/// A receiver that restarts counts from 1 again.
#[test]
fn messages_after_a_restart_are_new() {
    let moments: &[Moment] = &[(10, &["a", "b"]), (1, &[]), (2, &["b"]), (3, &["b"])];
    assert_eq!(told(moments, None), [None, None, new("b", 0), None]);
    let moments: &[Moment] = &[(10, &["a"]), (3, &["b"]), (4, &["b"])];
    assert_eq!(told(moments, None), [None, new("b", 0), None]);
}
