//! `vocc device calibrate`: a panel's calibration from pictures beside a grey card.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use fixed::types::{U1F31, U32F32};
use image::GrayImage;
use link::camera::Encoding;
use link::l2a_table::Interval;
use link::serial::Measured;
use reception::deep::SampleKind;
use rx_pipeline::corners::Corners;
use serde_json::json;
use studies::photometry::{self, Area, CameraSetup, Estimate, PanelCalibration, PictureError, Shot, USUAL};
use tx_firmware::calibration::{BENCH, Calibration, INTERVAL};

use super::calibration::filled_in;
use crate::camera::{CameraArguments, CameraHints};
use crate::commands::decode::corners;
use crate::files;
use crate::frames::PixelArguments;
use crate::frames::files as pictures;
use crate::frames::picture::{GreyPicture, PictureReader};
use crate::options::{SharedOptions, number_in};
use crate::output::{self, Verdict, line};

/// The prefix of the duty in a picture's name.
const DUTY: &str = "duty-";

/// Arguments of `vocc device calibrate`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A folder of pictures of the panel and a grey card in the same light, each named by its duty: duty-0.05.png, duty-0.05-again.png.
    #[arg(long, value_name = "DIR")]
    frames: PathBuf,
    /// Centres of the corner LEDs in all pictures, in pixels: top left, top right, bottom right, bottom left.
    #[arg(long, value_parser = corners, allow_hyphen_values = true, value_name = "x,y,x,y,x,y,x,y")]
    corners: Corners,
    /// The card, or a part of it, in pixels: left, top, width, height.
    #[arg(long, value_parser = area, value_name = "x,y,w,h")]
    card: Area,
    /// The card's reflectance, 0.02 to 1.
    #[arg(long, default_value_t = 0.18, value_name = "R", value_parser = within::<2, 100>)]
    card_reflectance: f64,
    /// Gap between LEDs in LED diameters, 0.5 to 3.
    #[arg(long, default_value_t = 1.0, value_name = "I", value_parser = interval)]
    interval: f64,
    /// Nanoseconds in a duty of 1, 100 to 10000000: the period of the dimming while the pictures were taken, a Pico's shortest by default.
    #[arg(long, default_value_t = 7776.0, value_name = "NS", value_parser = within::<10_000, 1_000_000_000>)]
    period_ns: f64,
    /// A picture of an evenly coloured sheet in front of panel and card, by the same camera at the same place. It corrects uneven light and
    /// vignetting.
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// The illuminance of panel and card in lx, from a meter or the transmitter's status. Needed for the luminance.
    #[arg(long, value_name = "LX", value_parser = within::<10, 20_000_000>)]
    illuminance_lx: Option<f64>,
    /// Write the calibration to this file, for `vocc device calibration`. Values that the pictures do not give are those of the bench
    /// panel.
    #[arg(long, value_name = "FILE", requires = "illuminance_lx")]
    out: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    pixels: PixelArguments,
}

/// A number within bounds in hundredths.
fn within<const LEAST: u64, const MOST: u64>(text: &str) -> Result<f64, String> {
    number_in(text, LEAST as f64 / 100.0..=MOST as f64 / 100.0, "")
}

/// The interval of a panel that a transmitter can drive.
fn interval(text: &str) -> Result<f64, String> {
    number_in(text, INTERVAL.start().to_num::<f64>()..=INTERVAL.end().to_num(), "")
}

/// Four numbers of the option `--card`.
fn area(text: &str) -> Result<Area, String> {
    let numbers: Result<Vec<usize>, _> = text.split(',').map(|one| one.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width @ 1..=8192, height @ 1..=8192]) if x <= 8192 && y <= 8192 => Ok(Area { x, y, width, height }),
        _ => Err(format!(
            "{text:?} is not a rectangle of pixels: give left,top,width,height, each a whole number up to 8192"
        )),
    }
}

/// Reads the pictures, and reports the results.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    if let Some(path) = &arguments.out {
        files::check_new(path)?;
    }
    let frames = &arguments.frames;
    ensure!(
        frames.is_dir(),
        "the folder {} does not exist: give the folder of the pictures",
        frames.display()
    );
    let hints = arguments.camera.hints(arguments.pixels)?;
    ensure!(
        hints.encoding.is_some(),
        "nobody has said how the camera encodes light, and all depends on it: raw pictures developed in proportion to light are --encoding \
         linear, photographs srgb, films rec709; or give what `vocc receive --save-camera` learnt with --camera"
    );
    let mut series = Series {
        arguments,
        reader: PictureReader::new(hints.pixels, hints.encoding),
        hints,
        first: None,
        views: Vec::new(),
        shots: Default::default(),
        left_out: Vec::new(),
    };
    let sheet = arguments.sheet.as_deref();
    if let Some(path) = sheet {
        series.take_sheet(path)?;
    }
    let sheet = sheet.map(std::fs::canonicalize).transpose()?;
    for picture in pictures::of(std::slice::from_ref(frames))? {
        let path = &picture.path;
        if sheet.is_none() || std::fs::canonicalize(path).ok() != sheet {
            series.take_shot(path)?;
        }
    }
    let [estimate_text, others @ ..] = &series.shots;
    let (card_reflectance, period_ns) = (arguments.card_reflectance, arguments.period_ns);
    let found = photometry::calibrate_in_doubt(estimate_text, others, card_reflectance, period_ns)?;
    report(arguments, &found, series.left_out, shared)?;
    if let (Some(path), Some(lux)) = (&arguments.out, arguments.illuminance_lx) {
        let measured = measured(&found, arguments.interval, lux);
        Calibration::new(measured).context("this is not a panel that a transmitter can drive")?;
        files::write(path, filled_in(&measured))?;
    }
    Ok(Verdict::Yes)
}

/// Pictures of one camera at one place.
struct Series<'a> {
    arguments: &'a Arguments,
    reader: PictureReader,
    hints: CameraHints,
    /// The first picture's size and kind of samples.
    first: Option<(u32, u32, SampleKind)>,
    /// With the given encoding, and with each other possible one.
    views: Vec<CameraSetup>,
    /// With each of them.
    shots: [Vec<Shot>; 1 + USUAL.len()],
    left_out: Vec<serde_json::Value>,
}

impl Series<'_> {
    fn take_sheet(&mut self, path: &Path) -> anyhow::Result<()> {
        let grey = self.read(path)?;
        for view in &mut self.views {
            let unevenness = view.read_sheet(grey.as_raw(), grey.width() as usize);
            view.unevenness = Some(unevenness.with_context(|| path.display().to_string())?);
        }
        Ok(())
    }

    fn take_shot(&mut self, path: &Path) -> anyhow::Result<()> {
        let duty = duty(path)?;
        let grey = self.read(path)?;
        for (index, view) in self.views.iter().enumerate() {
            match view.read(grey.as_raw(), grey.width() as usize) {
                Ok(reading) => self.shots[index].push(Shot { duty, reading }),
                // The same in all pictures.
                Err(why @ (PictureError::Outside(_) | PictureError::Small { .. })) => {
                    return Err(why).with_context(|| path.display().to_string());
                }
                Err(why) if index == 0 => {
                    output::tell(format_args!("left out: {}: {why}", path.display()));
                    let why = why.to_string();
                    self.left_out.push(json!({ "file": path, "why": why }));
                }
                Err(_) => {}
            }
        }
        Ok(())
    }

    fn read(&mut self, path: &Path) -> anyhow::Result<GrayImage> {
        let GreyPicture {
            image: grey,
            samples,
            remark,
        } = self.reader.read(path)?;
        if let Some(remark) = remark {
            output::tell(remark);
        }
        // White levels that are guessed per picture would differ in dark pictures.
        ensure!(
            samples == SampleKind::Plain || self.hints.pixels.depth.is_some(),
            "{} has more than 8 bits: give the bits of white with --depth; programs that develop raw pictures give it 16",
            path.display()
        );
        let (width, height) = grey.dimensions();
        let alike = (width, height, samples);
        if self.first.is_none() {
            self.first = Some(alike);
            self.views = views(self.arguments, &self.hints, samples);
        }
        ensure!(
            self.first == Some(alike),
            "{} has {width} × {height} pixels, {samples}, and others differ: all must be of one camera at one place",
            path.display()
        );
        Ok(grey)
    }
}

/// With the given encoding, and with the other possible ones; raw pictures have only one.
fn views(arguments: &Arguments, hints: &CameraHints, samples: SampleKind) -> Vec<CameraSetup> {
    let camera = hints.of_pixels(samples);
    let is_raw = hints.encoding == Some(Encoding::LINEAR);
    let is_other = |usual: &Encoding| !is_raw && *usual != camera.encoding;
    std::iter::once(camera.encoding)
        .chain(USUAL.into_iter().filter(is_other))
        .map(|encoding| CameraSetup {
            corners: arguments.corners,
            interval: arguments.interval,
            card: arguments.card,
            encoding,
            black_grey: camera.black_grey.into(),
            blur_sigma_px: camera.blur_sigma_px.into(),
            unevenness: None,
        })
        .collect()
}

/// The duty in a picture's name.
fn duty(path: &Path) -> anyhow::Result<f64> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let after = name.find(DUTY).map(|at| &name[at + DUTY.len()..]);
    let number = after.map(|after| after.split(['-', '_', ' ']).next().unwrap_or_default());
    match number.and_then(|number| number.parse().ok()) {
        Some(duty) if duty > 0.0 && duty <= 1.0 => Ok(duty),
        _ => bail!(
            "{} has no duty (above 0, at most 1) in its name: name it like {DUTY}0.05.png or {DUTY}0.05-again.png",
            path.display()
        ),
    }
}

/// The values that are written to a transmitter.
fn measured(found: &PanelCalibration, interval: f64, illuminance_lx: f64) -> Measured {
    Measured {
        luminance_full_cd_m2: U32F32::saturating_from_num(found.full_cd_m2_per_lx.value * illuminance_lx),
        shortest_pulse_ns: found.shortest_pulse_ns.round() as u32,
        reflectance: U1F31::saturating_from_num(found.reflectance.value),
        interval: Interval::saturating_from_num(interval),
        ..BENCH
    }
}

fn report(arguments: &Arguments, found: &PanelCalibration, left_out: Vec<serde_json::Value>, shared: &SharedOptions) -> anyhow::Result<()> {
    let full = arguments.illuminance_lx;
    let full = full.map(|lux| found.full_cd_m2_per_lx.times(lux));
    if shared.json {
        return output::json(&json!({
            "reflectance": found.reflectance.value,
            "reflectance_95": found.reflectance.interval_95,
            "reflectance_doubted_95": found.reflectance.doubted_95,
            "full_cd_m2_per_lx": found.full_cd_m2_per_lx.value,
            "full_cd_m2_per_lx_95": found.full_cd_m2_per_lx.interval_95,
            "full_cd_m2_per_lx_doubted_95": found.full_cd_m2_per_lx.doubted_95,
            "luminance_full_cd_m2": full.map(|full| full.value),
            "luminance_full_cd_m2_95": full.map(|full| full.interval_95),
            "luminance_full_cd_m2_doubted_95": full.map(|full| full.doubted_95),
            "shortest_pulse_ns": found.shortest_pulse_ns,
            "unclean_pulse_ns": found.unclean_pulse_ns,
            "left_out": left_out,
        }));
    }
    line("                     value (95 %; 95 % if the encoding is off as far as the pictures allow)")?;
    let reflectance = estimate_text(&found.reflectance, 4);
    line(&format!("reflectance          {reflectance}"))?;
    let ratio = estimate_text(&found.full_cd_m2_per_lx, 4);
    line(&format!("luminance over light {ratio} cd/m² per lx"))?;
    if let Some(full) = full {
        let full = estimate_text(&full, 0);
        line(&format!("full luminance       {full} cd/m², if the illuminance is right"))?;
    }
    let unclean = match found.unclean_pulse_ns {
        0.0 => "no shorter one was unclean".to_owned(),
        pulse => format!("{pulse:.0} ns are not clean"),
    };
    line(&format!("shortest clean pulse {:.0} ns; {unclean}", found.shortest_pulse_ns))
}

/// An estimate with its intervals.
fn estimate_text(estimate: &Estimate, digits: usize) -> String {
    let Estimate {
        value,
        interval_95: [low, high],
        doubted_95: [least, most],
    } = estimate;
    format!("{value:.digits$} ({low:.digits$} to {high:.digits$}; {least:.digits$} to {most:.digits$})")
}
