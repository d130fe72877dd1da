//! A panel's calibration from pictures, without a luminance meter: with a grey card beside the panel in the same light.
//!
//! A camera's linear value is proportional to luminance, by an unknown factor. The card's luminance is ρ·E/π, with its reflectance ρ and
//! the ambient illuminance E; that of an Off LED is R·E/π, and that of an On LED R·E/π + d·L at a duty d. So in one picture, in units of
//! the card's light,
//!
//! ```text
//! off = R/ρ              On − Off = d·π·L/(ρ·E)
//! ```
//!
//! which gives the reflectance R and the full luminance over the ambient illuminance, L/E. For L itself you need a lux meter for E, or the
//! transmitter's own sensor: then its error is in E and in L alike, and the ratio of LED to ambient light is nevertheless right. The panel
//! shows messages or beacons; On and Off are distinguished in each picture.
//!
//! Some light of On LEDs is scattered onto Off ones in the lens: `off` is the intercept of the straight line through off over On − Off. If
//! a uniform sheet looks brighter somewhere, there is more light or less vignetting: LEDs are divided by its light there relative to the
//! card's place, which makes E the illuminance of the panel.
//!
//! **Intervals** are Student's over pictures, which covers all that differs between pictures (noise, the ripple of the dimming, the On
//! LEDs), widened by the greatest common effect of rounding to whole grey levels. They are valid if the encoding is the camera's own. The
//! encoding must decode an On LED near white and a card near black: if the true light is its power 1 + ε, light over duty is off by ε·z,
//! and so is the luminance; the reflectance is off by ε·ln off, with
//!
//! ```text
//! z = (on·ln on − off·ln off) / (on − off)      on, off in units of the card's light
//! ```
//!
//! ε is the slope of ln(light over duty) over z. A second, wider interval ([`Estimate::doubted_95`]) adds the greatest |ε| that the
//! pictures allow with 95 %, and spans the results with those other [`USUAL`] encodings that the pictures allow: sRGB and a power differ
//! most near black, where a dark card lies and duties give no information. If light over duty is significantly nonlinear, the pictures are
//! refused. No interval covers a card that is turned towards other light than the panel, or whose reflectance is not the given one.
//!
//! **The shortest clean pulse** lies between the longest pulse whose light is certainly off the line by more than [`CLEAN`] and the
//! shortest from which on all are certainly within it.

mod estimate;
mod picture;
#[cfg(test)]
mod tests;

pub use estimate::Estimate;
pub use picture::{Area, CameraSetup, CardReading, PictureError, Unevenness};

use crate::statistics::student_97_5;
use estimate::Line;
use link::camera::Encoding;

/// The encodings of usual cameras.
pub const USUAL: [Encoding; 3] = [Encoding::Gamma(Encoding::USUAL_GAMMA as f32), Encoding::Srgb, Encoding::Rec709];

/// The greatest relative deviation of a clean pulse's light from the straight line.
pub const CLEAN: f64 = 0.1;
/// The least duty of the line, relative to the longest one.
const LINE_FROM: f64 = 1.0 / 8.0;
/// The greatest relative bend of the line between its ends.
const BEND: f64 = 0.05;
/// The greatest relative variation of the card's light between pictures.
const STEADY: f64 = 0.05;
/// The least number of pictures for an estimate of their scatter.
const PICTURES: usize = 4;
/// Duties that differ by less count as one.
const SAME: f64 = 0.01;

/// A picture at a known duty.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// The duty, above 0 to 1.
    pub duty: f64,
    /// Its reading.
    pub reading: CardReading,
}

/// A panel's calibration from pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelCalibration {
    /// The reflectance of the LEDs' surface.
    pub reflectance: Estimate,
    /// The full luminance of an On LED over the ambient illuminance, cd/m² per lx.
    pub full_cd_m2_per_lx: Estimate,
    /// The shortest certainly clean pulse, ns.
    pub shortest_pulse_ns: f64,
    /// The longest certainly unclean pulse, ns; 0 if all are clean.
    pub unclean_pulse_ns: f64,
}

/// Why pictures give no calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PhotometryError {
    /// There are too few.
    #[error(
        "usable pictures from an eighth of the longest duty on: {found}, duties among them: {duties}; \
         take {PICTURES} or more, of 2 duties or more"
    )]
    TooFew {
        /// Number of pictures.
        found: usize,
        /// Number of duties.
        duties: usize,
    },
    /// The card's brightness differs between pictures.
    #[error(
        "the card's light differs by {:.0} % from picture to picture ({:.0} % is much): lock the camera's exposure, keep the light steady, \
         and the card so far from the panel that the LEDs do not light it",
        100.0 * .by, 100.0 * STEADY
    )]
    Unsteady {
        /// The greatest over the least, less 1.
        by: f64,
    },
    /// Light is not proportional to duty.
    #[error(
        "light over duty changes by {:.0} % along the line ({:.0} % is much): is the encoding the camera's own, and are the duties right? \
         Raw pictures, developed in proportion to light, need no other encoding than linear",
        100.0 * .by, 100.0 * BEND
    )]
    Bent {
        /// The change between its ends.
        by: f64,
    },
    /// No pulse is certainly clean.
    #[error("the pictures scatter too widely to determine which pulses are clean: take more of each duty")]
    Scattered,
}

/// Calibrates from pictures, beside a card of `card_reflectance`, a panel whose period of the dimming is `period_ns`.
///
/// # Errors
/// [`PhotometryError`] if they give no calibration, or none with certainty.
pub fn calibrate(shots: &[Shot], card_reflectance: f64, period_ns: f64) -> Result<PanelCalibration, PhotometryError> {
    let longest = shots.iter().map(|shot| shot.duty).fold(0.0, f64::max);
    let line: Vec<&Shot> = shots.iter().filter(|shot| shot.duty >= LINE_FROM * longest).collect();
    let duties = distinct(line.iter().map(|shot| shot.duty)).len();
    if line.len() < PICTURES || duties < 2 {
        let found = line.len();
        return Err(PhotometryError::TooFew { found, duties });
    }
    let cards = shots.iter().map(|shot| shot.reading.card);
    let by = cards.clone().fold(0.0, f64::max) / cards.fold(f64::INFINITY, f64::min) - 1.0;
    if by > STEADY {
        return Err(PhotometryError::Unsteady { by });
    }
    let points = line.iter().map(|shot| [shot.bent(), shot.per_duty().ln()]);
    let bend = Line::through(&points.collect::<Vec<_>>()).slope;
    let bents = || line.iter().map(|shot| shot.bent());
    let by = bend.value.abs() * (most(bents()) - bents().fold(f64::INFINITY, f64::min));
    if !bend.may_be_zero() && by > BEND {
        return Err(PhotometryError::Bent { by });
    }
    let line = FullLight::of(&line, bend.most());
    let (clean, unclean) = line.pulses(shots).ok_or(PhotometryError::Scattered)?;
    let off = shots.iter().map(|shot| [shot.reading.own, shot.reading.off]);
    let off = Line::through(&off.collect::<Vec<_>>()).at_zero;
    let rounding = most(shots.iter().map(|shot| shot.reading.off_rounding));
    let off = off.widened(rounding).doubted(bend.most() * off.value.ln().abs());
    Ok(PanelCalibration {
        reflectance: off.times(card_reflectance),
        full_cd_m2_per_lx: line.full.times(card_reflectance / std::f64::consts::PI),
        shortest_pulse_ns: clean * period_ns,
        unclean_pulse_ns: unclean * period_ns,
    })
}

/// As [`calibrate`], with doubt about the encoding: `others` are the same pictures, read with other encodings.
///
/// # Errors
/// As [`calibrate`]; an encoding of `others` that the pictures exclude is ignored.
pub fn calibrate_in_doubt(
    told: &[Shot],
    others: &[Vec<Shot>],
    card_reflectance: f64,
    period_ns: f64,
) -> Result<PanelCalibration, PhotometryError> {
    let found = calibrate(told, card_reflectance, period_ns)?;
    let others = others.iter();
    let others = others.filter_map(|shots| calibrate(shots, card_reflectance, period_ns).ok());
    Ok(others.fold(found, PanelCalibration::or))
}

impl PanelCalibration {
    /// The union with another calibration.
    fn or(self, other: Self) -> Self {
        Self {
            reflectance: self.reflectance.or(&other.reflectance),
            full_cd_m2_per_lx: self.full_cd_m2_per_lx.or(&other.full_cd_m2_per_lx),
            shortest_pulse_ns: self.shortest_pulse_ns.max(other.shortest_pulse_ns),
            unclean_pulse_ns: self.unclean_pulse_ns.min(other.unclean_pulse_ns),
        }
    }
}

impl Shot {
    fn per_duty(&self) -> f64 {
        self.reading.own / self.duty
    }

    /// The relative error of an On LED's own light per relative error of the encoding's power.
    fn bent(&self) -> f64 {
        let CardReading { off, own, .. } = self.reading;
        let on = off + own;
        (on * on.ln() - off * off.ln()) / own
    }
}

/// The light over duty of certainly clean pulses.
struct FullLight {
    full: Estimate,
    /// The relative standard deviation between pictures.
    scatter: f64,
    /// The number of pictures minus 1.
    freedom: f64,
    /// The greatest error of the encoding's power.
    bend: f64,
    /// [`Shot::bent`] on average.
    bent: f64,
}

impl FullLight {
    fn of(line: &[&Shot], bend: f64) -> Self {
        let per_duty: Vec<f64> = line.iter().map(|shot| shot.per_duty()).collect();
        let bent = line.iter().map(|shot| shot.bent()).sum::<f64>() / line.len() as f64;
        let rounding = most(line.iter().map(|shot| shot.reading.own_rounding));
        let full = Estimate::mean(&per_duty);
        Self {
            full: full.widened(rounding).doubted(bend * bent.abs()),
            scatter: estimate::deviation(&per_duty) / full.value,
            freedom: line.len() as f64 - 1.0,
            bend,
            bent,
        }
    }

    /// The least duty from which on all are certainly on the line, and the greatest one below that is certainly off it (0: none).
    fn pulses(&self, shots: &[Shot]) -> Option<(f64, f64)> {
        let mut clean = None;
        let duties = distinct(shots.iter().map(|shot| shot.duty));
        for duty in duties.into_iter().rev() {
            let same = |shot: &&Shot| (shot.duty / duty - 1.0).abs() < SAME;
            let of_duty: Vec<&Shot> = shots.iter().filter(same).collect();
            let [off, reach] = self.distance(&of_duty);
            if off + reach <= CLEAN {
                clean = Some(duty);
            } else if off - reach > CLEAN {
                return clean.map(|clean| (clean, duty));
            }
        }
        clean.map(|clean| (clean, 0.0))
    }

    /// The relative distance of pictures of one duty from the line, and its uncertainty.
    fn distance(&self, of_duty: &[&Shot]) -> [f64; 2] {
        let count = of_duty.len() as f64;
        let mean = |of: &dyn Fn(&Shot) -> f64| of_duty.iter().map(|shot| of(shot)).sum::<f64>() / count;
        let light = mean(&Shot::per_duty) / self.full.value;
        let noise = mean(&|shot| shot.reading.own_noise.powi(2));
        let error = ((self.scatter.powi(2) + noise * light * light) / count).sqrt();
        let rounding = most(of_duty.iter().map(|shot| shot.reading.own_rounding));
        let bend = self.bend * (self.bent - mean(&Shot::bent)).abs();
        let reach = student_97_5(self.freedom) * (error + self.scatter / (self.freedom + 1.0).sqrt());
        [(light - 1.0).abs(), reach + light * (rounding + bend)]
    }
}

fn most(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// Duties in rising order, each once.
fn distinct(duties: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut duties: Vec<f64> = duties.collect();
    duties.sort_by(f64::total_cmp);
    duties.dedup_by(|next, last| *next < *last * (1.0 + SAME));
    duties
}
