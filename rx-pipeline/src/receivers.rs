//! Several panels in one picture, each with a message of its own.

use core::borrow::BorrowMut;

use crate::corners::Corners;
use crate::frame::Frame;
use crate::locate::{Effort, LocateError, Locator};
use crate::profile::Profile;
use crate::receiver::history::History;
use crate::receiver::reader::Reader;
use crate::receiver::{Loss, Outcome, Reading, ReceiverError, ReceiverMemory, ReceiverSettings};
use heapless::Vec;

/// Frames to the messages of up to `PANELS` panels.
///
/// Each panel is followed and read as by a [`crate::receiver::Receiver`]. As long as fewer are followed than there may be, each frame is
/// searched for one more, where none is yet. `M` and `H` are as there; each panel has a memory of its own.
///
/// ```
/// use rx_pipeline::{frame::Frame, receiver::{ReceiverMemory, ReceiverSettings}, receivers::Receivers};
/// let memories = [(); 2].map(|()| Box::new(ReceiverMemory::<4096>::new()));
/// let mut receivers = Receivers::<2, 4096, _, _>::new(ReceiverSettings::default(), memories, vec![0; 2 * 64 * 64])?;
/// let mut told = 0;
/// receivers.frame(0, &Frame::new(&[118; 64 * 64], 64, 64)?, &mut (), |_panel, outcome| {
///     assert!(outcome.reading.is_err());
///     told += 1;
/// });
/// assert_eq!(told, 1);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Receivers<const PANELS: usize, const PIXELS: usize, M, H> {
    locator: Locator,
    panels: [(Reader, M); PANELS],
    history: History<H>,
}

impl<
    const PANELS: usize,
    const PIXELS: usize,
    M: BorrowMut<ReceiverMemory<PIXELS>>,
    H: BorrowMut<[u8]>,
> Receivers<PANELS, PIXELS, M, H>
{
    /// Receivers that have seen nothing. `history` is as for [`crate::receiver::Receiver::with_history`].
    ///
    /// # Errors
    /// [`ReceiverError`] if a setting is out of its range.
    pub fn new(
        settings: ReceiverSettings,
        mut memories: [M; PANELS],
        history: H,
    ) -> Result<Self, ReceiverError> {
        for memory in &mut memories {
            memory.borrow_mut().prepare(&settings);
        }
        let reader = Reader::new(&settings)?;
        Ok(Self {
            locator: Locator::new(settings.camera)?,
            panels: memories.map(|memory| (reader.clone(), memory)),
            history: History::new(history),
        })
    }

    /// Takes in frame `number` and tells of each panel that was or is followed what the frame brought; and if there is room for one more,
    /// under the number of the panel that it would be, why none was found.
    pub fn frame(
        &mut self,
        number: u64,
        frame: &Frame<'_>,
        profile: &mut impl Profile,
        mut tell: impl FnMut(usize, Outcome<'_>),
    ) {
        let mut known = Vec::<Corners, PANELS>::new();
        let mut idle = None;
        for (index, (reader, memory)) in self.panels.iter_mut().enumerate() {
            let memory = memory.borrow_mut();
            let followed =
                reader.follow(number, frame, &self.locator, &mut memory.tools(), profile);
            if let Some(reading) = followed {
                // Two tracks on one panel are one too many.
                let twice = reading.as_ref().is_ok_and(|reading| {
                    known.iter().any(|other| overlap(other, &reading.corners))
                });
                if twice {
                    reader.forget();
                } else {
                    known.extend(reader.corners());
                    tell(
                        index,
                        reader.outcome(number, reading, &mut memory.deframer, profile),
                    );
                }
            }
            if !reader.is_following() {
                idle.get_or_insert(index);
            }
        }
        let Some(index) = idle else {
            self.history.forget();
            return;
        };
        let Some((reader, memory)) = self.panels.get_mut(index) else {
            return;
        };
        let memory = memory.borrow_mut();
        let found = self.history.with_earlier(frame, |earlier| {
            self.locator.locate_among(
                frame,
                earlier,
                &known,
                Effort::Share(number),
                &mut memory.locator,
                profile,
            )
        });
        self.history.keep(frame);
        let reading: Result<Reading, Loss> = match found {
            Ok(location) => reader.begin(number, frame, &location, &mut memory.tools(), profile),
            Err(why) => Err(Loss::Locate(why)),
        };
        // That there is no further panel is no loss.
        let nothing_more = matches!(
            reading,
            Err(Loss::Locate(
                LocateError::NothingStandsOut | LocateError::NoCandidate { .. }
            ))
        );
        if known.is_empty() || !nothing_more {
            tell(
                index,
                reader.outcome(number, reading, &mut memory.deframer, profile),
            );
        }
    }

    /// Takes in the symbols that the last frames showed, of which [`Receivers::frame`] waits for the end.
    pub fn finish(&mut self, mut tell: impl FnMut(usize, link::framing::Event<'_>)) {
        for (index, (reader, memory)) in self.panels.iter_mut().enumerate() {
            tell(index, reader.finish(&mut memory.borrow_mut().deframer));
        }
    }

    /// Where the panels were last seen that are followed, by their numbers.
    pub fn corners(&self) -> [Option<Corners>; PANELS] {
        self.panels.each_ref().map(|(reader, _)| reader.corners())
    }
}

/// Whether the centre of one panel lies on the other.
fn overlap(a: &Corners, b: &Corners) -> bool {
    let [column, row] = a.homography().to_panel(b.centre_px().map(f64::from));
    (-0.5..=7.5).contains(&column) && (-0.5..=7.5).contains(&row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Scene;
    use link::fec::Code;
    use link::framing::{Event, Framer};
    use std::boxed::Box;

    #[test]
    fn two_panels_deliver_their_own_messages() {
        let messages: [&[u8]; 2] = [b"left lane closed", b"ambulance behind"];
        let mut framers =
            messages.map(|m| Framer::new(m, Code::for_length(m.len()), false).unwrap());
        let memories = [(); 2].map(|()| Box::new(ReceiverMemory::<4096>::new()));
        let history = std::vec![0; 2 * 200 * 96];
        let mut receivers =
            Receivers::<2, 4096, _, _>::new(ReceiverSettings::default(), memories, history)
                .unwrap();
        let mut delivered = std::vec::Vec::new();
        for number in 0..30u64 {
            let x = [45.0 + 0.4 * number as f32, 150.0];
            let mut seen =
                framers
                    .iter_mut()
                    .zip(x)
                    .zip([4.4, 5.2])
                    .map(|((framer, x), pitch_px)| {
                        let scene = Scene {
                            bits: framer.next_panel().bits(),
                            width: 200,
                            centre: [x, 48.0],
                            pitch_px,
                            noise_grey: 1.0,
                            ..Scene::PLAIN
                        };
                        scene.render().pixels
                    });
            let (left, right) = (seen.next().unwrap(), seen.next().unwrap());
            let both: std::vec::Vec<u8> =
                left.iter().zip(&right).map(|(&a, &b)| a.max(b)).collect();
            receivers.frame(
                number,
                &Frame::new(&both, 200, 96).unwrap(),
                &mut (),
                |_, outcome| {
                    if let Event::Delivered(delivery) = outcome.event {
                        delivered.push(delivery.message.to_vec());
                    }
                },
            );
        }
        assert!(receivers.corners().iter().all(Option::is_some));
        for message in messages {
            assert!(delivered.iter().any(|got| got == message), "{delivered:?}");
        }
    }
}
