//! Faults of a board's wires, for tests of the diagnosis.

use link::orientation::Orientation;
use link::panel::{LEDS, PanelFrame, SIDE};

use super::board::Symbol;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The wires of two LEDs are exchanged.
    Swap([usize; 2]),
    /// An LED is never lit.
    Dead(usize),
    /// An LED is always lit.
    Stuck(usize),
    /// No LED of a row is lit.
    DeadRow(usize),
    /// The latch takes the bits after more edges of the shift clock.
    Late(usize),
    /// Left and right are exchanged.
    Mirror,
    /// Output enable is not inverted.
    Enable,
}

impl std::str::FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, numbers) = text.split_once('=').unwrap_or((text, ""));
        let numbers: Vec<Option<usize>> = numbers.split(',').map(|number| number.parse().ok()).collect();
        match (name, &numbers[..]) {
            ("swap", &[Some(one), Some(other)]) if one < LEDS && other < LEDS && one != other => Ok(Self::Swap([one, other])),
            ("dead", &[Some(led)]) if led < LEDS => Ok(Self::Dead(led)),
            ("stuck", &[Some(led)]) if led < LEDS => Ok(Self::Stuck(led)),
            ("dead-row", &[Some(row)]) if row < SIDE => Ok(Self::DeadRow(row)),
            ("late", &[Some(bits)]) if (1..LEDS).contains(&bits) => Ok(Self::Late(bits)),
            ("mirror", [None]) => Ok(Self::Mirror),
            ("enable", [None]) => Ok(Self::Enable),
            _ => Err(format!(
                "{text:?} is not a fault: give swap=LED,LED, dead=LED or stuck=LED (0 to 63), dead-row=ROW (0 to 7), late=BITS (1 to 63), \
                 mirror or enable"
            )),
        }
    }
}

impl Fault {
    /// The LEDs' state with this fault.
    pub fn plant(self, mut symbol: Symbol) -> Symbol {
        let bits = symbol.panel.bits();
        let lit = match self {
            Self::Swap([one, other]) => {
                let differs = (bits >> one ^ bits >> other) & 1;
                bits ^ (differs << one | differs << other)
            }
            Self::Dead(led) => bits & !(1 << led),
            Self::Stuck(led) => bits | 1 << led,
            Self::DeadRow(row) => bits & !(0xff << (SIDE * row)),
            // The next panel's bits come first, and test panels repeat.
            Self::Late(by) => bits.rotate_left(by as u32),
            Self::Mirror => symbol.panel.seen(Orientation::new(0, true)).bits(),
            Self::Enable => {
                symbol.light = 1.0 - symbol.light;
                bits
            }
        };
        symbol.panel = PanelFrame::from_bits(lit);
        symbol
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::waveform::SymbolTiming;
    use std::time::Duration;

    fn planted(fault: &str, bits: u64) -> (u64, f64) {
        let symbol = Symbol {
            at: Duration::ZERO,
            panel: PanelFrame::from_bits(bits),
            light: 0.25,
            timing: SymbolTiming::default(),
        };
        let shown = fault.parse::<Fault>().expect("a fault").plant(symbol);
        (shown.panel.bits(), shown.light)
    }

    #[test]
    fn faults_are_what_they_are_called() {
        for (fault, bits, lit) in [
            ("swap=0,63", 1, 1 << 63),
            ("swap=0,63", 2, 2),
            ("dead=3", 0xff, 0xf7),
            ("stuck=3", 0, 8),
            ("dead-row=1", u64::MAX, !0xff00),
            ("late=1", 1 << 63, 1),
            ("mirror", 1, 0x80),
        ] {
            assert_eq!(planted(fault, bits), (lit, 0.25), "{fault}");
        }
        assert_eq!(planted("enable", 5), (5, 0.75));
        for none in [
            "",
            "swap",
            "swap=1",
            "swap=1,1",
            "swap=1,64",
            "dead=-1",
            "late=0",
            "mirror=1",
            "dead-row=8",
            "x=1",
        ] {
            assert!(none.parse::<Fault>().is_err_and(|told| told.contains("dead-row=ROW")), "{none}");
        }
    }
}
