//! `vocc decode`: the bits of single frames.

use std::path::{Path, PathBuf};

use link::camera::Camera;
use rx_pipeline::camera::Learnt;
use rx_pipeline::cells::CellMap;
use rx_pipeline::corners::Corners;
use rx_pipeline::detect::{Detection, Method, check_white};
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::MaximumLikelihood;
use rx_pipeline::receiver::{
    FrameSearch, Reading, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory,
};
use serde::Serialize;
use serde_json::Value;
use studies::detectors::DetectorChoice;

use crate::camera::{CameraArguments, Told};
use crate::frames::PixelArguments;
use crate::frames::picture::PictureReader;
use crate::options::{self, Shared};
use crate::output::{self, Answer, line};
use crate::pose::{self, Measured, PanelArguments, PoseMeter};

/// The most pixels of a panel's bounding box.
const PANEL_PIXELS: usize = 512 * 512;
/// The most pixels that the likelihood looks at; larger panels are binned.
const LIKELIHOOD_PIXELS: usize = 128 * 128;
/// Pixels that a panel is looked for and read in where no corners are given; larger ones are seen in larger pixels. Boards end at
/// edges that the largest pixels mix with LEDs, so there is room to find panels in smaller ones.
const SEARCH_PIXELS: usize = 256 * 256;

/// Arguments of `vocc decode`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Frames: PNG, JPEG or PGM, grey or in colour, of 8 to 16 bits.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// best, ml, kmeans, kmeans-raw or otsu.
    #[arg(long, default_value = "best")]
    detector: DetectorChoice,
    /// Centres of the corner LEDs in pixels: top left, top right, bottom right, bottom left. Without them the panel is looked for.
    #[arg(long, value_parser = corners, allow_hyphen_values = true, value_name = "x,y,x,y,x,y,x,y")]
    corners: Option<Corners>,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    pixels: PixelArguments,
    #[command(flatten)]
    panel: PanelArguments,
}

#[derive(Serialize)]
struct Report<'a> {
    file: &'a Path,
    found: bool,
    bits: Option<String>,
    centre_px: Option<[f32; 2]>,
    pitch_px: Option<f32>,
    confidence: Option<f32>,
    why: Option<String>,
    pose: Option<Value>,
}

/// What an image shows: the panel and its pose.
struct Shown {
    corners: Corners,
    detection: Detection,
    pose: Measured,
}

/// Decodes each image; a bad one does not keep the others from being decoded.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    let told = arguments.camera.told(arguments.pixels)?;
    let mut pictures = PictureReader::new(told.pixels, told.encoding);
    let mut decoder = Decoder {
        method: options::untrained(arguments.detector)?,
        told,
        map: Box::new(CellMap::empty()),
        likelihood: Box::new(MaximumLikelihood::new(told.camera)),
    };
    let mut meter = PoseMeter::new(&arguments.panel, told.calibration)?;
    let mut answer = Answer::Yes;
    let mut bad = 0;
    for path in &arguments.images {
        match decoder.decode(&mut pictures, path, arguments.corners, &mut meter) {
            Ok(read) => {
                if read.is_err() {
                    answer = Answer::No;
                }
                report(path, read, meter.is_asked(), shared)?;
            }
            Err(error) => {
                bad += 1;
                output::tell(format_args!("vocc: {}", output::explain(&error)));
            }
        }
    }
    anyhow::ensure!(
        bad == 0,
        "{bad} of {} images could not be used",
        arguments.images.len()
    );
    Ok(answer)
}

/// Four points of the option `--corners`.
pub fn corners(text: &str) -> Result<Corners, String> {
    let numbers: Vec<f32> = text
        .split(',')
        .map(|number| {
            number
                .trim()
                .parse()
                .map_err(|_| format!("{number:?} is no number"))
        })
        .collect::<Result<_, _>>()?;
    let [a, b, c, d, e, f, g, h] = numbers[..] else {
        return Err(format!(
            "{} numbers instead of 8: give x,y of the top left, top right, bottom right and bottom left LED",
            numbers.len()
        ));
    };
    Corners::new([[a, b], [c, d], [e, f], [g, h]]).map_err(|error| error.to_string())
}

/// A panel's place and bits, or why they cannot be read.
type Read = Result<(Corners, Detection), String>;

/// What single images are read with.
struct Decoder {
    method: Method,
    told: Told,
    map: Box<CellMap<PANEL_PIXELS>>,
    likelihood: Box<MaximumLikelihood<LIKELIHOOD_PIXELS>>,
}

impl Decoder {
    /// What one image shows, or why no panel can be read in it; an error where the input itself is at fault.
    fn decode(
        &mut self,
        pictures: &mut PictureReader,
        path: &Path,
        given: Option<Corners>,
        meter: &mut PoseMeter,
    ) -> anyhow::Result<Result<Shown, String>> {
        let image = pictures.read(path)?;
        let (width, height) = (image.width() as usize, image.height() as usize);
        let camera = self.told.of_pixels(pictures.deep_white() > 0);
        let frame = Frame::new(image.as_raw(), width, height)?;
        let (read, learnt) = match given {
            None => self.search(camera, &frame)?,
            Some(corners) => {
                // Each image stands for itself.
                self.likelihood.prepare(camera);
                self.map
                    .build(&corners, width, height)
                    .map_err(|error| anyhow::anyhow!("{}: {error}", path.display()))?;
                let detection = self.detect(&frame, &corners);
                let read = detection.map(|detection| (corners, detection));
                (read, self.likelihood.learnt())
            }
        };
        let camera = learnt.map_or(camera, |learnt| learnt.camera);
        Ok(read.map(|(corners, detection)| Shown {
            pose: meter.pose(&frame, &corners, detection.bits, &camera),
            corners,
            detection,
        }))
    }

    /// What a receiver makes of a frame that it has seen none before, and what it learns of the camera.
    fn search(&self, camera: Camera, frame: &Frame) -> anyhow::Result<(Read, Option<Learnt>)> {
        let room = FrameSearch::<Box<SearchMemory>>::bytes(frame.width(), frame.height());
        let search = FrameSearch::with_history(Box::<SearchMemory>::default(), vec![0; room]);
        let settings = ReceiverSettings {
            camera,
            method: self.method,
            ..ReceiverSettings::default()
        };
        let memory = Box::<ReceiverMemory<SEARCH_PIXELS>>::default();
        let mut receiver = Receiver::new(settings, memory, search.thorough())?;
        let reading = receiver.frame(0, frame).reading;
        let read = reading
            .map(|Reading { corners, detection }| (corners, detection))
            .map_err(|why| why.to_string());
        Ok((read, receiver.learnt()))
    }

    fn detect(&mut self, frame: &Frame, corners: &Corners) -> Result<Detection, String> {
        let why = |error: &dyn std::error::Error| error.to_string();
        let features = Features::measure(frame, &self.map).map_err(|error| why(&error))?;
        check_white(&features).map_err(|error| why(&error))?;
        match &self.method {
            Method::Features(detector) => detector.detect(&features),
            Method::MaximumLikelihood => self.likelihood.detect(frame, corners),
        }
        .map_err(|error| why(&error))
    }
}

fn report(
    path: &Path,
    read: Result<Shown, String>,
    with_pose: bool,
    shared: &Shared,
) -> anyhow::Result<()> {
    let shown = match read {
        Ok(shown) => shown,
        Err(why) if shared.json => {
            return output::json(&Report {
                file: path,
                found: false,
                bits: None,
                centre_px: None,
                pitch_px: None,
                confidence: None,
                why: Some(why),
                pose: None,
            });
        }
        Err(why) => return line(&format!("{}: no panel: {why}", path.display())),
    };
    let Shown {
        corners,
        detection,
        pose,
    } = shown;
    if shared.json {
        return output::json(&Report {
            file: path,
            found: true,
            bits: Some(detection.bits.to_string()),
            centre_px: Some(corners.centre_px()),
            pitch_px: Some(corners.pitch_px()),
            confidence: Some(detection.confidence),
            why: None,
            pose: Some(pose::as_json(&pose)),
        });
    }
    let [x, y] = corners.centre_px();
    line(&format!(
        "{}: {}, panel at ({x:.2}, {y:.2}) px, LEDs {:.2} px apart, confidence {:.4}",
        path.display(),
        detection.bits,
        corners.pitch_px(),
        detection.confidence
    ))?;
    if with_pose {
        line(&format!("{}: {}", path.display(), pose::as_text(&pose)))?;
    }
    Ok(())
}
