//! The panel to draw.

/// A parallel panel: centre of its first LED, pitch and LED radius in px, linear values of LEDs before a background of 1.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    /// 64 bits, LED 8·row + column at that bit.
    pub bits: u64,
    /// Centre of LED 0, in px.
    pub first_px: [f64; 2],
    /// Distance of neighbouring LEDs in px.
    pub pitch_px: f64,
    /// Radius of an LED in px.
    pub radius_px: f64,
    /// Linear value of an Off LED.
    pub off: f64,
    /// Linear value of an On LED.
    pub on: f64,
}

impl Panel {
    /// Centre and linear value of an LED.
    pub fn led(&self, led: usize) -> ([f64; 2], f64) {
        let centre = [
            self.first_px[0] + (led % 8) as f64 * self.pitch_px,
            self.first_px[1] + (led / 8) as f64 * self.pitch_px,
        ];
        let is_on = self.bits >> led & 1 == 1;
        (centre, if is_on { self.on } else { self.off })
    }
}
