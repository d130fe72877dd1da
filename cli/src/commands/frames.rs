//! `vocc frames`: labelled frames, for other detectors.

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use link::panel::{LEDS, PanelFrame};
use serde::Serialize;
use sim::accuracy::Level;
use sim::renderer::canvas::Region;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{EvaluateError, Evaluator, FrameSource, LabelledFrame, Labels, Settings};
use studies::stop::Stop;

use crate::files::{self, Growing};
use crate::npy::{ARCHIVE_MAX, Array, Arrays, archive_size};
use crate::options::{SharedOptions, whole};
use crate::output::{self, Verdict, line};
use crate::outputs;
use crate::pictures;
use crate::progress::Progress;
use crate::stop::stop;

/// Maximum number of frames: 20 GB of pictures at 50 m.
const MOST_FRAMES: u64 = 10_000_000;
/// Maximum number of the first frame: JSON readers represent integers exactly up to it.
const FIRST_MAX: u64 = 1 << 53;
/// Frames that each thread renders before they are written.
const FRAMES_A_THREAD: usize = 128;
/// The file that is written last: a folder with this file is complete.
const ABOUT: &str = "frames.json";
/// The labels beside pictures.
const TRUTH: &str = "truth.csv";

const LAYOUT: &str = "\
Files, for N frames of H × W pixels: in a folder, or with these names in one FILE.npz (numpy.load).
  frames.npy    N × H × W, uint8: the panel's cells, row by row from the top
  truth.npy     N × 64, bool: LED 8·row + column, row 0 at the top; True is On
  corners.npy   N × 4 × 2, float32: x and y of the corner LEDs' centres, top left, top right, bottom right, bottom left, in pixels of the \
frame; (0, 0) is the centre of its top-left pixel
  across.npy    N, bool: the exposure is shared between two symbols
  features.npy  N × 64 × 3, float32: AGR, GRI and NGR of each LED's cell (--features)
  read.npy      N × 64, bool: what --detector reads
With --format png the folder has frame-000000.png and so on, and truth.csv: a line a frame, bits as 16 hexadecimal digits, bit 8·row + \
column. Folders have frames.json (scene, seed, sizes), which is written last: where it is, the files are complete.

Frame K of a scene, a seed and --random-reflectance is the one that `vocc evaluate` evaluates: count your errors over the same frames and \
compare. Ctrl-C leaves no arrays, and with --format png the finished frames.";

/// Arguments of `vocc frames`.
#[derive(clap::Args)]
#[command(after_help = LAYOUT)]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file.
    #[arg(default_value = "paper")]
    scene: OsString,
    /// The output: a new folder, or a new FILE.npz of up to 4 GB.
    #[arg(long, value_name = "DIR|FILE.npz")]
    out: PathBuf,
    /// Frames, each with random bits and a random sub-pixel phase.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = whole(1..=MOST_FRAMES))]
    count: u64,
    /// The number of the first frame.
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = whole(0..=FIRST_MAX))]
    first: u64,
    /// The format of files in a folder: npy (arrays) or png (pictures, and labels as CSV).
    #[arg(long, default_value = "npy")]
    format: Format,
    /// Also write the features AGR, GRI and NGR of each LED's cell; not with png.
    #[arg(long)]
    features: bool,
    /// Also write the bits that this detector reads, to compare frame by frame; detectors as in `vocc evaluate`.
    #[arg(long)]
    detector: Option<DetectorChoice>,
    /// Draw each frame's reflectance from 0.3 to 0.5.
    #[arg(long)]
    random_reflectance: bool,
    /// Rendering level: fine or fast.
    #[arg(long, default_value = "fast", value_parser = super::evaluate::single_precision)]
    level: Level,
}

/// The format of frames in a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    Npy,
    Png,
}

#[derive(Serialize)]
struct Report<'a> {
    out: &'a Path,
    files: Vec<String>,
    #[serde(flatten)]
    facts: &'a Facts,
}

/// A description of the frames.
#[derive(Serialize)]
struct Facts {
    frames: u64,
    first_frame: u64,
    seed: u64,
    random_reflectance: bool,
    level: Level,
    size_px: [usize; 2],
    origin_px: [usize; 2],
    bits: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    detector: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bit_errors: Option<u64>,
}

/// The contents of [`ABOUT`]: a description of the frames, and their scene.
#[derive(Serialize)]
struct About<'a> {
    version: &'static str,
    #[serde(flatten)]
    facts: &'a Facts,
    scene: &'a Scene,
}

impl About<'_> {
    /// Its file, written but not yet renamed into place.
    fn file(&self, path: PathBuf) -> anyhow::Result<(PathBuf, Growing)> {
        let mut file = Growing::create(&path)?;
        let written = writeln!(file, "{}", serde_json::to_string_pretty(self)?);
        written.with_context(|| format!("cannot write {}", path.display()))?;
        Ok((path, file))
    }
}

/// Renders, writes and reports.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let scene = shared.scene(&arguments.scene)?;
    let end = arguments.first + arguments.count;
    let is_archive = check_out(arguments)?;
    let settings = Settings {
        random_reflectance: arguments.random_reflectance,
        level: arguments.level,
        stop: stop(),
        ..Settings::fast(arguments.count, shared.seed, arguments.detector.unwrap_or(DetectorChoice::KMeans))
    };
    let evaluator = match Evaluator::new(&scene, settings) {
        Err(EvaluateError::Stopped) => return Ok(interrupted_before()),
        made => made?,
    };
    let labels = Labels {
        features: arguments.features,
        reading: arguments.detector.is_some(),
    };
    let source = FrameSource::new(evaluator, labels);
    let arrays = arrays(&source, arguments.count);
    let (_held, mut target) = if is_archive {
        check_archive(&arguments.out, &arrays)?;
        files::check_new(&arguments.out)?;
        (None, Target::Arrays(Arrays::in_archive(&arguments.out, &arrays)?))
    } else {
        let held = prepare_folder(&arguments.out)?;
        let target = match arguments.format {
            Format::Npy => Target::Arrays(Arrays::in_folder(&arguments.out, &arrays)?),
            Format::Png => Target::pictures(&arguments.out, labels)?,
        };
        (held, target)
    };
    let counted = write_all(&source, arguments.first..end, &mut target, settings.stop)?;
    let is_whole = counted.frames == arguments.count;
    let mut files = match &target {
        _ if is_archive => Vec::new(),
        Target::Arrays(_) => arrays.iter().map(Array::file).collect(),
        Target::Pictures(_) => vec!["frame-*.png".into(), TRUTH.into()],
    };
    if !is_whole && (counted.frames == 0 || !target.keeps_part()) {
        return Ok(interrupted_before());
    }
    let mut closed = target.close()?;
    let Region { x, y, width, height } = source.region();
    let facts = Facts {
        frames: counted.frames,
        first_frame: arguments.first,
        seed: shared.seed,
        random_reflectance: arguments.random_reflectance,
        level: arguments.level,
        size_px: [width, height],
        origin_px: [x, y],
        bits: counted.frames * LEDS as u64,
        detector: arguments.detector.map(DetectorChoice::name),
        bit_errors: arguments.detector.map(|_| counted.bit_errors),
    };
    if is_whole && !is_archive {
        let about = About {
            version: env!("CARGO_PKG_VERSION"),
            facts: &facts,
            scene: &scene,
        };
        closed.push(about.file(arguments.out.join(ABOUT))?);
        files.push(ABOUT.into());
    }
    files::keep_new(closed)?;
    if !is_whole {
        output::tell(format_args!(
            "interrupted: {} has {} frames of {}, and no {ABOUT}",
            arguments.out.display(),
            counted.frames,
            arguments.count
        ));
    }
    let report = Report {
        out: &arguments.out,
        files,
        facts: &facts,
    };
    print(&report, shared)?;
    Ok(if is_whole { Verdict::Yes } else { Verdict::No })
}

fn interrupted_before() -> Verdict {
    output::tell("interrupted: nothing is written");
    Verdict::No
}

fn print(report: &Report, shared: &SharedOptions) -> anyhow::Result<()> {
    if shared.json {
        return output::json(report);
    }
    let Facts {
        frames,
        size_px: [width, height],
        origin_px: [x, y],
        bits,
        detector,
        bit_errors,
        ..
    } = report.facts;
    line(&format!(
        "written  {} ({frames} frames of {width} × {height} pixels from ({x}, {y}) of the sensor on)",
        report.out.display(),
    ))?;
    if !report.files.is_empty() {
        line(&format!("files    {}", report.files.join(", ")))?;
    }
    if let (Some(detector), Some(errors)) = (detector, bit_errors) {
        line(&format!("read     by {detector}: {errors} of {bits} bits are wrong"))?;
    }
    Ok(())
}

/// Whether `--out` names an archive rather than a folder.
fn check_out(arguments: &Arguments) -> anyhow::Result<bool> {
    let out = &arguments.out;
    let ending = out.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    let is_archive = ending.as_deref() == Some("npz");
    if let Some("npy" | "png" | "csv" | "zip") = ending.as_deref() {
        anyhow::bail!("--out {}: give a folder for several files, or FILE.npz for one", out.display());
    }
    ensure!(
        is_archive || !out.exists() || out.is_dir(),
        "--out {} is not a folder: give a folder, or FILE.npz",
        out.display()
    );
    ensure!(
        !is_archive || arguments.format == Format::Npy,
        "--format png needs a folder, and {} is one file: give a folder",
        out.display()
    );
    ensure!(
        !arguments.features || arguments.format == Format::Npy,
        "--features are arrays, and --format png writes no arrays: omit one of the two"
    );
    Ok(is_archive)
}

fn check_archive(path: &Path, arrays: &[Array]) -> anyhow::Result<()> {
    let count = arrays[0].shape[0];
    let each = archive_size(arrays) / count;
    ensure!(
        archive_size(arrays) <= ARCHIVE_MAX,
        "--count {count}: {} would have {} bytes, more than {ARCHIVE_MAX}: give at most {}, or a folder",
        path.display(),
        archive_size(arrays),
        ARCHIVE_MAX / (each + 1)
    );
    Ok(())
}

/// Creates the folder, which must not contain other frames, and locks it.
fn prepare_folder(folder: &Path) -> anyhow::Result<Option<std::fs::File>> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let held = outputs::hold(folder)?;
    outputs::check_recording(folder)?;
    // Also check for files of other options: a detector's bits from an earlier run do not belong to these frames.
    let names = NAMES
        .map(|name| format!("{name}.npy"))
        .into_iter()
        .chain([TRUTH.into(), ABOUT.into()]);
    for name in names {
        let path = folder.join(&name);
        ensure!(
            !path.exists(),
            "{} already holds frames, such as {name}: give a new folder, or remove these files",
            folder.display()
        );
        files::check(&path)?;
    }
    Ok(held)
}

/// The names of all [`arrays`].
const NAMES: [&str; 6] = ["frames", "truth", "corners", "across", "features", "read"];

/// The arrays of `count` frames, in the order of [`bytes_of`].
fn arrays(source: &FrameSource, count: u64) -> Vec<Array> {
    let Region { width, height, .. } = source.region();
    let leds = LEDS as u64;
    let array = |name, kind, sides: &[u64]| Array {
        name,
        kind,
        shape: [&[count], sides].concat(),
    };
    let mut arrays = vec![
        array(NAMES[0], "|u1", &[height as u64, width as u64]),
        array(NAMES[1], "|b1", &[leds]),
        array(NAMES[2], "<f4", &[4, 2]),
        array(NAMES[3], "|b1", &[]),
    ];
    if source.labels().features {
        arrays.push(array(NAMES[4], "<f4", &[leds, 3]));
    }
    if source.labels().reading {
        arrays.push(array(NAMES[5], "|b1", &[leds]));
    }
    arrays
}

/// The bytes that frames add to each array of [`arrays`] except the first.
fn bytes_of(frames: &[LabelledFrame], labels: Labels) -> Vec<Vec<u8>> {
    let panels = |bits: fn(&LabelledFrame) -> Option<PanelFrame>| {
        let panels = frames.iter().filter_map(bits);
        panels
            .flat_map(|panel| (0..LEDS).map(move |led| u8::from(panel.led(led))))
            .collect()
    };
    let corners = frames.iter().flat_map(|frame| frame.corners_px).flatten();
    let mut bytes = vec![
        panels(|frame| Some(frame.bits)),
        corners.flat_map(f32::to_le_bytes).collect(),
        frames.iter().map(|frame| u8::from(frame.across)).collect(),
    ];
    if labels.features {
        let features = frames.iter().filter_map(|frame| frame.features.as_deref());
        let values = features.flat_map(|features| {
            let ngr = features.ngr();
            (0..LEDS).flat_map(move |led| [features.agr[led], features.gri[led], ngr[led]])
        });
        bytes.push(values.flat_map(f32::to_le_bytes).collect());
    }
    if labels.reading {
        bytes.push(panels(|frame| frame.read));
    }
    bytes
}

/// Counts of the frames written.
#[derive(Default)]
struct FrameCounts {
    frames: u64,
    bit_errors: u64,
}

/// Renders frames and writes them, until all are written or a stop is requested.
fn write_all(source: &FrameSource, frames: std::ops::Range<u64>, target: &mut Target, stop: Stop) -> anyhow::Result<FrameCounts> {
    let mut progress = Progress::new(frames.end - frames.start, "frames");
    let batch = FRAMES_A_THREAD * rayon::current_num_threads();
    let mut images = Vec::new();
    let mut counted = FrameCounts::default();
    while counted.frames < frames.end - frames.start {
        let first = frames.start + counted.frames;
        let count = (frames.end - first).min(batch as u64) as usize;
        images.resize(count * source.pixels(), 0);
        let drawn = match source.draw_many(first, &mut images, stop) {
            Err(EvaluateError::Stopped) => break,
            drawn => drawn?,
        };
        let written = target.write(source, first, &images, &drawn, stop)?;
        let errors = |frame: &LabelledFrame| frame.read.map_or(0, |read| read.distance(frame.bits));
        counted.frames += written as u64;
        counted.bit_errors += drawn[..written].iter().map(|frame| u64::from(errors(frame))).sum::<u64>();
        progress.done(counted.frames);
        if written < count {
            break;
        }
    }
    Ok(counted)
}

/// The destination of frames.
enum Target {
    Arrays(Arrays),
    Pictures(Pictures),
}

/// One picture per frame, and a table.
struct Pictures {
    folder: PathBuf,
    table: Growing,
    rows: Vec<u8>,
}

/// Bytes of a table per write.
const ROWS: usize = 1 << 16;

impl Target {
    fn pictures(folder: &Path, labels: Labels) -> anyhow::Result<Self> {
        let corners = ["top_left", "top_right", "bottom_right", "bottom_left"];
        let corners = corners.map(|corner| format!("{corner}_x_px,{corner}_y_px"));
        let read = if labels.reading { ",read" } else { "" };
        Ok(Self::Pictures(Pictures {
            folder: folder.to_owned(),
            table: Growing::create(&folder.join(TRUTH))?,
            rows: format!("frame,file,bits,across,{}{read}\n", corners.join(",")).into(),
        }))
    }

    /// Whether an interrupted run keeps its finished frames.
    fn keeps_part(&self) -> bool {
        matches!(self, Self::Pictures(_))
    }

    /// Writes frames from `first` on; returns how many, which is fewer if a stop was requested.
    fn write(&mut self, source: &FrameSource, first: u64, images: &[u8], frames: &[LabelledFrame], stop: Stop) -> anyhow::Result<usize> {
        match self {
            Self::Arrays(arrays) => {
                arrays.append(0, images)?;
                for (place, bytes) in bytes_of(frames, source.labels()).iter().enumerate() {
                    arrays.append(place + 1, bytes)?;
                }
                Ok(frames.len())
            }
            Self::Pictures(pictures) => {
                let Region { width, height, .. } = source.region();
                let images = images.chunks_exact(source.pixels());
                let mut written = 0;
                for ((number, image), frame) in (first..).zip(images).zip(frames) {
                    if stop.is_asked() {
                        break;
                    }
                    let path = outputs::frame_in(&pictures.folder, number);
                    pictures::write_png(&path, image, width, height)?;
                    pictures.add_row(number, &path, frame)?;
                    written += 1;
                }
                Ok(written)
            }
        }
    }

    /// The files that are not yet renamed into place.
    fn close(self) -> anyhow::Result<Vec<(PathBuf, Growing)>> {
        match self {
            Self::Arrays(arrays) => arrays.close(),
            Self::Pictures(mut pictures) => {
                pictures.write_rows()?;
                Ok(vec![(pictures.folder.join(TRUTH), pictures.table)])
            }
        }
    }
}

impl Pictures {
    fn add_row(&mut self, number: u64, path: &Path, frame: &LabelledFrame) -> anyhow::Result<()> {
        let name = path.file_name().unwrap_or_default().display();
        let corners = frame.corners_px.map(|[x, y]| format!("{x},{y}")).join(",");
        let read = frame.read.map_or(String::new(), |read| format!(",{read}"));
        let across = u8::from(frame.across);
        writeln!(self.rows, "{number},{name},{},{across},{corners}{read}", frame.bits)?;
        if self.rows.len() >= ROWS {
            self.write_rows()?;
        }
        Ok(())
    }

    fn write_rows(&mut self) -> anyhow::Result<()> {
        let written = self.table.write_all(&self.rows);
        self.rows.clear();
        written.with_context(|| format!("cannot write {}", self.folder.join(TRUTH).display()))
    }
}
