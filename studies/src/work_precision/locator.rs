//! Missed panels and corner errors, against the time of a search, on reduced frames.

use std::borrow::Cow;
use std::hint::black_box;

use image::GrayImage;
use link::camera::{Camera, CameraError};
use rx_pipeline::frame::Frame;
use rx_pipeline::locate::{Effort, Locator, LocatorMemory};

use super::Measurement;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{percent, rounded, variant};
use super::point::Point;
use super::scale::Scale;
use super::single_search::{self, SingleSearch};
use super::steps::Steps;
use super::timing::{Candidate, time_by_turns};
use crate::random_scenes::{FRAMES, RIGHT, RandomScene, WINDOW_PIXELS};
use crate::statistics::share_95;

/// The camera's frames.
const SIZE: [usize; 2] = [1920, 1080];
/// Panels to find.
const SCENES: usize = 60;
/// Number of these that are timed.
const TIMED: usize = 6;
/// Pixels of the sensor along one of the searched frame, and whether only a share of the candidates is tried.
const SEARCHES: [(usize, bool); 5] = [(1, true), (2, true), (3, true), (4, true), (1, false)];
/// The backgrounds of two panels in three.
const PHOTOGRAPHS: [&[u8]; 5] = [
    include_bytes!("../../photographs/brick.png"),
    include_bytes!("../../photographs/camera.png"),
    include_bytes!("../../photographs/coffee.png"),
    include_bytes!("../../photographs/gravel.png"),
    include_bytes!("../../photographs/rocket.png"),
];

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let photographs: Vec<GrayImage> = PHOTOGRAPHS
        .iter()
        .map(|png| Ok(image::load_from_memory(png)?.into_luma8()))
        .collect::<Result<_, PrecisionError>>()?;
    let scenes = scale.of(SCENES, 4) as u64;
    let first = 1000 * scale.seed;
    let panels: Vec<RandomScene> = (first..first + scenes)
        .map(|seed| RandomScene::draw(seed, SIZE, FRAMES as u64, &photographs))
        .collect::<Result<_, _>>()?;
    let (mut candidates, mut corners) = (Vec::new(), Vec::new());
    for (decimation, share) in SEARCHES {
        let search = Search::new(decimation, share)?;
        let (candidate, off) = search.candidate(&panels, steps)?;
        candidates.push(candidate);
        corners.push(off);
    }
    let missed = time_by_turns(candidates, scale.turns);
    let single = SingleSearch::all()?.into_iter().map(|search| search.candidate(&panels, steps));
    let single = time_by_turns(single.collect::<Result<_, _>>()?, scale.turns);
    let off = missed.iter().zip(corners);
    let off = off
        .filter_map(|(point, error)| {
            Some(Point {
                error: error?,
                error_95: None,
                at_most: false,
                ..point.clone()
            })
        })
        .collect();
    let cost = "one search of a frame";
    let diagrams = vec![
        Diagram::of("panels missed", ["miss rate", ""], cost, missed),
        Diagram::of("corners of those found", ["median corner error", "px"], cost, off),
        Diagram::of(SINGLE, ["miss rate", ""], "one search of a frame without its panel", single),
    ];
    Ok(Measurement {
        method: format!(
            "{scenes} panels anywhere in frames of {} × {} pixels at 30 to 70 m, two thirds before a photograph. A panel is missed if \
             {FRAMES} successive frames do not locate it to {RIGHT} of its pitch. *share* examines the strongest candidates and one other \
             in each frame, *full* all changes and the busiest places. In a single frame, *spots* searches for isolated spots, and \
             *places* then that number of busiest places; the time is with the panel covered.",
            SIZE[0], SIZE[1]
        ),
        reference: "The drawn corner LEDs.".into(),
        diagrams,
    })
}

/// The diagram of single frames.
const SINGLE: &str = "single frames";

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let Some(missed) = diagrams.first() else {
        return String::new();
    };
    let of = |share: bool, decimation: usize| variant(missed, &name(share, decimation));
    let result = |point: Option<&Point>| {
        point.map_or_else(String::new, |point| {
            format!("misses {} in {} times the time", percent(point), rounded(point.ratio.median))
        })
    };
    let smaller = SEARCHES.into_iter().filter(|&(decimation, _)| decimation > 1);
    let smaller = smaller.map(|(decimation, share)| format!("{} (n = {decimation})", result(of(share, decimation))));
    format!(
        "*share* on the whole frame, which misses {}. *full* {}. On frames averaged over n × n pixels *share* {}, because it tries all \
         candidates if it no longer sees the panel. {}",
        of(true, 1).map_or_else(String::new, percent),
        result(of(false, 1)),
        smaller.collect::<Vec<_>>().join(", "),
        diagrams
            .iter()
            .find(|diagram| diagram.title == SINGLE)
            .map_or_else(String::new, single_search::why)
    )
}

/// The name of a variant.
fn name(share: bool, decimation: usize) -> String {
    format!("{}, {decimation}×", if share { "share" } else { "full" })
}

/// A variant of the search.
struct Search {
    decimation: usize,
    /// Whether only a share of the candidates is tried.
    share: bool,
    locator: Locator,
    memory: Box<LocatorMemory<WINDOW_PIXELS>>,
}

impl Search {
    fn new(decimation: usize, share: bool) -> Result<Self, CameraError> {
        let finer = Camera::default();
        let pixels = decimation as f32;
        // The mean over n × n pixels adds blur.
        let variance = finer.blur_sigma_px.powi(2) + (pixels * pixels - 1.0) / 12.0;
        let camera = Camera {
            blur_sigma_px: variance.sqrt() / pixels,
            ..finer
        };
        Ok(Self {
            decimation,
            share,
            locator: Locator::new(camera.clamped())?,
            memory: Box::new(LocatorMemory::new()),
        })
    }

    /// The miss rate with the work of a search, and the median corner error of the found panels.
    fn candidate<'a>(mut self, panels: &'a [RandomScene], steps: &mut Steps) -> Result<(Candidate<'a>, Option<f64>), PrecisionError> {
        let mut errors: Vec<f64> = steps.take(name(self.share, self.decimation), |_| {
            Ok(panels.iter().filter_map(|panel| self.find(panel)).collect())
        })?;
        errors.sort_by(f64::total_cmp);
        let count = panels.len() as f64;
        let missed = count - errors.len() as f64;
        let point = Point::share(name(self.share, self.decimation), missed, count, || share_95(missed, count))
            .on(if self.share { "share" } else { "full" })
            .with_default(self.decimation == 1 && self.share);
        let timed = &panels[..TIMED.min(panels.len())];
        let earlier: Vec<_> = timed.iter().map(|panel| self.smaller(panel, 0)).collect();
        let candidate = Candidate::new(point, timed.len() as f64, move || {
            for (panel, earlier) in timed.iter().zip(&earlier) {
                let now = self.smaller(panel, 1);
                black_box(self.search(panel, &[&now, earlier]));
            }
        });
        Ok((candidate, errors.get(errors.len() / 2).copied()))
    }

    /// The error of the panel's corners in the first frame in which it is found, or `None`.
    fn find(&mut self, panel: &RandomScene) -> Option<f64> {
        let frames: Vec<_> = (0..FRAMES).map(|frame| self.smaller(panel, frame)).collect();
        let found = (1..=FRAMES).find_map(|count| {
            let newest_first: Vec<&[u8]> = frames[..count].iter().rev().map(AsRef::as_ref).collect();
            self.search(panel, &newest_first)
        })?;
        let error = panel.error_px(found);
        (error < RIGHT * panel.pitch_px).then_some(error)
    }

    /// A frame in the size of the search.
    fn smaller<'a>(&self, panel: &'a RandomScene, frame: usize) -> Cow<'a, [u8]> {
        let pixels = &panel.frames[frame];
        match self.decimation {
            1 => pixels.into(),
            n => means(pixels, panel.width, self.size(panel), n).into(),
        }
    }

    fn size(&self, panel: &RandomScene) -> [usize; 2] {
        [panel.width, panel.height].map(|length| length / self.decimation)
    }

    /// The corners, on the sensor, found in the first of some frames; the others are earlier ones.
    fn search(&mut self, panel: &RandomScene, newest_first: &[&[u8]]) -> Option<[[f32; 2]; 4]> {
        let [width, height] = self.size(panel);
        let frames = newest_first.iter().map(|pixels| Frame::new(pixels, width, height).ok());
        let frames: Vec<Frame> = frames.collect::<Option<_>>()?;
        let (now, earlier) = frames.split_first()?;
        let effort = if self.share {
            Effort::Share(earlier.len() as u64)
        } else {
            Effort::Full
        };
        let found = self.locator.locate_among(now, earlier, &[], effort, &mut self.memory, &mut ());
        let scale = self.decimation as f32;
        let corners = found.ok()?.corners.points();
        Some(corners.map(|corner| corner.map(|at| (at + 0.5) * scale - 0.5)))
    }
}

/// A frame reduced by `n`, each pixel the mean of n × n.
fn means(pixels: &[u8], width: usize, [columns, rows]: [usize; 2], n: usize) -> Vec<u8> {
    let mut sums = vec![0u32; columns];
    let mut smaller = Vec::with_capacity(columns * rows);
    for band in pixels.chunks_exact(width * n).take(rows) {
        sums.fill(0);
        for row in band.chunks_exact(width) {
            for (sum, few) in sums.iter_mut().zip(row.chunks_exact(n)) {
                *sum += few.iter().map(|&grey| u32::from(grey)).sum::<u32>();
            }
        }
        let area = (n * n) as u32;
        smaller.extend(sums.iter().map(|sum| ((sum + area / 2) / area) as u8));
    }
    smaller
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_frame_holds_the_means() {
        let pixels: Vec<u8> = (0..5 * 4).collect();
        assert_eq!(means(&pixels, 5, [2, 2], 2), [3, 5, 13, 15]);
        assert_eq!(means(&pixels, 5, [5, 4], 1), pixels);
    }

    #[test]
    fn a_panel_is_found_where_it_is_in_the_whole_frame_and_in_a_smaller_one() {
        let panel = (0..20)
            .map(|seed| RandomScene::draw(seed, [640, 480], FRAMES as u64, &[]).unwrap())
            .find(|panel| panel.pitch_px > 7.0 && panel.illuminance_lx > 1000.0)
            .expect("a large panel");
        let error = |decimation| Search::new(decimation, false).unwrap().find(&panel);
        let (whole, half) = (error(1).expect("found"), error(2).expect("found"));
        assert!(whole < 0.5 && half < 0.35 * panel.pitch_px, "{whole} {half}: {}", panel.what);
    }
}
