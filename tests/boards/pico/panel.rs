//! The panels that the LEDs of an emulated board showed, from the levels of its pins.

use link::fec::Code;
use link::framing::Framer;
use link::l2a_table::{Illuminance, Interval, L2aTable};
use link::panel::PanelFrame;
use link::waveform::SymbolTiming;
use tx_firmware::symbol_clock::QUARTERS;

pub use vocc_tests::driven_panel::{FULL_CD_M2, LOW_CURRENT_SHARE, Pulses, REFLECTANCE};

use crate::emulator::{CLOCK_HZ, Event};

/// The L2A of the built-in table at its interval of 1, by illuminance.
pub fn l2a(lux: f64) -> f64 {
    let illuminance = Illuminance::saturating_from_num(lux);
    L2aTable::default().l2a(illuminance, Interval::ONE).to_num()
}

/// A symbol: its start, in ns, and its panel.
#[derive(Clone, Copy, Debug)]
pub struct Symbol {
    pub ns: u64,
    pub panel: PanelFrame,
}

/// The edges of the latch while a new board shows a panel: it begins with a carrier.
pub fn carrier_edges(panel: PanelFrame) -> Vec<PanelFrame> {
    let quarter = |is_panel| if is_panel { panel } else { PanelFrame::from_bits(!panel.bits()) };
    QUARTERS.map(quarter).repeat(SymbolTiming::CARRIER.waveform().cycles().into())
}

/// Number of panels that identify the beginning of a message.
const OPENING: usize = 8;

/// The symbols from a board's first message on; `edges` gives the edges of the latch for each panel.
///
/// A computer sends a message at any time. A film that begins with the message is the same film each time.
pub fn from_message_on<'a>(symbols: &'a [Symbol], message: &[u8], edges: impl Fn(PanelFrame) -> Vec<PanelFrame>) -> &'a [Symbol] {
    let mut framer = Framer::new(message, Code::for_length(message.len()), true).expect("a message");
    let opening: Vec<PanelFrame> = (0..OPENING).flat_map(|_| edges(framer.next_panel())).collect();
    let begins = |at: &[Symbol]| at.iter().map(|edge| edge.panel).eq(opening.iter().copied());
    let first = symbols.windows(opening.len()).position(begins);
    &symbols[first.expect("the message is shown")..]
}

/// All events of the LEDs in order of time.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// The symbols.
    pub symbols: Vec<Symbol>,
    /// The pulses, each with its start in ns.
    pub pulses: Vec<(u64, Pulses)>,
}

impl Record {
    /// Adds the emulator's events.
    pub fn extend(&mut self, events: &[Event]) {
        let mut pulses = self.last_pulses();
        for event in events {
            if let Some(panel) = &event.panel {
                let bits = u64::from_str_radix(panel, 16).expect("16 digits");
                self.symbols.push(Symbol {
                    ns: event.ns,
                    panel: PanelFrame::from_bits(bits),
                });
            }
            if let (Some(lit), Some(period)) = (event.lit_cycles, event.period_cycles) {
                pulses.lit_s = f64::from(lit) / CLOCK_HZ;
                pulses.period_s = f64::from(period) / CLOCK_HZ;
            }
            if let Some(low_current) = event.low_current {
                pulses.low_current = low_current;
            }
            if pulses != self.last_pulses() {
                self.pulses.push((event.ns, pulses));
            }
        }
    }

    /// The symbols from the first panel that is not dark.
    pub fn lit_symbols(&self) -> &[Symbol] {
        let is_dark = |edge: &&Symbol| [0, u64::MAX].contains(&edge.panel.bits());
        let dark = self.symbols.iter().take_while(is_dark).count();
        assert!(dark < self.symbols.len(), "symbols are shown");
        &self.symbols[dark..]
    }

    /// The pulses at the end.
    pub fn last_pulses(&self) -> Pulses {
        self.pulses.last().map_or_else(Pulses::default, |&(_, pulses)| pulses)
    }

    /// The pulses at a time, ns.
    pub fn pulses_at(&self, ns: u64) -> Pulses {
        let before = self.pulses.partition_point(|&(from, _)| from <= ns);
        before.checked_sub(1).map_or_else(Pulses::default, |index| self.pulses[index].1)
    }
}
