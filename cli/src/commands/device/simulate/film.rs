//! A camera's frames of the simulated board.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use link::panel::PanelFrame;
use link::symbol_rate::SymbolRate;
use link::waveform::SymbolTiming;
use sim::accuracy::Level;
use sim::camera::clock::{Moment, WINDOW};
use sim::renderer::canvas::Canvas;
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::Scene;
use tx_firmware::calibration::BENCH;

use super::board::Symbol;
use crate::files::Pipe;
use crate::outputs;
use crate::pictures;

/// The destination of the frames.
pub enum FrameSink {
    /// A folder with a picture for each frame, as `vocc link --save` writes them.
    Folder {
        /// The folder.
        path: PathBuf,
        /// The lock on the folder while it is written to.
        _held: Option<File>,
    },
    /// A y4m film, or a pipe for one.
    Film(BufWriter<Pipe>),
}

impl FrameSink {
    /// A folder without frames.
    pub fn folder(path: &Path) -> anyhow::Result<Self> {
        std::fs::create_dir_all(path).with_context(|| format!("cannot make the folder {}", path.display()))?;
        outputs::check_recording(path)?;
        Ok(Self::Folder {
            path: path.into(),
            _held: outputs::hold(path)?,
        })
    }

    pub fn pipe(path: &Path) -> anyhow::Result<Self> {
        let pipe = File::options().write(true).open(path);
        let pipe = pipe.with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self::Film(BufWriter::new(Pipe(pipe))))
    }
}

/// A camera before the board.
pub struct Camera {
    reel: FrameSink,
    scene: Scene,
    seed: u64,
    full_cd_m2: f64,
    renderer: Renderer,
    canvas: Canvas<f32>,
    grey: Vec<u8>,
    /// The symbols for future frames; the first has number `first`.
    symbols: VecDeque<Symbol>,
    first: u64,
    frame: u64,
}

impl Camera {
    /// A camera that starts with the board. The board drives the scene's panel, and the scene determines the light.
    pub fn new(scene: &Scene, reel: FrameSink, seed: u64) -> anyhow::Result<Self> {
        let mut scene = scene.clone();
        scene.link.symbol_rate_hz = SymbolRate::DEFAULT.hz();
        scene.link.carrier_cycles = None;
        let bench = BENCH.luminance_full_cd_m2.to_num();
        let full_cd_m2 = scene.panels[0].luminance_max_cd_m2.unwrap_or(bench);
        let renderer = Renderer::new(&scene, Level::Fine)?;
        let sensor = renderer.sensor();
        let mut camera = Self {
            reel,
            seed,
            full_cd_m2,
            canvas: Canvas::new(renderer.lit_region()),
            grey: vec![0; sensor.width * sensor.height],
            renderer,
            scene,
            symbols: VecDeque::new(),
            first: 0,
            frame: 0,
        };
        let rate = (camera.scene.camera.frame_rate_hz * 1000.0).round();
        if let FrameSink::Film(film) = &mut camera.reel {
            let (width, height) = (sensor.width, sensor.height);
            writeln!(film, "YUV4MPEG2 W{width} H{height} F{rate}:1000 Ip A1:1 Cmono")?;
        }
        Ok(camera)
    }

    /// Number of frames taken.
    pub fn frames(&self) -> u64 {
        self.frame
    }

    /// Sets the light from the next frame on; the camera's exposure follows it at once.
    pub fn set_light(&mut self, illuminance_lx: f64) -> anyhow::Result<()> {
        self.scene.ambient.illuminance_lx = illuminance_lx;
        self.look_again()
    }

    fn look_again(&mut self) -> anyhow::Result<()> {
        let scene = self.scene.at_frame(self.frame).unwrap_or_else(|| self.scene.clone());
        self.look_at(&scene)
    }

    fn look_at(&mut self, scene: &Scene) -> anyhow::Result<()> {
        self.renderer = self.renderer.rebuilt_for(scene)?;
        self.canvas = Canvas::new(self.renderer.lit_region());
        Ok(())
    }

    /// Adapts to the carrier of the board's symbols, or to none.
    fn look_for_carrier(&mut self, timing: SymbolTiming) -> anyhow::Result<()> {
        let carrier = Some(timing).filter(|timing| !timing.waveform().is_still());
        let cycles = carrier.map(|timing| timing.waveform().cycles());
        let symbol_rate_hz = carrier.map_or(SymbolRate::DEFAULT, SymbolTiming::rate).hz();
        let link = &mut self.scene.link;
        if (link.carrier_cycles, link.symbol_rate_hz) == (cycles, symbol_rate_hz) {
            return Ok(());
        }
        (link.carrier_cycles, link.symbol_rate_hz) = (cycles, symbol_rate_hz);
        self.look_again()
    }

    /// Adds the next symbol, and takes the frames, at most `most` in all, that show no later one.
    pub fn see(&mut self, symbol: Symbol, most: u64) -> anyhow::Result<()> {
        self.symbols.push_back(symbol);
        while self.frame < most {
            if self.moment().is_none() {
                break;
            }
            if let Some(scene) = self.scene.at_frame(self.frame) {
                self.look_at(&scene).with_context(|| format!("frame {}", self.frame))?;
            }
            // With the exposure of the frame's own scene.
            let Some(moment) = self.moment() else {
                break;
            };
            self.look_for_carrier(self.symbols[moment.middle_symbol(0.0)].timing)?;
            let others = self.scene.panels.len();
            let mut shown: Vec<PanelExposure> = (0..others)
                .map(|index| self.renderer.steady(index, PanelFrame::default()))
                .collect();
            let in_view = &self.symbols;
            let middle = in_view[moment.middle_symbol(0.0)];
            shown[0].symbols = std::array::from_fn(|ahead| in_view[ahead].panel);
            shown[0].light = self.renderer.lit(0, middle.light * self.full_cd_m2);
            self.renderer.frame(self.seed, &moment, &shown, &mut self.canvas, &mut self.grey);
            self.keep()?;
            self.frame += 1;
        }
        Ok(())
    }

    /// The time of the next frame, in symbols at the board's own rate; none until all symbols that the exposure may show are known.
    fn moment(&mut self) -> Option<Moment> {
        let moment = self.renderer.moment(self.seed, self.frame);
        let link = &self.scene.link;
        // In the board's clock.
        let start_s = moment.start_s * moment.transmitter_rate + link.phase / SymbolRate::DEFAULT.hz();
        let begins_by = |symbol: &Symbol| symbol.at.as_secs_f64() <= start_s + 1e-9;
        while self.symbols.get(1).is_some_and(begins_by) {
            self.symbols.pop_front();
            self.first += 1;
        }
        if self.symbols.len() < WINDOW {
            return None;
        }
        let [began_s, ended_s] = [0, 1].map(|index| self.symbols[index].at.as_secs_f64());
        Some(Moment {
            symbol: self.first,
            since_change_s: (start_s - began_s).max(0.0) / moment.transmitter_rate,
            symbol_s: (ended_s - began_s) / moment.transmitter_rate,
            ..moment
        })
    }

    fn keep(&mut self) -> anyhow::Result<()> {
        let sensor = self.renderer.sensor();
        match &mut self.reel {
            FrameSink::Folder { path, .. } => {
                let path = outputs::frame_in(path, self.frame);
                pictures::write_png(&path, &self.grey, sensor.width, sensor.height)
            }
            FrameSink::Film(film) => {
                film.write_all(b"FRAME\n")?;
                film.write_all(&self.grey)?;
                Ok(film.flush()?)
            }
        }
    }
}
