//! The panels of a transmission.

use link::fec::Code;
use link::framing::FramingError;
use link::panel::PanelFrame;
use tx_firmware::schedule::{Repeats, Schedule};

/// One period of the firmware's panels: two repeats of a message of 1 to 1024 bytes, or of the beacon without one.
///
/// ```
/// use studies::flicker::panels;
/// let beacon = panels(None)?;
/// assert_eq!(beacon.len(), 6);
/// assert_eq!(beacon[3].bits(), !beacon[0].bits());
/// # Ok::<(), link::framing::FramingError>(())
/// ```
///
/// # Errors
/// [`FramingError`] if the message is empty or too long.
pub fn panels(message: Option<&[u8]>) -> Result<Vec<PanelFrame>, FramingError> {
    let mut schedule = Schedule::new();
    if let Some(message) = message {
        schedule.send(message, Code::for_length(message.len()), Repeats::Forever)?;
    }
    let period = 2 * schedule.panels_per_repeat();
    Ok((0..period).map(|_| schedule.next_panel()).collect())
}

/// Panels in Manchester code: each one is followed by its complement. Each LED is On in one of the two, at half of the data rate.
///
/// ```
/// use link::panel::PanelFrame;
/// let panels = [PanelFrame::from_bits(0xff)];
/// assert_eq!(studies::flicker::manchester(&panels), [0xff, !0xff].map(PanelFrame::from_bits));
/// ```
pub fn manchester(panels: &[PanelFrame]) -> Vec<PanelFrame> {
    let complement = |panel: PanelFrame| PanelFrame::from_bits(!panel.bits());
    panels.iter().flat_map(|&panel| [panel, complement(panel)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_firmware_goes_on_as_it_began() {
        for message in [None, Some(b"Ice".as_slice()), Some(&[0x5a; 1024])] {
            let period = panels(message).expect("a message");
            let mut schedule = Schedule::new();
            if let Some(message) = message {
                let code = Code::for_length(message.len());
                schedule.send(message, code, Repeats::Forever).expect("a message");
            }
            let shown = (0..5 * period.len()).map(|_| schedule.next_panel());
            assert!(shown.eq(period.iter().copied().cycle().take(5 * period.len())));
        }
    }

    #[test]
    fn messages_that_cannot_be_sent_are_refused() {
        assert_eq!(panels(Some(&[])), Err(FramingError::Empty));
        let length = 1025;
        assert_eq!(panels(Some(&vec![0; length])), Err(FramingError::TooLong { length }));
    }
}
