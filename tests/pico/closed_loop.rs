//! (d) The closed loop: a message given to the board by `vocc`, shown on its pins, seen by a simulated camera, and received.

use std::path::Path;
use std::time::Duration;

use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::{
    FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory,
};
use sim::accuracy::Level;
use sim::camera::clock::{Moment, WINDOW};
use sim::renderer::canvas::Canvas;
use sim::renderer::{Renderer, Shown};
use sim::scene::Scene;

use link::framing::Event as Received;

use crate::emulator::{Emulator, Fault};
use crate::image::Programs;
use crate::panel::{REFLECTANCE, Record};
use crate::terminal::Terminal;
use crate::vocc::vocc;

const MESSAGE: &str = "Sent from the pins of a board";
const LUX: f64 = 4_000.0;
/// Symbols for which the message is filmed, two repeats of it.
const FILMED_MS: u32 = 700;
const PANEL_PIXELS: usize = 128 * 128;

/// What the camera sees of the board's LEDs goes to the receiver; the message comes out.
pub fn a_message_sent_to_the_board_is_received_by_a_camera(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up(programs, folder, &[]);
    let mut record = Record::default();
    board.light(LUX, Fault::None);
    record.extend(&board.run_ms(500));
    record.extend(&board.real_time(true));
    let terminal = Terminal::open(board.socket());
    vocc(
        programs,
        folder,
        &["device", "send", "--message", MESSAGE],
        terminal.name(),
    )
    .json();
    std::thread::sleep(Duration::from_millis(100));
    record.extend(&board.real_time(false));
    let filmed_from_ns = record.symbols.last().expect("symbols are shown").ns;
    record.extend(&board.run_ms(FILMED_MS));
    let messages = film(&record, filmed_from_ns);
    assert!(
        messages.iter().any(|message| message == MESSAGE.as_bytes()),
        "{messages:?}"
    );
}

/// The messages that a camera and a receiver get from the panels of a record from a time on.
fn film(record: &Record, from_ns: u64) -> Vec<Vec<u8>> {
    let overrides = [
        format!("ambient.illuminance_lx={LUX}"),
        format!("panel.reflectance={REFLECTANCE}"),
        "link.symbol_rate_hz=90".into(),
    ];
    let scene = Scene::load("paper", &overrides).expect("a valid scene");
    let renderer = Renderer::new(&scene, Level::Fast).expect("a panel in view");
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
        let Some((moment, shown)) = exposure(record, &renderer, from_ns, number) else {
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

/// What the LEDs do during the exposure of a frame; none when the record ends before.
fn exposure(
    record: &Record,
    renderer: &Renderer,
    from_ns: u64,
    number: u64,
) -> Option<(Moment, Shown)> {
    let moment = renderer.moment(number);
    let start_ns = from_ns + (moment.start_s * 1e9) as u64;
    let symbol = record
        .symbols
        .partition_point(|symbol| symbol.ns <= start_ns)
        .checked_sub(1)?;
    let window: &[_; WINDOW] = record.symbols.get(symbol..)?.first_chunk()?;
    let moment = Moment {
        symbol: symbol as u64,
        since_change_s: (start_ns - window[0].ns) as f64 / 1e9,
        symbol_s: (window[1].ns - window[0].ns) as f64 / 1e9,
        ..moment
    };
    let view = renderer.view();
    let luminance_cd_m2 = record.pulses_at(start_ns).luminance_cd_m2();
    let l2a = luminance_cd_m2 / (LUX * REFLECTANCE);
    let mut unlimited = view.panels[0].panel.clone();
    // What the board gives has passed its own limits.
    (unlimited.luminance_min_cd_m2, unlimited.luminance_max_cd_m2) = (None, None);
    let light = view
        .exposure
        .led_light(&view.scene, &unlimited, REFLECTANCE, l2a);
    let shown = Shown {
        symbols: window.map(|symbol| symbol.panel),
        light,
        shift_px: [0.0; 2],
    };
    Some((moment, shown))
}
