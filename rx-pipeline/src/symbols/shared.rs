//! Exposures shared by two symbols under saturation: an LED that was On in either is as white as one that was On in both.
//!
//! Such a reading has an On LED wherever either symbol has one, and all its LEDs are sure. Single symbols of random bits differ from that:
//! of the 32 ± 4 On LEDs of one, another shares half by chance. It shares the required nine in ten once in 360 000 pairs.

use crate::detect::correlation;
use link::panel::{PanelFrame, SoftPanel};

/// The least correlation of a symbol's On LEDs with a reading that shows it and another (1 if all are On, 0 in another symbol). Higher:
/// noise hides shared exposures; lower: more single symbols look like shared ones. The tests compute how many.
const SHARED_ON: f32 = 0.8;
/// The greatest correlation of its Off LEDs (0 if half of them are On, 1 if the symbol is alone). Higher: noisy repeats look like shared
/// exposures; lower: shared exposures that add few On LEDs look like repeats.
const SHARED_OFF: f32 = 0.5;
/// Known On LEDs, and known Off LEDs, of a symbol to recognise in another reading, at least (count). Higher: fewer symbols qualify; lower:
/// chance decides.
const SHARED_LEAST: u32 = 20;

/// The soft values of the other symbol if `shown` has the On LEDs of both it and `one`: 0 for LEDs that are On in `one`. `None` if it shows
/// a single symbol.
pub(super) fn other(shown: &SoftPanel, one: &SoftPanel) -> Option<SoftPanel> {
    let on = one.hard().bits();
    let off = !on & one.seen();
    let agree = |leds| correlation(&part(shown, leds), &part(one, leds));
    let is_both = [on, off].iter().all(|leds| leds.count_ones() >= SHARED_LEAST) && agree(on) >= SHARED_ON && agree(off) <= SHARED_OFF;
    is_both.then(|| {
        SoftPanel(core::array::from_fn(|led| {
            let off = one.0[led].saturating_neg().max(0);
            shown.0[led].min(off)
        }))
    })
}

/// The panel with all but these LEDs erased.
fn part(panel: &SoftPanel, leds: u64) -> SoftPanel {
    let leds = PanelFrame::from_bits(leds);
    SoftPanel(core::array::from_fn(|led| if leds.led(led) { panel.0[led] } else { 0 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    fn panel(bits: u64) -> SoftPanel {
        SoftPanel::certain(PanelFrame::from_bits(bits), 10)
    }

    fn is_distinct(symbol: u64) -> bool {
        (SHARED_LEAST..=64 - SHARED_LEAST).contains(&symbol.count_ones())
    }

    /// n choose k.
    fn choose(n: u32, k: u32) -> f64 {
        (0..k).fold(1.0, |ways, i| ways * f64::from(n - i) / f64::from(i + 1))
    }

    #[test]
    fn chance_errs_as_stated() {
        // ρ = 2·agreeing/On − 1.
        let by_chance = |on: u32| {
            let least = libm::ceil(f64::from(on) * f64::from(1.0 + SHARED_ON) / 2.0) as u32;
            let ways: f64 = (least..=on).map(|agree| choose(on, agree)).sum();
            ways / libm::exp2(on.into())
        };
        let mistaken: f64 = (SHARED_LEAST..=64 - SHARED_LEAST)
            .map(|on| choose(64, on) / libm::exp2(64.0) * by_chance(on))
            .sum();
        assert!((1.0 / 3.8e5..1.0 / 3.4e5).contains(&mistaken), "{mistaken}");
    }

    properties! {
        #[test]
        fn both_tell_what_the_one_leaves(one: u64, rest: u64) {
            prop_assume!(is_distinct(one) && (rest & !one).count_ones() >= 18);
            let other = other(&panel(one | rest), &panel(one)).unwrap();
            prop_assert_eq!(other.seen(), !one);
            prop_assert_eq!(other.hard().bits(), rest & !one);
        }

        #[test]
        fn a_symbol_shown_alone_is_not_two(one: u64, wrong in prop::collection::vec(0u32..64, 0..4)) {
            prop_assume!(is_distinct(one));
            let shown = wrong.iter().fold(one, |bits, led| bits ^ 1 << led);
            prop_assert_eq!(other(&panel(shown), &panel(one)), None);
        }
    }
}
