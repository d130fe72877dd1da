//! Raster renderers, with which the project's own is compared in accuracy and time.
//!
//! Both draw a panel that faces the camera, before a uniform background of linear value 1.
//!
//! ```
//! use studies::baselines::{Panel, supersampled};
//! let panel = Panel { bits: 1, first_px: [8.0; 2], pitch_px: 4.0, radius_px: 1.0, off: 2.0, on: 16.0 };
//! let grey = supersampled::render(&panel, 1.5, 2.2, 44, 4);
//! assert!(grey[8 * 44 + 8] > grey[36 * 44 + 36]);
//! ```

mod panel;
mod raster;
pub mod straightforward;
pub mod supersampled;

pub use panel::Panel;
