//! `vocc plan --camera`: advice on a transmitter for a camera.

use std::ffi::{OsStr, OsString};
use std::sync::{Mutex, PoisonError};

use anyhow::Context;
use link::fec::Code;
use link::waveform::SymbolTiming;
use serde::Serialize;
use sim::scene::{Camera, Scene};
use studies::signalling::{Advice, CarrierAdvice, DimmingBeat, NoCarrier, Search, SignallingError, Trial, TrialError, TrialOutcome};

use crate::options::{SharedOptions, whole};
use crate::output::{self, Verdict, line, shell_word};
use crate::progress::Progress;
use crate::stop::stop;

/// Default scene for a camera.
const SCENE: &str = "day";
const HEAD: &str = "symbols/s  code    delivered  net bit/s  s a message  raw errors  carrier/Hz";

/// Options of the advice for a camera.
#[derive(clap::Args)]
pub struct Options {
    /// Advise on a transmitter for this camera: symbol rate, code, expected net rate, and a carrier without visible flicker, if one
    /// works. A preset or a TOML file, whose `[camera]` replaces the scene's (default scene: day); --set camera.KEY=VALUE then changes it.
    #[arg(long, value_name = "CAMERA")]
    camera: Option<OsString>,
    /// Length of the test messages in bytes.
    #[arg(long, default_value_t = 48, requires = "camera", value_parser = clap::value_parser!(u16).range(1..=1024))]
    bytes: u16,
    /// Test messages per setting.
    #[arg(long, default_value_t = 8, requires = "camera", value_parser = whole(1..=10_000))]
    runs: u64,
}

#[derive(Serialize)]
struct Row {
    symbol_rate_hz: f64,
    /// Cycles of a carrier a symbol, 0 for still panels.
    carrier_cycles: u16,
    code: String,
    runs: u64,
    delivered: u64,
    net_bit_s: f64,
    /// `None` if no message arrived.
    seconds_a_message: Option<f64>,
    /// `None` with a carrier: frames that are read before it is known may show complements.
    ber: Option<f64>,
}

/// The final line.
#[derive(Serialize)]
struct Best {
    best: Row,
    whole_exposures_hz: f64,
    /// `None` if no carrier works, with the reason beside it.
    carrier: Option<CarrierRow>,
    no_carrier: Option<String>,
    dimming: Vec<Beat>,
}

#[derive(Serialize)]
struct CarrierRow {
    #[serde(flatten)]
    trial: Row,
    carrier_hz: f64,
    cycles_an_exposure: f64,
    contrast: f64,
    low_risk_times: f64,
}

#[derive(Serialize)]
struct Beat {
    pwm_hz: f64,
    pulses_an_exposure: f64,
    beat_hz: f64,
    stray: f64,
    beats: bool,
}

impl Options {
    /// The camera to advise on, if given.
    pub fn camera(&self) -> Option<&OsStr> {
        self.camera.as_deref()
    }

    /// Tries the settings and prints the advice.
    pub fn run(&self, scene: Option<&OsStr>, camera: &OsStr, shared: &SharedOptions) -> anyhow::Result<Verdict> {
        let name = scene.unwrap_or(SCENE.as_ref());
        let mut scene = Scene::load(name, &[])?;
        let of_camera = Scene::load(camera, &[]).context("--camera names a preset or a scene file with a [camera]")?;
        let link = LinkCommand::new(name, &scene.camera, &of_camera.camera, shared)?;
        scene.camera = of_camera.camera;
        // All tried rates are below the frame rate.
        scene.link.symbol_rate_hz = 0.5 * scene.camera.frame_rate_hz;
        let scene = scene.with("--set", &shared.set)?;
        let search = Search {
            bytes: self.bytes.into(),
            runs: self.runs,
            seed: shared.seed,
        };
        let progress = Progress::new(Search::SETTINGS_MAX * self.runs, "messages");
        let counted = Mutex::new((progress, 0));
        let done = || {
            let (progress, messages) = &mut *counted.lock().unwrap_or_else(PoisonError::into_inner);
            *messages += 1;
            progress.done(*messages);
        };
        let mut printed = if shared.json { Ok(()) } else { line(HEAD) };
        let mut tell = |trial: &TrialOutcome| {
            if printed.is_ok() {
                printed = print(trial, shared.json);
            }
        };
        let advice = search.run(&scene, stop(), done, &mut tell);
        let advice = advice.map(|advice| (advice, search.carrier(&scene, stop(), done, &mut tell)));
        drop(counted);
        printed?;
        let (advice, carrier) = match advice {
            Err(SignallingError::Trial(TrialError::Stopped)) => {
                output::tell("interrupted: the settings tried so far are printed, without the best of all and without a carrier");
                return Ok(Verdict::No);
            }
            advice => advice?,
        };
        if shared.json {
            as_json(&advice, &carrier)?;
        } else {
            as_text(&scene, &advice, Code::for_length(search.bytes))?;
            if let Ok(carrier) = &carrier {
                carrier_as_text(carrier, &link)?;
            }
        }
        match carrier {
            Err(SignallingError::Trial(TrialError::Stopped)) => {
                output::tell("interrupted: the advice for still panels is printed, without a carrier");
                return Ok(Verdict::No);
            }
            carrier => drop(carrier.context("the advice for still panels is printed; carriers cannot be tried")?),
        }
        Ok(match advice.best().delivered {
            0 => Verdict::No,
            _ => Verdict::Yes,
        })
    }
}

/// A `vocc link` command for the scene and the camera of the advice.
struct LinkCommand(String);

impl LinkCommand {
    /// The scene of that name, with another camera in place of its `own`.
    fn new(name: &OsStr, own: &Camera, camera: &Camera, shared: &SharedOptions) -> anyhow::Result<Self> {
        let [own, camera] = [toml::Table::try_from(own)?, toml::Table::try_from(camera)?];
        let left_out = own.keys().filter(|key| !camera.contains_key(*key));
        let left_out = left_out.map(|key| format!("camera.{key}=none"));
        let differing = camera.iter().filter(|(key, value)| own.get(*key) != Some(value));
        let differing = differing.map(|(key, value)| format!("camera.{key}={value}"));
        let sets = left_out.chain(differing).chain(shared.set.iter().cloned());
        let words = sets.flat_map(|set| ["--set".into(), set]);
        let words = [output::name(name.as_ref())].into_iter().chain(words);
        let words: Vec<String> = words.map(|word| shell_word(&word)).collect();
        Ok(Self(format!("vocc link {}", words.join(" "))))
    }

    /// With a carrier.
    fn with(&self, timing: SymbolTiming) -> String {
        let (rate, cycles) = (timing.rate(), timing.waveform().cycles());
        let Self(link) = self;
        format!(
            "{link} --set link.symbol_rate_hz={rate} --set link.carrier_cycles={cycles} --frames {}",
            Trial::CARRIER_FRAMES
        )
    }
}

fn row(trial: &TrialOutcome) -> Row {
    Row {
        symbol_rate_hz: trial.rate.hz(),
        carrier_cycles: trial.waveform.cycles(),
        code: trial.code.to_string(),
        runs: trial.runs,
        delivered: trial.delivered,
        net_bit_s: trial.net_bit_s(),
        seconds_a_message: (trial.delivered > 0).then(|| trial.seconds_a_message()),
        ber: trial.bit_error_rate(),
    }
}

fn print(trial: &TrialOutcome, json: bool) -> anyhow::Result<()> {
    let row = row(trial);
    if json {
        return output::json(&row);
    }
    let seconds = row.seconds_a_message;
    let carrier = match row.carrier_cycles {
        0 => "still".into(),
        cycles => format!("{:.1}", f64::from(cycles) * row.symbol_rate_hz),
    };
    let errors = row.ber.map_or("-".into(), |ber| format!("{ber:.1e}"));
    line(&format!(
        "{:>9.1}  {:<6}  {:>4} of {:<3} {:>9.0}  {:>11}  {errors:>10}  {carrier:>10}",
        row.symbol_rate_hz,
        row.code,
        row.delivered,
        row.runs,
        row.net_bit_s,
        seconds.map_or("-".into(), |seconds| format!("{seconds:.2}")),
    ))
}

fn as_json(advice: &Advice, carrier: &Result<Result<CarrierAdvice, NoCarrier>, SignallingError>) -> anyhow::Result<()> {
    let dimming = advice.dimming.iter().map(|beat| Beat {
        pwm_hz: beat.pulses_hz,
        pulses_an_exposure: beat.pulses_an_exposure,
        beat_hz: beat.beat_hz,
        stray: beat.stray,
        beats: beat.is_seen(),
    });
    let (carrier, no_carrier) = match carrier {
        Ok(Ok(carrier)) => (Some(carrier), None),
        Ok(Err(none)) => (None, Some(none.to_string())),
        Err(error) => (None, Some(error.to_string())),
    };
    output::json(&Best {
        best: row(advice.best()),
        whole_exposures_hz: advice.whole_exposures.hz(),
        carrier: carrier.map(|advice| CarrierRow {
            trial: row(&advice.trial),
            carrier_hz: advice.carrier.hz(),
            cycles_an_exposure: advice.carrier.cycles_an_exposure,
            contrast: advice.carrier.contrast,
            low_risk_times: advice.low_risk_times,
        }),
        no_carrier,
        dimming: dimming.collect(),
    })
}

fn as_text(scene: &Scene, advice: &Advice, usual: Code) -> anyhow::Result<()> {
    line(&format!(
        "every symbol has a whole exposure on every row of the panel up to {:.1} symbols a second; the camera takes {} frames a second",
        advice.whole_exposures.hz(),
        scene.camera.frame_rate_hz
    ))?;
    for beat in &advice.dimming {
        line(&dimming(beat))?;
    }
    let best = advice.best();
    if best.delivered == 0 {
        return line("no message arrives: reduce distance or exposure, dim faster, or see which effects the scene has (vocc plan SCENE)");
    }
    if best.code != usual {
        line(&format!(
            "boards choose {usual} for messages of this length; {} is for your own transmitters",
            best.code
        ))?;
    }
    line(&format!(
        "best: {rate} symbols a second under {code}, {net:.0} bit/s; vocc device rate {rate} --port P sets a transmitter, and vocc receive \
         --symbol-rate {rate} follows it",
        rate = best.rate,
        code = best.code,
        net = best.net_bit_s(),
    ))
}

/// Prints the recommended carrier, or why there is none.
fn carrier_as_text(advice: &Result<CarrierAdvice, NoCarrier>, link: &LinkCommand) -> anyhow::Result<()> {
    let CarrierAdvice {
        carrier,
        low_risk_times,
        trial,
    } = match advice {
        Ok(advice) => advice,
        Err(none) => return line(&format!("no carrier to recommend: {none}")),
    };
    let (rate, cycles) = (carrier.timing.rate(), carrier.timing.waveform().cycles());
    line(&format!(
        "carrier: {cycles} cycles a symbol at {rate} symbols a second, {:.1} Hz; {:.2} times the limit of low risk, an exposure of {:.2} cycles \
         with at most {:.0} % of the contrast; {} of {} messages arrive, {:.0} bit/s from the first frame on",
        carrier.hz(),
        low_risk_times,
        carrier.cycles_an_exposure,
        1e2 * carrier.contrast,
        trial.delivered,
        trial.runs,
        trial.net_bit_s(),
    ))?;
    line(&format!(
        "vocc device rate {rate} --carrier-cycles {cycles} --port P sets a transmitter, and vocc receive --symbol-rate {rate} follows it; \
         this tries it in the same scene with the same camera:"
    ))?;
    line(&link.with(carrier.timing))
}

fn dimming(beat: &DimmingBeat) -> String {
    let held = format!(
        "dimming at {} Hz: an exposure covers {:.1} periods, and its light varies by at most {:.1} %",
        beat.pulses_hz,
        beat.pulses_an_exposure,
        1e2 * beat.stray
    );
    if !beat.is_seen() {
        return format!("{held}: no beat");
    }
    format!(
        "{held}, with a beat of {:.2} Hz: dim faster, expose for a whole number of periods, or dim by current",
        beat.beat_hz
    )
}
