//! `vocc link`: a message over a simulated road.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::Context;
use link::fec::Code;
use link::framing::{Framer, SIGNATURE_PANELS};
use link::signing::{self, TrustedKey};
use reception::keys::OwnKey;
use serde::Serialize;
use sim::accuracy::Level;
use sim::l2a::{self, OtherWaveform};
use sim::plan::Plan;
use sim::road::{LinkSettings, ReceivedMessage, Road};
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::receiving_method;
use studies::statistics::FrameErrors;

use crate::camera::CameraArguments;
use crate::keys::SigningArguments;
use crate::options::{Message, SharedOptions, whole};
use crate::output::{self, Hex, Verdict, line, quoted};
use crate::outputs;
use crate::pictures;
use crate::progress::Progress;
use crate::stop::stop;

/// The rule by which bits are counted.
const COUNTS: &str = "\
Bits are raw, before error correction: 64 in each frame. In a frame that is not read, all On bits are wrong. With a carrier, an exposure \
shows the panel or its complement, and the receiver learns from many frames which. Bits are then counted up to the signs that the carrier \
gives the frame and its lines: a complement is right, and at most half of a read frame's bits are wrong. --json has \
them as bits, bit_errors, ber and ber_95.";

/// Arguments of `vocc link`.
#[derive(clap::Args)]
#[command(after_help = COUNTS)]
pub struct Arguments {
    /// A preset (`vocc scene` lists them) or a TOML file.
    #[arg(default_value = "paper")]
    scene: OsString,
    #[command(flatten)]
    message: Message,
    /// Number of frames. Default: enough for two repeats of the message.
    #[arg(long, value_parser = whole(1..=u64::MAX))]
    frames: Option<u64>,
    /// best, ml, kmeans, kmeans-raw, fisher, fisher-ngr or otsu.
    #[arg(long, default_value = "best")]
    detector: DetectorChoice,
    /// Save every frame in this folder, for `vocc receive`.
    #[arg(long, value_name = "DIR")]
    save: Option<PathBuf>,
    /// Rendering level: fine or fast.
    #[arg(long, default_value = "fine", value_parser = super::evaluate::single_precision)]
    level: Level,
    #[command(flatten)]
    hex: Hex,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    signing: SigningArguments,
}

/// The default message.
const MESSAGE: &str = "Braking hard: queue behind the bend, 200 m ahead";

#[derive(Serialize)]
struct Report<'a> {
    delivered: bool,
    message: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message_hex: Option<String>,
    sent: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    sent_hex: Option<String>,
    frames: u64,
    bits: u64,
    bit_errors: u64,
    ber: f64,
    ber_95: [f64; 2],
    first_frame: Option<u64>,
    last_frame: Option<u64>,
    corrected_bits: Option<u32>,
    /// The verdict on the signature, if the message is signed.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    signer: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    counter: Option<u32>,
    unread_frames: u64,
    straddled_frames: u64,
    l2a: f64,
    luminance_cd_m2: f64,
    duty: f64,
    exposure_s: f64,
    iso: f64,
    seed: u64,
    plan: &'a Plan,
}

/// How to send the message, besides the settings of the link.
#[derive(Default)]
struct Sending<'a> {
    frames: Option<u64>,
    save: Option<&'a Path>,
    hex: Hex,
    /// The signing key and counter.
    signing: Option<(OwnKey, u32)>,
}

impl Sending<'_> {
    /// The receiver's verdict; it trusts this key only.
    fn verdict(&self, road: &Road) -> Option<signing::Verdict> {
        let (key, _) = self.signing.as_ref()?;
        let mut trusted = [TrustedKey::new(key.public.key, None)];
        Some(match road.received_signature() {
            Some(read) => signing::verdict(&mut trusted, &read.message, &read.signature),
            None => signing::Verdict::Unproven,
        })
    }
}

/// Counts of the frames so far by outcome.
#[derive(Default)]
struct FrameCounts {
    errors: FrameErrors,
    unread: u64,
    straddled: u64,
}

/// The run without arguments: a short link on the paper's scene.
pub fn demonstrate(shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let scene = shared.scene("paper")?;
    let settings = settings(&scene, MESSAGE.into(), DetectorChoice::Best, Level::Fine, shared)?;
    send(&scene, &settings, &Sending::default(), shared)
}

/// Transmits, films, receives and reports.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let message = arguments.message.bytes()?.unwrap_or_else(|| MESSAGE.into());
    let scene = shared.scene(&arguments.scene)?;
    let settings = LinkSettings {
        camera: arguments.camera.camera_if_any()?.unwrap_or_default(),
        ..settings(&scene, message, arguments.detector, arguments.level, shared)?
    };
    let sending = Sending {
        frames: arguments.frames,
        save: arguments.save.as_deref(),
        hex: arguments.hex,
        signing: arguments.signing.key()?,
    };
    send(&scene, &settings, &sending, shared)
}

fn settings(
    scene: &Scene,
    message: Vec<u8>,
    detector: DetectorChoice,
    level: Level,
    shared: &SharedOptions,
) -> anyhow::Result<LinkSettings> {
    Ok(LinkSettings {
        level,
        ..LinkSettings::new(message, receiving_method(scene, detector, shared.seed, level)?, shared.seed)
    })
}

fn send(scene: &Scene, settings: &LinkSettings, sending: &Sending, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    if let Some(made_for) = l2a::waveform_of_table(scene)?
        && let Some(other) = OtherWaveform::if_any(made_for, scene.link.waveform()?)
    {
        output::tell(format_args!("vocc: {other}"));
    }
    let mut road = Road::new(scene, settings)?;
    if let Some((key, counter)) = &sending.signing {
        road.sign(settings, key.sign(&settings.message, *counter))?;
    }
    let frames = match sending.frames {
        Some(frames) => frames,
        None => frames_for(scene, &settings.message, sending.signing.is_some())?,
    };
    let save = sending.save;
    let _held = match save {
        Some(folder) => {
            std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
            outputs::check_recording(folder)?;
            outputs::hold(folder)?
        }
        None => None,
    };
    let stop = stop();
    let mut progress = Progress::new(frames, "frames");
    let mut counts = FrameCounts::default();
    let (mut received, mut saved, mut last_loss): (Option<ReceivedMessage>, Option<PathBuf>, Option<String>) = Default::default();
    let sensor = road.renderer().sensor();
    let (mut ended, mut unsaved) = (None, None);
    for frame in 0..frames {
        let report = match road.frame(frame) {
            Ok(report) => report,
            // A panel that drives out of view ends the run, but keeps the frames so far.
            Err(error) if frame > 0 => {
                ended = Some(format!("frame {frame}: {error}"));
                break;
            }
            Err(error) => return Err(error.into()),
        };
        if let Some(folder) = save.filter(|_| unsaved.is_none()) {
            let path = outputs::frame_in(folder, frame);
            let written = pictures::write_png(&path, report.grey, sensor.width, sensor.height);
            // The run can still report whether the message arrives.
            unsaved = written.err();
            if let Some(error) = &unsaved {
                progress.aside(|| {
                    output::tell(format_args!("vocc: {error:#}; continuing without frames"));
                });
            } else {
                saved.get_or_insert(path);
            }
        }
        if let Err(loss) = &report.read {
            counts.unread += 1;
            last_loss = Some(format!("frame {frame}: {loss}"));
        }
        counts.errors.push(report.bit_errors);
        counts.straddled += u64::from(report.straddled);
        received = received.or(report.delivered);
        progress.done(frame + 1);
        if stop.is_asked() {
            break;
        }
    }
    drop(progress);
    let received = received.or_else(|| road.finish());
    report(&road, settings, received.as_ref(), &counts, sending, shared)?;
    if let Some(why) = ended {
        output::tell(format_args!("the run ended early, {why}"));
    }
    if !shared.json {
        if let Some(loss) = last_loss {
            line(&format!("unread        the last one, {loss}"))?;
        }
        if let Some(path) = saved {
            line(&format!("saved         {}", path.display()))?;
        }
    }
    if let Some(error) = unsaved {
        return Err(error);
    }
    Ok(if received.is_some_and(|received| received.message == settings.message) {
        Verdict::Yes
    } else {
        Verdict::No
    })
}

/// Frames for two repeats of the message with its signatures, and one more for the end of the last symbol.
fn frames_for(scene: &Scene, message: &[u8], is_signed: bool) -> anyhow::Result<u64> {
    let signature = if is_signed { SIGNATURE_PANELS as u32 } else { 0 };
    let panels = Framer::new(message, Code::for_length(message.len()), false)?.panels_per_repeat() + signature;
    Ok((2.0 * f64::from(panels) * scene.camera.frame_rate_hz / scene.link.symbol_rate_hz).ceil() as u64 + 1)
}

fn report(
    road: &Road,
    settings: &LinkSettings,
    received: Option<&ReceivedMessage>,
    counts: &FrameCounts,
    sending: &Sending,
    shared: &SharedOptions,
) -> anyhow::Result<()> {
    let errors = &counts.errors;
    let dimming = road.transmitter().dimming().context("the transmitter has seen light")?;
    let exposure = road.renderer().view().exposure;
    let (hex, verdict) = (sending.hex, sending.verdict(road));
    let claim = verdict.and_then(|verdict| verdict.claim());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let report = Report {
        delivered: received.is_some_and(|received| received.message == settings.message),
        message: received.map(|received| text(&received.message)),
        message_hex: received.and_then(|received| hex.of(&received.message)),
        sent: text(&settings.message),
        sent_hex: hex.of(&settings.message),
        frames: errors.frames(),
        bits: errors.bits(),
        bit_errors: errors.errors(),
        ber: errors.rate(),
        ber_95: errors.interval_95(),
        first_frame: received.map(|received| received.first_frame),
        last_frame: received.map(|received| received.last_frame),
        corrected_bits: received.map(|received| received.corrected_bits),
        verdict: verdict.map(|verdict| verdict.name()),
        signer: claim.map(|(signer, _)| signer.to_string()),
        counter: claim.map(|(_, counter)| counter),
        unread_frames: counts.unread,
        straddled_frames: counts.straddled,
        l2a: dimming.l2a.to_num(),
        luminance_cd_m2: dimming.luminance_cd_m2.to_num(),
        duty: dimming.duty.to_num(),
        exposure_s: exposure.time_s,
        iso: exposure.iso,
        seed: settings.seed,
        plan: road.renderer().plan(),
    };
    if shared.json {
        return output::json(&report);
    }
    output::plan(report.plan)?;
    line(&format!(
        "transmitter   L2A {:.3}, {:.1} cd/m2, duty {:.4}",
        report.l2a, report.luminance_cd_m2, report.duty
    ))?;
    line(&format!(
        "camera        1/{:.0} s at ISO {:.0}",
        1.0 / report.exposure_s,
        report.iso
    ))?;
    line(&format!("sent          {}", quoted(&settings.message)))?;
    match received {
        Some(received) => line(&format!(
            "received      {} in frames {} to {}, {} bits corrected",
            quoted(&received.message),
            received.first_frame,
            received.last_frame,
            received.corrected_bits
        ))?,
        None => line("received      nothing: film longer (--frames), reduce the distance, or change the L2A")?,
    }
    if let Some(verdict) = verdict {
        line(&format!("signature     {verdict}"))?;
    }
    let carrier = road.renderer().view().waveform;
    let signs = if carrier.is_still() { "" } else { ", up to the carrier's signs" };
    line(&format!(
        "bit errors    {} of {} raw bits in {} frames{signs} ({} unread, {} across a symbol change)",
        report.bit_errors, report.bits, report.frames, report.unread_frames, report.straddled_frames
    ))?;
    line(&format!(
        "raw BER       {}",
        output::rate(report.bit_errors, report.bits, report.ber, report.ber_95)
    ))
}
