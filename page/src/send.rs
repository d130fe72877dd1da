//! Sends a message over the simulated road, frame by frame.

use link::fec::Code;
use link::framing::Framer;
use link::waveform::Waveform;
use reception::bytes::hex_if_no_text;
use serde_json::{Value, json};
use sim::accuracy::Level;
use sim::renderer::canvas::Region;
use sim::road::{LinkSettings, ReceivedMessage, Road};
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::flicker::{Flicker, panels};
use studies::monte_carlo::receiving_method;
use studies::signalling::Trial;
use studies::statistics::FrameErrors;

use crate::explore::Place;
use crate::fault::Fault;
use crate::scene_text::Settings;

/// Number of repeats after which a message is given up.
const REPEATS: f64 = 2.0;

/// A transmitter, a road and a receiver.
pub struct Sending {
    road: Road,
    scene: Scene,
    message: Vec<u8>,
    next: u64,
    /// The number of frames after which the message is given up.
    frames: u64,
    /// Panels of one repeat.
    panels: u32,
    /// The visible region of each frame.
    region: Region,
    seed: u64,
    waveform: Waveform,
    errors: FrameErrors,
    unread: u64,
    /// Frames whose exposure contains two symbols.
    straddled: u64,
    /// Why there are no more frames, if the film has ended.
    ended: Option<String>,
    /// The reason of the last frame that could not be read.
    last_loss: Option<String>,
    delivered: Option<Value>,
}

impl Sending {
    /// Sets up transmitter, road and receiver.
    pub fn new(scene: &Scene, message: &str, detector: DetectorChoice, level: Level, seed: u64) -> Result<Self, Fault> {
        let message = message.as_bytes().to_vec();
        let framer = Framer::new(&message, Code::for_length(message.len()), false);
        let panels = framer.map_err(sim::road::RoadError::from)?.panels_per_repeat();
        let settings = LinkSettings {
            level,
            ..LinkSettings::new(message.clone(), receiving_method(scene, detector, seed, level)?, seed)
        };
        let road = Road::new(scene, &settings)?;
        let waveform = road.renderer().view().waveform;
        let seconds = REPEATS * f64::from(panels) / scene.link.symbol_rate_hz;
        let frames = (seconds * scene.camera.frame_rate_hz).ceil() as u64 + 1;
        Ok(Self {
            region: road.renderer().surroundings(0),
            frames: if waveform.is_still() {
                frames
            } else {
                frames.max(Trial::CARRIER_FRAMES)
            },
            waveform,
            scene: scene.clone(),
            seed,
            road,
            message,
            next: 0,
            panels,
            errors: FrameErrors::default(),
            unread: 0,
            straddled: 0,
            ended: None,
            last_loss: None,
            delivered: None,
        })
    }

    /// The description before the first frame.
    pub fn begun(&self) -> Result<Value, Fault> {
        let renderer = self.road.renderer();
        let mut told = serde_json::to_value(Settings::of(renderer.view())?)?;
        if let Value::Object(told) = &mut told {
            told.insert("frames".into(), self.frames.into());
            told.insert("panels".into(), self.panels.into());
            told.insert("frame_rate_hz".into(), self.scene.camera.frame_rate_hz.into());
            told.insert("symbol_rate_hz".into(), self.scene.link.symbol_rate_hz.into());
            told.insert("carrier".into(), self.carrier()?);
            told.insert("region".into(), serde_json::to_value(Place::from(self.region))?);
            told.insert(
                "corners_px".into(),
                json!(renderer.corner_leds_in(self.region, &renderer.moment(self.seed, 0))),
            );
        }
        Ok(told)
    }

    /// The carrier's frequency; the message's greatest modulation relative to the limit of low risk; and the worst LED's other measures,
    /// named as in `vocc transmit --flicker --json`. Null for still panels.
    fn carrier(&self) -> Result<Value, Fault> {
        if self.waveform.is_still() {
            return Ok(Value::Null);
        }
        let rate_hz = self.scene.link.symbol_rate_hz;
        let panels = panels(Some(&self.message)).map_err(sim::road::RoadError::from)?;
        let light = Flicker::with_waveform(&panels, self.waveform);
        let measures = light.worst_led_measures(rate_hz);
        Ok(json!({
            "hz": self.waveform.carrier_hz(rate_hz).ok(),
            "low_risk_times": light.low_risk_times(rate_hz),
            "longest_period_s": measures.longest_period_s,
            "pst_lm": measures.short_term,
            "svm": measures.stroboscopic,
        }))
    }

    /// The next frame, with the surroundings of the panel.
    pub fn frame(&mut self, out: &mut Vec<u8>) -> Result<Value, Fault> {
        let frame = self.next;
        let sensor = self.road.renderer().sensor();
        let report = match self.road.frame(frame) {
            Ok(report) => report,
            // A panel that drives out of view ends the run, but the frames before remain valid.
            Err(why) if frame > 0 => {
                self.ended = Some(why.to_string());
                return Ok(json!({ "frame": frame, "ended": self.ended }));
            }
            Err(why) => return Err(why.into()),
        };
        self.next += 1;
        let Region { x, y, width, height } = self.region;
        out.clear();
        for row in report.grey.chunks_exact(sensor.width).skip(y).take(height) {
            out.extend_from_slice(&row[x..x + width]);
        }
        self.errors.push(report.bit_errors);
        self.straddled += u64::from(report.straddled);
        let why = report.read.as_ref().err().map(ToString::to_string);
        let corners = report
            .corners
            .map(|corners| corners.points().map(|[left, top]| [left - x as f32, top - y as f32]));
        let delivered = report.delivered.as_ref().map(|received| self::told(received, &self.message));
        let told = json!({
            "frame": frame, "sent": report.sent.to_string(), "read": report.read.ok().map(|bits| bits.to_string()), "why": why,
            "bit_errors": report.bit_errors, "straddled": report.straddled, "corners_px": corners, "delivered": delivered, "ended": null,
        });
        self.unread += u64::from(why.is_some());
        self.last_loss = why.or(self.last_loss.take());
        self.delivered = self.delivered.take().or(delivered);
        Ok(told)
    }

    /// The result.
    pub fn end(&mut self) -> Value {
        let last = self.road.finish();
        let last = last.map(|received| told(&received, &self.message));
        self.delivered = self.delivered.take().or(last);
        json!({
            "delivered": self.delivered, "frames": self.errors.frames(), "unread": self.unread, "bit_errors": self.errors.errors(),
            "bits": self.errors.bits(), "advice": self.advice(),
        })
    }

    /// Why no message arrived, and remedies.
    fn advice(&self) -> Vec<String> {
        if self.delivered.is_some() {
            return Vec::new();
        }
        let mut advice = Vec::new();
        if self.unread > 0 {
            advice.push(format!(
                "in {} of {} frames no panel was read; the last time since {}",
                self.unread,
                self.errors.frames(),
                self.last_loss.as_deref().unwrap_or_default()
            ));
        }
        // Frames that are read before the carrier is known may show complements.
        if !self.waveform.is_still() {
            advice.push("the carrier was not found: expose for at most half a cycle of it, or switch it off".into());
        } else if self.errors.errors() > 0 {
            advice.push(format!(
                "{} of {} bits were wrong: reduce the distance, or use a longer lens, a wider interval of LEDs or another L2A",
                self.errors.errors(),
                self.errors.bits()
            ));
        }
        if self.straddled > 0 {
            advice.push(format!(
                "{} frames caught two symbols: show fewer symbols a second, or expose for a shorter time",
                self.straddled
            ));
        }
        if let Some(why) = &self.ended {
            advice.push(format!("there were no more frames: {why}"));
        }
        if advice.is_empty() {
            advice.push(format!(
                "all bits were right, and symbols were missed: {} frames a second see {} symbols a second; show fewer, or film longer",
                self.scene.camera.frame_rate_hz, self.scene.link.symbol_rate_hz
            ));
        }
        advice
    }
}

fn told(received: &ReceivedMessage, sent: &[u8]) -> Value {
    json!({
        "message": String::from_utf8_lossy(&received.message), "message_hex": hex_if_no_text(&received.message),
        "is_right": received.message == sent,
        "first_frame": received.first_frame, "last_frame": received.last_frame, "corrected_bits": received.corrected_bits,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sending(set: &[&str]) -> Sending {
        let set: Vec<String> = set.iter().map(ToString::to_string).collect();
        let scene = Scene::load("day", &set).unwrap();
        Sending::new(&scene, "Ice", DetectorChoice::Best, Level::Fast, 1).unwrap()
    }

    fn run(sending: &mut Sending) -> Value {
        let mut out = Vec::new();
        for _ in 0..sending.frames {
            let told = sending.frame(&mut out).unwrap();
            if told["ended"].is_string() {
                break;
            }
        }
        sending.end()
    }

    const SMALL: [&str; 2] = ["camera.width_px=320", "camera.height_px=240"];

    #[test]
    fn a_message_arrives_and_the_same_bytes_as_were_sent() {
        let end = run(&mut sending(&[SMALL[0], SMALL[1], "pose.distance_m=40"]));
        assert_eq!(end["delivered"]["message"], "Ice");
        assert_eq!(end["delivered"]["is_right"], true);
        assert!(end["advice"].as_array().unwrap().is_empty());
    }

    #[test]
    fn a_carrier_s_frequency_and_flicker_are_known_before_the_first_frame() {
        let with = ["camera.exposure_s=0.00025", "link.carrier_cycles=16"];
        let mut sending = sending(&[SMALL[0], SMALL[1], with[0], with[1]]);
        let carrier = &sending.begun().unwrap()["carrier"];
        assert_eq!(carrier["hz"], 1440.0);
        for measure in ["low_risk_times", "pst_lm", "svm"] {
            let value = carrier[measure].as_f64().unwrap();
            assert!(value > 0.0 && value < 1.0, "{carrier}");
        }
        assert!(carrier["longest_period_s"].as_f64().unwrap() < 0.005);
        assert_eq!(run(&mut sending)["delivered"]["message"], "Ice");
    }

    #[test]
    fn where_nothing_arrives_there_is_advice() {
        let end = run(&mut sending(&[SMALL[0], SMALL[1], "pose.distance_m=150"]));
        assert!(end["delivered"].is_null());
        assert!(!end["advice"].as_array().unwrap().is_empty());
    }
}
