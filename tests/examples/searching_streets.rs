//! Measures the cost of searching streets without a panel, and the delay until one that appears is found.
//!
//! `cargo run --release -p vocc-tests --example searching_streets -- [FILMS] [FIRST SEED] [FRAMES] [WIDTHxHEIGHT] [PITCH PX] [APPEARS]`
//!
//! Without a pitch there is no panel; with one it appears in frame APPEARS. Times are Linux CPU times of the thread, as means per frame:
//! over all frames and from the 33rd on.

use reception::{PanelEvent, Reception, ReceptionSettings, Stamp};
use rx_pipeline::frame::Frame;
use vocc_tests::streets::{Drawing, MESSAGE, MOTIONS, SYMBOLS_PER_FRAME, Street};

const FPS: f32 = 100.0;
/// Frames after which a receiver without a detection reduces its effort.
const LATE: usize = 32;

/// CPU time of this thread, in ms.
fn processor_ms() -> f64 {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let nanoseconds = times.split(' ').next().and_then(|time| time.parse::<f64>().ok());
    nanoseconds.expect("a time") / 1e6
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<f64>().ok());
    let films = number(0).unwrap_or(3.0) as u64;
    let first = number(1).unwrap_or(1.0) as u64;
    let frames = number(2).unwrap_or(60.0) as usize;
    let size = arguments.get(3).map_or("1280x720", String::as_str);
    let size = size.split_once('x').expect("WIDTHxHEIGHT");
    let size = [size.0, size.1].map(|side| side.parse::<usize>().expect("a count of pixels"));
    let pitch_px = number(4);
    let appears = number(5).unwrap_or(0.0) as usize;
    for (motion, name) in MOTIONS {
        let (mut times, mut late) = (Vec::new(), Vec::new());
        let (mut found, mut delivered, mut wrong) = (Vec::new(), 0, 0);
        for seed in first..first + films {
            let mut drawing = Drawing::new(Street {
                seed,
                size,
                motion,
                pitch_px,
                appears,
            });
            let settings = ReceptionSettings {
                fps: FPS,
                symbol_rate_hz: Some(FPS * SYMBOLS_PER_FRAME as f32),
                ..ReceptionSettings::default()
            };
            let mut reception = Reception::new(settings).expect("settings");
            let (mut first_seen, mut came) = (None, false);
            for number in 0..frames {
                let grey = drawing.take(number);
                let frame = Frame::new(&grey, size[0], size[1]).expect("a frame");
                let begun = processor_ms();
                let reports = reception.frame(Stamp::of(number as u64), &frame, &Err(String::new()), &mut ());
                let time_ms = processor_ms() - begun;
                times.push(time_ms);
                if number >= LATE {
                    late.push(time_ms);
                }
                for report in &reports.expect("a report") {
                    came |= report
                        .events
                        .iter()
                        .any(|event| matches!(event, PanelEvent::Message(message) if message.data == MESSAGE));
                    let Ok(reading) = &report.reading else { continue };
                    let [x, y] = reading.corners.centre_px().map(f64::from);
                    let centre = drawing.centre_px().filter(|_| number >= appears);
                    let is_right = centre.is_some_and(|centre| (x - centre[0]).hypot(y - centre[1]) < 0.5 * pitch_px.unwrap_or(0.0));
                    if is_right {
                        first_seen.get_or_insert(number);
                    } else {
                        wrong += 1;
                    }
                }
            }
            delivered += u32::from(came);
            found.push(first_seen.map_or(String::from("–"), |number| number.to_string()));
        }
        let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len().max(1) as f64;
        println!(
            "{name:14} {:5.1} ms a frame, {:5.1} from frame {LATE} on; found in frame {}, {delivered} delivered, {wrong} wrong",
            mean(&times),
            mean(&late),
            found.join(" ")
        );
    }
}
