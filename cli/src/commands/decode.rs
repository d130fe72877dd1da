//! `vocc decode`: the bits of single frames.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use reception::bytes::hex_if_no_text;
use reception::panel_pose::{PanelPose, PoseInput, PoseMeter};
use reception::still::{PlaceCheck, StillDecoder, StillError, StillReading};
use rx_pipeline::corners::Corners;
use rx_pipeline::frame::Frame;
use rx_pipeline::locate::BUSY_PEAKS;
use rx_pipeline::receiver::FrameReading;
use rx_pipeline::settings::SearchSettings;
use serde::Serialize;
use serde_json::Value;
use studies::detectors::DetectorChoice;

use crate::camera::{CameraArguments, CameraHints};
use crate::frames::PixelArguments;
use crate::frames::foreign;
use crate::frames::picture::PictureReader;
use crate::options::{self, SharedOptions};
use crate::output::{self, Verdict, line};
use crate::outputs;
use crate::pose::{self, PanelArguments};
use crate::show;

/// Arguments of `vocc decode`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Frames: PNG, JPEG or PGM, grey or in colour, of 8 to 16 bits.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// best, ml, kmeans, kmeans-raw or otsu.
    #[arg(long, default_value = "best")]
    detector: DetectorChoice,
    /// Centres of the corner LEDs in pixels: top left, top right, bottom right, bottom left. Without them, the tool searches for the panel.
    #[arg(long, value_parser = corners, allow_hyphen_values = true, value_name = "x,y,x,y,x,y,x,y")]
    corners: Option<Corners>,
    /// After a search for isolated spots, search this many of the busiest places for a panel, 1 to 96. Higher: panels beside busier
    /// objects are found, and pictures without a panel take longer.
    #[arg(long, value_name = "N", default_value_t = SearchSettings::DEFAULT.full_places, conflicts_with = "corners")]
    #[arg(value_parser = clap::value_parser!(u16).range(1..=BUSY_PEAKS as i64))]
    places: u16,
    /// Draw the panel of each picture into this folder, as NAME-panel.png: outline, cells and bits.
    #[arg(long, value_name = "DIR")]
    show: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    pixels: PixelArguments,
    #[command(flatten)]
    panel: PanelArguments,
}

impl Arguments {
    fn search(&self) -> SearchSettings {
        SearchSettings {
            full_places: self.places,
            ..SearchSettings::DEFAULT
        }
    }

    /// Whether a search may have left out places.
    fn leaves_places(&self) -> bool {
        self.corners.is_none() && usize::from(self.places) < BUSY_PEAKS
    }
}

#[derive(Default, Serialize)]
struct Report<'a> {
    file: Cow<'a, str>,
    /// The name's bytes if it is not UTF-8.
    #[serde(skip_serializing_if = "Option::is_none")]
    file_hex: Option<String>,
    found: bool,
    bits: Option<String>,
    centre_px: Option<[f32; 2]>,
    pitch_px: Option<f32>,
    confidence: Option<f32>,
    /// Whether the picture shows a panel there: confirmed, elsewhere or unconfirmed.
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<&'static str>,
    /// The corners of the panel that the picture shows instead.
    #[serde(skip_serializing_if = "Option::is_none")]
    elsewhere_px: Option<[[f32; 2]; 4]>,
    /// The panel's clockwise rotation in the picture, by its corners.
    #[serde(skip_serializing_if = "Option::is_none")]
    turned_deg: Option<u32>,
    why: Option<String>,
    pose: Option<Value>,
}

/// A panel in an image.
struct PanelReading {
    still: StillReading,
    panel_pose: PanelPose,
    /// An error if its drawing could not be written.
    drawn: anyhow::Result<()>,
}

/// Decodes each image; a bad one does not stop the others.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    if let Some(folder) = &arguments.show {
        let images = || arguments.images.iter().map(PathBuf::as_path);
        outputs::check_drawings(folder, images().map(show::in_picture), images())?;
    }
    let hints = arguments.camera.hints(arguments.pixels)?;
    let mut pictures = PictureReader::new(hints.pixels, hints.encoding);
    let mut decoder = Decoder {
        still: StillDecoder::new(options::untrained(arguments.detector)?).with_search(arguments.search()),
        hints,
        meter: PoseMeter::new(arguments.panel.size()?),
        drawings: arguments.show.as_deref(),
    };
    let with_pose = arguments.panel.is_set() || hints.calibration.is_set();
    let mut answer = Verdict::Yes;
    let mut bad = 0;
    for path in &arguments.images {
        let drawn = match decoder.decode(&mut pictures, path, arguments.corners) {
            Ok(Ok(panel)) => {
                report(path, &panel, with_pose, shared)?;
                panel.drawn
            }
            Ok(Err(why)) => {
                answer = Verdict::No;
                report_none(path, why, shared)?;
                Ok(())
            }
            Err(error) => Err(error),
        };
        if let Err(error) = drawn {
            bad += 1;
            output::tell(format_args!("vocc: {}", output::explain(&error)));
        }
    }
    if answer == Verdict::No && arguments.leaves_places() {
        output::tell(format_args!(
            "vocc: the {} busiest places of a picture were searched. Crop it to the panel, try --places {BUSY_PEAKS}, which takes longer, or \
             read a film with `vocc receive`, which finds the panel by its changes",
            arguments.places
        ));
    }
    anyhow::ensure!(bad == 0, "{bad} of {} images could not be used", arguments.images.len());
    Ok(answer)
}

/// Parses the four points of `--corners`.
pub fn corners(text: &str) -> Result<Corners, String> {
    let numbers: Vec<f32> = text
        .split(',')
        .map(|number| number.trim().parse().map_err(|_| format!("{number:?} is not a number")))
        .collect::<Result<_, _>>()?;
    let [a, b, c, d, e, f, g, h] = numbers[..] else {
        return Err(format!(
            "{} numbers instead of 8: give x,y of the top left, top right, bottom right and bottom left LED",
            numbers.len()
        ));
    };
    Corners::new([[a, b], [c, d], [e, f], [g, h]]).map_err(|error| error.to_string())
}

/// Settings to read single images with.
struct Decoder<'a> {
    still: StillDecoder,
    hints: CameraHints,
    meter: PoseMeter,
    /// The folder of the drawings.
    drawings: Option<&'a Path>,
}

impl Decoder<'_> {
    /// Decodes one image: its panel, or why none is readable. An error if the input itself is at fault.
    fn decode(
        &mut self,
        pictures: &mut PictureReader,
        path: &Path,
        given: Option<Corners>,
    ) -> anyhow::Result<Result<PanelReading, String>> {
        if let Some(advice) = foreign::many_frames(path) {
            anyhow::bail!(advice);
        }
        let picture = pictures.read(path)?;
        if let Some(remark) = picture.remark {
            output::tell(remark);
        }
        let image = picture.image;
        let (width, height) = (image.width() as usize, image.height() as usize);
        let camera = self.hints.of_pixels(picture.samples);
        let frame = Frame::new(image.as_raw(), width, height)?;
        let decoded = self.still.decode(&frame, camera, given);
        let (read, learnt) = decoded.map_err(|error| match error {
            StillError::Cells(error) => anyhow::anyhow!("{}: {error}", path.display()),
            error => error.into(),
        })?;
        let camera = learnt.map_or(camera, |learnt| learnt.camera);
        let lens = self.hints.calibration.lens([width, height]);
        Ok(read.map(|still| {
            let input = PoseInput {
                frame: &frame,
                reading: &still.reading,
                camera: &camera,
                lens: &lens,
            };
            let panel_pose = PanelPose::in_picture(&mut self.meter, &input);
            let drawing = self.drawings.map(|folder| folder.join(show::in_picture(path)));
            PanelReading {
                drawn: drawing.map_or(Ok(()), |drawing| show::reading(&drawing, &frame, &still.reading, &panel_pose)),
                panel_pose,
                still,
            }
        }))
    }
}

/// Warns on standard error if the bits may be of another panel, or of none.
fn doubt(path: &Path, corners: &Corners, place: &PlaceCheck) {
    let name = output::name(path);
    match place {
        PlaceCheck::Confirmed => {}
        PlaceCheck::Elsewhere(shown) => {
            let numbers: Vec<String> = shown.points().iter().flatten().map(|c| format!("{c:.1}")).collect();
            output::tell(format_args!(
                "vocc: {name}: not all LEDs are where they were read: the picture shows a panel with --corners={}",
                numbers.join(",")
            ));
        }
        PlaceCheck::Unconfirmed => output::tell(format_args!(
            "vocc: {name}: the picture does not confirm that a panel is there: it is faint or out of focus, an outer line of LEDs is dark, \
             or the corners are another's"
        )),
    }
    let turned_deg = corners.turned_deg();
    if turned_deg > 0 {
        output::tell(format_args!(
            "vocc: {name}: these corners turn the panel by {turned_deg}° clockwise; its first row begins at the first corner"
        ));
    }
}

/// A picture's path as JSON has it: as text, and its bytes if it is not UTF-8.
fn named(path: &Path) -> Report<'_> {
    Report {
        file: path.to_string_lossy(),
        file_hex: hex_if_no_text(path.as_os_str().as_encoded_bytes()),
        ..Report::default()
    }
}

fn report_none(path: &Path, why: String, shared: &SharedOptions) -> anyhow::Result<()> {
    if shared.json {
        return output::json(&Report {
            why: Some(why),
            ..named(path)
        });
    }
    line(&format!("{}: no panel: {why}", output::name(path)))
}

fn report(path: &Path, panel: &PanelReading, with_pose: bool, shared: &SharedOptions) -> anyhow::Result<()> {
    let StillReading {
        reading: FrameReading { corners, detection },
        place,
    } = &panel.still;
    let pose = panel.panel_pose.measured();
    doubt(path, corners, place);
    if shared.json {
        return output::json(&Report {
            found: true,
            bits: Some(detection.bits.to_string()),
            centre_px: Some(corners.centre_px()),
            pitch_px: Some(corners.pitch_px()),
            confidence: Some(detection.confidence),
            place: Some(place.name()),
            elsewhere_px: place.elsewhere().map(Corners::points),
            turned_deg: Some(corners.turned_deg()),
            pose: Some(pose::as_json(pose)),
            ..named(path)
        });
    }
    let [x, y] = corners.centre_px();
    line(&format!(
        "{}: {}, panel at ({x:.2}, {y:.2}) px, LEDs {:.2} px apart, confidence {:.4}",
        output::name(path),
        detection.bits,
        corners.pitch_px(),
        detection.confidence
    ))?;
    if with_pose {
        line(&format!("{}: {}", output::name(path), pose::as_text(pose)))?;
    }
    Ok(())
}
