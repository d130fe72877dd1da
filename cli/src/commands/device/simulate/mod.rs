//! `vocc device simulate`: a serial port with a transmitter behind it, without hardware.
//!
//! The transmitter is the firmware's: [`board`] gives it a clock, [`flash`] a memory, [`light_sensor`] light, [`leds`] a panel and
//! [`terminal`] a port. [`orders`] has the user's commands while it runs, [`fault`] the faults of its wires; [`symbol_log`] and [`film`]
//! record its symbols.

mod board;
mod fault;
mod film;
mod flash;
mod leds;
mod light_sensor;
mod orders;
mod symbol_log;
mod terminal;

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::options::{SharedOptions, whole};
use crate::output::{self, Verdict};
use crate::outputs;
use crate::stop::stop;

use board::Board;
use fault::Fault;
use film::{Camera, FrameSink};
use flash::Flash;
use light_sensor::LightSensor;
use orders::{Input, Order, Orders};
use symbol_log::SymbolLog;
use terminal::{Link, Terminal};

/// Maximum step of the board's clock, so that the port is served while frames are drawn.
const STEP: Duration = Duration::from_millis(20);
/// Maximum time for listening to the port at once.
const PATIENCE: Duration = Duration::from_millis(4);

/// Arguments of `vocc device simulate`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A preset or a TOML file, with the light on the board and the camera that films it.
    #[arg(default_value = "day")]
    scene: OsString,
    /// The light, 0.1 to 200000 lx. Default: the scene's. `light LX` on standard input changes it.
    #[arg(long, value_name = "LX", value_parser = orders::illuminance)]
    light_lx: Option<f64>,
    /// Keep the flash memory in this file, so that a table survives a restart. It is created if it does not exist.
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Create a link with this name to the port, and remove it at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Write a line for each symbol: its bits as `transmit` prints them, and the light of an On LED as a share of full light. `-` and pipes
    /// get it immediately, a file at the end.
    #[arg(long, value_name = "FILE")]
    symbols: Option<PathBuf>,
    /// Save the frames of the scene's camera in this folder, for `vocc receive`. The board's clock waits for the frames.
    #[arg(long, value_name = "DIR")]
    frames: Option<PathBuf>,
    /// Write the same frames as a y4m film to a pipe, such as `>(vocc receive -)`.
    #[arg(long, value_name = "PIPE", conflicts_with = "frames")]
    film: Option<PathBuf>,
    /// Simulate a wiring fault, for `vocc device test`: swap=LED,LED, dead=LED, stuck=LED, dead-row=ROW, late=BITS, mirror or enable.
    /// May be repeated; LED 8·row + column.
    #[arg(long, value_name = "FAULT")]
    fault: Vec<Fault>,
    /// Stop after this many frames, whether or not standard input has ended.
    #[arg(long, value_name = "N", value_parser = whole(1..=u64::MAX))]
    count: Option<u64>,
}

/// The board's time: real time, without the time that the computer could not keep up with.
struct Clock {
    began: Instant,
    now: Duration,
}

impl Clock {
    fn start() -> Self {
        Self {
            began: Instant::now(),
            now: Duration::ZERO,
        }
    }

    /// The present time, at most a [`STEP`] after the last one.
    fn next(&mut self) -> Duration {
        let real = self.began.elapsed();
        let now = real.min(self.now + STEP);
        self.began += real - now;
        self.now = now;
        now
    }
}

/// Serves until a signal, the film's last frame or, if the film has no limit, the end of standard input.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let mut scene = shared.scene(&arguments.scene)?;
    if let Some(lux) = arguments.light_lx {
        scene.ambient.illuminance_lx = lux;
    }
    let written = [&arguments.flash, &arguments.symbols].into_iter().flatten();
    outputs::check(
        written.filter(|path| path.as_os_str() != "-").cloned(),
        outputs::files_of(&arguments.scene, &scene),
    )?;
    anyhow::ensure!(
        arguments.count.is_none() || arguments.frames.is_some() || arguments.film.is_some(),
        "--count counts frames: give their destination with --frames or --film"
    );
    let flash = match &arguments.flash {
        Some(path) => Flash::in_file(path)?,
        None => Flash::forgetful(),
    };
    let mut board = Board::start(flash, Duration::ZERO)?;
    let stop = stop();
    let mut symbol_log = arguments.symbols.as_deref().map(SymbolLog::to).transpose()?;
    let reel = match (&arguments.frames, &arguments.film) {
        (Some(folder), _) => Some(FrameSink::folder(folder)?),
        (None, Some(pipe)) => Some(FrameSink::pipe(pipe)?),
        (None, None) => None,
    };
    let camera = reel.map(|reel| Camera::new(&scene, reel, shared.seed));
    let mut camera = camera.transpose()?;
    let mut terminal = Terminal::open()?;
    let link = arguments.link.as_deref();
    let link = link.map(|path| Link::new(path, terminal.name()));
    let _link = link.transpose()?;
    announce(arguments, &terminal, shared)?;

    let mut sensor = LightSensor::new(scene.ambient.illuminance_lx);
    let orders = Orders::listen()?;
    let mut clock = Clock::start();
    let most = arguments.count.unwrap_or(u64::MAX);
    let mut bytes = [0; 2048];
    while !stop.is_asked() {
        let asked = terminal.read(PATIENCE, &mut bytes)?;
        let answers = board.exchange(asked);
        if !answers.is_empty() {
            terminal.write(&answers);
        }
        match orders.next() {
            Input::Line(line) => match line.parse() {
                Ok(Order::Restart) => board = board.restarted()?,
                Ok(Order::Halt) => board.halt(),
                Ok(Order::Sensor(health)) => sensor.health = health,
                Ok(Order::Light(lux)) => {
                    sensor.illuminance_lx = lux;
                    if let Some(camera) = &mut camera {
                        camera.set_light(lux)?;
                    }
                }
                Err(_) if line.is_empty() => {}
                Err(told) => output::tell(format_args!("vocc: {told}")),
            },
            Input::End if arguments.count.is_none() => break,
            Input::Nothing | Input::End => {}
        }
        let now = clock.next();
        while let Some(symbol) = board.advance(now, &mut sensor) {
            let symbol = arguments.fault.iter().fold(symbol, |symbol, fault| fault.plant(symbol));
            if let Some(log) = &mut symbol_log {
                log.write(&symbol, shared.json)?;
            }
            if let Some(camera) = &mut camera {
                camera.see(symbol, most)?;
            }
        }
        if camera.as_ref().is_some_and(|camera| camera.frames() >= most) {
            break;
        }
    }
    symbol_log.map_or(Ok(()), SymbolLog::finish)?;
    Ok(Verdict::Yes)
}

/// Prints the port's name and, on a terminal, the possible next steps.
fn announce(arguments: &Arguments, terminal: &Terminal, shared: &SharedOptions) -> anyhow::Result<()> {
    let port = terminal.name();
    if shared.json {
        return output::json(&json!({ "port": port, "link": arguments.link }));
    }
    output::line(port)?;
    let name = match &arguments.link {
        Some(link) => link.display().to_string(),
        None => port.to_owned(),
    };
    output::tell(format_args!(
        "a simulated transmitter: try `vocc device status --port {name}` elsewhere, and `light 500` here; Ctrl-C ends it"
    ));
    Ok(())
}
