//! Diagnoses a panel from the levels of its LEDs in the test panels.
//!
//! Each place names the LED whose bits it shows, by the signs of its six differences. The whole panel comes first: its rotation and shift
//! are those that leave the fewest LEDs at a wrong place. The remaining faults are reported by row, by column and by LED.

use link::orientation::Orientation;
use link::panel::{LEDS, SIDE};

use super::{PAIRS, RAMP_PANEL, StepLevels};
use crate::bring_up::Finding;

/// Minimum difference in each pair, as a share of the LED's greatest, for an LED that follows all pairs.
const FOLLOWS_MIN: f32 = 0.4;
/// Minimum difference of a lit LED, as a share of a usual LED's.
const LIT_MIN: f32 = 0.15;
/// Number of LEDs that may be brighter than usual.
const OUTLIERS: usize = 2;
/// Maximum distance of an LED from its place, in pitches.
const OFF_MAX: f32 = 0.25;
/// Maximum share of the light at a duty of 0.
const UNDIMMED_MAX: f32 = 0.06;
/// Minimum brightness at a lower duty, relative to full duty, from which light counts as growing while the duty falls.
const INVERTED_MIN: f32 = 1.02;

/// The observed state of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PlaceState {
    /// An LED's bits, or their complements.
    Led {
        led: usize,
        is_inverted: bool,
    },
    /// A bit of several LEDs: `open` has the pairs in which the place does not change, `bits` the values of the others.
    Several {
        bits: usize,
        open: usize,
    },
    Dark,
    Lit,
}

use PlaceState::{Dark, Led, Lit, Several};

/// The faults of a panel; empty if all LEDs work.
pub fn diagnose(reading: &StepLevels) -> Vec<Finding> {
    let shown = shown(reading);
    let dimming = dimming(reading, &shown);
    if !shown.iter().any(|shown| matches!(shown, Led { .. } | Several { .. })) {
        let is_lit = shown.iter().filter(|&&shown| shown == Lit).count() > LEDS / 2;
        return vec![dimming.unwrap_or(Finding::NothingFollows { is_lit })];
    }
    let mut findings = Vec::new();
    let inverted = shown.iter().filter(|shown| matches!(shown, Led { is_inverted: true, .. })).count();
    let right = shown.iter().filter(|shown| matches!(shown, Led { is_inverted: false, .. })).count();
    let is_complemented = inverted > right;
    let placement = Placement::of(&shown);
    if placement.orientation != Orientation::UPRIGHT {
        findings.push(Finding::Turned(placement.orientation));
    }
    if placement.shift != 0 {
        findings.push(Finding::ChainShifted(placement.shift));
    }
    if is_complemented {
        findings.push(Finding::Complemented);
    }
    findings.extend(dimming);
    Local::new(&shown, placement, is_complemented).tell(&mut findings);
    for led in 0..LEDS {
        let offset = reading.offsets[placement.place_of(led)];
        if let Some(offset) = offset.filter(|offset| offset.iter().any(|pitches| pitches.abs() > OFF_MAX)) {
            findings.push(Finding::OffLattice(led, offset));
        }
    }
    findings
}

/// The number of places that show the bits of several LEDs.
pub(super) fn of_several(reading: &StepLevels) -> usize {
    shown(reading).iter().filter(|shown| matches!(shown, Several { .. })).count()
}

/// The state of each place.
fn shown(reading: &StepLevels) -> [PlaceState; LEDS] {
    let differences: [[f32; PAIRS]; LEDS] =
        std::array::from_fn(|place| std::array::from_fn(|pair| reading.pairs[pair][0][place] - reading.pairs[pair][1][place]));
    let strengths = differences.map(|pairs| pairs.into_iter().fold(0.0, |most: f32, by| most.max(by.abs())));
    let mut sorted = strengths;
    sorted.sort_by(|one, other| other.total_cmp(one));
    let usual = sorted[OUTLIERS];
    let lit_min = reading.visible.max(LIT_MIN * usual);
    let lit = |place: usize| usual >= reading.visible && strengths[place] >= lit_min;

    let level = |place: usize, choose: fn(f32, f32) -> f32| {
        let levels = reading.pairs.iter().map(|[one, other]| choose(one[place], other[place]));
        levels.sum::<f32>() / PAIRS as f32
    };
    let [low, high] = [f32::min, f32::max].map(|choose| median((0..LEDS).filter(|&place| lit(place)).map(|place| level(place, choose))));
    // If no LED follows, the darkness is the only reference.
    let half = match (low, high) {
        (Some(low), Some(high)) => (low + high) / 2.0,
        _ => reading.visible,
    };
    std::array::from_fn(|place| {
        if !lit(place) {
            let mean = (level(place, f32::min) + level(place, f32::max)) / 2.0;
            return match (mean > half, reading.dark[place] > half) {
                (true, true) => Lit,
                // Two complementary LEDs drive this place: one of them is On in every panel of the pairs.
                (true, false) => Several { bits: 0, open: LEDS - 1 },
                (false, _) => Dark,
            };
        }
        let follows = |pair: &usize| differences[place][*pair].abs() >= FOLLOWS_MIN * strengths[place];
        let set = |bits: usize, pair: usize| bits | 1 << pair;
        let bits = (0..PAIRS)
            .filter(|&pair| follows(&pair) && differences[place][pair] > 0.0)
            .fold(0, set);
        let open = (0..PAIRS).filter(|pair| !follows(pair)).fold(0, set);
        if open != 0 {
            return Several { bits, open };
        }
        let is_inverted = reading.dark[place] > (level(place, f32::min) + level(place, f32::max)) / 2.0;
        let led = if is_inverted { LEDS - 1 - bits } else { bits };
        Led { led, is_inverted }
    })
}

/// The median; none if there are no values.
pub(super) fn median(values: impl IntoIterator<Item = f32>) -> Option<f32> {
    let mut sorted: Vec<f32> = values.into_iter().collect();
    sorted.sort_by(f32::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// The fault of the dimming, if it has one.
fn dimming(reading: &StepLevels, shown: &[PlaceState; LEDS]) -> Option<Finding> {
    let ramp = reading.ramp.as_ref()?;
    // The excess brightness of the panel's lit LEDs over the others, at the recognised places, or, if there are none, at the nominal ones.
    let any_is_known = shown.iter().any(|shown| matches!(shown, Led { .. }));
    let sign = |place: usize| match shown[place] {
        Led { led, is_inverted } => Some(RAMP_PANEL.led(led) != is_inverted),
        _ if any_is_known => None,
        _ => Some(RAMP_PANEL.led(place)),
    };
    let contrast = |levels: &[f32; LEDS]| {
        let mean = |is_on: bool| {
            let of_them: Vec<f32> = (0..LEDS)
                .filter(|&place| sign(place) == Some(is_on))
                .map(|place| levels[place])
                .collect();
            (!of_them.is_empty()).then(|| of_them.iter().sum::<f32>() / of_them.len() as f32)
        };
        Some(mean(true)? - mean(false)?)
    };
    let steps: Vec<f32> = ramp.iter().map(contrast).collect::<Option<_>>()?;
    let (none, full) = (*steps.first()?, *steps.last()?);
    if none < reading.visible.max(UNDIMMED_MAX * full) {
        return None;
    }
    // At a duty of 0 the board may have switched on the LEDs' low current.
    let brightest = steps.iter().copied().fold(0.0, f32::max);
    Some(if brightest > INVERTED_MIN * full {
        Finding::EnableInverted
    } else {
        Finding::EnableStuck
    })
}

/// The orientation and shift of the whole panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Placement {
    orientation: Orientation,
    /// The number of LEDs by which bits have moved too far along the chain.
    shift: i8,
}

impl Placement {
    /// The placement that has the most LEDs at their places; of equal ones, the simplest.
    fn of(shown: &[PlaceState; LEDS]) -> Self {
        let shifts = (0..=LEDS as i8 / 2).flat_map(|by| if by == 0 { vec![0] } else { vec![by, -by] });
        let mut best = (
            0,
            Self {
                orientation: Orientation::UPRIGHT,
                shift: 0,
            },
        );
        for shift in shifts {
            for orientation in Orientation::ALL {
                let placement = Self { orientation, shift };
                let right = (0..LEDS).filter(|&led| matches!(shown[placement.place_of(led)], Led { led: found, .. } if found == led));
                let right = right.count();
                if right > best.0 {
                    best = (right, placement);
                }
            }
        }
        best.1
    }

    /// The place that shows an LED's bit.
    fn place_of(self, led: usize) -> usize {
        let along = (led as i32 + i32::from(self.shift)).rem_euclid(LEDS as i32);
        self.orientation.place_of(along as usize)
    }
}

/// Rows, columns and LEDs, once the placement of the whole panel is known.
struct Local {
    /// The observed states, indexed by the LED that belongs at the place.
    shown: [PlaceState; LEDS],
    is_complemented: bool,
    /// LEDs that are already covered by a finding.
    is_done: [bool; LEDS],
}

/// The state that all LEDs of a line have in common, and the finding for such a line.
type LineFinding = (PlaceState, fn(usize) -> Finding);

/// The row whose bits a row shows, and whether it shows them from right to left.
type RowShown = (usize, bool);

fn at(row: usize, column: usize) -> usize {
    SIDE * row + column
}

fn reversed(column: usize, is_reversed: bool) -> usize {
    if is_reversed { SIDE - 1 - column } else { column }
}

impl Local {
    fn new(shown: &[PlaceState; LEDS], placement: Placement, is_complemented: bool) -> Self {
        Self {
            shown: std::array::from_fn(|led| shown[placement.place_of(led)]),
            is_complemented,
            is_done: [false; LEDS],
        }
    }

    fn tell(mut self, findings: &mut Vec<Finding>) {
        self.tell_chain(findings);
        self.tell_lines(findings, at, [(Dark, Finding::RowDead), (Lit, Finding::RowStuck)]);
        let columns: [LineFinding; 2] = [(Dark, Finding::ColumnDead), (Lit, Finding::ColumnStuck)];
        self.tell_lines(findings, |column, along| at(along, column), columns);
        let rows: [RowShown; SIDE] = std::array::from_fn(|row| self.row_shown(row));
        let columns: [usize; SIDE] = std::array::from_fn(|column| self.column_shown(column, &rows));
        tell_moved(&rows.map(|(row, _)| row), Finding::RowsSwapped, Finding::RowShows, findings);
        findings.extend((0..SIDE).filter(|&row| rows[row].1).map(Finding::RowReversed));
        tell_moved(&columns, Finding::ColumnsSwapped, Finding::ColumnShows, findings);
        let meant: [usize; LEDS] = std::array::from_fn(|led| {
            let (row, is_reversed) = rows[led / SIDE];
            at(row, reversed(columns[led % SIDE], is_reversed))
        });
        self.tell_leds(&meant, findings);
    }

    /// Reports the rows at the end of the chain that do not follow.
    fn tell_chain(&mut self, findings: &mut Vec<Finding>) {
        let is_silent = |row: &usize| (0..SIDE).all(|column| matches!(self.shown[at(*row, column)], Dark | Lit));
        let silent = (0..SIDE).rev().take_while(is_silent).count();
        if (2..SIDE).contains(&silent) {
            let first = SIDE - silent;
            findings.push(Finding::ChainBroken(first));
            self.is_done[at(first, 0)..].fill(true);
        }
    }

    /// Reports rows or columns that are dark or lit as a whole; `led` gives the LED at a position along a line.
    fn tell_lines(&mut self, findings: &mut Vec<Finding>, led: fn(usize, usize) -> usize, states: [LineFinding; 2]) {
        for line in 0..SIDE {
            let leds: Vec<usize> = (0..SIDE).map(|along| led(line, along)).filter(|&led| !self.is_done[led]).collect();
            for (state, finding) in states {
                // The LEDs that no earlier finding covers represent the line only if they are most of it.
                if leds.len() > SIDE / 2 && leds.iter().all(|&led| self.shown[led] == state) {
                    findings.push(finding(line));
                    leds.iter().for_each(|&led| self.is_done[led] = true);
                }
            }
        }
    }

    /// The row whose bits most of a row's LEDs show.
    fn row_shown(&self, row: usize) -> RowShown {
        let found: Vec<(usize, usize)> = (0..SIDE)
            .filter_map(|column| match self.shown[at(row, column)] {
                Led { led, .. } => Some((column, led)),
                _ => None,
            })
            .collect();
        let candidates = [false, true]
            .into_iter()
            .flat_map(|is_reversed| (0..SIDE).map(move |other| (other, is_reversed)));
        most_of(found.len(), (row, false), candidates, |&(other, is_reversed)| {
            let is_shown = |&&(column, led): &&(usize, usize)| led == at(other, reversed(column, is_reversed));
            found.iter().filter(is_shown).count()
        })
    }

    /// The column whose bits most of a column's LEDs show, without LEDs whose bits belong to another row.
    fn column_shown(&self, column: usize, rows: &[RowShown; SIDE]) -> usize {
        let found: Vec<usize> = (0..SIDE)
            .filter_map(|row| match self.shown[at(row, column)] {
                Led { led, .. } if led / SIDE == rows[row].0 => Some(reversed(led % SIDE, rows[row].1)),
                _ => None,
            })
            .collect();
        most_of(found.len(), column, 0..SIDE, |other| {
            found.iter().filter(|&shown| shown == other).count()
        })
    }

    fn tell_leds(&self, meant: &[usize; LEDS], findings: &mut Vec<Finding>) {
        let found = |led: usize| match self.shown[led] {
            Led { led: found, .. } => Some(found),
            _ => None,
        };
        for led in (0..LEDS).filter(|&led| !self.is_done[led]) {
            match self.shown[led] {
                Dark => findings.push(Finding::LedDead(led)),
                Lit => findings.push(Finding::LedStuck(led)),
                Several { bits, open } => {
                    let other = led ^ open;
                    let is_joined = led & !open == bits && self.shown[other] == self.shown[led];
                    match is_joined {
                        true if led < other => findings.push(Finding::LedsJoined([led, other])),
                        true => {}
                        false => findings.push(Finding::LedUnclear(led)),
                    }
                }
                Led { led: shown, is_inverted } => {
                    if is_inverted != self.is_complemented {
                        findings.push(Finding::LedInverted(led));
                    }
                    if shown == meant[led] {
                        continue;
                    }
                    let other = (0..LEDS).find(|&other| meant[other] == shown);
                    match other.filter(|&other| found(other) == Some(meant[led])) {
                        Some(other) if led < other => findings.push(Finding::LedsSwapped([led, other])),
                        Some(_) => {}
                        None => findings.push(Finding::LedShows([led, shown])),
                    }
                }
            }
        }
    }
}

/// The candidate that has more than half of `all` votes; `usual` if there is none.
fn most_of<C: Copy>(all: usize, usual: C, candidates: impl Iterator<Item = C>, count: impl Fn(&C) -> usize) -> C {
    let mut best = (count(&usual), usual);
    for candidate in candidates {
        let votes = count(&candidate);
        // One or two LEDs do not represent a line.
        if votes > best.0 && votes >= 3 && 2 * votes > all {
            best = (votes, candidate);
        }
    }
    best.1
}

/// Reports lines that show the bits of other lines.
fn tell_moved(shown: &[usize; SIDE], swapped: fn([usize; 2]) -> Finding, shows: fn([usize; 2]) -> Finding, findings: &mut Vec<Finding>) {
    for (line, &other) in shown.iter().enumerate() {
        if other == line {
            continue;
        }
        if shown[other] != line {
            findings.push(shows([line, other]));
        } else if line < other {
            findings.push(swapped([line, other]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bring_up::{CODES, RAMP, StepPictures, walk};
    use link::panel::PanelFrame;
    use properties::prelude::*;

    /// A fault of a panel: maps a panel's bits to the LEDs that are lit.
    type Fault<'a> = &'a dyn Fn(u64) -> u64;

    const DUTY: f32 = 0.2;

    /// The levels of a panel with those faults, applied in turn, if `light` gives the light at a duty.
    fn read(faults: &[Fault<'_>], light: impl Fn(f32) -> f32) -> StepLevels {
        let pictures: Vec<Vec<f32>> = walk()
            .take(CODES + RAMP.len())
            .map(|step| {
                let lit = faults.iter().fold(step.panel.bits(), |bits, fault| fault(bits));
                let light = light(DUTY * f32::from(step.share) / 255.0);
                // Each LED has its own brightness, and its own background.
                let level = |led: usize, on: f32| 20.0 + (led % 5) as f32 + on * light * (400.0 + 10.0 * (led % 11) as f32);
                let shares = PanelFrame::from_bits(lit).shares();
                shares.iter().enumerate().map(|(led, &on)| level(led, on)).collect()
            })
            .collect();
        let aligned = StepPictures {
            codes: pictures[..CODES].to_vec(),
            ramp: Some(pictures[CODES..].to_vec()),
        };
        StepLevels::of_levels(&aligned, 4.0).unwrap()
    }

    fn found(faults: &[Fault<'_>]) -> Vec<Finding> {
        diagnose(&read(faults, |duty| duty))
    }

    /// A panel whose bits are permuted: place `place` shows bit `from(place)`.
    fn moved(bits: u64, from: impl Fn(usize) -> usize) -> u64 {
        (0..LEDS).fold(0, |lit, place| lit | (bits >> from(place) & 1) << place)
    }

    fn swapped(bits: u64, [one, other]: [usize; 2]) -> u64 {
        moved(bits, |place| match place {
            place if place == one => other,
            place if place == other => one,
            place => place,
        })
    }

    fn row(row: usize) -> u64 {
        0xff << (SIDE * row)
    }

    fn column(column: usize) -> u64 {
        0x0101_0101_0101_0101 << column
    }

    fn swapped_lines(bits: u64, [one, other]: [usize; 2], is_row: bool) -> u64 {
        let line = |line| match line {
            line if line == one => other,
            line if line == other => one,
            line => line,
        };
        moved(bits, |place| match (place / SIDE, place % SIDE) {
            (row, column) if is_row => at(line(row), column),
            (row, column) => at(row, line(column)),
        })
    }

    #[test]
    fn a_healthy_panel_gives_no_finding() {
        assert_eq!(found(&[]), []);
        assert_eq!(diagnose(&read(&[], |duty| duty.powf(0.45))), []);
    }

    #[test]
    fn each_led_that_is_dead_or_lit_all_the_time_is_named() {
        for led in 0..LEDS {
            assert_eq!(found(&[&|bits| bits & !(1 << led)]), [Finding::LedDead(led)]);
            assert_eq!(found(&[&|bits| bits | 1 << led]), [Finding::LedStuck(led)]);
            assert_eq!(found(&[&|bits| bits ^ 1 << led]), [Finding::LedInverted(led)]);
        }
    }

    #[test]
    fn each_two_leds_that_are_swapped_or_joined_are_named() {
        for one in 0..LEDS {
            for other in one + 1..LEDS {
                assert_eq!(found(&[&|bits| swapped(bits, [one, other])]), [Finding::LedsSwapped([one, other])]);
                let both = 1 << one | 1 << other;
                assert_eq!(
                    found(&[&|bits| if bits & both == 0 { bits } else { bits | both }]),
                    [Finding::LedsJoined([one, other])]
                );
                assert_eq!(
                    found(&[&|bits| bits & !(1 << one) | (bits >> other & 1) << one]),
                    [Finding::LedShows([one, other])]
                );
            }
        }
    }

    #[test]
    fn each_row_and_column_is_named() {
        for line in 0..SIDE {
            let last_rows = line + 1 == SIDE;
            assert_eq!(found(&[&|bits| bits & !row(line)]), [Finding::RowDead(line)]);
            assert_eq!(found(&[&|bits| bits | row(line)]), [Finding::RowStuck(line)]);
            assert_eq!(found(&[&|bits| bits & !column(line)]), [Finding::ColumnDead(line)]);
            assert_eq!(found(&[&|bits| bits | column(line)]), [Finding::ColumnStuck(line)]);
            let reversed = |place| match (place / SIDE, place % SIDE) {
                (row, column) if row == line => at(row, SIDE - 1 - column),
                _ => place,
            };
            assert_eq!(found(&[&|bits| moved(bits, reversed)]), [Finding::RowReversed(line)]);
            for other in line + 1..SIDE {
                assert_eq!(
                    found(&[&|bits| swapped_lines(bits, [line, other], true)]),
                    [Finding::RowsSwapped([line, other])]
                );
                assert_eq!(
                    found(&[&|bits| swapped_lines(bits, [line, other], false)]),
                    [Finding::ColumnsSwapped([line, other])]
                );
            }
            if line > 0 && !last_rows {
                let rest = u64::MAX << (SIDE * line);
                assert_eq!(found(&[&|bits| bits & !rest]), [Finding::ChainBroken(line)]);
                assert_eq!(found(&[&|bits| bits | rest]), [Finding::ChainBroken(line)]);
            }
        }
    }

    #[test]
    fn the_whole_panel_may_be_turned_shifted_and_complemented() {
        for orientation in Orientation::ALL.into_iter().skip(1) {
            let turned: Fault = &|bits| PanelFrame::from_bits(bits).seen(orientation).bits();
            assert_eq!(found(&[turned]), [Finding::Turned(orientation)]);
            assert_eq!(
                found(&[&|bits| !bits, turned]),
                [Finding::Turned(orientation), Finding::Complemented]
            );
        }
        for shift in 1..=32 {
            assert_eq!(found(&[&|bits| bits.rotate_left(shift)]), [Finding::ChainShifted(shift as i8)]);
        }
        for shift in 1..32 {
            assert_eq!(found(&[&|bits| bits.rotate_right(shift)]), [Finding::ChainShifted(-(shift as i8))]);
        }
        assert_eq!(found(&[&|bits| !bits]), [Finding::Complemented]);
    }

    #[test]
    fn two_faults_at_once_are_both_named() {
        let (dead, late): (Fault, Fault) = (&|bits| bits & !row(3), &|bits| bits.rotate_left(1));
        let crossed: Fault = &|bits| swapped(bits, [18, 45]);
        assert_eq!(found(&[crossed, dead]), [Finding::RowDead(3), Finding::LedsSwapped([18, 45])]);
        assert_eq!(found(&[late, crossed]), [Finding::ChainShifted(1), Finding::LedsSwapped([17, 44])]);
        let mirrored: Fault = &|bits| PanelFrame::from_bits(bits).seen(Orientation::new(0, true)).bits();
        assert_eq!(
            found(&[crossed, mirrored]),
            [Finding::Turned(Orientation::new(0, true)), Finding::LedsSwapped([18, 45])]
        );
        assert_eq!(
            found(&[&|bits| swapped_lines(bits, [1, 6], true), &|bits| swapped_lines(
                bits,
                [0, 4],
                false
            )]),
            [Finding::RowsSwapped([1, 6]), Finding::ColumnsSwapped([0, 4])]
        );
        assert_eq!(
            found(&[&|bits| bits & !column(2), &|bits| bits | 1 << 9]),
            [Finding::ColumnDead(2), Finding::LedStuck(9)]
        );
        assert_eq!(
            diagnose(&read(&[crossed], |duty| 1.0 - duty)),
            [Finding::EnableInverted, Finding::LedsSwapped([18, 45])]
        );
    }

    #[test]
    fn the_enable_line_is_named() {
        for duty in [0.01, 0.2, 0.5, 0.9, 0.98] {
            let inverted = diagnose(&read(&[], |share| 1.0 - share / DUTY * duty));
            let stuck_or_inverted = [Finding::EnableInverted, Finding::EnableStuck];
            assert!(
                inverted.len() == 1 && stuck_or_inverted.contains(&inverted[0]),
                "{duty}: {inverted:?}"
            );
            assert!(duty < 0.1 || inverted == [Finding::EnableInverted], "{duty}: {inverted:?}");
        }
        // At full duty only dimmed LEDs are lit.
        assert_eq!(diagnose(&read(&[], |share| 1.0 - share / DUTY)), [Finding::EnableInverted]);
        assert_eq!(diagnose(&read(&[], |_| 1.0)), [Finding::EnableStuck]);
        // At a duty of 0 the low current remains.
        let current = |share: f32| if share == 0.0 { 0.125 } else { 1.0 };
        assert_eq!(
            diagnose(&read(&[], |share| current(share) * (1.0 - share))),
            [Finding::EnableInverted]
        );
        assert_eq!(diagnose(&read(&[], current)), [Finding::EnableStuck]);
    }

    #[test]
    fn a_panel_that_does_not_follow_is_dark_or_lit() {
        for (panel, is_lit) in [(0, false), (u64::MAX, true)] {
            let reading = read(&[&|_| panel], |duty| duty);
            let mut dark = reading.clone();
            // Levels above those of the dark LEDs, as in a record of pins.
            for levels in dark.pairs.iter_mut().flatten().chain([&mut dark.dark]) {
                levels
                    .iter_mut()
                    .enumerate()
                    .for_each(|(led, level)| *level -= 20.0 + (led % 5) as f32);
            }
            assert_eq!(diagnose(&dark), [Finding::NothingFollows { is_lit }]);
        }
    }

    #[test]
    fn an_led_off_its_place_is_named() {
        let mut reading = read(&[], |duty| duty);
        reading.offsets = [Some([0.1, -0.1]); LEDS];
        reading.offsets[20] = Some([-0.3, 0.0]);
        assert_eq!(diagnose(&reading), [Finding::OffLattice(20, [-0.3, 0.0])]);
    }

    #[test]
    fn each_finding_has_words_and_a_wire() {
        use crate::bring_up::Kit;
        let findings = found(&[&|bits| bits & !row(3) | 1 << 2, &|bits| swapped(bits, [40, 41])]);
        let words: Vec<String> = findings.iter().map(ToString::to_string).collect();
        assert_eq!(
            words,
            [
                "row 3 is dead",
                "the LED of row 0, column 2 is lit all the time",
                "the LED of row 5, column 0 and the LED of row 5, column 1 are swapped"
            ]
        );
        assert!(findings[0].wire(Kit::Road).contains("row 3's register"));
        assert!(findings[0].wire(Kit::Desk).contains("DIG 3"));
        assert!(findings[2].wire(Kit::Road).contains("output Q0 of row 5's register and output Q1"));
        assert!(findings[2].wire(Kit::Desk).contains("SEG DP"));
    }

    properties! {
        /// Noise well below the light, any two LEDs swapped and another one dead.
        #[test]
        fn noise_hides_no_fault_and_makes_none(seed in any::<u64>(), one in 0usize..64, other in 0usize..64, dead in 0usize..64) {
            prop_assume!(one < other && dead != one && dead != other);
            let mut reading = read(&[&|bits| swapped(bits, [one, other]) & !(1 << dead)], |duty| duty);
            let mut state = seed;
            for level in reading.pairs.iter_mut().flatten().chain([&mut reading.dark]).flatten() {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                *level += (state >> 40) as f32 / (1 << 24) as f32 * 6.0 - 3.0;
            }
            let mut findings = diagnose(&reading);
            findings.sort_by_key(|finding| finding.name());
            prop_assert_eq!(findings, [Finding::LedDead(dead), Finding::LedsSwapped([one, other])]);
        }
    }
}
