//! Readings of the paper's statements, and of its gaps, about how a frame is made and measured.

/// The drawing of an LED's disc on whole pixels.
#[derive(Clone, Copy, PartialEq)]
pub enum Disc {
    /// Each pixel has the share of it that the disc covers.
    Area,
    /// A pixel belongs to the disc if its centre is inside.
    Point,
    /// Like `Point`, but the LED's centre is first rounded to a pixel.
    Rounded,
}

/// The position of the blur in the chain.
#[derive(Clone, Copy, PartialEq)]
pub enum Order {
    /// Light is blurred, encoded by gamma, clipped at 255 (section 4.2).
    BlurGammaClip,
    /// Light is clipped at the level of grey 255, blurred, encoded.
    ClipBlurGamma,
    /// Grey is blurred, then clipped (Eq. 14 of greyscales, section 3.3.3 b).
    GammaBlurClip,
    /// Grey is clipped, then blurred.
    GammaClipBlur,
}

/// The width of the blur.
#[derive(Clone, Copy, PartialEq)]
pub enum Blur {
    /// The same number of pixels at every distance.
    Pixels(f64),
    /// This number of pixels at 50 m, growing with the panel's image.
    WithImage(f64),
    /// This number of pixels, with a kernel cut to that many pixels on either side and scaled to sum 1.
    Cut(f64, usize),
}

/// The area that is divided into 8 × 8 equal cells.
#[derive(Clone, Copy, PartialEq)]
pub enum Cells {
    /// 8 × 8 pitches, each cell centred on its LED.
    Pitches,
    /// The smallest square that contains the discs.
    Discs,
    /// 8 × 8 pitches with a border of half a pitch.
    Border,
}

/// One reading.
#[derive(Clone, Copy)]
pub struct Interpretation {
    pub name: &'static str,
    pub disc: Disc,
    pub order: Order,
    pub blur: Blur,
    pub cells: Cells,
    /// Whether gradients stop at a cell's border.
    pub gradient_within_cell: bool,
    pub focal_mm: f64,
    /// On light over Off light is 1 + `contrast` · r.
    pub contrast: f64,
    pub gamma: f64,
    /// Linear value of the background behind the LEDs.
    pub background: f64,
    /// Whether the panel's sub-pixel phase is drawn for each frame.
    pub random_phase: bool,
}

const PLAIN: Interpretation = Interpretation {
    name: "plain",
    disc: Disc::Area,
    order: Order::BlurGammaClip,
    blur: Blur::Pixels(1.5),
    cells: Cells::Pitches,
    gradient_within_cell: false,
    focal_mm: 25.0,
    contrast: std::f64::consts::PI,
    gamma: 2.2,
    background: 1.0,
    random_phase: true,
};

impl Interpretation {
    /// Whether the reading is entirely the simulator's.
    pub fn is_plain(&self) -> bool {
        self.name == PLAIN.name
    }
}

/// All readings; the first is the simulator's.
#[rustfmt::skip]
pub const READINGS: [Interpretation; 30] = [
    PLAIN,
    Interpretation { name: "discs by pixel centres", disc: Disc::Point, ..PLAIN },
    Interpretation { name: "LED centres rounded to pixels", disc: Disc::Rounded, ..PLAIN },
    Interpretation { name: "phase fixed", random_phase: false, ..PLAIN },
    Interpretation { name: "blur 0.5 px", blur: Blur::Pixels(0.5), ..PLAIN },
    Interpretation { name: "blur 1 px", blur: Blur::Pixels(1.0), ..PLAIN },
    Interpretation { name: "blur 2 px", blur: Blur::Pixels(2.0), ..PLAIN },
    Interpretation { name: "blur 3 px", blur: Blur::Pixels(3.0), ..PLAIN },
    Interpretation { name: "blur cut to 3 x 3", blur: Blur::Cut(1.5, 1), ..PLAIN },
    Interpretation { name: "blur cut to 5 x 5", blur: Blur::Cut(1.5, 2), ..PLAIN },
    Interpretation { name: "blur cut to 7 x 7", blur: Blur::Cut(1.5, 3), ..PLAIN },
    Interpretation { name: "blur grows with the image", blur: Blur::WithImage(1.5), ..PLAIN },
    Interpretation { name: "light clipped before blur", order: Order::ClipBlurGamma, ..PLAIN },
    Interpretation { name: "gamma before blur", order: Order::GammaBlurClip, ..PLAIN },
    Interpretation { name: "gamma and clip before blur", order: Order::GammaClipBlur, ..PLAIN },
    Interpretation { name: "no gamma", gamma: 1.0, ..PLAIN },
    Interpretation { name: "cells of the discs' square", cells: Cells::Discs, ..PLAIN },
    Interpretation { name: "cells with a border", cells: Cells::Border, ..PLAIN },
    Interpretation { name: "gradient within the cell", gradient_within_cell: true, ..PLAIN },
    Interpretation { name: "black behind the LEDs", background: 0.1, ..PLAIN },
    Interpretation { name: "contrast 1 + r", contrast: 1.0, ..PLAIN },
    Interpretation { name: "18 mm", focal_mm: 18.0, ..PLAIN },
    Interpretation { name: "contrast 1 + r, 18 mm", contrast: 1.0, focal_mm: 18.0, ..PLAIN },
    Interpretation { name: "contrast 1 + r, 3 x 3", contrast: 1.0, blur: Blur::Cut(1.5, 1), ..PLAIN },
    Interpretation { name: "contrast 1 + r, blur 0.5 px", contrast: 1.0, blur: Blur::Pixels(0.5), ..PLAIN },
    Interpretation { name: "contrast 1 + r, gamma, clip, blur", contrast: 1.0, order: Order::GammaClipBlur, ..PLAIN },
    Interpretation { name: "3 x 3, gamma and clip first", blur: Blur::Cut(1.5, 1), order: Order::GammaClipBlur, ..PLAIN },
    Interpretation { name: "3 x 3, border", blur: Blur::Cut(1.5, 1), cells: Cells::Border, ..PLAIN },
    Interpretation { name: "blur 2 px, border", blur: Blur::Pixels(2.0), cells: Cells::Border, ..PLAIN },
    Interpretation { name: "points, phase fixed, 7 x 7", disc: Disc::Point, random_phase: false, blur: Blur::Cut(1.5, 3), ..PLAIN },
];
