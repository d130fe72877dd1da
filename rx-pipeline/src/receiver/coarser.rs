//! Detects that a lattice is finer than the panel's: only every second, fourth, fifth, eighth or ninth place is an LED.
//!
//! All LEDs of a carrier glow. In an exposure that sees little of their bits, an LED stands out only against the gaps. A lattice that lies
//! at an angle to the panel's, or has a fraction of its pitch, is then read as a panel whose On LEDs form a lattice themselves. In a
//! message they never do. At a third of the pitch an LED may lie between two places, in its row, in its column or in both, and light both
//! places.

use crate::frame::Frame;
use crate::lattice::{Lattice, MIDDLE};
use link::panel::{LEDS, SIDE};

/// Columns and rows from one LED to the next in its row, in places of the finer lattice.
const STEPS: [[i32; 2]; 6] = [[3, 0], [2, 2], [2, 1], [2, -1], [2, 0], [1, 1]];
/// The step at which an LED may light two places.
const THIRD: [i32; 2] = [3, 0];
/// Places that such an LED lights, along the columns and along the rows.
const WIDTHS: [[i32; 2]; 3] = [[2, 2], [2, 1], [1, 2]];
/// Minimum share of the places with an LED that look On.
const ON: f32 = 0.6;
/// Maximum number of the other places that look On (count).
const OFF: u32 = 1;

/// Minimum contrast of the coarser lattice's LEDs relative to the finer's. The ratio is at least 2 if there are no LEDs in between, and 1
/// if there are, but Off.
const STANDS_OUT: f32 = 1.5;

/// A coarser lattice, and one place of the finer lattice that is an LED, or the first of those that an LED lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coarser {
    step: [i32; 2],
    led: [i32; 2],
    /// Places that an LED lights, along the columns and along the rows.
    width: [i32; 2],
}

impl Coarser {
    /// The lattice of the LEDs that are On in `bits`, if they form one.
    pub fn of(bits: u64) -> Option<Self> {
        let first = bits.trailing_zeros() as i32;
        let led = [first % SIDE as i32, first / SIDE as i32];
        let single = STEPS.map(|step| Self { step, led, width: [1, 1] });
        let [third, _] = THIRD;
        let wide = WIDTHS.into_iter().flat_map(|width| {
            let places = (0..third * third).map(move |place| [place % third, place / third]);
            places.map(move |led| Self { step: THIRD, led, width })
        });
        single.into_iter().chain(wide).find(|coarser| {
            let leds = coarser.leds();
            let (on, all) = ((bits & leds).count_ones(), leds.count_ones());
            on as f32 >= ON * all as f32 && (bits & !leds).count_ones() <= OFF
        })
    }

    /// The places with LEDs, as bits.
    fn leds(&self) -> u64 {
        let [a, b] = self.step;
        let is_led = |place: usize| {
            let [x, y] = [(place % SIDE) as i32 - self.led[0], (place / SIDE) as i32 - self.led[1]];
            let along = [a * x + b * y, a * y - b * x].map(|along| along.rem_euclid(a * a + b * b));
            // Steps along one axis if an LED is wide.
            along
                .into_iter()
                .zip(self.width)
                .all(|(along, width)| along < a * width && along % a == 0)
        };
        (0..LEDS).fold(0, |leds, place| leds | u64::from(is_led(place)) << place)
    }

    /// The panel whose LEDs are such places of `lattice`. The known LED gets the row and column with which the LEDs stand out most from the
    /// gaps. None if no such panel lies within the frame, or if its LEDs stand out no better than those of `lattice`.
    pub fn panel(&self, frame: &Frame<'_>, lattice: &Lattice) -> Option<Lattice> {
        let [a, b] = self.step.map(|step| step as f32);
        let [column, row] = [0, 1].map(|axis| {
            let along = |column: f32, row: f32| core::array::from_fn(|i| column * lattice.column[i] + row * lattice.row[i]);
            if axis == 0 { along(a, b) } else { along(-b, a) }
        });
        let [x, y] = [0, 1].map(|axis| self.led[axis] as f32 + 0.5 * (self.width[axis] - 1) as f32);
        let at = lattice.position(x, y);
        let upright = Lattice {
            centre: at,
            column,
            row,
            tilt: [0.0; 2],
        }
        .most_upright();
        let panels = (0..LEDS).filter_map(|led| {
            let [x, y] = [led % SIDE, led / SIDE].map(|place| MIDDLE - place as f32);
            let panel = Lattice {
                centre: core::array::from_fn(|i| at[i] + x * upright.column[i] + y * upright.row[i]),
                ..upright
            };
            Some((stands_out(frame, &panel)?, panel))
        });
        let least = STANDS_OUT * stands_out(frame, lattice)?;
        let best = panels.max_by(|a, b| a.0.total_cmp(&b.0));
        best.filter(|(stands_out, _)| *stands_out > least).map(|(_, panel)| panel)
    }
}

/// The mean difference between a panel's LEDs and the places between and around them (grey levels); none if the panel is not in the frame.
fn stands_out(frame: &Frame<'_>, panel: &Lattice) -> Option<f32> {
    let mean = |side: usize, first: f32| {
        let mut sum = 0.0;
        for place in 0..side * side {
            let [column, row] = [place % side, place / side].map(|at| first + at as f32);
            sum += f32::from(frame.nearest(panel.position(column, row))?);
        }
        Some(sum / (side * side) as f32)
    };
    Some(mean(SIDE, 0.0)? - mean(SIDE + 1, -0.5)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattices_of_on_leds_are_known() {
        for (bits, step) in [
            (0xaa55_aa55_aa55_aa55, Some([1, 1])),
            (0x0055_0055_0055_0055, Some([2, 0])),
            (0x49, None),
            (0x0049_0000_4900_0049, Some([3, 0])),
            (0x9936_c96c_b24d_6693, None),
            (0, None),
            (u64::MAX, None),
            // LEDs at a third of the pitch, between two places of their rows, of their columns, or of both.
            (0xdbdb_00db_db00_dbdb, Some([3, 0])),
            (0x18db_00db_db00_dbdb, Some([3, 0])),
            (0xdb00_00db_0000_db00, Some([3, 0])),
            (0x4949_0049_4900_4949, Some([3, 0])),
            (0xdbdb_08db_db08_dbdb, None),
        ] {
            assert_eq!(Coarser::of(bits).map(|coarser| coarser.step), step, "{bits:x}");
        }
    }

    #[test]
    fn an_led_between_places_of_a_third_of_the_pitch_is_in_their_middle() {
        // LEDs 12 px apart from (14, 14) on, 6 px wide, and a lattice of 4 px whose places are 2 px beside them.
        let is_led = |x: usize, y: usize| {
            let of_led = |at: usize| (14..=98).contains(&at) && at.wrapping_add(1) % 12 < 6;
            of_led(x) && of_led(y)
        };
        let pixels: std::vec::Vec<u8> = (0..128 * 128).map(|i| if is_led(i % 128, i / 128) { 200 } else { 20 }).collect();
        let frame = Frame::new(&pixels, 128, 128).expect("a frame");
        let fine = Lattice {
            centre: [50.0, 50.0],
            column: [4.0, 0.0],
            row: [0.0, 4.0],
            tilt: [0.0; 2],
        };
        let is_on = |place: usize| {
            let [x, y] = fine.position((place % SIDE) as f32, (place / SIDE) as f32);
            frame.pixel(x as usize, y as usize).is_some_and(|grey| grey > 100)
        };
        let bits = (0..LEDS).fold(0, |bits, place| bits | u64::from(is_on(place)) << place);
        let panel = Coarser::of(bits).and_then(|coarser| coarser.panel(&frame, &fine));
        let panel = panel.unwrap_or_else(|| panic!("no panel in {bits:016x}"));
        let off = [0, 1].map(|axis| panel.centre[axis] - 55.5);
        assert!(off.iter().all(|off| off.abs() <= 1.0), "{panel:?}");
        assert_eq!((panel.column, panel.row), ([12.0, 0.0], [0.0, 12.0]));
    }

    #[test]
    fn the_panel_is_where_its_leds_are() {
        // LEDs 8 px apart from (20, 12) on, and a lattice across them.
        let is_led =
            |x: usize, y: usize| x >= 20 && y >= 12 && (x - 20).is_multiple_of(8) && (y - 12).is_multiple_of(8) && x <= 76 && y <= 68;
        let pixels: std::vec::Vec<u8> = (0..96 * 96).map(|i| if is_led(i % 96, i / 96) { 200 } else { 20 }).collect();
        let frame = Frame::new(&pixels, 96, 96).expect("a frame");
        let across = Lattice {
            centre: [44.0, 40.0],
            column: [4.0, 4.0],
            row: [-4.0, 4.0],
            tilt: [0.0; 2],
        };
        let is_on = |place: usize| {
            let [x, y] = across.position((place % SIDE) as f32, (place / SIDE) as f32);
            frame.pixel(x as usize, y as usize).is_some_and(|grey| grey > 100)
        };
        let bits = (0..LEDS).fold(0, |bits, place| bits | u64::from(is_on(place)) << place);
        let panel = Coarser::of(bits)
            .and_then(|coarser| coarser.panel(&frame, &across))
            .expect("a panel");
        assert_eq!((panel.centre, panel.column, panel.row), ([48.0, 40.0], [8.0, 0.0], [0.0, 8.0]));
    }

    #[test]
    fn a_panel_that_shows_a_chequerboard_stays() {
        const CHEQUERBOARD: u64 = 0xaa55_aa55_aa55_aa55;
        let panel = Lattice {
            centre: [100.0, 100.0],
            column: [8.0, 0.0],
            row: [0.0, 8.0],
            tilt: [0.0; 2],
        };
        let mut pixels = std::vec![20; 200 * 200];
        for led in (0..LEDS).filter(|led| CHEQUERBOARD >> led & 1 == 1) {
            let [x, y] = panel.position((led % SIDE) as f32, (led / SIDE) as f32);
            pixels[y as usize * 200 + x as usize] = 200;
        }
        let frame = Frame::new(&pixels, 200, 200).expect("a frame");
        let coarser = Coarser::of(CHEQUERBOARD).expect("every second place is lit");
        assert_eq!(coarser.panel(&frame, &panel), None);
    }
}
