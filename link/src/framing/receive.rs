//! Decodes panels, as read by a camera, to messages.

use super::assembly::{AddedSignature, Addition, Assembly, Payload};
use super::header::{Announcement, HEADER_BLOCK, Header, HeaderError, SignatureHeader};
use super::signature::{SIGNATURE_BLOCK, Signature};
use super::{Layout, OVERHEAD_PANELS, SYNC};
use crate::fec::{Block, CODEWORD_PANELS_MAX, Decoder, Undecodable};
use crate::geometry::Geometry;
use crate::orientation::Orientation;
use crate::panel::{PanelFrame, SoftPanel};
use crate::scramble;

/// Minimum correlation of a sync panel with [`SYNC`], in standard deviations of a random reading.
const SYNC_DEVIATIONS: i64 = 4;
/// Minimum correlation of an unreadable header at its expected place, sync and header together, in the same unit.
const EXPECTED_DEVIATIONS: i64 = 5;
/// The same for the header alone.
const EXPECTED_HEADER_DEVIATIONS: i64 = 3;
/// Successive headers, neither read nor recognised, after which none are expected.
const HEADERS_MISSED_MAX: u8 = 8;
/// The longest gap, in panels, after which the position in the message is still known.
const GAP_MAX: i32 = 1024;

/// The sync panel in a picture of each [`Orientation`].
pub const SYNC_SEEN: [PanelFrame; 8] = {
    let mut seen = [SYNC; 8];
    let mut i = 0;
    while i < seen.len() {
        seen[i] = SYNC.seen(Orientation::ALL[i]);
        i += 1;
    }
    seen
};

/// Reads panels, delivers messages. At most 37 KiB, of which 16 KiB are ratios kept for combining; no heap.
///
/// # How it finds a message
///
/// **Hunting.** At every panel it tests whether the panel two symbols ago was a sync panel or its complement: Σ llr·s ≥ 4·√Σ llr², a
/// correlation coefficient of 0.5. If so, it decodes the two panels since as a header. The test is true for other readings with a
/// probability of at most 2·exp(−4²/2) = 6.7e-4 a panel, whatever their magnitudes, and 7.7e-5 for 64 readings of equal strength (16 or
/// fewer of 64 differ).
///
/// **Orientation.** Pictures may show the panel in any of eight [orientations](Orientation). It tries the one in which the sync panel
/// agrees best, and keeps it once a header decodes, until a header is missed. While all eight are tried, the probabilities above are eight
/// times as great. A false header must also decode, match the CRC-8, the version and the ranges: of 10⁸ random panels 61 400 passed as sync
/// and none led to a header (`cargo run --release -p vocc-link --example false_alarms 100000000`).
///
/// **Expecting.** A header determines all that follows: the next segment, its position, and every LED of its header. If that header is not
/// readable, the three panels are compared with the expected ones, and accepted if the correlation is at least 5 standard deviations over
/// sync and header together, and 3 over the header alone. Random readings pass with a probability of at most exp(−5²/2) = 3.7e-6. So a lost
/// sync panel, or one lost header panel, does not cost the segment. After 8 successive missed headers, it expects none.
///
/// # How it assembles a message
///
/// A segment is decoded at the end of its payload: alone and, if that fails, summed with its earlier repeats. Lost panels count as unknown.
/// A message is delivered once all its segments have decoded **and** the CRC-32 matches; never otherwise. If it does not match, everything
/// is forgotten. A delivered message is not delivered again until another message or a beacon has come between. If decoding fails
/// unnoticed, the CRC-32 passes one wrong message in 2³².
///
/// **A signature** is decoded once the message before it is whole: alone, then summed with its earlier repeats. It is reported once, and
/// again with another counter. If it belongs to no known message, it is ignored.
///
/// **A header of another message** than that in progress replaces it once its segment decodes, or once it is seen twice without a header of
/// the message in progress in between. So a false header, which passes the CRC-8 by chance, costs at most the segment during which it
/// appeared. A new message loses at most the first reading of its first segment, if that does not decode by itself. A beacon, 50 bits of
/// which are fixed, takes effect at once.
///
/// **A symbol inserted or left out** by the receiver within a segment spoils that reading of the segment, because it is not searched for.
/// The sync of the next segment restores the position.
///
/// Joined at any panel, a clean message is delivered within one repeat and one segment.
pub struct Deframer {
    decoder: Decoder,
    recent: [StampedPanel; OVERHEAD_PANELS],
    last_index: Option<u32>,
    /// The orientation of the last decoded header.
    orientation: Option<Orientation>,
    track: Option<Track>,
    payload: Payload,
    assembly: Assembly,
    rival: Option<Header>,
}

/// The effect of a panel. One push returns one event: the most important, if lost panels before it caused others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// Nothing happened.
    Nothing,
    /// Something was seen but not used.
    Rejected(Rejection),
    /// A header with a correct CRC-8 and another version than [`super::VERSION`].
    UnsupportedVersion(u8),
    /// A segment begins.
    Header {
        /// Its header.
        header: Header,
        /// Whether it is shown in complement.
        inverted: bool,
        /// Whether the header was not readable but matches the expected one.
        expected: bool,
        /// Whether the message is whole and starts again where its signature would be: it is not signed.
        unsigned: bool,
    },
    /// A segment has ended.
    Segment {
        /// Its header.
        header: Header,
        /// Its outcome.
        outcome: SegmentOutcome,
        /// Missing segments of the message in progress.
        missing: u8,
    },
    /// The transmitter is idle.
    Beacon {
        /// Whether it is shown in complement.
        inverted: bool,
    },
    /// The panel's size. The message in progress is kept.
    Geometry(Geometry),
    /// A whole message, checked.
    Delivered(Delivery<'a>),
    /// The signature of the message that was delivered last, not checked.
    Signed(SignedPayload<'a>),
}

/// The outcome of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentOutcome {
    /// It was decoded.
    Decoded {
        /// Wrong LEDs in this reading.
        corrected_bits: u32,
        /// LEDs in this reading that were not erased.
        coded_bits: u32,
    },
    /// It had been decoded before.
    Known,
    /// It did not decode yet; it is kept for its repeats, unless its message was seen for the first time.
    Failed(Undecodable),
}

/// Why an apparent segment was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Rejection {
    /// A sync panel, but no code word after it.
    #[error("a sync panel was seen, but the header after it could not be decoded: {0}")]
    HeaderUndecodable(Undecodable),
    /// A sync panel and a code word after it that is not a header.
    #[error("a sync panel was seen, but what followed it was not a valid header: {0}")]
    HeaderInvalid(HeaderError),
    /// No header at the expected place of the next one.
    #[error("no header was seen where segment {segment} should begin: its panels were lost, or the transmitter shows something else")]
    HeaderMissed {
        /// The expected segment.
        segment: u8,
    },
    /// No header at the expected place of a signature.
    #[error("no header was seen where the message's signature should begin: its panels were lost, or the transmitter no longer signs")]
    SignatureMissed,
    /// A signature could not be decoded.
    #[error("the message's signature could not be decoded ({0}); waiting for it to be shown again")]
    SignatureUndecodable(Undecodable),
    /// A signature that decoded but is not the one announced by its header.
    #[error("the message's signature is not the one that its header announces: it was decoded wrongly; waiting for it to be shown again")]
    SignatureCorrupt,
    /// All segments decoded, but the message is not the one announced by their headers.
    #[error("the message's CRC-32 is {computed:#010x}, its headers announce {announced:#010x}: it was decoded wrongly and is dropped")]
    MessageCorrupt {
        /// The CRC in the headers.
        announced: u32,
        /// The CRC of the bytes.
        computed: u32,
    },
}

/// A whole message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delivery<'a> {
    /// Its bytes: 1 to [`super::MESSAGE_MAX`].
    pub message: &'a [u8],
    /// The stamp of the first panel of the first segment that was used.
    pub first_stamp: u64,
    /// The stamp of the panel at which it was delivered.
    pub last_stamp: u64,
    /// Wrong payload LEDs, in the readings of its segments that decoded.
    pub corrected_bits: u32,
    /// Payload LEDs in these readings: `corrected_bits / coded_bits` is the channel's bit error rate.
    pub coded_bits: u32,
}

/// A signature and its message. `link::signing` verifies it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SignedPayload<'a> {
    /// The message's bytes.
    pub message: &'a [u8],
    /// Its signature, as read.
    pub signature: Signature,
}

/// A reading of a panel and its stamp; no stamp if it was lost.
#[derive(Clone, Copy)]
struct StampedPanel {
    panel: SoftPanel,
    stamp: Option<u64>,
}

impl StampedPanel {
    const LOST: Self = Self {
        panel: SoftPanel::ERASED,
        stamp: None,
    };
}

/// The position of the last panel in the transmission.
#[derive(Clone, Copy)]
struct Track {
    header: Header,
    /// The signature after each repeat, once it was seen.
    signature: Option<SignatureHeader>,
    /// Whether the panel belongs to the signature rather than to the segment of `header`.
    at_signature: bool,
    inverted: bool,
    /// The panel's number within its segment; the sync panel is 0.
    position: usize,
    /// Whether the segment's header was read rather than expected.
    confirmed: bool,
    /// Headers missed in a row.
    missed: u8,
    first_stamp: u64,
}

impl Track {
    /// The position of the next panel.
    fn next(self) -> Self {
        let position = self.position + 1;
        if position < OVERHEAD_PANELS + self.block().panels() {
            return Self { position, ..self };
        }
        let segments = Layout::segments(self.header.layout());
        let segment = usize::from(self.header.segment) + 1;
        // Polarity is that of segment + repeat, a signature's that of the repeat.
        let (at_signature, segment, inverted) = if self.at_signature {
            (false, 0, !self.inverted)
        } else if segment < segments {
            (false, segment, !self.inverted)
        } else if self.signature.is_some() {
            (true, 0, self.inverted != segments.is_multiple_of(2))
        } else {
            // From the last segment to the first one of the next repeat, segment + repeat falls by segments − 2.
            (false, 0, self.inverted != (segments % 2 == 1))
        };
        Self {
            header: self.header.of_segment(segment as u8),
            at_signature,
            inverted,
            position: 0,
            confirmed: false,
            ..self
        }
    }

    /// The code word of the panel.
    fn block(self) -> Block {
        if self.at_signature { SIGNATURE_BLOCK } else { self.header.block() }
    }

    /// The announcement of its header.
    fn announcement(self) -> Announcement {
        match self.signature.filter(|_| self.at_signature) {
            Some(signature) => Announcement::Signature(signature),
            None => Announcement::Segment(self.header),
        }
    }

    /// Whether `header` is the expected one of this segment, and starts a repeat of the message.
    fn begins_repeat(self, header: Header) -> bool {
        let is_here = self.ends_header() && !self.confirmed && self.missed == 0 && !self.at_signature;
        is_here && header.segment == 0 && self.header == header
    }

    /// Whether the panel is the last one of its header.
    fn ends_header(self) -> bool {
        self.position + 1 == OVERHEAD_PANELS
    }

    /// The panel's number among the payload's.
    fn payload_position(self) -> Option<usize> {
        self.position.checked_sub(OVERHEAD_PANELS)
    }

    fn ends_segment(self) -> bool {
        self.position + 1 == OVERHEAD_PANELS + self.block().panels()
    }
}

/// An event without the borrow of the message.
#[derive(Clone, Copy)]
enum Outcome {
    Other(Event<'static>),
    Delivered,
    Signed(Signature),
}

impl Outcome {
    const NOTHING: Self = Self::Other(Event::Nothing);

    fn weight(self) -> u8 {
        match self {
            Self::Other(Event::Nothing) => 0,
            Self::Other(Event::Rejected(_)) => 1,
            Self::Other(Event::UnsupportedVersion(_)) => 2,
            Self::Other(Event::Header { .. }) => 3,
            Self::Other(Event::Segment { .. }) => 4,
            Self::Other(Event::Beacon { .. } | Event::Geometry(_)) => 5,
            Self::Other(Event::Signed(_)) | Self::Signed(_) => 6,
            Self::Other(Event::Delivered(_)) | Self::Delivered => 7,
        }
    }

    /// The more important of the two; the first, if they are equal.
    fn or(self, other: Self) -> Self {
        if other.weight() > self.weight() { other } else { self }
    }
}

/// The result of hunting in the last three panels.
enum Found {
    Nothing,
    Announced { announcement: Announcement, inverted: bool },
    Refused(Event<'static>),
}

impl Deframer {
    /// A receiver before its first panel; `const`, so that it can be a static.
    pub const fn new() -> Self {
        Self {
            decoder: Decoder::new(),
            recent: [StampedPanel::LOST; OVERHEAD_PANELS],
            last_index: None,
            orientation: None,
            track: None,
            payload: [SoftPanel::ERASED; CODEWORD_PANELS_MAX],
            assembly: Assembly::new(),
            rival: None,
        }
    }

    /// Adds the next panel.
    ///
    /// `index` is the receiver's running count of symbols, which may wrap around. Skipped indices are lost panels. An index equal to the
    /// last or up to 1024 smaller is the same panel again, and is ignored; a greater jump, in either direction, restarts the count. `stamp`
    /// is any number, such as the frame's: the delivery returns it.
    pub fn push(&mut self, index: u32, stamp: u64, panel: &SoftPanel) -> Event<'_> {
        let ahead = self.last_index.map_or(1, |last| index.wrapping_sub(last).cast_signed());
        let lost = match ahead {
            1..=GAP_MAX => ahead - 1,
            _ if (-GAP_MAX..=0).contains(&ahead) => return Event::Nothing,
            _ => {
                self.lose_track();
                0
            }
        };
        self.last_index = Some(index);
        let mut outcome = Outcome::NOTHING;
        for _ in 0..lost {
            outcome = outcome.or(self.step(StampedPanel::LOST));
        }
        match outcome.or(self.step(StampedPanel {
            panel: *panel,
            stamp: Some(stamp),
        })) {
            Outcome::Other(event) => event,
            Outcome::Delivered => Event::Delivered(self.delivery(stamp)),
            Outcome::Signed(signature) => Event::Signed(SignedPayload {
                message: self.assembly.message(),
                signature,
            }),
        }
    }

    /// The panel's orientation in the picture, from the first header on.
    pub const fn orientation(&self) -> Option<Orientation> {
        self.orientation
    }

    /// Forgets its position in the transmission, but not the message in progress.
    fn lose_track(&mut self) {
        self.track = None;
        self.recent = [StampedPanel::LOST; OVERHEAD_PANELS];
    }

    /// Processes the next panel, read or lost.
    fn step(&mut self, panel: StampedPanel) -> Outcome {
        self.recent.rotate_left(1);
        self.recent[OVERHEAD_PANELS - 1] = panel;
        self.track = self.track.map(Track::next);
        match self.hunt() {
            Found::Announced { announcement, inverted } => self.begin(announcement, inverted),
            Found::Refused(event) => self.follow(event),
            Found::Nothing => self.follow(Event::Nothing),
        }
    }

    /// Looks for a sync panel and a header in the last three panels.
    fn hunt(&mut self) -> Found {
        let Some((orientation, inverted)) = self.sync() else {
            return Found::Nothing;
        };
        let panels = [1, 2].map(|n| self.recent[n].panel.upright(orientation).flipped(mask(n, inverted)));
        let bytes = match self.decoder.decode(HEADER_BLOCK, &panels) {
            Ok(bytes) => bytes,
            Err(why) => return Found::Refused(Event::Rejected(Rejection::HeaderUndecodable(why))),
        };
        let mut header = [0; super::HEADER_BYTES];
        header.iter_mut().zip(bytes).for_each(|(to, &from)| *to = from);
        match Announcement::from_bytes(header) {
            Ok(announcement) => {
                self.orientation = Some(orientation);
                Found::Announced { announcement, inverted }
            }
            Err(HeaderError::Version(version)) => Found::Refused(Event::UnsupportedVersion(version)),
            Err(why) => Found::Refused(Event::Rejected(Rejection::HeaderInvalid(why))),
        }
    }

    /// If the first of the last three panels is a sync panel: its orientation, and whether it is in complement.
    fn sync(&self) -> Option<(Orientation, bool)> {
        let is_kept = self.track.is_some_and(|track| track.missed == 0);
        let tried = Orientation::ALL.into_iter().zip(SYNC_SEEN);
        let tried = tried.filter(|&(orientation, _)| !is_kept || Some(orientation) == self.orientation);
        tried
            .map(|(orientation, seen)| (orientation, self.recent[0].panel.correlation(seen)))
            .filter(|&(_, (sum, squares))| exceeds(sum.abs(), squares, SYNC_DEVIATIONS))
            .max_by_key(|&(_, (sum, _))| sum.abs())
            .map(|(orientation, (sum, _))| (orientation, sum < 0))
    }

    /// Handles a decoded header.
    fn begin(&mut self, announcement: Announcement, inverted: bool) -> Outcome {
        match announcement {
            Announcement::Beacon => {
                self.track = None;
                self.rival = None;
                self.assembly.clear();
                Outcome::Other(Event::Beacon { inverted })
            }
            Announcement::Geometry(geometry) => {
                // These panels delay the next segment.
                self.track = None;
                Outcome::Other(Event::Geometry(geometry))
            }
            Announcement::Signature(signature) => {
                self.begin_signature(signature, inverted);
                Outcome::NOTHING
            }
            Announcement::Segment(header) => self.begin_segment(header, inverted, false),
        }
    }

    /// Follows the signature of the message in progress; ignores another one, like a size.
    fn begin_signature(&mut self, signature: SignatureHeader, inverted: bool) {
        let header = self.assembly.signed_by(signature);
        self.track = header.map(|header| Track {
            header,
            signature: Some(signature),
            at_signature: true,
            inverted,
            position: OVERHEAD_PANELS - 1,
            confirmed: true,
            missed: 0,
            first_stamp: 0,
        });
        self.payload = [SoftPanel::ERASED; CODEWORD_PANELS_MAX];
    }

    fn begin_segment(&mut self, header: Header, inverted: bool, expected: bool) -> Outcome {
        let first_stamp = self.recent.iter().find_map(|reading| reading.stamp).unwrap_or(0);
        let before = self.track.filter(|track| track.header.same_message(header));
        let signature = before.and_then(|track| track.signature);
        let unsigned = before.is_some_and(|track| track.begins_repeat(header)) && signature.is_none() && self.assembly.is_complete();
        self.track = Some(Track {
            header,
            signature,
            at_signature: false,
            inverted,
            position: OVERHEAD_PANELS - 1,
            confirmed: true,
            missed: 0,
            first_stamp,
        });
        self.payload = [SoftPanel::ERASED; CODEWORD_PANELS_MAX];
        if self.assembly.is_of(header) {
            self.rival = None;
        } else if self.assembly.is_empty() || self.rival.is_some_and(|rival| rival.same_message(header)) {
            self.adopt(header, first_stamp);
        } else {
            self.rival = Some(header);
        }
        Outcome::Other(Event::Header {
            header,
            inverted,
            expected,
            unsigned,
        })
    }

    fn adopt(&mut self, header: Header, first_stamp: u64) {
        self.assembly.begin(header, first_stamp);
        self.rival = None;
    }

    /// Continues with the expected segment after a header that was not read, for the reason in `refused`.
    fn follow(&mut self, refused: Event<'static>) -> Outcome {
        let Some(track) = self.track else {
            return Outcome::Other(refused);
        };
        if !track.confirmed {
            if !track.ends_header() {
                return Outcome::Other(refused);
            }
            if self.is_as_expected(track) {
                return match track.announcement() {
                    Announcement::Segment(header) => self.begin_segment(header, track.inverted, true),
                    signature => self.begin(signature, track.inverted),
                };
            }
            let missed = track.missed + 1;
            self.track = (missed < HEADERS_MISSED_MAX).then_some(Track { missed, ..track });
            let segment = track.header.segment;
            let missed = Event::Rejected(match track.at_signature {
                true => Rejection::SignatureMissed,
                false => Rejection::HeaderMissed { segment },
            });
            return Outcome::Other(refused).or(Outcome::Other(missed));
        }
        let Some(position) = track.payload_position() else {
            return Outcome::NOTHING;
        };
        if let Some(place) = self.payload.get_mut(position) {
            let latest = self.recent[OVERHEAD_PANELS - 1].panel;
            let latest = latest.upright(self.orientation.unwrap_or_default());
            *place = latest.flipped(mask(track.position, track.inverted));
        }
        if track.ends_segment() {
            self.end_segment(track)
        } else {
            Outcome::NOTHING
        }
    }

    /// Whether the last three panels match the sync and header panels of `track`.
    fn is_as_expected(&self, track: Track) -> bool {
        let correlation = |n: usize, coded: PanelFrame| {
            let shown = PanelFrame::from_bits(coded.bits() ^ mask(n, track.inverted));
            let seen = shown.seen(self.orientation.unwrap_or_default());
            self.recent[n].panel.correlation(seen)
        };
        let sync = correlation(0, SYNC);
        let header = track.announcement().to_panels().zip(1..OVERHEAD_PANELS);
        let header = header.map(|(coded, n)| correlation(n, coded)).fold((0, 0), add);
        let all = add(sync, header);
        exceeds(all.0, all.1, EXPECTED_DEVIATIONS) && exceeds(header.0, header.1, EXPECTED_HEADER_DEVIATIONS)
    }

    /// Decodes the payload of `track`'s segment, as far as it was received.
    fn end_segment(&mut self, track: Track) -> Outcome {
        if let Announcement::Signature(signature) = track.announcement() {
            return match self.assembly.add_signature(signature, &self.payload, &mut self.decoder) {
                AddedSignature::Unused => Outcome::NOTHING,
                AddedSignature::Kept(why) => Outcome::Other(Event::Rejected(Rejection::SignatureUndecodable(why))),
                AddedSignature::Corrupt => Outcome::Other(Event::Rejected(Rejection::SignatureCorrupt)),
                AddedSignature::Read(signature) => Outcome::Signed(signature),
            };
        }
        let header = track.header;
        if !self.assembly.is_of(header) {
            if let Err(why) = self.decoder.decode(header.block(), &self.payload) {
                return self.ended(header, SegmentOutcome::Failed(why));
            }
            self.adopt(header, track.first_stamp);
        }
        match self.assembly.add(header, &self.payload, &mut self.decoder) {
            Addition::Known => self.ended(header, SegmentOutcome::Known),
            Addition::Kept(why) => self.ended(header, SegmentOutcome::Failed(why)),
            Addition::Decoded(bits) => {
                let outcome = SegmentOutcome::Decoded {
                    corrected_bits: bits.corrected,
                    coded_bits: bits.coded,
                };
                self.ended(header, outcome)
            }
            Addition::Complete => Outcome::Delivered,
            Addition::Corrupt { announced, computed } => {
                self.assembly.clear();
                self.track = None;
                Outcome::Other(Event::Rejected(Rejection::MessageCorrupt { announced, computed }))
            }
        }
    }

    fn ended(&self, header: Header, outcome: SegmentOutcome) -> Outcome {
        Outcome::Other(Event::Segment {
            header,
            outcome,
            missing: self.assembly.missing(),
        })
    }

    fn delivery(&self, last_stamp: u64) -> Delivery<'_> {
        let bits = self.assembly.bits();
        Delivery {
            message: self.assembly.message(),
            first_stamp: self.assembly.first_stamp(),
            last_stamp,
            corrected_bits: bits.corrected,
            coded_bits: bits.coded,
        }
    }
}

impl Default for Deframer {
    fn default() -> Self {
        Self::new()
    }
}

/// The XOR mask of panel `n` of a segment.
const fn mask(n: usize, inverted: bool) -> u64 {
    scramble::word(n) ^ if inverted { u64::MAX } else { 0 }
}

fn add(one: (i32, i32), other: (i32, i32)) -> (i32, i32) {
    (one.0 + other.0, one.1 + other.1)
}

/// Whether a correlation is positive and at least `deviations` standard deviations of a random reading.
fn exceeds(sum: i32, squares: i32, deviations: i64) -> bool {
    sum > 0 && i64::from(sum) * i64::from(sum) >= deviations * deviations * i64::from(squares)
}
