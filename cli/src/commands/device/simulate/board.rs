//! A board without hardware: the firmware's transmitter, service and store, and a clock.

use std::time::Duration;

use anyhow::Context;
use link::panel::PanelFrame;
use link::waveform::SymbolTiming;
use tx_firmware::calibration::{BENCH, Calibration};
use tx_firmware::service::{ANSWER_MAX, Identity, Service};
use tx_firmware::store::Store;
use tx_firmware::transmitter::Transmitter;

use super::flash::{FLASH_BYTES, Flash};
use super::leds::Leds;
use super::light_sensor::LightSensor;

/// Interval between readings of the light.
const SENSOR_PERIOD: Duration = Duration::from_millis(100);

const IDENTITY: Identity = Identity {
    firmware: env!("CARGO_PKG_VERSION"),
    board: "simulated",
};

/// The LEDs' state from a time on.
#[derive(Clone, Copy, Debug)]
pub struct Symbol {
    /// The time since the start.
    pub at: Duration,
    pub panel: PanelFrame,
    /// The light of an On LED, relative to full light.
    pub light: f64,
    pub timing: SymbolTiming,
}

/// A running transmitter.
pub struct Board {
    transmitter: Transmitter<Leds>,
    service: Service,
    store: Store<Flash>,
    /// The time of the start.
    began: Duration,
    /// The time of the next symbol.
    next_symbol: Duration,
    /// Number of readings since the start.
    readings: u32,
    /// Whether its symbol clock stands still.
    is_halted: bool,
}

impl Board {
    /// Starts with the contents of the flash, or as a new board if it is empty.
    pub fn start(flash: Flash, began: Duration) -> anyhow::Result<Self> {
        let mut store = Store::new(flash, 0..FLASH_BYTES as u32)?;
        let typical = Calibration::new(BENCH).context("the bench's panel")?;
        let start = store.remembered::<Leds>(typical);
        let leds = Leds::new(start.calibration.measured());
        let transmitter = Transmitter::from_store(leds, start);
        Ok(Self {
            transmitter,
            service: Service::new(IDENTITY),
            store,
            began,
            next_symbol: began,
            readings: 0,
            is_halted: false,
        })
    }

    /// Stops the symbols until the board is restarted.
    pub fn halt(&mut self) {
        self.is_halted = true;
    }

    /// The board after a power cut in place of the next symbol.
    pub fn restarted(self) -> anyhow::Result<Self> {
        Self::start(self.store.release(), self.next_symbol)
    }

    /// The answer to these bytes.
    pub fn exchange(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut room = [0; ANSWER_MAX];
        let mut answers = Vec::new();
        for &byte in bytes {
            let (transmitter, store) = (&mut self.transmitter, &mut self.store);
            let answer = self.service.receive(byte, transmitter, store, &mut room);
            answers.extend_from_slice(answer.unwrap_or_default());
        }
        answers
    }

    /// Runs until `now`. Returns the next symbol that begins before, if any.
    pub fn advance(&mut self, now: Duration, sensor: &mut LightSensor) -> Option<Symbol> {
        if self.is_halted {
            self.next_symbol = now + Duration::from_nanos(1);
        }
        let at = self.next_symbol;
        loop {
            let since_start = SENSOR_PERIOD * self.readings;
            if self.began + since_start > at.min(now) {
                break;
            }
            self.readings += 1;
            let range = self.transmitter.next_range();
            let now_ms = since_start.as_millis() as u64;
            let Ok(_) = self.transmitter.sense(now_ms, range, sensor.read());
        }
        if at > now {
            return None;
        }
        let timing = self.transmitter.timing_shown();
        self.next_symbol += Duration::from_secs_f64(1.0 / timing.rate().hz());
        let Ok(panel) = self.transmitter.tick();
        Some(Symbol {
            at,
            panel,
            light: self.transmitter.matrix().light(),
            timing,
        })
    }
}
