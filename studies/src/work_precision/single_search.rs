//! Missed panels against the time of a search in a single frame, which has no frame before it.

use std::hint::black_box;

use link::camera::Camera;
use rx_pipeline::frame::Frame;
use rx_pipeline::locate::{BUSY_PEAKS, Effort, Locator, LocatorMemory};
use rx_pipeline::settings::SearchSettings;

use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{percent, rounded, variant};
use super::point::Point;
use super::steps::Steps;
use super::timing::Candidate;
use crate::random_scenes::{RIGHT, RandomScene, WINDOW_PIXELS};
use crate::statistics::share_95;

/// All busy places (count).
const ALL: u16 = BUSY_PEAKS as u16;
/// Busy places that the full search examines after that of isolated spots (count).
const PLACES: [u16; 6] = [0, 1, 2, 4, SearchSettings::DEFAULT.full_places, ALL];
/// Frames without their panel that are timed.
const TIMED: usize = 6;
/// Room around the panel that is covered with it (pitches).
const ROOM: f64 = 3.0;

/// The name of a variant.
fn name(places: u16) -> String {
    match places {
        0 => "spots".into(),
        1 => "1 place".into(),
        places => format!("{places} places"),
    }
}

/// A search for isolated spots and then, at that many busy places, for any panel.
pub(super) struct SingleSearch {
    places: u16,
    locator: Locator,
    memory: Box<LocatorMemory<WINDOW_PIXELS>>,
}

impl SingleSearch {
    /// The searches to compare, the quickest first.
    pub fn all() -> Result<Vec<Self>, PrecisionError> {
        PLACES.into_iter().map(Self::new).collect()
    }

    fn new(places: u16) -> Result<Self, PrecisionError> {
        let settings = SearchSettings {
            full_places: places.max(1),
            ..SearchSettings::DEFAULT
        };
        Ok(Self {
            places,
            locator: Locator::new(Camera::default())?.with_settings(settings)?,
            memory: Box::new(LocatorMemory::new()),
        })
    }

    /// The miss rate, with the time of a search in frames whose panel is covered: nothing ends it early.
    pub fn candidate<'a>(mut self, panels: &'a [RandomScene], steps: &mut Steps) -> Result<Candidate<'a>, PrecisionError> {
        let found = steps.take(format!("single, {}", name(self.places)), |_| {
            Ok(panels.iter().filter(|panel| self.finds(panel)).count())
        })?;
        let count = panels.len() as f64;
        let missed = count - found as f64;
        let point = Point::share(name(self.places), missed, count, || share_95(missed, count))
            .with_default(self.places == SearchSettings::DEFAULT.full_places);
        let timed = &panels[..TIMED.min(panels.len())];
        let frames: Vec<Vec<u8>> = timed.iter().map(covered).collect();
        Ok(Candidate::new(point, timed.len() as f64, move || {
            for (panel, pixels) in timed.iter().zip(&frames) {
                black_box(self.search(pixels, [panel.width, panel.height]));
            }
        }))
    }

    fn finds(&mut self, panel: &RandomScene) -> bool {
        let found = self.search(&panel.frames[0], [panel.width, panel.height]);
        found.is_some_and(|corners| panel.error_px(corners) < RIGHT * panel.pitch_px)
    }

    fn search(&mut self, pixels: &[u8], [width, height]: [usize; 2]) -> Option<[[f32; 2]; 4]> {
        let frame = Frame::new(pixels, width, height).ok()?;
        let mut look = |effort| self.locator.locate_among(&frame, &[], &[], effort, &mut self.memory, &mut ()).ok();
        let found = look(Effort::Spots).or_else(|| if self.places > 0 { look(Effort::Full) } else { None });
        found.map(|found| found.corners.points())
    }
}

/// The default, and the reason.
pub(super) fn why(diagram: &Diagram) -> String {
    let default = SearchSettings::DEFAULT.full_places;
    let cost_of = |places: u16| {
        variant(diagram, &name(places)).map_or_else(String::new, |point| {
            format!("{} in {} times the time", percent(point), rounded(point.ratio.median))
        })
    };
    let Some(chosen) = variant(diagram, &name(default)) else {
        return String::new();
    };
    let as_few = diagram.points.iter().filter(|point| point.error <= chosen.error);
    let quickest = as_few
        .min_by(|one, other| one.ratio.median.total_cmp(&other.ratio.median))
        .unwrap_or(chosen);
    format!(
        "In single frames, the {default} busiest places, which miss {}; *spots* alone misses {}. The fastest that misses as few: {}, in {} \
         times the time.",
        percent(chosen),
        cost_of(0),
        quickest.variant,
        rounded(quickest.ratio.median)
    )
}

/// The first frame with the columns of the panel replaced by those beside it.
fn covered(panel: &RandomScene) -> Vec<u8> {
    let mut pixels = panel.frames[0].clone();
    let room = ROOM * panel.pitch_px;
    let columns = panel.corners.map(|[x, _]| x);
    let first = columns.iter().fold(f64::INFINITY, |least, x| least.min(x - room)).max(0.0) as usize;
    let last = columns.iter().fold(0.0f64, |most, x| most.max(x + room)) as usize;
    let last = last.min(panel.width - 1);
    let width = last + 1 - first;
    let from = if first >= width {
        first - width
    } else {
        (last + 1).min(panel.width - width)
    };
    for row in pixels.chunks_exact_mut(panel.width) {
        row.copy_within(from..from + width, first);
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panel_is_found_until_it_is_covered() {
        let panel = (0..20)
            .map(|seed| RandomScene::draw(seed, [640, 480], 1, &[]).unwrap())
            .find(|panel| panel.pitch_px > 5.0 && panel.illuminance_lx > 1000.0)
            .expect("a clear panel");
        let mut search = SingleSearch::new(8).unwrap();
        assert!(search.finds(&panel), "{}", panel.what);
        assert_eq!(search.search(&covered(&panel), [panel.width, panel.height]), None);
    }
}
