//! A transmitter without a board: the firmware's own service with its memory in RAM.

use fixed::types::I32F32;
use link::intensity::IntensityLimit;
use link::l2a_table::L2aTable;
use link::waveform::SymbolTiming;
use tx_firmware::ambient::Smoothing;
use tx_firmware::calibration::{BENCH, Calibration};
use tx_firmware::light_watch::{LightSample, SensorRange};
use tx_firmware::matrix::RecordingMatrix;
use tx_firmware::program::ProgramHash;
use tx_firmware::service::{ANSWER_MAX, Identity, Service};
use tx_firmware::store::{Memory, StoreError};
use tx_firmware::transmitter::Transmitter;

/// The transmitter's persistent memory.
#[derive(Default)]
pub struct FakeMemory {
    pub table: Option<L2aTable>,
    pub timing: Option<SymbolTiming>,
    pub limit: Option<IntensityLimit>,
    /// The hash of its program, if it knows it.
    pub program_hash: Option<ProgramHash>,
    /// Why it can no longer be written to, if so.
    pub fault: Option<StoreError>,
}

impl FakeMemory {
    fn writable(&self) -> Result<(), StoreError> {
        self.fault.map_or(Ok(()), Err)
    }
}

impl Memory for FakeMemory {
    fn save_table(&mut self, table: &L2aTable) -> Result<(), StoreError> {
        self.writable()?;
        self.table = Some(table.clone());
        Ok(())
    }

    fn save_calibration(&mut self, _: &Calibration) -> Result<(), StoreError> {
        Ok(())
    }

    fn save_timing(&mut self, timing: SymbolTiming) -> Result<(), StoreError> {
        self.writable()?;
        self.timing = Some(timing);
        Ok(())
    }

    fn save_intensity_limit(&mut self, limit: Option<IntensityLimit>) -> Result<(), StoreError> {
        self.writable()?;
        self.limit = limit;
        Ok(())
    }

    fn program_hash(&mut self) -> Option<ProgramHash> {
        self.program_hash
    }
}

/// A transmitter in 2000 lx, with a table of L2A 2 everywhere.
pub struct Fake {
    pub transmitter: Transmitter<RecordingMatrix>,
    pub memory: FakeMemory,
    service: Service,
}

impl Fake {
    /// The initial table.
    pub fn first_table() -> L2aTable {
        L2aTable::new(&[1.0], &[1.0], &[2.0]).expect("a table")
    }

    pub fn new() -> Self {
        let calibration = Calibration::new(BENCH).expect("possible values");
        let mut transmitter = Transmitter::new(RecordingMatrix::default(), calibration, Self::first_table(), Smoothing::default());
        let light = LightSample::Light {
            lux: I32F32::lit("2000"),
            word: 0,
        };
        let Ok(_) = transmitter.sense(1000, SensorRange::Operating, light);
        Self {
            transmitter,
            memory: FakeMemory::default(),
            service: Service::new(Identity {
                firmware: "1.2.3",
                board: "fake",
            }),
        }
    }

    /// The answer to these bytes.
    pub fn exchange(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut answer = [0; ANSWER_MAX];
        let mut all = Vec::new();
        for &byte in bytes {
            let (transmitter, memory) = (&mut self.transmitter, &mut self.memory);
            if let Some(back) = self.service.receive(byte, transmitter, memory, &mut answer) {
                all.extend_from_slice(back);
            }
        }
        all
    }
}
