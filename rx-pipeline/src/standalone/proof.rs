//! Whether what is followed is a panel, and where none is looked for.

use crate::corners::Corners;
use crate::receiver::Reading;
use crate::receiver::blinked::{Area, Barred, Blinked, Verdict, proof_frames};
use link::framing::Event;

/// The share of bits that have to be right by their soft values, for a reading to count: what two groups of LEDs have that lie four of their
/// deviations apart. Noise parts into two of 2.7.
const LEAST_CONFIDENCE: f32 = 0.977;

/// What has been seen of what is followed. Signs, lamps and edges blink too, and are found; they are given up when they have not shown what
/// panels show within 30 symbols, and passed over for 90.
pub struct Proof {
    /// What is followed, and where it was last.
    place: Option<(Blinked, Corners)>,
    has_failed: bool,
    barred: Barred,
    /// Frames in which it has to prove to be a panel.
    frames: u64,
}

impl Proof {
    /// Nothing is followed.
    pub const NONE: Self = Self {
        place: None,
        has_failed: false,
        barred: Barred::NONE,
        frames: 0,
    };

    /// Forgets everything and goes by that many symbols a frame, above 0.
    pub fn begin(&mut self, symbols_per_frame: f32) {
        *self = Self {
            frames: proof_frames(symbols_per_frame),
            ..Self::NONE
        };
    }

    /// Something is followed from frame `number` on.
    pub fn found(&mut self, corners: Corners, number: u64) {
        self.place = Some((Blinked::new(number), corners));
        self.has_failed = false;
    }

    /// It is followed no more.
    pub fn lost(&mut self, number: u64) {
        self.has_failed = false;
        if let Some((mut blinked, corners)) = self.place.take() {
            let verdict = blinked.verdict(number, self.frames);
            self.barred.add(&corners, verdict, number, self.frames);
        }
    }

    /// Where nothing is looked for in frame `number`.
    pub fn others(&self, number: u64) -> impl Iterator<Item = Area> {
        self.barred.areas(number)
    }

    /// Whether what is followed is no panel, or one no more.
    pub fn has_failed(&self) -> bool {
        self.has_failed
    }

    /// It was read so in frame `number`, if at all, and the symbol before meant that.
    pub fn judge(&mut self, number: u64, reading: Option<&Reading>, event: &Event<'_>) {
        let Some((blinked, corners)) = &mut self.place else {
            return;
        };
        if let Some(reading) = reading {
            *corners = reading.corners;
            if reading.detection.confidence >= LEAST_CONFIDENCE {
                blinked.see(reading.detection.bits.bits());
            }
        }
        blinked.hear(event);
        let verdict = blinked.verdict(number, self.frames);
        self.has_failed = matches!(verdict, Verdict::Other | Verdict::Gone);
    }
}
