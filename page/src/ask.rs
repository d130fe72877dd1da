//! Requests and answers.

use serde::Deserialize;
use serde_json::{Value, json};
use sim::accuracy::Level;
use sim::scene::{PRESETS, Preset, Scene};
use studies::detectors::DetectorChoice;

use crate::compare;
use crate::count::Count;
use crate::curve::{self, Curve, Measure};
use crate::decode;
use crate::explore::{Explore, FrameReadings};
use crate::fault::Fault;
use crate::receive::{self, Film, Format};
use crate::scene_text::SceneText;
use crate::send::Sending;

/// Maximum number of frames per request, because a worker that counts receives no messages meanwhile.
const FRAMES_MAX: u64 = 1_000_000;
/// Size in bytes above which memory is freed after use.
pub(crate) const LARGE: usize = 1 << 24;

/// All requests of the page.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
enum Request {
    Presets,
    Open {
        scene: SceneText,
        #[serde(default)]
        level: Level,
        #[serde(default = "one")]
        seed: u64,
    },
    Compare {
        frame: u64,
        show: String,
    },
    Costs,
    Picture {
        frame: u64,
    },
    Count {
        scene: SceneText,
        #[serde(default)]
        level: Level,
        detector: DetectorChoice,
        #[serde(default = "one")]
        seed: u64,
    },
    CountOn {
        frames: u64,
    },
    Curve {
        scene: SceneText,
        #[serde(default)]
        level: Level,
        measure: Measure,
        detector: DetectorChoice,
        #[serde(default = "one")]
        seed: u64,
        points: usize,
    },
    CurveOn {
        frames: u64,
    },
    Optimum {
        scene: SceneText,
        measure: Measure,
        detector: DetectorChoice,
        frames: u64,
        #[serde(default = "one")]
        seed: u64,
    },
    Send {
        scene: SceneText,
        #[serde(default)]
        level: Level,
        message: String,
        detector: DetectorChoice,
        #[serde(default = "one")]
        seed: u64,
    },
    SendOn,
    SendEnd,
    Decode,
    DecodeRgba {
        width: usize,
        height: usize,
    },
    Y4mBegin,
    Receive {
        width: usize,
        height: usize,
        fps: Option<f32>,
        symbol_rate: Option<f32>,
        #[serde(default)]
        is_y4m: bool,
        /// The text of a file of trusted public keys.
        #[serde(default)]
        keys: String,
    },
    Take {
        number: u64,
        #[serde(default)]
        late: f64,
        format: Format,
    },
    ReceiveEnd,
}

fn one() -> u64 {
    1
}

/// The state of the page.
#[derive(Default)]
pub struct Page {
    explore: Option<Box<Explore>>,
    count: Option<Box<Count>>,
    curve: Option<Curve>,
    sending: Option<Box<Sending>>,
    film: Option<Box<Film>>,
    /// The header of the last y4m film.
    header: Option<Vec<u8>>,
    out: Vec<u8>,
}

impl Page {
    /// Answers a request. Both are JSON; pictures are passed as bytes.
    ///
    /// # Errors
    /// A sentence for the user: see [`Fault`].
    pub fn ask(&mut self, request: &str, bytes: &[u8]) -> Result<String, Fault> {
        self.out.clear();
        // One large picture does not keep its memory forever.
        if self.out.capacity() > LARGE {
            self.out = Vec::new();
        }
        let request = serde_json::from_str(request)?;
        Ok(self.answer(request, bytes)?.to_string())
    }

    /// Draws and reads frame `frame` of the open scene; [`Page::sight`] has the readings, [`Page::grey`] the picture.
    ///
    /// # Errors
    /// If no scene is open.
    pub fn frame(&mut self, frame: u64) -> Result<(), Fault> {
        self.open()?.frame(frame);
        Ok(())
    }

    /// The readings of the last frame.
    pub fn sight(&self) -> &FrameReadings {
        static NOTHING: FrameReadings = FrameReadings::NOTHING;
        self.explore.as_ref().map_or(&NOTHING, |explore| &explore.sight)
    }

    /// The last frame's picture: the surroundings of the panel.
    pub fn grey(&self) -> &[u8] {
        self.explore.as_ref().map_or(&[], |explore| &explore.grey)
    }

    /// The bytes of the last answer.
    pub fn out(&self) -> &[u8] {
        &self.out
    }

    fn open(&mut self) -> Result<&mut Explore, Fault> {
        self.explore.as_deref_mut().ok_or(Fault::NotBegun("open a scene"))
    }

    fn answer(&mut self, request: Request, bytes: &[u8]) -> Result<Value, Fault> {
        match request {
            Request::Presets => presets(),
            Request::Open { scene, level, seed } => {
                let explore = Explore::new(&scene.scene()?, level, seed)?;
                let opened = explore.opened()?;
                self.explore = Some(Box::new(explore));
                Ok(opened)
            }
            Request::Compare { frame, show } => {
                let explore = self.explore.as_ref().ok_or(Fault::NotBegun("open a scene"))?;
                compare::compare(explore, frame, &show, &mut self.out)
            }
            Request::Costs => Ok(compare::costs(self.open()?)),
            Request::Picture { frame } => self.picture(frame),
            Request::Count {
                scene,
                level,
                detector,
                seed,
            } => {
                self.count = Some(Box::new(Count::new(&scene.scene()?, detector, for_many(level)?, seed, false)?));
                Ok(json!({}))
            }
            Request::CountOn { frames } => {
                let count = self.count.as_mut().ok_or(Fault::NotBegun("count"))?;
                let began = crate::clock();
                count.add(few(frames)?)?;
                let mut told = count.as_json();
                told["ms"] = json!((crate::clock() - began).as_secs_f64() * 1e3);
                Ok(told)
            }
            Request::Curve {
                scene,
                level,
                measure,
                detector,
                seed,
                points,
            } => {
                self.curve = Some(Curve::new(&scene.scene()?, measure, detector, for_many(level)?, seed, points)?);
                Ok(json!({}))
            }
            Request::CurveOn { frames } => {
                let curve = self.curve.as_mut().ok_or(Fault::NotBegun("begin a curve"))?;
                curve.add(few(frames)?)?;
                Ok(curve.as_json())
            }
            Request::Optimum {
                scene,
                measure,
                detector,
                frames,
                seed,
            } => curve::best(&scene.scene()?, detector, measure, few(frames)?, seed),
            Request::Send {
                scene,
                level,
                message,
                detector,
                seed,
            } => {
                let sending = Sending::new(&scene.scene()?, &message, detector, for_many(level)?, seed)?;
                let begun = sending.begun();
                self.sending = Some(Box::new(sending));
                begun
            }
            Request::SendOn => {
                let sending = self.sending.as_mut().ok_or(Fault::NotBegun("send"))?;
                sending.frame(&mut self.out)
            }
            Request::SendEnd => {
                let sending = self.sending.as_mut().ok_or(Fault::NotBegun("send"))?;
                Ok(sending.end())
            }
            Request::Decode => decode::file(bytes, &mut self.out),
            Request::DecodeRgba { width, height } => decode::rgba(bytes, (width, height), &mut self.out),
            Request::Y4mBegin => {
                let told = receive::y4m(bytes)?;
                self.header = Some(bytes.to_vec());
                Ok(told)
            }
            Request::Receive {
                width,
                height,
                fps,
                symbol_rate,
                is_y4m,
                keys,
            } => {
                let header = self.header.take().filter(|_| is_y4m);
                let trust = receive::trust(&keys, self.film.as_deref().map(Film::trust))?;
                self.film = Some(Box::new(Film::new((width, height), fps, symbol_rate, header, trust)?));
                Ok(json!({}))
            }
            Request::Take { number, late, format } => self.film()?.take(number, late, format, bytes),
            Request::ReceiveEnd => self.film()?.end(),
        }
    }

    fn film(&mut self) -> Result<&mut Film, Fault> {
        self.film.as_deref_mut().ok_or(Fault::NotBegun("open a film"))
    }

    /// The whole sensor's frame of the open scene, as `vocc render` draws it.
    fn picture(&mut self, frame: u64) -> Result<Value, Fault> {
        let explore = self.explore.as_ref().ok_or(Fault::NotBegun("open a scene"))?;
        let (renderer, seed) = (&explore.renderer, explore.seed);
        let (moment, shown) = (renderer.moment(seed, frame), renderer.shown(seed, frame, None));
        let sensor = renderer.sensor();
        let mut image = renderer.linear_image(sensor);
        renderer.draw_frame(seed, frame, &shown, &mut image);
        self.out.resize(sensor.width * sensor.height, 0);
        renderer.read_frame(seed, frame, &image, &mut self.out);
        Ok(json!({
            "width": sensor.width, "height": sensor.height, "corners_px": renderer.corner_leds_in(sensor, &moment),
            "sent": renderer.truth(0, &moment, &shown[0]).to_string(),
        }))
    }
}

/// The choices: scenes, and the camera of each.
fn presets() -> Result<Value, Fault> {
    let told = |preset: &Preset| {
        let scene = Scene::load(preset.name, &[])?;
        Ok(json!({
            "name": preset.name, "summary": preset.summary, "camera": scene.camera, "symbol_rate_hz": scene.link.symbol_rate_hz,
        }))
    };
    let presets: Vec<Value> = PRESETS.iter().map(told).collect::<Result<_, Fault>>()?;
    Ok(json!({ "presets": presets }))
}

/// A level for drawing many frames.
fn for_many(level: Level) -> Result<Level, Fault> {
    match level {
        Level::Reference => Err(Fault::Reference),
        level => Ok(level),
    }
}

/// A number of frames for which a page waits.
fn few(frames: u64) -> Result<u64, Fault> {
    match frames {
        1..=FRAMES_MAX => Ok(frames),
        _ => Err(Fault::Range {
            what: "the number of frames",
            value: frames as f64,
            allowed: "give 1 to 1 000 000",
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_a_sentence() {
        let mut page = Page::default();
        for request in [
            "",
            "{}",
            r#"{"do": "dance"}"#,
            r#"{"do": "costs"}"#,
            r#"{"do": "count_on", "frames": 5}"#,
            r#"{"do": "send_on"}"#,
            r#"{"do": "take", "number": 0, "format": "grey"}"#,
            r#"{"do": "open", "scene": {"name": "noon"}}"#,
            r#"{"do": "open", "scene": {"name": "day", "set": ["pose.distance_m=0"]}}"#,
            r#"{"do": "open", "scene": {"name": "mine", "toml": "[camera"}}"#,
            r#"{"do": "open", "scene": {"name": "day", "set": ["ambient.background_image=\"road.png\""]}}"#,
            r#"{"do": "send", "scene": {"name": "day"}, "message": "", "detector": "best"}"#,
            r#"{"do": "send", "scene": {"name": "day"}, "message": "Ice", "detector": "genie"}"#,
            r#"{"do": "send", "scene": {"name": "day"}, "message": "Ice", "detector": "best", "level": "reference"}"#,
            r#"{"do": "count", "scene": {"name": "day"}, "detector": "best", "level": "reference"}"#,
            r#"{"do": "decode"}"#,
        ] {
            let fault = page.ask(request, b"nothing").expect_err(request).to_string();
            assert!(fault.len() > 10, "{request}: {fault}");
        }
        assert!(page.frame(0).is_err());
    }

    #[test]
    fn the_whole_picture_holds_what_is_explored() {
        let mut page = Page::default();
        let open = r#"{"do": "open", "scene": {"name": "paper", "set": ["camera.width_px=320", "camera.height_px=240"]}, "seed": 3}"#;
        let opened: Value = serde_json::from_str(&page.ask(open, &[]).unwrap()).unwrap();
        page.frame(5).unwrap();
        let grey = page.grey().to_vec();
        page.ask(r#"{"do": "picture", "frame": 5}"#, &[]).unwrap();
        let place = |key: &str| opened["region"][key].as_u64().unwrap() as usize;
        let rows = page.out().chunks_exact(320).skip(place("y")).take(place("height"));
        let part: Vec<u8> = rows.flat_map(|row| row[place("x")..][..place("width")].to_vec()).collect();
        assert_eq!(part, grey);
    }
}
