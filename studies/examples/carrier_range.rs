//! The cost of a carrier: net rate and range compared with still panels, over frame rate, readout and exposure of a camera.
//!
//! `cargo run --release -p vocc-studies --example carrier_range -- SCENE [FILMS]`, for example `night 4`. The receiver is not configured.
//! Symbols are sent at 0.9 a frame, with whole cycles of about 1440 Hz. The range is the greatest of distances 10 m apart at which 48 bytes
//! arrive in three quarters of the films of 3 s, but at least 150 frames. The net rate, at 50 m, is that of 256 bytes from their first
//! frame to their last one; a message that takes more than 10 s counts as 0.

use rand::RngExt;
use rx_pipeline::detect::Method;
use sim::random::{Purpose, stream};
use sim::road::{LinkSettings, ReceivedMessage, Road};
use sim::scene::Scene;

/// Bytes of a message for the range, and for the net rate.
const BYTES: [usize; 2] = [48, 256];
const CARRIER_HZ: f64 = 1440.0;
const SYMBOLS_A_FRAME: f64 = 0.9;
const FRAMES_HZ: [f64; 3] = [100.0, 60.0, 30.0];
/// The readout, in frame periods.
const READOUTS: [f64; 2] = [0.0, 0.8];
const EXPOSURES: [u32; 4] = [4000, 2000, 1000, 500];
const NEAR_M: u32 = 20;
const STEP_M: u32 = 10;
/// Beyond, no panel of interval 1 is found.
const STEPS: u32 = 9;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// A camera, and the cycles of a symbol.
struct Link<'a> {
    preset: &'a str,
    frames_hz: f64,
    readout_s: f64,
    exposure_s: f64,
    cycles: u16,
}

impl Link<'_> {
    fn scene(&self, distance_m: f64, phase: f64) -> Outcome<Scene> {
        let settings = [
            format!("camera.frame_rate_hz={}", self.frames_hz),
            format!("camera.readout_s={}", self.readout_s),
            format!("camera.exposure_s={}", self.exposure_s),
            "camera.width_px=480".into(),
            "camera.height_px=360".into(),
            format!("link.symbol_rate_hz={}", SYMBOLS_A_FRAME * self.frames_hz),
            format!("link.carrier_cycles={}", self.cycles),
            format!("link.phase={phase}"),
            format!("pose.distance_m={distance_m}"),
        ];
        Ok(Scene::load(self.preset, &settings)?)
    }

    /// A message of that many random bytes, if it arrives within these frames.
    fn send(&self, bytes: usize, distance_m: f64, seed: u64, frames: f64) -> Outcome<Option<ReceivedMessage>> {
        let random = &mut stream(seed, 0, Purpose::Setting);
        let message: Vec<u8> = (0..bytes).map(|_| random.random()).collect();
        let scene = self.scene(distance_m, random.random())?;
        let mut road = Road::new(&scene, &LinkSettings::new(message.clone(), Method::default(), seed))?;
        for frame in 0..frames as u64 {
            if let Some(received) = road.frame(frame)?.delivered.filter(|received| received.message == message) {
                return Ok(Some(received));
            }
        }
        Ok(None)
    }

    /// The greatest distance at which three quarters of the films deliver, by halving; 0 if they do at none.
    fn range_m(&self, films: u64) -> Outcome<u32> {
        let frames = (3.0 * self.frames_hz).max(150.0);
        let [mut within, mut beyond] = [0, STEPS + 1];
        while beyond - within > 1 {
            let middle = (within + beyond) / 2;
            let mut delivered = 0;
            for seed in 1..=films {
                delivered += u64::from(
                    self.send(BYTES[0], f64::from(NEAR_M + STEP_M * (middle - 1)), seed, frames)?
                        .is_some(),
                );
            }
            *(if 4 * delivered >= 3 * films { &mut within } else { &mut beyond }) = middle;
        }
        Ok(if within == 0 { 0 } else { NEAR_M + STEP_M * (within - 1) })
    }

    /// The mean net rate of the films at 50 m, bit/s.
    fn net_bit_s(&self, films: u64) -> Outcome<f64> {
        let mut sum = 0.0;
        for seed in 1..=films {
            if let Some(received) = self.send(BYTES[1], 50.0, seed, 10.0 * self.frames_hz)? {
                sum += (8 * BYTES[1]) as f64 * self.frames_hz / (received.last_frame - received.first_frame + 1) as f64;
            }
        }
        Ok(sum / films as f64)
    }
}

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let preset = arguments.first().ok_or("give SCENE [FILMS], such as day 4")?;
    let films = arguments.get(1).map_or(Ok(4), |films| films.parse())?;
    println!("| frames/s | readout | exposure | carrier | net bit/s, still | carrier | of it | range, still | carrier | of it |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (frames_hz, readout) in FRAMES_HZ.into_iter().flat_map(|hz| READOUTS.map(|readout| (hz, readout))) {
        for exposure in EXPOSURES {
            let cycles = (CARRIER_HZ / (SYMBOLS_A_FRAME * frames_hz)).round();
            let link = |cycles| Link {
                preset,
                frames_hz,
                readout_s: readout / frames_hz,
                exposure_s: 1.0 / f64::from(exposure),
                cycles,
            };
            let links = [link(0), link(cycles as u16)];
            let [still, carried] = [links[0].net_bit_s(films)?, links[1].net_bit_s(films)?];
            let [still_m, carried_m] = [links[0].range_m(films)?, links[1].range_m(films)?];
            let of_it = |part: f64, whole: f64| {
                if whole == 0.0 {
                    "".into()
                } else {
                    format!("{:.0} %", 100.0 * part / whole)
                }
            };
            println!(
                "| {frames_hz} | {:.0} ms | 1/{exposure} s | {:.0} Hz | {still:.0} | {carried:.0} | {} | {still_m} m | {carried_m} m | {} |",
                1e3 * readout / frames_hz,
                cycles * SYMBOLS_A_FRAME * frames_hz,
                of_it(carried, still),
                of_it(carried_m.into(), still_m.into())
            );
        }
    }
    Ok(())
}
