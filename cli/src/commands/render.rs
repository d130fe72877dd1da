//! `vocc render`: one camera frame.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Context, ensure};
use serde::Serialize;
use sim::accuracy::Level;
use sim::renderer::canvas::Region;
use sim::renderer::{LinearImage, PanelExposure, Renderer};

use link::panel::PanelFrame;

use crate::npy;
use crate::options::SharedOptions;
use crate::output::{self, Verdict, line};
use crate::outputs;
use crate::pictures;

const LEDS: u32 = link::panel::LEDS as u32;

/// Arguments of `vocc render`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file.
    #[arg(default_value = "paper")]
    scene: OsString,
    /// The PNG file to write.
    #[arg(long)]
    out: PathBuf,
    /// The panel's bits, 16 hexadecimal digits, bit 8·row + column; default: random, by seed and frame.
    #[arg(long, value_parser = hexadecimal)]
    bits: Option<u64>,
    /// Also write the linear image to this NumPy file.
    #[arg(long, value_name = "F.npy")]
    linear: Option<PathBuf>,
    /// Rendering level: reference, fine or fast.
    #[arg(long, default_value = "fine")]
    level: Level,
    /// The frame's number, which sets its time and its random numbers.
    #[arg(long, default_value_t = 0)]
    frame: u64,
    /// Write the first panel's surroundings instead of the whole sensor.
    #[arg(long)]
    crop: bool,
    /// Write the first panel's surroundings, enlarged N times for viewing. Printed positions are in pixels of the camera.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=64))]
    zoom: Option<u8>,
}

/// The longest side of an enlarged picture.
const SIDE_MAX: usize = 16_384;

#[derive(Serialize)]
struct Report {
    bits: String,
    centre_px: [f64; 2],
    pitch_px: f64,
    level: Level,
    error_bound_grey: f64,
    origin_px: [usize; 2],
    size_px: [usize; 2],
    zoom: u8,
    corners_px: [[f64; 2]; 4],
    out: PathBuf,
    plan: sim::plan::Plan,
}

fn hexadecimal(text: &str) -> Result<u64, String> {
    match (text.len(), u64::from_str_radix(text, 16)) {
        (16, Ok(bits)) => Ok(bits),
        _ => Err(format!("{text:?} is not 16 hexadecimal digits, such as 8040201008040201")),
    }
}

/// Renders, writes and reports.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let scene = shared.scene(&arguments.scene)?;
    outputs::check(
        [&arguments.out].into_iter().chain(&arguments.linear).cloned(),
        outputs::files_of(&arguments.scene, &scene),
    )?;
    let renderer = Renderer::new(&scene, arguments.level)?;
    let bits = arguments.bits.map(PanelFrame::from_bits);
    let shown = renderer.shown(shared.seed, arguments.frame, bits);
    let region = if arguments.crop || arguments.zoom.is_some() {
        renderer.surroundings(0)
    } else {
        renderer.sensor()
    };
    let zoom = arguments.zoom.map_or(1, usize::from);
    let longest = region.width.max(region.height);
    ensure!(
        longest * zoom <= SIDE_MAX,
        "{} × {} pixels, enlarged {zoom} times, exceed {SIDE_MAX} pixels: give --zoom up to {}",
        region.width,
        region.height,
        SIDE_MAX / longest
    );
    let mut linear = renderer.linear_image(region);
    renderer.draw_frame(shared.seed, arguments.frame, &shown, &mut linear);
    let mut picture = vec![0; region.width * region.height];
    renderer.read_frame(shared.seed, arguments.frame, &linear, &mut picture);
    if let Some(path) = &arguments.linear {
        match &linear {
            LinearImage::Single(canvas) => npy::write_matrix(path, canvas.values(), region.width, region.height)?,
            LinearImage::Double(canvas) => npy::write_matrix(path, canvas.values(), region.width, region.height)?,
        }
    }
    let enlarged = pictures::enlarged(&picture, region.width, zoom);
    let [width, height] = [region.width, region.height].map(|side| side * zoom);
    pictures::write_png(&arguments.out, &enlarged, width, height)?;
    report(arguments, shared, &renderer, region, shown.first().context("a scene has a panel")?)
}

fn report(
    arguments: &Arguments,
    shared: &SharedOptions,
    renderer: &Renderer,
    region: Region,
    shown: &PanelExposure,
) -> anyhow::Result<Verdict> {
    let corners_px = renderer.corner_leds_in(region, &renderer.moment(shared.seed, arguments.frame));
    let [top_left, top_right, ..] = corners_px;
    let report = Report {
        bits: shown.symbols[0].to_string(),
        centre_px: [0, 1].map(|axis| corners_px.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0),
        pitch_px: (top_right[0] - top_left[0]).hypot(top_right[1] - top_left[1]) / 7.0,
        level: arguments.level,
        error_bound_grey: arguments.level.error_bound_grey(),
        origin_px: [region.x, region.y],
        size_px: [region.width, region.height],
        zoom: arguments.zoom.unwrap_or(1),
        corners_px,
        out: arguments.out.clone(),
        plan: renderer.plan().clone(),
    };
    if shared.json {
        output::json(&report)?;
        return Ok(Verdict::Yes);
    }
    output::plan(&report.plan)?;
    line(&format!("bits     {}", report.bits))?;
    if let 0 | LEDS = shown.symbols[0].bits().count_ones() {
        line("         all LEDs are in one state: a single frame shows neither which one nor where the panel is")?;
    }
    line(&format!(
        "panel    centre ({:.3}, {:.3}) px, LEDs {:.3} px apart",
        report.centre_px[0], report.centre_px[1], report.pitch_px
    ))?;
    line(&format!(
        "corners  {}",
        report.corners_px.map(|[x, y]| format!("{x:.3},{y:.3}")).join(",")
    ))?;
    line(&format!(
        "grey     at most {} from the reference, before rounding",
        report.error_bound_grey
    ))?;
    let enlarged = match report.zoom {
        1 => String::new(),
        zoom => format!(", each drawn as {zoom} × {zoom}, for viewing and not for `vocc decode`"),
    };
    line(&format!(
        "written  {} ({} × {} pixels from ({}, {}) of the sensor on{enlarged})",
        report.out.display(),
        region.width,
        region.height,
        region.x,
        region.y
    ))?;
    Ok(Verdict::Yes)
}
