//! Uncertain changes: a second sighting on the same lattice confirms a panel.

use crate::lattice::Lattice;
use heapless::Vec;

/// Age of an earlier sighting that confirms a faint panel, at most (searches). More: faint panels are found sooner.
const LOOKS_BACK: usize = 3;
/// The number of remembered searches (count). More: panels that are misfits, or faint while the camera moves, are found sooner.
const REMEMBERED: usize = 8;
/// Searches that must have shown such a lattice (count). More: such panels are found more surely.
const SIGHTINGS: usize = 2;

/// Suspects retried in a frame, at most (count). More: slower, and panels among much motion are found sooner.
const LOOKED_AT_AGAIN: usize = 2;

/// A change that may be a panel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Suspect {
    pub lattice: Lattice,
    /// Standard deviation of one LED's image (percent of the pitch).
    spot_percent: u8,
    /// Whether its residual exceeds the allowed one.
    pub is_misfit: bool,
}

impl Suspect {
    /// A lattice that fits, or nearly fits, with spots of that standard deviation.
    pub fn new(lattice: Lattice, spot_sigma_px: f32, is_misfit: bool) -> Self {
        let [across, _] = lattice.pitch();
        Self {
            lattice,
            spot_percent: (100.0 * spot_sigma_px / across) as u8,
            is_misfit,
        }
    }

    /// Standard deviation of one LED's image.
    pub fn spot_sigma_px(&self) -> f32 {
        let [across, _] = self.lattice.pitch();
        f32::from(self.spot_percent) / 100.0 * across
    }

    /// Whether both have the same lattice.
    fn is_as(&self, other: &Self) -> bool {
        self.lattice.is_close_to(&other.lattice)
    }
}

/// The suspects of the last searches, the latest first.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Suspects([Option<Suspect>; REMEMBERED]);

impl Suspects {
    /// No suspects yet.
    pub const NONE: Self = Self([None; REMEMBERED]);

    /// Starts a search, and returns the suspects of the searches before.
    pub fn begin(&mut self) -> Self {
        let before = *self;
        self.0.rotate_right(1);
        self.0[0] = None;
        before
    }

    /// Keeps one suspect of this search: preferably one with an earlier sighting, then one that fits, then the last.
    pub fn keep(&mut self, suspect: Suspect) {
        let [latest, before @ ..] = &mut self.0;
        let rank = |one: &Suspect| {
            let mut before = before.iter().flatten();
            (before.any(|other| one.is_as(other)), !one.is_misfit)
        };
        if latest.is_none_or(|kept| rank(&kept) <= rank(&suspect)) {
            *latest = Some(suspect);
        }
    }

    /// The latest suspects on different lattices, the latest first.
    pub fn latest(&self) -> Vec<Suspect, LOOKED_AT_AGAIN> {
        let mut latest = Vec::<Suspect, LOOKED_AT_AGAIN>::new();
        for suspect in self.0.iter().flatten() {
            if latest.iter().all(|other| !suspect.is_as(other)) && latest.push(*suspect).is_err() {
                break;
            }
        }
        latest
    }

    /// Whether the last search had a suspect that fits.
    pub fn was_faint(&self) -> bool {
        self.0[0].is_some_and(|suspect| !suspect.is_misfit)
    }

    /// Whether earlier searches confirm a suspect: one that fits needs a recent sighting while the camera is `at_rest`; any needs several.
    pub fn confirm(&self, suspect: &Suspect, at_rest: bool) -> bool {
        let same = |other: &&Suspect| suspect.is_as(other);
        let mut lately = self.0[..LOOKS_BACK].iter().flatten().filter(same);
        let sightings = self.0.iter().flatten().filter(same).count();
        at_rest && !suspect.is_misfit && lately.any(|other| !other.is_misfit) || sightings >= SIGHTINGS
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    const HERE: Lattice = Lattice {
        centre: [60.0, 50.0],
        column: [5.0, 0.0],
        row: [0.0, 5.0],
        tilt: [0.0; 2],
    };
    const ELSEWHERE: Lattice = Lattice {
        centre: [65.0, 50.0],
        ..HERE
    };

    fn seen(lattice: Lattice, is_misfit: bool) -> Option<Suspect> {
        Some(Suspect::new(lattice, 1.6, is_misfit))
    }

    /// Whether each search would have confirmed its suspect.
    fn confirmed(searches: &[Option<Suspect>], at_rest: bool) -> vec::Vec<bool> {
        let mut suspects = Suspects::NONE;
        let search = |suspect: &Option<Suspect>| {
            let before = suspects.begin();
            suspect.is_some_and(|suspect| {
                suspects.keep(suspect);
                before.confirm(&suspect, at_rest)
            })
        };
        searches.iter().map(search).collect()
    }

    #[test]
    fn a_faint_panel_at_rest_is_one_when_another_frame_shows_it() {
        let faint = seen(HERE, false);
        assert_eq!(confirmed(&[faint, faint], true), [false, true]);
        assert_eq!(confirmed(&[faint, seen(ELSEWHERE, false)], true), [false; 2]);
        let later = [&[faint][..], &[None; LOOKS_BACK], &[faint]].concat();
        assert!(!confirmed(&later, true).contains(&true));
    }

    #[test]
    fn misfits_and_what_moves_have_to_be_seen_again_and_again() {
        for (suspect, at_rest) in [(seen(HERE, true), true), (seen(HERE, false), false)] {
            let other = seen(ELSEWHERE, false);
            let searches = [suspect, None, suspect, other, None, suspect];
            let expected = [false, false, false, false, false, true];
            assert_eq!(confirmed(&searches, at_rest), expected);
            let rarely = [&[suspect, suspect][..], &[None; REMEMBERED], &[suspect]].concat();
            assert!(!confirmed(&rarely, at_rest).contains(&true));
        }
    }

    #[test]
    fn one_seen_before_is_kept_then_one_that_fits_then_the_last() {
        let kept = |searches: &[&[Option<Suspect>]]| {
            let mut suspects = Suspects::NONE;
            for search in searches {
                suspects.begin();
                search.iter().flatten().for_each(|&suspect| suspects.keep(suspect));
            }
            suspects.0[0].unwrap().lattice
        };
        let [here, elsewhere] = [HERE, ELSEWHERE].map(|lattice| seen(lattice, false));
        let misfit = seen(HERE, true);
        assert_eq!(kept(&[&[misfit], &[misfit, elsewhere]]), HERE);
        assert_eq!(kept(&[&[elsewhere, misfit]]), ELSEWHERE);
        assert_eq!(kept(&[&[here, elsewhere]]), ELSEWHERE);
    }
}
