//! Log-likelihood ratios in nats, and their soft values.

use link::panel::{LEDS, LLR_STEP, Llr, SoftPanel};

/// Log-likelihood ratios in nats, in steps of [`LLR_STEP`], within ±127.
pub(crate) fn soft_panel(llr: &[f32; LEDS]) -> SoftPanel {
    SoftPanel(llr.map(|llr| libm::roundf(llr / LLR_STEP).clamp(-127.0, 127.0) as Llr))
}

/// The soft values, limited to `nats` either way.
pub(crate) fn limited_to(panel: &SoftPanel, nats: f32) -> SoftPanel {
    let most = libm::floorf(nats / LLR_STEP).clamp(0.0, 127.0) as Llr;
    SoftPanel(panel.0.map(|llr| llr.clamp(-most, most)))
}

/// Σ a·b/√(Σ a²·Σ b²): −1 to 1; 0 if either is 0 throughout.
pub(crate) fn correlation(a: &SoftPanel, b: &SoftPanel) -> f32 {
    let product = |a: &SoftPanel, b: &SoftPanel| -> f32 {
        let sum: i32 = a.0.iter().zip(&b.0).map(|(&a, &b)| i32::from(a) * i32::from(b)).sum();
        sum as f32
    };
    let norm = libm::sqrtf(product(a, a) * product(b, b));
    if norm > 0.0 { product(a, b) / norm } else { 0.0 }
}
