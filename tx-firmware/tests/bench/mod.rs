//! A transmitter on a bench: its service, its store, and a request at a time.

use link::l2a_table::L2aTable;
use link::serial::{ANSWER_FRAME_MAX, Answer, CHUNK_MAX, FrameReader, Kind, REQUEST_FRAME_MAX, Request, encode, wire_length};
use tx_firmware::ambient::Smoothing;
use tx_firmware::calibration::{BENCH, Calibration};
use tx_firmware::matrix::{LedMatrix, RecordingMatrix};
use tx_firmware::service::{ANSWER_MAX, Identity, Service};
use tx_firmware::store::Store;
use tx_firmware::transmitter::Transmitter;

use crate::flash::Flash;

pub struct Bench<M = RecordingMatrix> {
    pub transmitter: Transmitter<M>,
    pub store: Store<Flash<4>>,
    pub service: Service,
    pub sequence: u32,
}

impl Bench {
    pub fn new() -> Self {
        Self::of(RecordingMatrix::default())
    }
}

impl<M: LedMatrix> Bench<M> {
    pub fn of(matrix: M) -> Self {
        let calibration = Calibration::new(BENCH).expect("possible values");
        Self {
            transmitter: Transmitter::new(matrix, calibration, L2aTable::default(), Smoothing::default()),
            store: Store::new(Flash::new(), 0..8192).expect("a store"),
            service: Self::another_port(),
            sequence: 0,
        }
    }

    /// The service of a port that has received nothing.
    pub fn another_port() -> Service {
        Service::new(Identity {
            firmware: "1.2.3",
            board: "bench",
        })
    }

    /// The bytes that come back for these.
    pub fn exchange(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut answer = [0; ANSWER_MAX];
        let mut all = Vec::new();
        for &byte in bytes {
            let Self {
                transmitter,
                store,
                service,
                ..
            } = self;
            all.extend_from_slice(service.receive(byte, transmitter, store, &mut answer).unwrap_or_default());
        }
        all
    }

    /// The only answer among these bytes, to the request of that number.
    pub fn answer<R>(bytes: &[u8], sequence: u32, read: impl Fn(Answer<'_>) -> R) -> R {
        let mut reader = FrameReader::<ANSWER_FRAME_MAX>::new();
        let mut answers = Vec::new();
        for &byte in bytes {
            if let Some(frame) = reader.push(byte) {
                let frame = frame.expect("a whole frame");
                assert_eq!(frame.sequence(), sequence);
                answers.push(read(frame.answer().expect("an answer")));
            }
        }
        assert_eq!(answers.len(), 1, "one answer");
        answers.remove(0)
    }

    /// The transmitter's answer.
    pub fn ask<R>(&mut self, request: &Request<'_>, read: impl Fn(Answer<'_>) -> R) -> R {
        self.sequence += 1;
        self.repeat(request, read)
    }

    /// The transmitter's answer to a request with the sequence number of the last one.
    pub fn repeat<R>(&mut self, request: &Request<'_>, read: impl Fn(Answer<'_>) -> R) -> R {
        let mut wire = [0; wire_length(REQUEST_FRAME_MAX)];
        let wire = encode(Kind::Request, self.sequence, request, &mut wire).expect("it fits");
        let answer = self.exchange(wire);
        Self::answer(&answer, self.sequence, read)
    }

    /// Asserts what the transmitter answers.
    pub fn expect(&mut self, request: &Request<'_>, answer: &Answer<'_>) {
        let found = self.ask(request, |found| (found == *answer, format!("{found:?}")));
        assert!(found.0, "{request:?} gave {}, not {answer:?}", found.1);
    }

    /// Sends all parts of a table's image.
    #[allow(dead_code, reason = "not every test sends tables")]
    pub fn stage(&mut self, image: &[u8], crc: u32) {
        let length = image.len() as u16;
        self.expect(&Request::BeginTable { length, crc }, &Answer::Staged { received: 0 });
        for (index, bytes) in image.chunks(CHUNK_MAX).enumerate() {
            let offset = (index * CHUNK_MAX) as u16;
            let received = offset + bytes.len() as u16;
            self.expect(&Request::WriteTable { offset, bytes }, &Answer::Staged { received });
        }
    }
}
