//! `vocc device test`: checks a board and its panel, by eye or by a camera's pictures.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::ValueEnum;
use link::panel::{PanelFrame, SIDE};
use link::serial::{Answer, Faults, Refusal, Request, SensorReading, Status};
use reception::bring_up::{self, Part, Step, walk};
use serde_json::{Value, json};
use studies::stop::Stop;

use super::rate;
use crate::device::DeviceError;
use crate::frames::PixelArguments;
use crate::options::{Connection, Port, SharedOptions, seconds};
use crate::output::{self, Verdict, line};
use crate::stop::stop;

mod pictures;

/// Time in which the light sensor is read in both ranges a few times.
const SENSOR_TIME: Duration = Duration::from_millis(1200);
/// Time for which a test panel outlasts the next one's start, because a request may have to be repeated.
const GRACE: Duration = Duration::from_secs(3);
/// Time for which a board may hold its panel after a write to its flash, because it prepares 410 ms of panels first.
const STORE_TIME: Duration = Duration::from_millis(500);
/// Minimum number of symbols of a test panel: its duty takes effect at once, and its LEDs up to five symbols later.
const SYMBOLS_MIN: f64 = 10.0;
/// Interval between checks for a stop.
const NAP: Duration = Duration::from_millis(20);
/// Added to the error of a board that may not have ended its test panel.
const STILL_SHOWN: &str = "the test broke off, and the panel may still show its last test panel";
/// Time without a new symbol after which a board stands still. An emulated one may be 20 times slower than a board.
const STANDSTILL: Duration = Duration::from_secs(5);
/// Maximum ratio of the light between the sensor's ranges, because it may change between the readings.
const RANGES_RATIO_MAX: f64 = 2.0;
/// Minimum reading of one range while the other is saturated: half of the lowest of their limits, the 35 000 lx of a VEML7700.
const SATURATED_LX_MIN: f64 = 35_000.0 / RANGES_RATIO_MAX;

/// Arguments of `vocc device test`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    port: Option<Port>,
    /// Diagnose the faults from a camera's view of the test panels: a film, or a folder of its frames or of one picture for each test
    /// panel. This needs no transmitter.
    #[arg(long, value_name = "SOURCE", conflicts_with = "port")]
    frames: Option<PathBuf>,
    /// The LED driver: it decides the names of wires, and whether a light sensor is expected.
    #[arg(long, value_enum, default_value_t)]
    kit: Kit,
    /// Duration of each test panel in seconds, 0.1 to 10, and at least ten symbols. A camera should take at least eight frames of each.
    #[arg(long, default_value_t = 0.5, value_name = "S", value_parser = seconds::<100, 10_000>)]
    step: f64,
    /// Show only the test panels that a camera needs.
    #[arg(long, requires = "port")]
    camera: bool,
    #[command(flatten)]
    pixels: PixelArguments,
}

/// What drives the LEDs.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum Kit {
    /// Shift registers, and a light sensor.
    #[default]
    Road,
    /// A module with a MAX7219, and no light sensor.
    Desk,
}

impl From<Kit> for bring_up::Kit {
    fn from(kit: Kit) -> Self {
        match kit {
            Kit::Road => Self::Road,
            Kit::Desk => Self::Desk,
        }
    }
}

/// Tests a board, or diagnoses it from pictures of the test.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    if let Some(source) = &arguments.frames {
        return pictures::run(source, arguments.kit.into(), arguments.pixels, shared);
    }
    let port = arguments
        .port
        .as_ref()
        .context("give the port with --port, or pictures with --frames")?;
    let mut client = port.greet_transmitter()?;
    let rate = rate::in_use(&mut client).map_err(|error| match error {
        // Firmware without symbol rates has no test panels, either.
        DeviceError::NoSymbolRate => DeviceError::NoTest,
        error => error,
    });
    let symbol_rate_hz = rate.with_context(|| port.name())?.symbol_rate_hz;
    let least_s = SYMBOLS_MIN / symbol_rate_hz;
    if arguments.step < least_s {
        return Err(DeviceError::ShortStep {
            step_s: arguments.step,
            least_s,
            symbol_rate_hz,
        })
        .with_context(|| port.name());
    }
    let tested = test_board(&mut client, symbol_rate_hz, arguments, port, shared);
    // Ends the test at once, also after Ctrl-C and errors; without an answer, a board that works ends it soon.
    let ended = test(&mut client, PanelFrame::default(), u8::MAX, Duration::ZERO).with_context(|| port.name());
    let is_shown = ended.is_err() || is_halted(&tested);
    let outcome = tested.and_then(|verdict| ended.map(|()| verdict));
    if is_shown { outcome.context(STILL_SHOWN) } else { outcome }
}

/// Whether the test ended because the board shows no new panels.
fn is_halted(tested: &anyhow::Result<Verdict>) -> bool {
    let error = tested.as_ref().err().and_then(|error| error.downcast_ref());
    matches!(error, Some(DeviceError::Halted(_)))
}

/// Tests a board. May leave a test panel on.
fn test_board(
    client: &mut Connection,
    symbol_rate_hz: f64,
    arguments: &Arguments,
    port: &Port,
    shared: &SharedOptions,
) -> anyhow::Result<Verdict> {
    let stop = stop();
    let sensor = read_sensor(client, symbol_rate_hz, stop).with_context(|| port.name())?;
    if stop.is_asked() {
        return Ok(Verdict::No);
    }
    let status = super::status(client, port)?;
    let store = check_store(client, symbol_rate_hz, &status).with_context(|| port.name())?;
    // Otherwise the first test panels would be shown only after the panels that the board prepared before its write.
    wait(client, STORE_TIME, symbol_rate_hz, stop).with_context(|| port.name())?;
    let report = Report {
        sensor,
        sensor_fault: sensor_fault(sensor, &status, arguments.kit),
        store_fault: store,
        is_dark: status.duty == 0,
    };
    if !shared.json {
        report.print(client, port, &status)?;
    }
    let steps: Vec<Step> = walk()
        .filter(|step| !arguments.camera || matches!(step.part, Part::Codes | Part::Ramp))
        .filter(|_| !report.is_dark)
        .collect();
    let shown = Walk {
        client,
        stop,
        step: Duration::from_secs_f64(arguments.step),
        symbol_rate_hz,
        is_quiet: shared.json,
    }
    .show(&steps);
    let shown = shown.with_context(|| port.name())?;
    if shared.json {
        output::json(&report.as_json(client, port, &status, &steps[..shown]))?;
    } else if shown > 0 {
        line("if you saw anything else, docs/hardware/bring-up.md says which wire to check")?;
    }
    let is_done = shown == steps.len() && !report.is_dark && report.sensor_fault.is_none() && report.store_fault.is_none();
    Ok(if is_done { Verdict::Yes } else { Verdict::No })
}

/// The results before the walk.
struct Report {
    sensor: [SensorReading; 2],
    sensor_fault: Option<String>,
    store_fault: Option<String>,
    is_dark: bool,
}

impl Report {
    fn print(&self, client: &Connection, port: &Port, status: &Status) -> anyhow::Result<()> {
        let identity = client.identity();
        line(&format!("{}: {}, firmware {}", port.name(), identity.board, identity.firmware))?;
        let [operating, cross_check] = self.sensor.map(in_words);
        line(&format!("light sensor: {operating}; in its other range: {cross_check}"))?;
        line(&match &self.sensor_fault {
            Some(fault) => format!("  wrong: {fault}"),
            None => "  right".into(),
        })?;
        line("store: the symbol rate in use, written and read back")?;
        line(&match &self.store_fault {
            Some(fault) => format!("  wrong: {fault}"),
            None => "  right".into(),
        })?;
        let duty = status.duty.to_num::<f64>();
        line(&if self.is_dark {
            "panel: its duty is 0, so test panels are dark: `vocc device status` says why; it needs light, or two seconds without any"
                .into()
        } else {
            format!("panel: duty {duty:.4}; test panels have at most that")
        })
    }

    fn as_json(&self, client: &Connection, port: &Port, status: &Status, shown: &[Step]) -> Value {
        let identity = client.identity();
        let [operating, cross_check] = self.sensor.map(as_value);
        let shown = shown.iter().map(|step| {
            let part = name(step.part);
            json!({ "part": part, "bits": step.panel.to_string(), "share": f64::from(step.share) / 255.0 })
        });
        json!({
            "port": port.name(),
            "board": identity.board,
            "firmware": identity.firmware,
            "light": format!("{:?}", status.light).to_lowercase(),
            "duty": status.duty.to_num::<f64>(),
            "sensor_lx": operating,
            "sensor_other_range_lx": cross_check,
            "sensor_fault": self.sensor_fault,
            "store_fault": self.store_fault,
            "faults": super::faults(status),
            "shown": shown.collect::<Vec<_>>(),
        })
    }
}

fn in_words(reading: SensorReading) -> String {
    match reading {
        SensorReading::None => "not read".into(),
        SensorReading::Missing => "no answer".into(),
        SensorReading::Saturated => "too much light".into(),
        SensorReading::Light(lux) => format!("{:.2} lx", lux.to_num::<f64>()),
    }
}

fn as_value(reading: SensorReading) -> Value {
    match reading {
        SensorReading::None => Value::Null,
        SensorReading::Missing => "missing".into(),
        SensorReading::Saturated => "saturated".into(),
        SensorReading::Light(lux) => lux.to_num::<f64>().into(),
    }
}

const fn name(part: Part) -> &'static str {
    match part {
        Part::Codes => "codes",
        Part::Ramp => "ramp",
        Part::Rows => "rows",
        Part::Columns => "columns",
        Part::Leds => "leds",
    }
}

/// The light sensor's fault, if any.
fn sensor_fault(sensor: [SensorReading; 2], status: &Status, kit: Kit) -> Option<String> {
    const WIRES: &str = "look at SDA (GPIO 4, pin 6), SCL (GPIO 5, pin 7), their pull-ups, and its supply, 3V3 (pin 36)";
    let is_absent = |reading: &SensorReading| matches!(reading, SensorReading::None | SensorReading::Missing);
    let is_lost = status.faults.intersects(Faults::SENSOR_MISSING.union(Faults::SENSOR_SILENT));
    match sensor {
        _ if status.faults.contains(Faults::SENSOR_STUCK) => {
            Some("it gives the same register in both ranges: disconnect its supply and connect it again".into())
        }
        sensor if (is_lost || sensor.iter().all(is_absent)) && matches!(kit, Kit::Desk) => None,
        sensor if is_lost || sensor.iter().any(is_absent) => Some(format!("it does not answer: {WIRES}; without a sensor give --kit desk")),
        [SensorReading::Saturated, SensorReading::Light(lux)] | [SensorReading::Light(lux), SensorReading::Saturated]
            if lux.to_num::<f64>() < SATURATED_LX_MIN =>
        {
            Some(format!(
                "one of its ranges has too much light, and the other reads {:.0} lx, far below the limit of either: check that it is the \
                 sensor of the build",
                lux.to_num::<f64>()
            ))
        }
        [SensorReading::Light(one), SensorReading::Light(other)] => {
            let [one, other] = [one, other].map(|lux| lux.to_num::<f64>().max(1.0));
            let ratio = one.max(other) / one.min(other);
            (ratio > RANGES_RATIO_MAX).then(|| {
                format!(
                    "its two ranges differ by a factor of {ratio:.1}: give it steady light, and check that it is the sensor of the build"
                )
            })
        }
        _ => None,
    }
}

/// Reads the sensor in both ranges, while all LEDs are Off.
fn read_sensor(client: &mut Connection, symbol_rate_hz: f64, stop: Stop) -> Result<[SensorReading; 2], DeviceError> {
    test(client, PanelFrame::default(), u8::MAX, SENSOR_TIME + GRACE)?;
    wait(client, SENSOR_TIME, symbol_rate_hz, stop)?;
    client.ask(&Request::ReadSensor, |answer| match answer {
        Answer::Sensor { operating, cross_check } => Some([operating, cross_check]),
        _ => None,
    })
}

/// The store's fault, if any: the board is asked to store the symbol rate in use.
fn check_store(client: &mut Connection, symbol_rate_hz: f64, status: &Status) -> Result<Option<String>, DeviceError> {
    let millihertz = (symbol_rate_hz * 1e3).round() as u32;
    let written = client.ask(&Request::WriteSymbolRate { millihertz }, |answer| match answer {
        Answer::SymbolRate { millihertz } => Some(millihertz),
        _ => None,
    });
    let failed = "the flash memory failed: flash the board again; if it fails again, replace it";
    match written {
        Err(DeviceError::Refused(Refusal::Store)) => return Ok(Some(failed.into())),
        written => written?,
    };
    let has_failed = status.faults.contains(Faults::STORE);
    let damaged = "data in the flash memory was damaged: write table and calibration again, and repeat the test";
    Ok(has_failed.then(|| damaged.into()))
}

/// Shows a test panel.
fn test(client: &mut Connection, panel: PanelFrame, share: u8, time: Duration) -> Result<(), DeviceError> {
    let request = Request::TestPanel {
        bits: panel.bits(),
        share,
        time_ms: u16::try_from(time.as_millis()).unwrap_or(u16::MAX),
    };
    let outcome = client.ask(&request, |answer| (answer == Answer::Done).then_some(()));
    outcome.map_err(|error| error.if_unknown(DeviceError::NoTest))
}

/// Waits until some time has passed on this computer and on the board, whose clock is its symbols: an emulated board may be slower.
fn wait(client: &mut Connection, time: Duration, symbol_rate_hz: f64, stop: Stop) -> Result<(), DeviceError> {
    let begun = Instant::now();
    let first = symbols(client)?;
    let wanted = (time.as_secs_f64() * symbol_rate_hz) as u32;
    while begun.elapsed() < time && !stop.is_asked() {
        std::thread::sleep(NAP.min(time.saturating_sub(begun.elapsed())));
    }
    let (mut shown, mut changed) = (first, Instant::now());
    while !stop.is_asked() {
        let now = symbols(client)?;
        if now < shown {
            return Err(DeviceError::Restarted);
        }
        if now - first >= wanted {
            break;
        }
        if now > shown {
            (shown, changed) = (now, Instant::now());
        } else if changed.elapsed() >= STANDSTILL {
            return Err(DeviceError::Halted(STANDSTILL.as_secs()));
        }
        std::thread::sleep(NAP);
    }
    Ok(())
}

/// Symbols that the board has shown or lost.
fn symbols(client: &mut Connection) -> Result<u32, DeviceError> {
    client.ask(&Request::Status, |answer| match answer {
        Answer::Status(status) => Some(status.counters.symbols.saturating_add(status.counters.lost_symbols)),
        _ => None,
    })
}

/// Shows successive test panels.
struct Walk<'a> {
    client: &'a mut Connection,
    stop: Stop,
    step: Duration,
    symbol_rate_hz: f64,
    is_quiet: bool,
}

impl Walk<'_> {
    /// Shows the steps with instructions; returns the number of steps shown.
    fn show(self, steps: &[Step]) -> anyhow::Result<usize> {
        let mut shown = 0;
        let mut part = None;
        for (index, step) in steps.iter().enumerate() {
            if self.stop.is_asked() || output::is_unread() {
                break;
            }
            if part != Some(step.part) {
                part = Some(step.part);
                self.say(what_to_see(step.part))?;
            }
            test(self.client, step.panel, step.share, self.step + GRACE)?;
            if let Some(place) = place(&steps[..=index]) {
                self.say(&place)?;
            }
            wait(self.client, self.step, self.symbol_rate_hz, self.stop)?;
            shown += 1;
        }
        Ok(shown)
    }

    fn say(&self, text: &str) -> anyhow::Result<()> {
        if self.is_quiet { Ok(()) } else { line(text) }
    }
}

const fn what_to_see(part: Part) -> &'static str {
    match part {
        Part::Codes => "for a camera: a dark panel, then twelve, each with half of the LEDs lit, each the complement of another",
        Part::Ramp => {
            "duty: a chequerboard, dark at first, then never darker, and brightest at the end; in dim light or with a MAX7219 some steps \
             look alike"
        }
        Part::Rows => "rows: one whole row at a time, from the top down",
        Part::Columns => "columns: one whole column at a time, from the left to the right",
        Part::Leds => "LEDs: exactly one at a time, along each row from the left to the right, from the top row down",
    }
}

/// The row, column or LED that the last of these steps lights.
fn place(steps: &[Step]) -> Option<String> {
    let part = steps.last()?.part;
    let number = steps.iter().filter(|step| step.part == part).count() - 1;
    match part {
        Part::Codes | Part::Ramp => None,
        Part::Rows => Some(format!("  row {number}")),
        Part::Columns => Some(format!("  column {number}")),
        Part::Leds => Some(format!("  row {}, column {}", number / SIDE, number % SIDE)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::l2a_table::Illuminance;
    use link::serial::{Counters, Light};

    fn status(faults: Faults) -> Status {
        Status {
            uptime_s: 1,
            light: Light::Measured,
            illuminance_lx: None,
            l2a: Default::default(),
            luminance_cd_m2: Default::default(),
            duty: Default::default(),
            limited: None,
            faults,
            table_crc: 0,
            sending: false,
            counters: Counters::default(),
        }
    }

    #[test]
    fn each_fault_of_the_sensor_is_named() {
        use SensorReading::{Light, Missing, None as Unread, Saturated};
        let lux = |lux: u32| Light(Illuminance::from_num(lux));
        let no_faults = Faults::empty();
        let right = Option::None;
        for (readings, faults, kit, meant) in [
            ([lux(1000), lux(1000)], no_faults, Kit::Road, right),
            ([lux(1000), lux(1900)], no_faults, Kit::Road, right),
            ([lux(1000), lux(2100)], no_faults, Kit::Road, Some("a factor of 2.1")),
            ([lux(2100), lux(1000)], no_faults, Kit::Desk, Some("a factor of 2.1")),
            // Below 1 lx a ratio is meaningless.
            ([lux(0), lux(1)], no_faults, Kit::Road, right),
            ([Saturated, Saturated], no_faults, Kit::Road, right),
            ([Saturated, lux(90_000)], no_faults, Kit::Road, right),
            ([Saturated, lux(1000)], no_faults, Kit::Road, Some("too much light")),
            ([lux(1000), Saturated], no_faults, Kit::Road, Some("too much light")),
            ([Missing, lux(1000)], no_faults, Kit::Road, Some("SDA")),
            ([Missing, lux(1000)], no_faults, Kit::Desk, Some("SDA")),
            ([Missing, Unread], no_faults, Kit::Road, Some("--kit desk")),
            ([Missing, Unread], no_faults, Kit::Desk, right),
            ([lux(1000), lux(1000)], Faults::SENSOR_MISSING, Kit::Road, Some("SDA")),
            ([lux(1000), lux(1000)], Faults::SENSOR_SILENT, Kit::Desk, right),
            ([lux(1000), lux(1000)], Faults::SENSOR_STUCK, Kit::Desk, Some("the same register")),
        ] {
            let fault = sensor_fault(readings, &status(faults), kit);
            let is_as_meant = match (&fault, meant) {
                (Some(fault), Some(words)) => fault.contains(words),
                (fault, meant) => fault.is_none() && meant.is_none(),
            };
            assert!(is_as_meant, "{readings:?}, {faults:?}, {kit:?}: {fault:?}");
        }
    }
}
