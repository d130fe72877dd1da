//! Bring-up of a panel: the test panels that a transmitter shows, and the wiring faults that their pictures reveal.
//!
//! ```text
//! walk ── a transmitter shows it, a camera films it ──▶ frames
//!                                                         │  film: where the panel is, which frames show which step
//!                                                         ▼
//!                                                      StepLevels: each LED's level in each step
//!                                                         │  diagnosis
//!                                                         ▼
//!                                                      Findings, each with the wire that it points to
//! ```
//!
//! Six pairs of a panel and its complement name each LED: LED i is On in the first panel of pair k if bit k of i is 1. Thirteen steps
//! therefore identify the LED at each place, whichever wires are exchanged. Each panel of a pair lights half of the LEDs, so a camera's
//! exposure stays constant.

mod alignment;
mod diagnosis;
mod film;
mod finding;
mod lattice;

use link::panel::{LEDS, PanelFrame, SIDE};

pub use alignment::{StepPictures, align};
pub use diagnosis::diagnose;
pub use film::{Activity, Film, FilmError, Region};
pub use finding::{Finding, Kit};

/// Bits of an LED's number: the number of pairs of panels that name it.
pub const PAIRS: usize = LEDS.ilog2() as usize;
/// Steps that name the LEDs: a dark one and the pairs.
pub const CODES: usize = 1 + 2 * PAIRS;
/// The light in the steps that dim, in 1/255 of the full light.
pub const RAMP: [u8; 5] = [0, 32, 64, 128, 255];
/// The dimmed panel: a chequerboard.
pub const RAMP_PANEL: PanelFrame = PanelFrame::from_bits(0xaa55_aa55_aa55_aa55);

/// A part of the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// The panels by which a camera names each LED.
    Codes,
    /// One panel at several duties.
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
    /// The part of the walk that the panel belongs to.
    pub part: Part,
    /// Its LEDs: at most 32 are On.
    pub panel: PanelFrame,
    /// The panel's light, in 1/255 of a message's.
    pub share: u8,
}

/// All steps in the order in which they are shown. A camera needs only the first two parts.
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

/// The LEDs whose number has bit `pair`.
fn code(pair: usize) -> u64 {
    (0..LEDS).fold(0, |bits, led| bits | ((led >> pair & 1) as u64) << led)
}

/// The level of each place of the panel in the steps, row by row as the camera sees it, in any unit.
#[derive(Clone, Debug, PartialEq)]
pub struct StepLevels {
    /// Levels with all LEDs Off.
    pub dark: [f32; LEDS],
    /// Levels with a panel and with its complement.
    pub pairs: [[[f32; LEDS]; 2]; PAIRS],
    /// Levels in the [`RAMP`]; none if the pictures lack it.
    pub ramp: Option<[[f32; LEDS]; RAMP.len()]>,
    /// The displacement of each LED, in pitches to the right and down; none if it is unknown.
    pub offsets: [Option<[f32; 2]>; LEDS],
    /// The smallest difference that counts.
    pub visible: f32,
}

impl StepLevels {
    /// Levels without displacements, from the pictures of the steps, each of which has one level per place.
    pub fn of_levels(aligned: &StepPictures, visible: f32) -> Option<Self> {
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
