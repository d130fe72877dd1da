//! Random and mutated frames against the service: it answers exactly the whole requests among them, acts on nothing
//! else, and is there for the next one. None of them opens a lock or changes anything behind it.
//!
//! A million frames run with all tests. Ten million:
//!
//! ```sh
//! VOCC_TEST_CASES=all cargo test --release -p vocc-tx-firmware --test serial_fuzz
//! ```

#[cfg(feature = "signing")]
mod flash;
mod frames;

use frames::{Random, contents, is_whole_request};
use link::intensity::IntensityLimit;
use link::l2a_table::L2aTable;
use link::serial::{ANSWER_FRAME_MAX, Answer, FrameReader, Kind, Request, encode};
use link::waveform::SymbolTiming;
use tx_firmware::ambient::Smoothing;
use tx_firmware::calibration::{BENCH, Calibration};
use tx_firmware::matrix::RecordingMatrix;
use tx_firmware::service::{ANSWER_MAX, Device, Identity, Service};
use tx_firmware::store::{Memory, StoreError};
use tx_firmware::transmitter::Transmitter;

/// A transmitter that counts how often anything of it was changed.
struct Recorder {
    transmitter: Transmitter<RecordingMatrix>,
    acts: u64,
}

impl Device for Recorder {
    type Matrix = RecordingMatrix;

    fn read<R>(&self, read: impl FnOnce(&Transmitter<RecordingMatrix>) -> R) -> R {
        read(&self.transmitter)
    }

    fn change<R>(&mut self, change: impl FnOnce(&mut Transmitter<RecordingMatrix>) -> R) -> R {
        self.acts += 1;
        change(&mut self.transmitter)
    }
}

/// A memory that fails now and then.
struct Unsteady(u32);

impl Unsteady {
    fn save(&mut self) -> Result<(), StoreError> {
        self.0 = self.0.wrapping_add(1);
        if self.0.is_multiple_of(3) { Err(StoreError::Flash) } else { Ok(()) }
    }
}

impl Memory for Unsteady {
    fn save_table(&mut self, _: &L2aTable) -> Result<(), StoreError> {
        self.save()
    }

    fn save_calibration(&mut self, _: &Calibration) -> Result<(), StoreError> {
        self.save()
    }

    fn save_timing(&mut self, _: SymbolTiming) -> Result<(), StoreError> {
        self.save()
    }

    fn save_intensity_limit(&mut self, _: Option<IntensityLimit>) -> Result<(), StoreError> {
        self.save()
    }
}

/// Counts over the frames.
#[derive(Debug, Default)]
struct Tally {
    frames: u64,
    requests: u64,
    acts: u64,
}

/// A transmitter, its memory and its service.
struct Board<M> {
    recorder: Recorder,
    memory: M,
    service: Service,
    /// Number of the last request that a test sent by itself.
    #[cfg(feature = "signing")]
    sequence: u32,
}

impl<M: Memory> Board<M> {
    fn new(memory: M) -> Self {
        let calibration = Calibration::new(BENCH).expect("possible values");
        Self {
            recorder: Recorder {
                transmitter: Transmitter::new(RecordingMatrix::default(), calibration, L2aTable::default(), Smoothing::default()),
                acts: 0,
            },
            memory,
            service: Service::new(Identity {
                firmware: "fuzzed",
                board: "none",
            }),
            #[cfg(feature = "signing")]
            sequence: 0,
        }
    }

    fn receive<'a>(&mut self, byte: u8, out: &'a mut [u8; ANSWER_MAX]) -> Option<&'a [u8]> {
        self.service.receive(byte, &mut self.recorder, &mut self.memory, out)
    }

    /// Sends random frames, each followed by a hello.
    fn fuzz(&mut self, frames: u64, seed: u64) -> Tally {
        println!("seed {seed}");
        let mut random = Random::new(seed);
        let mut tally = Tally::default();
        let (mut wire, mut pending) = (Vec::new(), Vec::new());
        let before = self.recorder.acts;
        while tally.frames < frames {
            wire.clear();
            frames::next(&mut random, &mut wire);
            // A whole frame in the end: whatever came before, it must be answered.
            let sequence = random.number() as u32;
            let mut hello = [0; 32];
            wire.extend_from_slice(encode(Kind::Request, sequence, &Request::Hello, &mut hello).expect("it fits"));
            tally.frames += 2;

            let mut answers = 0;
            let mut last = None;
            for &byte in &wire {
                let before = self.recorder.acts;
                let mut out = [0; ANSWER_MAX];
                let answer = self.receive(byte, &mut out);
                let expected = contents(&mut pending, byte).is_some_and(|content| is_whole_request(&content));
                assert_eq!(answer.is_some(), expected, "seed {seed}, frame {}", tally.frames);
                if let Some(answer) = answer {
                    answers += 1;
                    last = read(answer);
                }
                assert!(expected || self.recorder.acts == before, "acted on a bad frame: seed {seed}");
            }
            assert_eq!(last, Some((sequence, true)), "seed {seed}, frame {}", tally.frames);
            tally.requests += answers;
        }
        tally.acts = self.recorder.acts - before;
        tally
    }
}

/// The number of an answer, and whether it says hello.
fn read(answer: &[u8]) -> Option<(u32, bool)> {
    let mut reader = FrameReader::<ANSWER_FRAME_MAX>::new();
    let mut found = None;
    for &byte in answer {
        if let Some(frame) = reader.push(byte) {
            let frame = frame.expect("answers are whole");
            let answer = frame.answer().expect("answers are answers");
            found = Some((frame.sequence(), matches!(answer, Answer::Hello(_))));
        }
    }
    found
}

/// A million frames, or ten where all cases are asked for, which takes a minute in the release profile.
#[test]
fn a_million_frames_are_answered_exactly_where_they_are_whole_requests() {
    let (frames, seed) = match std::env::var("VOCC_TEST_CASES").as_deref() {
        Ok("all") => (10_000_000, 2),
        _ => (1_000_000, 1),
    };
    let tally = Board::new(Unsteady(0)).fuzz(frames, seed);
    println!("{tally:?}");
    assert!(tally.requests > frames / 2 && tally.acts > frames / 100, "{tally:?}");
}

/// Frames against a lock: permits and keys are guessed, and nothing is stored, shown or sent.
#[cfg(feature = "signing")]
mod locked {
    use link::serial::Seed;
    use link::signing::SecretKey;
    use tx_firmware::store::Store;

    use super::*;
    use crate::flash::{ERASE, Flash};

    impl<M: Memory> Board<M> {
        /// Sends one request, and returns its answer as text.
        fn ask(&mut self, request: &Request<'_>) -> String {
            self.sequence += 1;
            let mut wire = [0; 200];
            let mut reader = FrameReader::<ANSWER_FRAME_MAX>::new();
            for &byte in encode(Kind::Request, self.sequence, request, &mut wire).expect("it fits") {
                let mut out = [0; ANSWER_MAX];
                for &byte in self.receive(byte, &mut out).unwrap_or_default() {
                    if let Some(frame) = reader.push(byte) {
                        return format!("{:?}", frame.expect("whole").answer().expect("an answer"));
                    }
                }
            }
            panic!("no answer");
        }
    }

    #[test]
    fn no_frame_opens_a_lock_or_changes_anything_behind_it() {
        let (frames, seed) = match std::env::var("VOCC_TEST_CASES").as_deref() {
            Ok("all") => (2_000_000, 4),
            _ => (100_000, 3),
        };
        let store = Store::new(Flash::<4>::new(), 0..2 * ERASE as u32).expect("a store");
        let store = store.beside_program(2 * ERASE as u32..3 * ERASE as u32);
        let mut board = Board::new(store);
        board.ask(&Request::WriteKey {
            seed: Seed(&[7; 32]),
            counter: 5,
        });
        let owner = SecretKey::from_seed([1; 32]).expect("a key").public().to_bytes();
        board.ask(&Request::WriteLock { key: &owner, salt: 9 });
        let settings = [
            Request::ReadKey,
            Request::ReadCalibration,
            Request::ReadSymbolRate,
            Request::ReadCarrier,
            Request::ReadIntensityLimit,
            Request::ReadTable { offset: 0 },
        ];
        let before = settings.map(|request| board.ask(&request));
        let lock = board.ask(&Request::ReadLock);

        let tally = board.fuzz(frames, seed);
        println!("{tally:?}");

        assert!(tally.requests > frames / 2 && tally.acts == 0, "{tally:?}");
        assert_eq!(settings.map(|request| board.ask(&request)), before);
        assert_eq!(board.ask(&Request::EraseKey), "Refused(Locked)");
        assert!(lock.contains("salt: Some(9)") && board.ask(&Request::ReadLock).contains("salt: Some(9)"));
    }
}
