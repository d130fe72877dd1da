//! The positions of a panel's LEDs on the sensor, in the fastest form for drawing.

use glam::{DMat2, DVec2, DVec3};
use link::panel::{LEDS, SIDE};

use crate::accuracy::Accuracy;
use crate::camera::projection::{Ellipse, Projection, distorted};
use crate::disc::chords::Chords;
use crate::disc::kernel::Exact;
use crate::disc::outline::Outline;
use crate::disc::spread::Spread;
use crate::formation::Formation;
use crate::renderer::canvas::Canvas;
use crate::renderer::outlined::LargeShape;
use crate::renderer::placed::ExposureVibration;
use crate::renderer::polyphase::Polyphase;
use crate::renderer::separable::SeparableImage;
use crate::scene::Camera;
use crate::view::PanelView;

/// The LEDs of one panel at one moment of the exposure.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Their positions.
    pub places: Places,
    /// Their images.
    pub images: Images,
}

/// Iterations for the row in which a point of a vibrating image is exposed.
const ROW_STEPS: usize = 3;

/// The images of a panel's LEDs: one for all, or one for each.
#[derive(Clone, Debug)]
pub enum Images {
    /// By chords.
    Chords {
        /// The chords.
        shapes: Vec<Chords>,
        /// The table of the common image, if there is one and f32 suffices.
        table: Option<Polyphase>,
    },
    /// Pixel by pixel, without a blur or with one far smaller than the LEDs.
    Outlines(Box<[LargeShape; LEDS]>),
}

/// The positions of a panel's LEDs, in px of the sensor.
#[derive(Clone, Debug)]
pub enum Places {
    /// On upright rows and columns: a panel parallel to the sensor.
    Lattice {
        /// Pixel columns of the LEDs' centres.
        columns: [f64; SIDE],
        /// Pixel rows of the LEDs' centres.
        rows: [f64; SIDE],
    },
    /// Any positions.
    Scattered(Box<[DVec2; LEDS]>),
}

impl Layout {
    /// The layout of a panel at a moment.
    pub fn new(imaging: &Imaging, accuracy: &Accuracy, spread: &Spread) -> Self {
        let ellipses = imaging.ellipses();
        Self {
            images: images(&ellipses, imaging.formation, accuracy, spread),
            places: places(&ellipses),
        }
    }

    /// The centre of LED `led`, 0 to 63.
    pub fn centre(&self, led: usize) -> DVec2 {
        match &self.places {
            Places::Lattice { columns, rows } => DVec2::new(columns[led % SIDE], rows[led / SIDE % SIDE]),
            Places::Scattered(centres) => centres[led % LEDS],
        }
    }

    /// Adds the LEDs to a canvas, each by its image with its linear `light`, all moved by `shift`.
    #[inline(always)]
    pub fn paint<S: SeparableImage>(
        &self,
        image: impl Fn(usize) -> S,
        shift: DVec2,
        light: &[S::Real; LEDS],
        canvas: &mut Canvas<S::Real>,
    ) {
        match &self.places {
            Places::Lattice { columns, rows } => canvas.add_lattice(
                &image(0),
                &columns.map(|column| column + shift.x),
                &rows.map(|row| row + shift.y),
                light,
            ),
            Places::Scattered(centres) => {
                for (led, (centre, &light)) in centres.iter().zip(light).enumerate() {
                    canvas.add_led(&image(led), *centre + shift, light);
                }
            }
        }
    }
}

/// The image of LED `led`.
pub fn image_of<T>(images: &[T], led: usize) -> &T {
    images.get(led).unwrap_or(&images[0])
}

/// The images of LEDs whose outlines are `ellipses`.
fn images(ellipses: &[Ellipse; LEDS], formation: &Formation, accuracy: &Accuracy, spread: &Spread) -> Images {
    // Up to rounding, some 1e-13 px.
    let alike = |e: &Ellipse| (e.shape - ellipses[0].shape).abs_diff_eq(DMat2::ZERO, 1e-11);
    let distinct = if ellipses.iter().all(alike) { 1 } else { LEDS };
    let shapes = ellipses[..distinct].iter().map(|ellipse| ellipse.shape);
    let extent = |ellipse: &Ellipse| ellipse.half_extent().length();
    let largest = ellipses.iter().max_by(|a, b| extent(a).total_cmp(&extent(b)));
    let largest = Outline::Ellipse(largest.map_or(DMat2::IDENTITY, |e| e.shape));
    let Some(Chords(most)) = Chords::within(&largest, formation.sigma_px, accuracy.quadrature) else {
        let outlined = |ellipse: &Ellipse| LargeShape::new(Outline::Ellipse(ellipse.shape), ellipse.centre);
        return Images::Outlines(Box::new(ellipses.each_ref().map(outlined)));
    };
    let shapes: Vec<_> = shapes.map(|shape| Chords::new(shape, most.len())).collect();
    let table = match shapes.as_slice() {
        [one] if accuracy.phases > 0 => Polyphase::new(
            &Exact::new(formation.sigma_px),
            one,
            spread,
            accuracy.margin_px(formation.sigma_px) + spread.reach_px,
            accuracy.phases,
        ),
        _ => None,
    };
    Images::Chords { shapes, table }
}

/// The positions of LEDs, as rows and columns if they form an upright lattice of equal images.
fn places(ellipses: &[Ellipse; LEDS]) -> Places {
    if is_lattice(ellipses) {
        Places::Lattice {
            columns: std::array::from_fn(|c| ellipses[c].centre.x),
            rows: std::array::from_fn(|r| ellipses[SIDE * r].centre.y),
        }
    } else {
        Places::Scattered(Box::new(ellipses.map(|ellipse| ellipse.centre)))
    }
}

/// Whether the LEDs form an upright lattice of equal images.
fn is_lattice(ellipses: &[Ellipse; LEDS]) -> bool {
    let shape = ellipses[0].shape;
    let upright = shape.x_axis.y == 0.0 && shape.y_axis.x == 0.0;
    upright
        && ellipses.iter().enumerate().all(|(led, ellipse)| {
            let (row, column) = (led / SIDE, led % SIDE);
            let (above, left) = (ellipses[column].centre.x, ellipses[SIDE * row].centre.y);
            // Up to rounding, some 1e-13 px.
            (ellipse.shape - shape).abs_diff_eq(DMat2::ZERO, 1e-11) && (ellipse.centre - DVec2::new(above, left)).length() < 1e-9
        })
}

/// The inputs of a panel's image at a moment of an exposure.
#[derive(Clone, Copy)]
pub struct Imaging<'a> {
    /// The camera, and the panel before it.
    pub camera: &'a Camera,
    /// The panel at rest.
    pub panel: &'a PanelView,
    /// The image formation.
    pub formation: &'a Formation,
    /// The camera's vibration; `None`: it is still.
    pub shaken: Option<&'a ExposureVibration>,
    /// Seconds after the middle of the exposure.
    pub after_s: f64,
}

impl Imaging<'_> {
    /// The images of the 64 LEDs by the formation.
    pub fn ellipses(&self) -> [Ellipse; LEDS] {
        let at_once = (self.formation.row_delay_s == 0.0).then(|| self.moved(0.0));
        std::array::from_fn(|led| {
            let (row, column) = ((led / SIDE) as f64, (led % SIDE) as f64);
            let at = self.panel.projection.led_m(row, column);
            let projection = at_once.unwrap_or_else(|| {
                let delay_s = self.delay_s(at, self.panel.ellipses[led].centre.y);
                self.moved(delay_s)
            });
            let ellipse = if self.formation.exact_perspective {
                projection.ellipse(at)
            } else {
                let jacobian = projection.jacobian(DVec2::ZERO);
                Ellipse {
                    centre: projection.pixel(DVec2::ZERO) + jacobian * at,
                    shape: jacobian * (self.panel.panel.led_diameter_m / 2.0),
                }
            };
            if self.formation.distortion_k1 == 0.0 {
                ellipse
            } else {
                distorted(self.camera, self.formation.distortion_k1, ellipse)
            }
        })
    }

    /// The image of a point of the panel (its own coordinates in metres), `after_s` seconds after the middle of its row's exposure.
    pub fn place(&self, at: DVec2) -> DVec2 {
        let delay_s = self.delay_s(at, self.panel.projection.pixel(at).y);
        let projection = self.moved(delay_s);
        let centre = projection.pixel(DVec2::ZERO);
        let point = if self.formation.exact_perspective {
            projection.pixel(at)
        } else {
            centre + projection.jacobian(DVec2::ZERO) * at
        };
        distorted(
            self.camera,
            self.formation.distortion_k1,
            Ellipse {
                centre: point,
                shape: DMat2::IDENTITY,
            },
        )
        .centre
    }

    /// The delay of a point of the panel relative to the sensor's first row, `after_s` seconds after the middle of the exposure. If the
    /// camera is still, the point's row at rest gives it.
    ///
    /// If the camera vibrates, it is the row of the point at the time of that row's exposure. Each iteration multiplies the error by the
    /// ratio of the image's speed to the read-out's.
    fn delay_s(&self, at: DVec2, row_at_rest: f64) -> f64 {
        let at_rest_s = self.formation.row_delay_s * row_at_rest;
        if self.shaken.is_none() || self.formation.row_delay_s == 0.0 {
            return at_rest_s;
        }
        (0..ROW_STEPS).fold(at_rest_s, |delay_s, _| self.formation.row_delay_s * self.moved(delay_s).pixel(at).y)
    }

    /// The panel's projection `after_s` seconds after the middle of the exposure, `delay_s` later than in the first row.
    fn moved(&self, delay_s: f64) -> Projection {
        let velocity = DVec3::from_array(self.panel.pose.velocity_m_s);
        let moved_s = if self.formation.moves { self.after_s + delay_s } else { delay_s };
        let projection = if velocity == DVec3::ZERO || moved_s == 0.0 {
            self.panel.projection
        } else {
            Projection::new(self.camera, &self.panel.panel, &self.panel.pose.after(moved_s))
        };
        match self.shaken {
            Some(shaken) => projection.turned(shaken.turn(self.after_s + delay_s)),
            None => projection,
        }
    }
}
