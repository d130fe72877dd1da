//! Decodes the messages of a film or a camera frame by frame, as `vocc receive` does.

use std::io::Read;

use link::camera::Encoding;
use reception::bytes::hex_if_no_text;
use reception::colour::Channel;
use reception::keys::Trust;
use reception::signers::{Delivery, Signers};
use reception::stream::{SIDE_MAX, Stream};
use reception::{Message, PanelEvent, PanelReport, Reception, ReceptionSettings, Stamp, USUAL_FPS, learnt};
use rx_pipeline::camera::CameraEstimate;
use rx_pipeline::frame::Frame;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::decode::brightest;
use crate::fault::Fault;

/// The format of a frame's bytes.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Red, green, blue and opacity of each pixel.
    Rgba,
    /// Grey levels.
    Grey,
    /// A frame of the opened y4m film, with the line before it.
    Y4m,
}

/// A reception with the messages so far.
pub struct Film {
    reception: Reception,
    size: (usize, usize),
    messages: Vec<Value>,
    signers: Signers,
    read: u64,
    frames: u64,
    next: u64,
    /// The header line of a y4m film.
    header: Option<Vec<u8>>,
    grey: Vec<u8>,
}

/// The properties in the header of a y4m film, for the page.
pub fn y4m(header: &[u8]) -> Result<Value, Fault> {
    let line = [header, b"\n"].concat();
    let stream = Stream::open(line.as_slice(), None, Channel::Brightest)?;
    let (width, height) = stream.size();
    Ok(json!({ "width": width, "height": height, "fps": stream.rate(), "frame_bytes": stream.frame_bytes() }))
}

impl Film {
    /// A film with frames of a size; the symbol rate is searched for if it is not configured. Signatures are checked with the keys.
    pub fn new(
        (width, height): (usize, usize),
        fps: Option<f32>,
        symbol_rate: Option<f32>,
        header: Option<Vec<u8>>,
        trust: Trust,
    ) -> Result<Self, Fault> {
        let sides = 1..=SIDE_MAX;
        for (what, side) in [("the frame's width", width), ("the frame's height", height)] {
            if !sides.contains(&side) {
                return Err(Fault::Range {
                    what,
                    value: side as f64,
                    allowed: "frames of 1 × 1 to 8192 × 8192 pixels are read: scale or cut it",
                });
            }
        }
        let fps = fps.unwrap_or(USUAL_FPS);
        if !(fps > 0.0 && fps.is_finite()) {
            return Err(Fault::Range {
                what: "the number of frames a second",
                value: fps.into(),
                allowed: "give one above 0",
            });
        }
        let settings = ReceptionSettings {
            fps,
            symbol_rate_hz: symbol_rate,
            ..ReceptionSettings::default()
        };
        Ok(Self {
            reception: Reception::new(settings)?,
            size: (width, height),
            messages: Vec::new(),
            signers: Signers::new(trust, false),
            read: 0,
            frames: 0,
            next: 0,
            header,
            grey: Vec::new(),
        })
    }

    /// The trusted keys with the counters seen so far.
    pub fn trust(&self) -> &Trust {
        self.signers.trust()
    }

    /// Processes frame `number`, taken `late` frame periods after its time.
    pub fn take(&mut self, number: u64, late: f64, format: Format, bytes: &[u8]) -> Result<Value, Fault> {
        if number < self.next {
            return Err(Fault::Range {
                what: "the frame's number",
                value: number as f64,
                allowed: "numbers rise from frame to frame: start again",
            });
        }
        if !late.is_finite() {
            return Err(Fault::Range {
                what: "its delay in frames",
                value: late,
                allowed: "give a number",
            });
        }
        self.fill(format, bytes)?;
        self.next = number.saturating_add(1);
        self.frames += 1;
        let (width, height) = self.size;
        let frame = Frame::new(&self.grey, width, height)?;
        let no_lens = Err(String::new());
        let reports = self.reception.frame(Stamp { number, late }, &frame, &no_lens, &mut ())?;
        let before = self.messages.len();
        let (mut panels, mut proofs) = (Vec::new(), Vec::new());
        for report in &reports {
            for event in &report.events {
                self.event(event, &mut proofs);
            }
            self.read += u64::from(report.reading.is_ok());
            panels.push(panel_json(report));
        }
        Ok(json!({
            "frame": number, "size_px": [width, height], "panels": panels, "symbol_rate_hz": self.reception.symbol_rate_hz(),
            "camera": self.reception.learnt().map(learnt::as_json), "messages": self.messages[before..], "proofs": proofs,
        }))
    }

    /// The summary of all frames.
    pub fn end(&mut self) -> Result<Value, Fault> {
        let mut proofs = Vec::new();
        for (_, event) in self.reception.finish() {
            self.event(&event, &mut proofs);
        }
        let camera = self.reception.learnt();
        let advice = match self.messages.is_empty() {
            true => self.reception.advice(false),
            false => Vec::new(),
        };
        Ok(json!({
            "messages": self.messages, "proofs": proofs, "read": self.read, "frames": self.frames, "advice": advice,
            "camera": camera.map(learnt::as_json), "camera_text": camera.map(learnt::as_text),
            "camera_toml": camera.map(file_of).transpose()?,
        }))
    }

    /// Adds a message to the list, or the verdict on an earlier one to `proofs`.
    fn event(&mut self, event: &PanelEvent, proofs: &mut Vec<Value>) {
        match self.signers.delivery(0, event) {
            Some(Delivery::Message(message, verdict)) => {
                let mut told = as_json(&message);
                if self.trust().is_checking() {
                    self.trust().add_json(&mut told, &verdict);
                }
                self.messages.push(told);
            }
            Some(Delivery::Proof(data, verdict)) => {
                let mut told = text_json(&data);
                self.trust().add_json(&mut told, &verdict);
                proofs.push(told);
            }
            Some(Delivery::Withheld) | None => {}
        }
    }

    /// Converts the frame to grey levels.
    fn fill(&mut self, format: Format, bytes: &[u8]) -> Result<(), Fault> {
        let (width, height) = self.size;
        match format {
            Format::Rgba => return brightest(bytes, self.size, &mut self.grey),
            Format::Grey if bytes.len() == width * height => {
                self.grey.clear();
                self.grey.extend_from_slice(bytes);
            }
            Format::Grey => {
                return Err(Fault::Pixels {
                    bytes: bytes.len(),
                    wanted: width * height,
                    width,
                    height,
                });
            }
            Format::Y4m => {
                let header = self.header.as_deref().ok_or(Fault::NotBegun("open a film"))?;
                let film = header.chain(b"\n".as_slice()).chain(bytes);
                let mut stream = Stream::open(film, None, Channel::Brightest)?;
                let frame = stream.next_frame()?.ok_or(Fault::NoFrame)?;
                self.grey.clear();
                self.grey.extend_from_slice(frame);
            }
        }
        Ok(())
    }
}

/// The learnt keys of a camera's file.
#[derive(Serialize)]
struct CameraFile {
    encoding: Encoding,
    black_grey: f32,
    blur_sigma_px: f32,
    blur_aspect: f32,
    read_noise_e: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    line_delay_exposures: Option<f32>,
}

/// The learnt camera as a file for `vocc --camera`.
fn file_of(learnt: &CameraEstimate) -> Result<String, Fault> {
    let camera = learnt.camera.clamped();
    let file = CameraFile {
        encoding: camera.encoding,
        black_grey: camera.black_grey,
        blur_sigma_px: camera.blur_sigma_px,
        blur_aspect: camera.blur_aspect,
        read_noise_e: camera.read_noise_e,
        // A delay of 0 is left out, because only panels of one size have shown it.
        line_delay_exposures: learnt.line_delay.filter(|&delay| delay != 0.0),
    };
    let keys = toml::to_string(&file)?;
    Ok(format!("# {}\n{keys}", learnt::as_text(learnt)))
}

/// A panel in a frame, with the keys of the events of `vocc receive --view`.
fn panel_json(report: &PanelReport) -> Value {
    let reading = match &report.reading {
        Ok(reading) => reading,
        Err(loss) => return json!({ "panel": report.panel, "why": loss.to_string() }),
    };
    let (corners, detection) = (&reading.corners, &reading.detection);
    json!({
        "panel": report.panel, "bits": detection.bits.to_string(), "confidence": detection.confidence, "symbol": report.symbol,
        "corners_px": corners.points(), "pitch_px": corners.pitch_px(),
        "orientation": report.orientation.map(|orientation| orientation.to_string()),
    })
}

/// A message with the keys of `vocc receive --json`.
fn text_json(data: &[u8]) -> Value {
    json!({ "panel": 0, "message": String::from_utf8_lossy(data), "message_hex": hex_if_no_text(data) })
}

fn as_json(message: &Message) -> Value {
    let mut told = text_json(&message.data);
    told["first_frame"] = message.first_frame.into();
    told["last_frame"] = message.last_frame.into();
    told["corrected_bits"] = message.corrected_bits.into();
    told
}

/// The keys in the page's field, with the counters that `earlier` has seen of them. Without any, signatures are not checked.
pub fn trust(keys: &str, earlier: Option<&Trust>) -> Result<Trust, Fault> {
    if keys.trim().is_empty() {
        return Ok(Trust::default());
    }
    let mut trust = Trust::parse(keys, "the field of public keys")?;
    if let Some(earlier) = earlier {
        trust.remember(earlier);
    }
    Ok(trust)
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::fec::Code;
    use link::framing::{Framer, SignedFramer};
    use link::panel::PanelFrame;
    use link::signing::SecretKey;
    use reception::keys::NamedKey;
    use sim::accuracy::Level;
    use sim::renderer::Renderer;
    use sim::renderer::canvas::Canvas;
    use sim::scene::Scene;

    /// Frames of a panel that shows a message, one symbol per frame.
    fn film(text: &str) -> (usize, usize, Vec<Vec<u8>>) {
        let mut framer = Framer::new(text.as_bytes(), Code::for_length(text.len()), false).unwrap();
        film_of(3 * framer.panels_per_repeat(), || framer.next_panel())
    }

    /// The same, signed.
    fn signed_film(text: &str, key: &SecretKey, counter: u32) -> (usize, usize, Vec<Vec<u8>>) {
        let signature = key.sign(text.as_bytes(), counter);
        let mut framer = SignedFramer::new(text.as_bytes(), Code::for_length(text.len()), false, signature).unwrap();
        film_of(2 * framer.panels_per_repeat(), || framer.next_panel())
    }

    fn film_of(panels: u32, mut next_panel: impl FnMut() -> PanelFrame) -> (usize, usize, Vec<Vec<u8>>) {
        let scene = Scene::load("paper", &[]).unwrap();
        let renderer = Renderer::new(&scene, Level::Fast).unwrap();
        let region = renderer.surroundings(0);
        let frames = (0..panels).map(|frame| {
            let shown = renderer.shown(1, frame.into(), Some(next_panel()));
            let mut canvas = Canvas::<f32>::new(region);
            renderer.draw(&renderer.moment(1, 0), &shown, &mut canvas);
            let mut grey = vec![0; region.width * region.height];
            renderer.read_out(1, frame.into(), &canvas, &mut grey);
            grey
        });
        (region.width, region.height, frames.collect())
    }

    #[test]
    fn a_message_comes_out_of_each_kind_of_frames() {
        let (width, height, frames) = film("Ice");
        let header = format!("YUV4MPEG2 W{width} H{height} F100:1 Cmono").into_bytes();
        assert_eq!(y4m(&header).unwrap()["frame_bytes"], width * height);
        for format in [Format::Grey, Format::Rgba, Format::Y4m] {
            let mut receiving = Film::new((width, height), Some(100.0), Some(100.0), Some(header.clone()), Trust::default()).unwrap();
            for (number, grey) in (0..).zip(&frames) {
                let bytes = match format {
                    Format::Grey => grey.clone(),
                    Format::Rgba => grey.iter().flat_map(|&grey| [grey, grey, grey, 255]).collect(),
                    Format::Y4m => [b"FRAME\n".as_slice(), grey].concat(),
                };
                receiving.take(number, 0.0, format, &bytes).unwrap();
            }
            let end = receiving.end().unwrap();
            assert_eq!(end["messages"][0]["message"], "Ice", "{format:?}: {end}");
            let file = end["camera_toml"].as_str().unwrap();
            assert!(file.starts_with("# camera as learnt") && file.contains("blur_sigma_px = "));
        }
    }

    /// The verdicts on the messages of a film, and the keys afterwards.
    fn proofs((width, height, frames): (usize, usize, Vec<Vec<u8>>), trust: Trust) -> (Vec<Value>, Film) {
        let mut receiving = Film::new((width, height), Some(100.0), Some(100.0), None, trust).unwrap();
        let mut proofs = Vec::new();
        for (number, grey) in (0..).zip(&frames) {
            let told = receiving.take(number, 0.0, Format::Grey, grey).unwrap();
            proofs.extend(told["proofs"].as_array().unwrap().clone());
        }
        proofs.extend(receiving.end().unwrap()["proofs"].as_array().unwrap().clone());
        (proofs, receiving)
    }

    #[test]
    fn a_signer_is_told_and_only_a_trusted_one_is_proven() {
        let [own, other] = [1, 2].map(|seed| SecretKey::from_seed([seed; 32]).unwrap());
        let id = own.public().id().to_string();
        let keys_of = |key: &SecretKey| {
            let (name, key) = ("truck 12".into(), key.public());
            NamedKey { name, key }.to_toml().unwrap()
        };
        let keys = keys_of(&own);
        let told = |verdict: &str, name: Value| {
            let (signer, counter) = (&id, 41);
            json!([{
                "panel": 0, "message": "Ice", "message_hex": null,
                "verdict": verdict, "signer": signer, "signer_name": name, "counter": counter,
            }])
        };
        let signed = || signed_film("Ice", &own, 41);
        let (first, receiving) = proofs(signed(), trust(&keys, None).unwrap());
        assert_eq!(json!(first), told("proven", "truck 12".into()));
        assert_eq!(receiving.messages[0]["verdict"], "unproven");
        // The counters stay when another key is added.
        let both = keys.clone() + &keys_of(&other);
        let (again, _) = proofs(signed(), trust(&both, Some(receiving.trust())).unwrap());
        assert_eq!(json!(again), told("replayed", "truck 12".into()));
        let (unknown, _) = proofs(signed(), trust(&keys_of(&other), None).unwrap());
        assert_eq!(json!(unknown), told("unknown", Value::Null));

        let (unchecked, receiving) = proofs(signed(), trust(" ", None).unwrap());
        assert_eq!(json!(unchecked), told("unchecked", Value::Null));
        assert_eq!(receiving.messages[0].get("verdict"), None);
        let (unsigned, _) = proofs(film("Ice"), Trust::default());
        assert_eq!(
            json!(unsigned),
            json!([{ "panel": 0, "message": "Ice", "message_hex": null, "verdict": "unsigned" }])
        );

        for (keys, words) in [
            ("x", "the field of public keys holds no public keys"),
            (&keys.repeat(2), "have the same id"),
        ] {
            let refused = trust(keys, None).err().unwrap().to_string();
            assert!(refused.contains(words), "{refused}");
        }
    }

    #[test]
    fn a_film_without_a_panel_gives_advice() {
        let mut receiving = Film::new((64, 48), None, None, None, Trust::default()).unwrap();
        for number in 0..5 {
            let told = receiving.take(number, 0.0, Format::Grey, &[90; 64 * 48]).unwrap();
            assert!(told["panels"][0]["why"].is_string());
        }
        let end = receiving.end().unwrap();
        assert_eq!(end["read"], 0);
        assert!(end["advice"].as_array().unwrap().len() > 1, "{end}");
        assert!(receiving.take(2, 0.0, Format::Grey, &[90; 64 * 48]).is_err());
        assert!(receiving.take(9, 0.0, Format::Grey, &[90; 5]).is_err());
        assert!(receiving.take(9, 0.0, Format::Y4m, &[90; 5]).is_err());
    }

    #[test]
    fn sizes_and_rates_that_are_none_are_refused() {
        for (size, fps) in [((0, 5), 30.0), ((9000, 5), 30.0), ((5, 5), 0.0), ((5, 5), f32::NAN)] {
            assert!(Film::new(size, Some(fps), None, None, Trust::default()).is_err());
        }
        assert!(Film::new((64, 48), Some(30.0), Some(1e9), None, Trust::default()).is_err());
        assert!(y4m(b"YUV4MPEG2 W9").is_err() && y4m(b"RIFF").is_err());
    }
}
