//! The faults of a panel, in words, and the wire that each points to.

use link::orientation::Orientation;
use link::panel::SIDE;

/// A fault of a panel. An LED's number is 8·row + column, the bit that should light it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// No LED follows the test.
    NothingFollows {
        /// Whether all LEDs are always lit.
        is_lit: bool,
    },
    /// LEDs show the bits of a panel that is mounted in this orientation.
    Turned(Orientation),
    /// Each LED shows the bit of the LED that many places before it in the chain, or behind it if the number is negative.
    ChainShifted(i8),
    /// A 0 lights an LED.
    Complemented,
    /// Light grows while the duty falls.
    EnableInverted,
    /// Light does not depend on the duty.
    EnableStuck,
    /// No row from this one on follows.
    ChainBroken(usize),
    /// No LED of the row is ever lit.
    RowDead(usize),
    /// All LEDs of the row are always lit.
    RowStuck(usize),
    /// No LED of the column is ever lit.
    ColumnDead(usize),
    /// All LEDs of the column are always lit.
    ColumnStuck(usize),
    /// Each of two rows shows the bits of the other.
    RowsSwapped([usize; 2]),
    /// Each of two columns shows the bits of the other.
    ColumnsSwapped([usize; 2]),
    /// A row shows the bits of another row.
    RowShows([usize; 2]),
    /// A column shows the bits of another column.
    ColumnShows([usize; 2]),
    /// A row shows its bits from right to left.
    RowReversed(usize),
    /// An LED is never lit.
    LedDead(usize),
    /// An LED is always lit.
    LedStuck(usize),
    /// An LED is inverted, unlike the rest.
    LedInverted(usize),
    /// Each of two LEDs shows the bit of the other.
    LedsSwapped([usize; 2]),
    /// An LED shows the bit of another LED.
    LedShows([usize; 2]),
    /// Each of two bits lights both LEDs.
    LedsJoined([usize; 2]),
    /// An LED follows no single bit.
    LedUnclear(usize),
    /// An LED is displaced by these pitches to the right and down.
    OffLattice(usize, [f32; 2]),
}

/// The LED driver, as `docs/hardware` builds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kit {
    /// A chain of shift registers, one per row.
    #[default]
    Road,
    /// A module with a MAX7219.
    Desk,
}

/// An LED's row and column.
struct Led(usize);

impl std::fmt::Display for Led {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the LED of row {}, column {}", self.0 / SIDE, self.0 % SIDE)
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::NothingFollows { is_lit: false } => f.write_str("no LED is lit by any test panel"),
            Self::NothingFollows { is_lit: true } => f.write_str("LEDs are lit all the time, whatever the test panel"),
            Self::Turned(orientation) => write!(f, "the panel is {orientation}"),
            Self::ChainShifted(by) => write!(
                f,
                "each LED shows the bit of the LED {} {} it in the chain",
                by.unsigned_abs(),
                if by > 0 { "before" } else { "behind" }
            ),
            Self::Complemented => f.write_str("LEDs are lit by a 0 and dark by a 1"),
            Self::EnableInverted => f.write_str("LEDs get brighter when the duty falls, and are brightest when it is 0"),
            Self::EnableStuck => f.write_str("LEDs are lit when the duty is 0: they are not dimmed"),
            Self::ChainBroken(row) => write!(f, "no row from row {row} on follows"),
            Self::RowDead(row) => write!(f, "row {row} is dead"),
            Self::RowStuck(row) => write!(f, "row {row} is lit all the time"),
            Self::ColumnDead(column) => write!(f, "column {column} is dead"),
            Self::ColumnStuck(column) => write!(f, "column {column} is lit all the time"),
            Self::RowsSwapped([one, other]) => write!(f, "rows {one} and {other} are swapped"),
            Self::ColumnsSwapped([one, other]) => write!(f, "columns {one} and {other} are swapped"),
            Self::RowShows([row, other]) => write!(f, "row {row} shows row {other}"),
            Self::ColumnShows([column, other]) => write!(f, "column {column} shows column {other}"),
            Self::RowReversed(row) => write!(f, "row {row} is mirrored"),
            Self::LedDead(led) => write!(f, "{} is dead", Led(led)),
            Self::LedStuck(led) => write!(f, "{} is lit all the time", Led(led)),
            Self::LedInverted(led) => write!(f, "{} is lit by the other bit than the rest", Led(led)),
            Self::LedsSwapped([one, other]) => write!(f, "{} and {} are swapped", Led(one), Led(other)),
            Self::LedShows([led, other]) => write!(f, "{} shows {}", Led(led), Led(other)),
            Self::LedsJoined([one, other]) => write!(f, "{} and {} are lit together", Led(one), Led(other)),
            Self::LedUnclear(led) => write!(f, "{} follows no single bit", Led(led)),
            Self::OffLattice(led, [right, down]) => write!(
                f,
                "{} is {:.2} pitches {} and {:.2} {} off its place",
                Led(led),
                right.abs(),
                if right > 0.0 { "right" } else { "left" },
                down.abs(),
                if down > 0.0 { "down" } else { "up" }
            ),
        }
    }
}

/// The LEDs of a MAX7219's row: segment DP is the left one.
const SEGMENTS: [&str; SIDE] = ["DP", "A", "B", "C", "D", "E", "F", "G"];

impl Finding {
    /// The finding's name, for programs.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::NothingFollows { .. } => "nothing_follows",
            Self::Turned(_) => "turned",
            Self::ChainShifted(_) => "chain_shifted",
            Self::Complemented => "complemented",
            Self::EnableInverted => "enable_inverted",
            Self::EnableStuck => "enable_stuck",
            Self::ChainBroken(_) => "chain_broken",
            Self::RowDead(_) => "row_dead",
            Self::RowStuck(_) => "row_stuck",
            Self::ColumnDead(_) => "column_dead",
            Self::ColumnStuck(_) => "column_stuck",
            Self::RowsSwapped(_) => "rows_swapped",
            Self::ColumnsSwapped(_) => "columns_swapped",
            Self::RowShows(_) => "row_shows",
            Self::ColumnShows(_) => "column_shows",
            Self::RowReversed(_) => "row_reversed",
            Self::LedDead(_) => "led_dead",
            Self::LedStuck(_) => "led_stuck",
            Self::LedInverted(_) => "led_inverted",
            Self::LedsSwapped(_) => "leds_swapped",
            Self::LedShows(_) => "led_shows",
            Self::LedsJoined(_) => "leds_joined",
            Self::LedUnclear(_) => "led_unclear",
            Self::OffLattice(..) => "off_lattice",
        }
    }

    /// The rows, columns or LEDs of the finding; empty if it concerns all.
    pub fn places(&self) -> Vec<usize> {
        match *self {
            Self::ChainBroken(one)
            | Self::RowDead(one)
            | Self::RowStuck(one)
            | Self::ColumnDead(one)
            | Self::ColumnStuck(one)
            | Self::RowReversed(one)
            | Self::LedDead(one)
            | Self::LedStuck(one)
            | Self::LedInverted(one)
            | Self::LedUnclear(one)
            | Self::OffLattice(one, _) => vec![one],
            Self::RowsSwapped(two)
            | Self::ColumnsSwapped(two)
            | Self::RowShows(two)
            | Self::ColumnShows(two)
            | Self::LedsSwapped(two)
            | Self::LedShows(two)
            | Self::LedsJoined(two) => two.to_vec(),
            Self::NothingFollows { .. }
            | Self::Turned(_)
            | Self::ChainShifted(_)
            | Self::Complemented
            | Self::EnableInverted
            | Self::EnableStuck => vec![],
        }
    }

    /// The wire or the part that the finding points to.
    pub fn wire(&self, kit: Kit) -> String {
        match kit {
            Kit::Road => self.road_wire(),
            Kit::Desk => self.desk_wire(),
        }
    }

    fn road_wire(&self) -> String {
        let output = |led: usize| format!("output Q{} of row {}'s register", led % SIDE, led / SIDE);
        match *self {
            Self::NothingFollows { is_lit: false } => {
                "the LEDs' supply, output enable (the gate behind GPIO 20, pin 26), data (GPIO 19, pin 25), shift clock (GPIO 18, pin 24), \
                 latch (GPIO 17, pin 22), and clear, which belongs at the supply"
                    .into()
            }
            Self::NothingFollows { is_lit: true } => {
                "latch (GPIO 17, pin 22), shift clock (GPIO 18, pin 24), data (GPIO 19, pin 25) to serial in of row 0's register".into()
            }
            Self::Turned(_) => {
                "Q0 is column 0, the left as the camera sees it, and the first register of the chain is row 0, the top: turn the panel, or \
                 exchange the wires; a film of a selfie camera may be mirrored itself"
                    .into()
            }
            Self::ChainShifted(1..) => {
                "the latch (GPIO 17, pin 22) rises too late, or the registers see more edges than the shift clock has (GPIO 18, pin 24): \
                 shorten both wires, and look that the two are not exchanged"
                    .into()
            }
            Self::ChainShifted(_) => {
                "the latch (GPIO 17, pin 22) rises too early, or the registers miss edges of the shift clock (GPIO 18, pin 24): look at \
                 the level shifter and at that wire"
                    .into()
            }
            Self::Complemented => "no wire: these LEDs are lit by the other level of their outputs; flash the build with the feature \
                                   lit-by-0, or without it"
                .into(),
            Self::EnableInverted => {
                "the inverting gate between GPIO 20 (pin 26) and output enable: it is missing, bridged, or a buffer that does not invert"
                    .into()
            }
            Self::EnableStuck => "output enable of the registers: it is at ground instead of behind the gate of GPIO 20 (pin 26)".into(),
            Self::ChainBroken(row) => format!(
                "serial out of row {}'s register (Q7') to serial in of row {row}'s, or supply, ground and shift clock from row {row} on",
                row.saturating_sub(1)
            ),
            // Data passes through any register that has its clock.
            Self::RowDead(row) | Self::RowStuck(row) if row + 1 < SIDE => format!(
                "latch (RCLK) and output enable (OE) of row {row}'s register, and its LEDs' supply: data passes through it to the next row"
            ),
            Self::RowDead(row) | Self::RowStuck(row) => {
                format!("row {row}'s register: serial in, shift clock, latch, output enable, supply and ground, and its LEDs' supply")
            }
            Self::ColumnDead(column) | Self::ColumnStuck(column) => {
                format!("outputs Q{column} of all registers: the connector or the ribbon between registers and LEDs")
            }
            Self::RowsSwapped([one, other]) => {
                format!("the registers of rows {one} and {other} have each other's place in the chain or the LEDs")
            }
            Self::ColumnsSwapped([one, other]) => format!("outputs Q{one} and Q{other} of all registers"),
            Self::RowShows([row, other]) => {
                format!("the LEDs of row {row} are at the register of row {other}, or serial in comes from elsewhere")
            }
            Self::ColumnShows([column, other]) => format!("the LEDs of column {column} are at outputs Q{other}"),
            Self::RowReversed(row) => format!("outputs Q0 to Q7 of row {row}'s register: their order is the other way round"),
            Self::LedDead(led) => format!(
                "the LED (broken, or the wrong way round), its solder joints, its resistor, {}",
                output(led)
            ),
            Self::LedStuck(led) => format!("{} is shorted to what lights its LED", output(led)),
            Self::LedInverted(led) => format!("the LED at {} is between the wrong lines", output(led)),
            Self::LedsSwapped([one, other]) => format!("the wires of {} and {}", output(one), output(other)),
            Self::LedShows([led, other]) => format!("its wire is at {} instead of {}", output(other), output(led)),
            Self::LedsJoined([one, other]) => format!("a short between {} and {}", output(one), output(other)),
            Self::LedUnclear(led) => format!("the neighbours of {}: shorts, or a loose contact", output(led)),
            Self::OffLattice(led, _) => format!("no wire: the LED at {} is mounted off its place", output(led)),
        }
    }

    fn desk_wire(&self) -> String {
        let output = |led: usize| format!("DIG {}, SEG {}", led / SIDE, SEGMENTS[led % SIDE]);
        match *self {
            Self::NothingFollows { .. } => {
                "DIN (GPIO 19, pin 25), CS (GPIO 17, pin 22), CLK (GPIO 18, pin 24) and the level shifter; the module's supply".into()
            }
            Self::Turned(_) => "no wire: turn the module until row 0 (DIG 0) is at the top and segment DP at the left; a film of a selfie \
                                camera may be mirrored itself"
                .into(),
            Self::ChainShifted(_) => "CLK (GPIO 18, pin 24) and CS (GPIO 17, pin 22): shorten the wires, and use the level shifter".into(),
            Self::Complemented => "no wire: flash the build with the feature max7219".into(),
            Self::EnableInverted | Self::EnableStuck => {
                "the chip does not take its intensity: DIN, CLK and CS, or its resistor at ISET".into()
            }
            Self::ChainBroken(row) => format!("DIG {row} to DIG 7 of the module"),
            Self::RowDead(row) | Self::RowStuck(row) | Self::RowReversed(row) => format!("DIG {row} of the module"),
            Self::ColumnDead(column) | Self::ColumnStuck(column) => format!("SEG {} of the module", SEGMENTS[column]),
            Self::RowsSwapped([one, other]) | Self::RowShows([one, other]) => format!("DIG {one} and DIG {other} of the module"),
            Self::ColumnsSwapped([one, other]) | Self::ColumnShows([one, other]) => {
                format!("SEG {} and SEG {} of the module", SEGMENTS[one], SEGMENTS[other])
            }
            Self::LedDead(led) | Self::LedStuck(led) | Self::LedInverted(led) | Self::LedUnclear(led) | Self::OffLattice(led, _) => {
                format!("the LED between {} of the module", output(led))
            }
            Self::LedsSwapped([one, other]) | Self::LedShows([one, other]) | Self::LedsJoined([one, other]) => {
                format!("the LEDs between {} and between {}", output(one), output(other))
            }
        }
    }
}
