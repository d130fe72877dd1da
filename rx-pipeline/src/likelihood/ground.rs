//! An uneven ground: an open panel before a wall that grows brighter to one side, or before a bright stripe.
//!
//! The ground between LEDs also adds to their light. 64 lights determine two values, On and Off, and a surface of second order, without
//! known bits: such a smooth surface does not look like random bits.

use super::least_squares::two_groups;
use link::panel::{LEDS, SIDE};

/// The ground is plain if LEDs of one state differ by less (standard deviation, share of the step from Off to On). Lower: slower.
const CLEAR: f32 = 0.1;
/// Rounds of separating the surface and the bits (count). More: slower.
const ROUNDS: usize = 8;
/// Maximum residuals of the LEDs' light with a surface (share of those with two states alone). Higher: noise looks like a surface, which
/// has five unknowns more.
const UNEVEN: f32 = 0.5;

/// The ground's part of the light of each LED, 0 on the average; 0 throughout if it is plain, or if a surface does not reduce the residuals
/// of `light` much. LEDs that do not follow the message are ignored.
pub(super) fn ground_under(light: &[f32; LEDS], follows: impl Fn(usize) -> bool) -> [f32; LEDS] {
    const PLAIN: [f32; LEDS] = [0.0; LEDS];
    let surface = Surface { light, follows };
    let plain = surface.groups(&PLAIN);
    let step = plain.high - plain.low;
    let least = surface.left(&PLAIN, &plain);
    if least <= CLEAR * CLEAR * step * step {
        return PLAIN;
    }
    let mean = light.iter().sum::<f32>() / LEDS as f32;
    let middle = Groups { low: mean, high: mean };
    let found = [middle, plain].map(|start| surface.settled(start));
    let [a, b] = &found;
    let (left, ground) = if a.0 < b.0 { a } else { b };
    if *left < UNEVEN * least { *ground } else { PLAIN }
}

/// The light of Off and of On LEDs.
#[derive(Clone, Copy)]
struct Groups {
    low: f32,
    high: f32,
}

impl Groups {
    /// The nearer level of both.
    fn nearest(&self, light: f32) -> f32 {
        if light > 0.5 * (self.low + self.high) {
            self.high
        } else {
            self.low
        }
    }
}

struct Surface<'a, F> {
    light: &'a [f32; LEDS],
    follows: F,
}

impl<F: Fn(usize) -> bool> Surface<'_, F> {
    /// The converged ground from two initial groups, and its mean square residual.
    fn settled(&self, start: Groups) -> (f32, [f32; LEDS]) {
        let mut ground = [0.0; LEDS];
        self.improve(&mut ground, &start);
        let mut groups = self.groups(&ground);
        for _ in 0..ROUNDS {
            self.improve(&mut ground, &groups);
            groups = self.groups(&ground);
        }
        (self.left(&ground, &groups), ground)
    }

    fn groups(&self, ground: &[f32; LEDS]) -> Groups {
        let [low, high] = two_groups(core::array::from_fn(|led| self.light[led] - ground[led]));
        Groups { low, high }
    }

    /// The residual of an LED's light on a ground.
    fn rest(&self, led: usize, ground: f32, groups: &Groups) -> f32 {
        let light = self.light[led] - ground;
        if (self.follows)(led) { light - groups.nearest(light) } else { 0.0 }
    }

    fn left(&self, ground: &[f32; LEDS], groups: &Groups) -> f32 {
        let squares = (0..LEDS).map(|led| {
            let rest = self.rest(led, ground[led], groups);
            rest * rest
        });
        squares.sum::<f32>() / LEDS as f32
    }

    /// Adds the surface in the residuals of a ground.
    fn improve(&self, ground: &mut [f32; LEDS], groups: &Groups) {
        let mut products = [0.0; TERMS];
        for (led, ground) in ground.iter().enumerate() {
            let rest = self.rest(led, *ground, groups);
            for (product, term) in products.iter_mut().zip(terms(led)) {
                *product += rest * term;
            }
        }
        for (led, ground) in ground.iter_mut().enumerate() {
            let pairs = products.iter().zip(terms(led));
            *ground += pairs.map(|(product, term)| product * term).sum::<f32>();
        }
    }
}

const TERMS: usize = 5;

/// The polynomials of first and second order at an LED: orthonormal over the panel.
fn terms(led: usize) -> [f32; TERMS] {
    let [u, v] = [led % SIDE, led / SIDE].map(|i| i as f32 - 3.5);
    // √ of 8·42, 8·168 and 42·42, the sums of squares over the panel.
    let [linear, square, mixed] = [1.0 / 18.330_303, 1.0 / 36.660_606, 1.0 / 42.0];
    [
        linear * u,
        linear * v,
        square * (u * u - 5.25),
        square * (v * v - 5.25),
        mixed * u * v,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const BITS: u64 = 0x9a3c_5e71_0f96_c3a5;

    fn light(ground: impl Fn(f32, f32) -> f32) -> [f32; LEDS] {
        core::array::from_fn(|led| {
            let on = (BITS >> led & 1) as f32;
            // Noise.
            let noise = 0.08 * (((led * 37) % 11) as f32 / 5.0 - 1.0);
            2.0 * on + noise + ground((led % 8) as f32, (led / 8) as f32)
        })
    }

    #[test]
    fn the_terms_are_orthonormal() {
        for i in 0..TERMS {
            assert!((0..LEDS).map(|led| terms(led)[i]).sum::<f32>().abs() < 1e-4);
            for j in 0..TERMS {
                let product = (0..LEDS).map(|led| terms(led)[i] * terms(led)[j]);
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((product.sum::<f32>() - expected).abs() < 1e-4, "{i} {j}");
            }
        }
    }

    #[test]
    fn a_plain_ground_is_none() {
        let ground = ground_under(&light(|_, _| 3.0), |_| true);
        assert_eq!(ground, [0.0; LEDS]);
    }

    #[test]
    fn slopes_and_stripes_are_found_and_their_bits_too() {
        let slope = |u: f32, v: f32| 0.5 * u - 0.2 * v;
        let stripe = |u: f32, _: f32| 2.0 * (-0.15 * (u - 3.0) * (u - 3.0)).exp();
        for light in [light(slope), light(stripe)] {
            let ground = ground_under(&light, |led| led != 9);
            let flat: [f32; LEDS] = core::array::from_fn(|led| light[led] - ground[led]);
            let [low, high] = two_groups(flat);
            for (led, light) in flat.into_iter().enumerate() {
                let on = light > 0.5 * (low + high);
                assert_eq!(on, BITS >> led & 1 == 1, "LED {led}");
            }
        }
    }
}
