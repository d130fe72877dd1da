//! A table that is made for another waveform than the panel shows.

use std::fmt;

use link::waveform::Waveform;

/// A warning: with a carrier, Off LEDs glow too, so that its best ratios differ from those of still panels.
///
/// ```
/// use link::waveform::Waveform;
/// use sim::l2a::OtherWaveform;
/// let carrier = Waveform::new(16)?;
/// assert_eq!(OtherWaveform::if_any(carrier, carrier), None);
/// let warning = OtherWaveform::if_any(Waveform::STILL, carrier).map(|other| other.to_string());
/// assert!(warning.is_some_and(|warning| warning.starts_with("the table is made for still panels")));
/// # Ok::<(), link::waveform::WaveformError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OtherWaveform {
    /// The waveform of the table.
    pub made_for: Waveform,
    /// The waveform of the panel.
    pub shown: Waveform,
}

impl OtherWaveform {
    /// The warning, if the waveforms differ.
    pub fn if_any(made_for: Waveform, shown: Waveform) -> Option<Self> {
        (made_for != shown).then_some(Self { made_for, shown })
    }

    /// A waveform in words.
    pub fn words(waveform: Waveform) -> String {
        match waveform.cycles() {
            0 => "still panels".into(),
            cycles => format!("a carrier of {cycles} cycles a symbol"),
        }
    }
}

impl fmt::Display for OtherWaveform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the table is made for {}, and the transmitter shows {}, with which another ratio may reach farther; compare ratios with `vocc link \
             --set link.symbol_rate_hz=HZ --set link.carrier_cycles={} --set link.l2a=R`",
            Self::words(self.made_for),
            Self::words(self.shown),
            self.shown.cycles()
        )
    }
}
