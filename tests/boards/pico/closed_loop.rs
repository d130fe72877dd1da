//! (d) The closed loop: `vocc` gives the board a message, the board shows it on its pins, and a simulated camera and a receiver read it.

use std::path::Path;

use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};
use sim::accuracy::Level;
use sim::camera::clock::{Moment, WINDOW};
use sim::renderer::canvas::Canvas;
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::Scene;

use link::framing::Event as Received;

use crate::emulator::{Emulator, Fault};
use crate::image::Programs;
use crate::panel::{REFLECTANCE, Record, Symbol, from_message_on};
use crate::terminal::Terminal;
use crate::vocc::vocc;

const MESSAGE: &str = "Sent from the pins of a board";
const LUX: f64 = 4_000.0;
/// Changes of the paper's scene.
const SCENE: [&str; 1] = ["link.symbol_rate_hz=90"];
/// Time for the panels that were prepared before the message was sent.
const READY_MS: u32 = 500;
/// Number of filmed symbols, two repeats of the message.
const FILMED_MS: u32 = 700;
const PANEL_PIXELS: usize = 128 * 128;

/// The camera films the board's LEDs, and the receiver decodes the message.
pub fn a_message_sent_to_the_board_is_received_by_a_camera(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up_still(programs, folder, &[]);
    let mut record = Record::default();
    board.light(LUX, Fault::None);
    record.extend(&board.run_ms(500));
    record.extend(&board.real_time(true));
    let terminal = Terminal::open(board.socket());
    vocc(programs, folder, &["device", "send", "--message", MESSAGE], terminal.name()).json();
    record.extend(&board.real_time(false));
    record.extend(&board.run_ms(READY_MS + FILMED_MS));
    let filmed_from_ns = from_message_on(&record.symbols, MESSAGE.as_bytes(), |panel| vec![panel])[0].ns;
    let luminance_cd_m2 = |ns| record.pulses_at(ns).luminance_cd_m2();
    let film = Film::new("paper", &SCENE, LUX, REFLECTANCE);
    let messages = film.messages(&record.symbols, luminance_cd_m2, filmed_from_ns);
    assert!(messages.iter().any(|message| message == MESSAGE.as_bytes()), "{messages:?}");
}

/// A camera before the LEDs of a board.
pub struct Film {
    renderer: Renderer,
}

impl Film {
    /// A camera in a scene with these changes and this light.
    pub fn new(scene: &str, changes: &[&str], lux: f64, reflectance: f64) -> Self {
        let light = [format!("ambient.illuminance_lx={lux}"), format!("panel.reflectance={reflectance}")];
        let changes = changes.iter().map(|&change| change.to_owned());
        let overrides: Vec<String> = changes.chain(light).collect();
        let scene = Scene::load(scene, &overrides).expect("a valid scene");
        Self {
            renderer: Renderer::new(&scene, Level::Fast).expect("a panel in view"),
        }
    }

    /// The messages that a receiver decodes from this camera's frames of the symbols, from a time on, if On LEDs have this luminance.
    pub fn messages(&self, symbols: &[Symbol], luminance_cd_m2: impl Fn(u64) -> f64, from_ns: u64) -> Vec<Vec<u8>> {
        let renderer = &self.renderer;
        let scene = &renderer.view().scene;
        let settings = ReceiverSettings {
            symbols_per_frame: (scene.link.symbol_rate_hz / scene.camera.frame_rate_hz) as f32,
            ..ReceiverSettings::default()
        };
        let memory = Box::<ReceiverMemory<PANEL_PIXELS>>::default();
        let search = FrameSearch::new(Box::<SearchMemory>::default());
        let mut receiver = Receiver::new(settings, memory, search).expect("a usable link");
        let mut canvas = Canvas::new(renderer.lit_region());
        let sensor = renderer.sensor();
        let mut grey = vec![0; sensor.width * sensor.height];
        let mut messages = vec![];
        for number in 0.. {
            let Some((moment, shown)) = self.exposure(symbols, &luminance_cd_m2, from_ns, number) else {
                break;
            };
            renderer.frame(1, &moment, &[shown], &mut canvas, &mut grey);
            let frame = Frame::new(&grey, sensor.width, sensor.height).expect("a whole frame");
            if let Received::Delivered(delivery) = receiver.frame(number, &frame).event {
                messages.push(delivery.message.to_vec());
            }
        }
        if let Received::Delivered(delivery) = receiver.finish() {
            messages.push(delivery.message.to_vec());
        }
        messages
    }

    /// The LEDs' state during the exposure of a frame; none if the symbols end before.
    fn exposure(
        &self,
        symbols: &[Symbol],
        luminance_cd_m2: impl Fn(u64) -> f64,
        from_ns: u64,
        number: u64,
    ) -> Option<(Moment, PanelExposure)> {
        let moment = self.renderer.moment(1, number);
        let start_ns = from_ns + (moment.start_s * 1e9) as u64;
        let symbol = symbols.partition_point(|symbol| symbol.ns <= start_ns).checked_sub(1)?;
        let window: &[_; WINDOW] = symbols.get(symbol..)?.first_chunk()?;
        let moment = Moment {
            symbol: symbol as u64,
            since_change_s: (start_ns - window[0].ns) as f64 / 1e9,
            symbol_s: (window[1].ns - window[0].ns) as f64 / 1e9,
            ..moment
        };
        let shown = PanelExposure {
            symbols: window.map(|symbol| symbol.panel),
            light: self.renderer.lit(0, luminance_cd_m2(start_ns)),
            shift_px: [0.0; 2],
        };
        Some((moment, shown))
    }
}
