//! One picture: the light of On and Off LEDs in units of a grey card's.

use link::camera::Encoding;
use link::panel::{LEDS, SIDE};
use rx_pipeline::corners::Corners;

/// The used part of a disc's radius.
const MIDDLE: f64 = 0.4;
/// The least distance of the disc's edge from the used part, in standard deviations of the blur.
const FREE_OF_BLUR: f64 = 4.0;
/// The greatest relative error of the light by the remaining blur, and by curves when rounded levels are decoded: the first is less than
/// 1e-4, the second 0.11/grey² for a gamma of 2.2.
const REST: f64 = 3e-4;
/// The grey level from which on light is clipped.
const CLIPPED: u8 = 253;
/// The grey level up to which light is lost in black.
const DARK_GREY: f64 = 5.0;
/// The allowed part of clipped pixels, at white or at black.
const CLIPPED_SHARE: f64 = 0.01;
/// The least gap between On and Off LEDs, relative to the distance of their means: less is a change of symbols, or invisible light.
const GAP: f64 = 0.5;
/// The greatest relative excess of an Off LED over three quarters of them: more is light of a neighbouring symbol.
const OFF_SPREAD: f64 = 0.25;

/// The greatest ratio of a sheet's brightness between two LEDs: more is the panel itself.
const UNEVEN: f64 = 2.0;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Its first column.
    pub x: usize,
    /// Its first row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// The geometry of all pictures, and the camera's encoding.
#[derive(Clone, Copy, Debug)]
pub struct CameraSetup {
    /// The panel.
    pub corners: Corners,
    /// Gap between LEDs over their diameter.
    pub interval: f64,
    /// The grey card, or a part of it.
    pub card: Area,
    /// The camera's encoding.
    pub encoding: Encoding,
    /// Its grey level of no light.
    pub black_grey: f64,
    /// Standard deviation of its blur, px.
    pub blur_sigma_px: f64,
    /// The unevenness of illumination and lens, if known.
    pub unevenness: Option<Unevenness>,
}

/// The picture of a uniform sheet: brighter with more light, darker towards the picture's edges.
#[derive(Clone, Copy, Debug)]
pub struct Unevenness {
    /// The sheet's light at the LEDs, relative to that at the card.
    leds: [f64; LEDS],
    /// Its greatest relative error by rounding to grey levels.
    rounding: f64,
}

/// The result of a picture; light is in units of the card's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CardReading {
    /// The card's light, in units of grey 118's.
    pub card: f64,
    /// Light of Off LEDs.
    pub off: f64,
    /// Light of On LEDs above that.
    pub own: f64,
    /// Relative standard deviation of `own` by the pixels' noise.
    pub own_noise: f64,
    /// The greatest relative error of `off` by rounding to grey levels and by the remaining blur.
    pub off_rounding: f64,
    /// The greatest relative error of `own` by the same causes.
    pub own_rounding: f64,
}

/// Why a picture cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// Panel or card are beyond its edge.
    #[error("the {0} is not wholly in the picture: give its place in pixels")]
    Outside(&'static str),
    /// The LEDs are too small in the picture to have a middle without blur.
    #[error("LEDs are {found:.1} px wide, and this blur requires {needed:.1}: move closer")]
    Small {
        /// Their diameter, px.
        found: f64,
        /// The least diameter.
        needed: f64,
    },
    /// Light is clipped.
    #[error("the {0} is clipped at white: expose less, or leave this duty out")]
    Clipped(&'static str),
    /// Light is lost in black.
    #[error("the {what} is at grey {grey:.1}, too dark: expose longer, or use more ambient light")]
    Dark {
        /// The dark object.
        what: &'static str,
        /// Its mean grey level.
        grey: f64,
    },
    /// It does not show a uniform sheet.
    #[error(
        "before one LED it is {0:.1} times as bright as before another ({UNEVEN} is much): hold a sheet of one colour before panel and card"
    )]
    NoSheet(f64),
    /// Symbols change while it is exposed.
    #[error("the exposure is across a change of symbols: leave the picture out, expose more shortly, and let symbols come more slowly")]
    Changing,
    /// On and Off are indistinguishable.
    #[error(
        "On and Off LEDs cannot be distinguished: the exposure is across a change of symbols, or their light is too weak beside the ambient"
    )]
    Alike,
}

/// Sums over pixels of one kind.
#[derive(Clone, Copy, Default)]
struct Sum {
    count: f64,
    lost: f64,
    light: f64,
    squares: f64,
    grey: f64,
    grey_squares: f64,
    clipped: f64,
}

impl Sum {
    fn add(&mut self, grey: u8, light: f64) {
        let level = f64::from(grey);
        self.count += 1.0;
        self.light += light;
        self.squares += light * light;
        self.grey += level;
        self.grey_squares += level * level;
        self.clipped += f64::from(u8::from(grey >= CLIPPED));
        self.lost += f64::from(u8::from(light == 0.0));
    }

    /// The sum of that part of the light.
    fn times(self, part: f64) -> Self {
        Self {
            light: self.light * part,
            squares: self.squares * part * part,
            ..self
        }
    }

    fn mean(&self) -> f64 {
        self.light / self.count
    }

    fn mean_grey(&self) -> f64 {
        self.grey / self.count
    }

    /// The variance of the mean light.
    fn variance(&self) -> f64 {
        (self.squares / self.count - self.mean().powi(2)).max(0.0) / self.count
    }

    /// The greatest difference of the mean of rounded levels from that of levels with this noise, in grey levels: the first term of the
    /// Fourier series of the sawtooth, all others are smaller.
    fn rounding_grey(&self) -> f64 {
        let variance = (self.grey_squares / self.count - self.mean_grey().powi(2)).max(0.0);
        let pi = std::f64::consts::PI;
        ((-2.0 * pi * pi * variance).exp() / pi).min(0.5)
    }
}

impl CameraSetup {
    /// Reads a picture of `width` columns.
    ///
    /// # Errors
    /// [`PictureError`] if it cannot be used.
    pub fn read(&self, grey: &[u8], width: usize) -> Result<CardReading, PictureError> {
        let found = f64::from(self.corners.pitch_px()) / (1.0 + self.interval);
        let needed = 2.0 * FREE_OF_BLUR * self.blur_sigma_px / (1.0 - MIDDLE);
        if found < needed {
            return Err(PictureError::Small { found, needed });
        }
        let light = self.lights();
        let card = self.card_of(grey, width, &light)?;
        usable("card", &card)?;
        let mut leds = self.leds(grey, width, &light)?;
        if let Some(unevenness) = &self.unevenness {
            leds = std::array::from_fn(|led| leds[led].times(1.0 / unevenness.leds[led]));
        }
        let (on, off) = groups(&leds).ok_or(PictureError::Alike)?;
        let clipped = on.iter().any(|led| led.clipped > CLIPPED_SHARE * led.count);
        if clipped {
            return Err(PictureError::Clipped("light of On LEDs"));
        }
        off.iter().try_for_each(|led| usable("light of Off LEDs", led))?;
        // In ascending order.
        if off[off.len() - 1].mean() > (1.0 + OFF_SPREAD) * off[off.len() / 4].mean() {
            return Err(PictureError::Changing);
        }
        let [on_mean, off_mean] = [&on, &off].map(|leds| mean(leds));
        let own = on_mean - off_mean;
        let noise = |leds: &[Sum]| leds.iter().map(Sum::variance).sum::<f64>() / (leds.len() as f64).powi(2);
        let card_noise = card.variance() / card.mean().powi(2);
        let own_noise = ((noise(&on) + noise(&off)) / (own * own) + card_noise).sqrt();
        let shift_of = |leds: &[Sum]| {
            let shifts = leds.iter().map(|led| self.shift(led) * led.mean());
            shifts.sum::<f64>() / leds.len() as f64
        };
        let everywhere = self.shift(&card) + REST + self.unevenness.map_or(0.0, |uneven| uneven.rounding);
        Ok(CardReading {
            card: card.mean(),
            off: off_mean / card.mean(),
            own: own / card.mean(),
            own_noise,
            off_rounding: shift_of(&off) / off_mean + everywhere,
            own_rounding: (shift_of(&on) + shift_of(&off)) / own + everywhere,
        })
    }

    /// Reads the picture, of `width` columns, of a uniform sheet before panel and card.
    ///
    /// # Errors
    /// [`PictureError`] if it cannot be used.
    pub fn read_sheet(&self, grey: &[u8], width: usize) -> Result<Unevenness, PictureError> {
        let light = self.lights();
        let card = self.card_of(grey, width, &light)?;
        let leds = self.leds(grey, width, &light)?;
        for part in leds.iter().chain([&card]) {
            usable("sheet", part)?;
        }
        let lights = || leds.iter().map(Sum::mean);
        let by = lights().fold(0.0, f64::max) / lights().fold(f64::INFINITY, f64::min);
        if by > UNEVEN {
            return Err(PictureError::NoSheet(by));
        }
        let shifts = leds.iter().map(|led| self.shift(led));
        Ok(Unevenness {
            leds: leds.map(|led| led.mean() / card.mean()),
            rounding: shifts.fold(0.0, f64::max) + self.shift(&card),
        })
    }

    /// The relative effect of rounding to grey levels on a mean light.
    fn shift(&self, sum: &Sum) -> f64 {
        let at = sum.mean_grey();
        sum.rounding_grey() * (self.light(at + 0.5) - self.light(at - 0.5)) / self.light(at)
    }

    fn lights(&self) -> [f64; 256] {
        std::array::from_fn(|level| self.light(level as f64))
    }

    /// Light of a grey level, in units of grey 118's.
    fn light(&self, grey: f64) -> f64 {
        let above = (grey - self.black_grey).max(0.0);
        self.encoding.light_f64(above * 255.0 / (255.0 - self.black_grey))
    }

    fn card_of(&self, grey: &[u8], width: usize, light: &[f64; 256]) -> Result<Sum, PictureError> {
        let Area {
            x,
            y,
            width: columns,
            height: rows,
        } = self.card;
        let inside = x + columns <= width && (y + rows) * width <= grey.len();
        if !inside || columns * rows == 0 {
            return Err(PictureError::Outside("card"));
        }
        let mut sum = Sum::default();
        for row in grey.chunks_exact(width).skip(y).take(rows) {
            for &level in &row[x..x + columns] {
                sum.add(level, light[usize::from(level)]);
            }
        }
        Ok(sum)
    }

    /// The middles of the LEDs.
    fn leds(&self, grey: &[u8], width: usize, light: &[f64; 256]) -> Result<[Sum; LEDS], PictureError> {
        let pitch = f64::from(self.corners.pitch_px());
        let points = self.corners.points();
        let outside = || PictureError::Outside("panel");
        let range = |axis: usize, size: usize| {
            let places = points.iter().map(|point| f64::from(point[axis]));
            let low = places.clone().fold(f64::INFINITY, f64::min) - pitch / 2.0;
            let high = places.fold(0.0, f64::max) + pitch / 2.0;
            (low >= 0.0 && high < size as f64).then_some(low as usize..high as usize + 1)
        };
        let columns = range(0, width).ok_or_else(outside)?;
        let rows = range(1, grey.len() / width).ok_or_else(outside)?;
        let map = self.corners.homography();
        let radius = MIDDLE * 0.5 / (1.0 + self.interval);
        let mut leds = [Sum::default(); LEDS];
        for y in rows {
            for x in columns.clone() {
                let [u, v] = map.to_panel([x as f64, y as f64]);
                let (column, row) = (u.round(), v.round());
                let last = (SIDE - 1) as f64;
                let is_led = (0.0..=last).contains(&column) && (0.0..=last).contains(&row);
                if is_led && (u - column).hypot(v - row) <= radius {
                    let level = grey[y * width + x];
                    leds[SIDE * row as usize + column as usize].add(level, light[usize::from(level)]);
                }
            }
        }
        if leds.iter().any(|led| led.count == 0.0) {
            return Err(outside());
        }
        Ok(leds)
    }
}

/// Checks that light is neither clipped nor lost.
fn usable(what: &'static str, sum: &Sum) -> Result<(), PictureError> {
    if sum.clipped > CLIPPED_SHARE * sum.count {
        return Err(PictureError::Clipped(what));
    }
    let grey = sum.mean_grey();
    if grey < DARK_GREY || sum.lost > CLIPPED_SHARE * sum.count {
        return Err(PictureError::Dark { what, grey });
    }
    Ok(())
}

fn mean(leds: &[Sum]) -> f64 {
    leds.iter().map(Sum::mean).sum::<f64>() / leds.len() as f64
}

/// On and Off LEDs in ascending order, separated at the widest gap; `None` without a wide one.
fn groups(leds: &[Sum; LEDS]) -> Option<(Vec<Sum>, Vec<Sum>)> {
    let mut sorted = leds.to_vec();
    sorted.sort_by(|a, b| a.mean().total_cmp(&b.mean()));
    let gap = |at: usize| sorted[at].mean() - sorted[at - 1].mean();
    let widest = (1..LEDS).max_by(|&a, &b| gap(a).total_cmp(&gap(b)))?;
    let on = sorted.split_off(widest);
    let wide = on[0].mean() - sorted[widest - 1].mean();
    (wide >= GAP * (mean(&on) - mean(&sorted))).then_some((on, sorted))
}
