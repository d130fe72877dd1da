//! Charts side by side, with a common legend above.

use super::chart::Chart;
use super::legend::{self, Entry};
use super::paper::{self, Drawing};

/// Charts on one page.
pub struct Page {
    pub charts: Vec<Chart>,
    /// Charts per row.
    pub columns: usize,
    /// Size of each chart in pixels: width, height.
    pub chart_px: (i32, i32),
    /// Rows of the common legend; if empty, each chart has its own.
    pub legend: Vec<Vec<Entry>>,
}

impl Page {
    /// Charts without a common legend.
    pub fn new(charts: Vec<Chart>, columns: usize, chart_px: (i32, i32)) -> Self {
        Self {
            charts,
            columns,
            chart_px,
            legend: Vec::new(),
        }
    }

    /// The page as an SVG document.
    pub fn draw(&self) -> anyhow::Result<Drawing> {
        let columns = self.columns.max(1);
        let rows = self.charts.len().div_ceil(columns).max(1);
        let width_px = self.chart_px.0 * columns as i32;
        let legend_px = legend::height_px(&self.legend, width_px);
        let height_px = legend_px + self.chart_px.1 * rows as i32;
        paper::draw((width_px as u32, height_px as u32), |surface| {
            let (head, body) = surface.split_vertically(legend_px);
            legend::above(&head, &self.legend)?;
            let places = body.split_evenly((rows, columns));
            let mut charts = places.iter().zip(&self.charts);
            charts.try_for_each(|(place, chart)| chart.draw(place, self.legend.is_empty()))
        })
    }
}
