//! Bring-up of a panel: the test panels that a transmitter shows, and what their pictures say of its wires.
//!
//! ```text
//! walk ── a transmitter shows it, a camera films it ──▶ frames
//!                                                         │  film: where the panel is, which frames show which step
//!                                                         ▼
//!                                                      Reading: each LED's level in each step
//!                                                         │  diagnosis
//!                                                         ▼
//!                                                      Findings, each with the wire that it points to
//! ```
//!
//! Six pairs of a panel and its complement name each LED: LED i is On in the first panel of pair k if bit k of i is 1. So thirteen steps
//! tell which LED is where, however wires are exchanged, and each of them lights half of the LEDs: a camera's exposure stays as it is.

mod alignment;
mod diagnosis;
mod film;
mod finding;
mod lattice;

use link::panel::{LEDS, PanelFrame, SIDE};

pub use alignment::{Aligned, align};
pub use diagnosis::diagnose;
pub use film::{Activity, Film, FilmError, Region};
pub use finding::{Finding, Kit};

/// Bits of an LED's number, and so pairs of panels that name it.
pub const PAIRS: usize = LEDS.ilog2() as usize;
/// Steps that name the LEDs: a dark one, and the pairs.
pub const CODES: usize = 1 + 2 * PAIRS;
/// The shares of the light in the steps that dim, in 1/255.
pub const RAMP: [u8; 5] = [0, 32, 64, 128, 255];
/// The panel that is dimmed: a chequerboard.
pub const RAMP_PANEL: PanelFrame = PanelFrame::from_bits(0xaa55_aa55_aa55_aa55);

/// A part of the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// The panels by which a camera names each LED.
    Codes,
    /// One panel, dimmed.
    Ramp,
    /// Row after row.
    Rows,
    /// Column after column.
    Columns,
    /// LED after LED.
    Leds,
}

/// One test panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// What it belongs to.
    pub part: Part,
    /// Its LEDs: at most 32 are On.
    pub panel: PanelFrame,
    /// The share of the light that a message has, in 1/255.
    pub share: u8,
}

/// All steps, in the order in which they are shown: a camera needs the first two parts alone.
///
/// ```
/// use reception::bring_up::{CODES, Part, RAMP, walk};
/// let steps: Vec<_> = walk().collect();
/// assert_eq!(steps.len(), CODES + RAMP.len() + 8 + 8 + 64);
/// assert!(steps.iter().all(|step| step.panel.count_on() <= 32));
/// assert!(steps[..CODES].iter().all(|step| step.part == Part::Codes));
/// ```
pub fn walk() -> impl Iterator<Item = Step> {
    let full = |part| {
        move |bits| Step {
            part,
            panel: PanelFrame::from_bits(bits),
            share: u8::MAX,
        }
    };
    let codes = (0..PAIRS).flat_map(|pair| [code(pair), !code(pair)]);
    let rows = (0..SIDE).map(|row| 0xff << (SIDE * row));
    let columns = (0..SIDE).map(|column| 0x0101_0101_0101_0101 << column);
    let leds = (0..LEDS).map(|led| 1 << led);
    std::iter::once(0)
        .chain(codes)
        .map(full(Part::Codes))
        .chain(RAMP.into_iter().map(|share| Step {
            part: Part::Ramp,
            panel: RAMP_PANEL,
            share,
        }))
        .chain(rows.map(full(Part::Rows)))
        .chain(columns.map(full(Part::Columns)))
        .chain(leds.map(full(Part::Leds)))
}

/// The LEDs whose number has that bit.
fn code(pair: usize) -> u64 {
    (0..LEDS).fold(0, |bits, led| bits | ((led >> pair & 1) as u64) << led)
}

/// How bright each place of the panel is in the steps, row by row as it is seen; in any unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// With all LEDs Off.
    pub dark: [f32; LEDS],
    /// With a panel and with its complement.
    pub pairs: [[[f32; LEDS]; 2]; PAIRS],
    /// In the [`RAMP`]; none if it was not seen.
    pub ramp: Option<[[f32; LEDS]; RAMP.len()]>,
    /// How far each LED is off its place, in pitches to the right and down; none where that is not known.
    pub offsets: [Option<[f32; 2]>; LEDS],
    /// The least difference that counts.
    pub visible: f32,
}

impl Reading {
    /// The levels alone, from the pictures of the steps, each of which has the level of each place.
    pub fn of_levels(aligned: &Aligned, visible: f32) -> Option<Self> {
        let levels = |picture: &[f32]| <[f32; LEDS]>::try_from(picture).ok();
        let codes: Vec<[f32; LEDS]> = aligned.codes.iter().map(|picture| levels(picture)).collect::<Option<_>>()?;
        let ramp = aligned.ramp.as_ref().and_then(|ramp| {
            let ramp: Vec<[f32; LEDS]> = ramp.iter().map(|picture| levels(picture)).collect::<Option<_>>()?;
            ramp.try_into().ok()
        });
        Some(Self {
            dark: *codes.first()?,
            pairs: std::array::from_fn(|pair| [codes[1 + 2 * pair], codes[2 + 2 * pair]]),
            ramp,
            offsets: [None; LEDS],
            visible,
        })
    }
}
