//! What the camera of a Pico 2 sees of a panel, exposed as the receiver on this computer asked for it.

use std::io::{self, Write};
use std::iter;

use link::fec::Code;
use link::framing::Framer;
use link::l2a_table::{Illuminance, Interval, L2aTable};
use link::panel::PanelFrame;
use rx_pipeline::hm01b0::{BLACK_GREY, Exposure, LINE_CLOCKS, PIXEL_CLOCK_HZ};
use vocc_tests::driven_panel::{Cycles, FULL_CD_M2, REFLECTANCE};
use vocc_tests::hm01b0::{Eye, FrameRequest};

use crate::here::{Here, MODE, SYMBOL_MILLIHERTZ, Said};

/// The hall's light, lx.
const LUX: f64 = 500.0;
/// Frames of a film: 6.7 s, and as many as the board has memory for.
const FRAMES: usize = 200;
/// From the first frame on the transmitter has no power for so long; its symbols begin at another time than frames.
pub const DARK_S: f64 = 1.01;
/// When the first frame is read.
const START_S: f64 = 1.0;
/// Of the transmitter's dimming, cycles.
const PERIOD_CYCLES: u32 = 20_000;
const LINE_NS: f64 = LINE_CLOCKS as f64 * 1e9 / PIXEL_CLOCK_HZ as f64;
/// An exposure that is asked for after a frame is that of the next but one: the next is being read by then.
const DELAY_FRAMES: usize = 2;

/// What a panel shows, where it stands, and how it moves once it is found.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    pub text: &'static str,
    pub distance_m: f64,
    /// The gap between its LEDs over their diameter of 30 mm.
    pub interval: f64,
    /// To the right, from frame to frame.
    pub drift_m: f64,
}

/// Frames, and what this computer's receiver made of them.
pub struct Film {
    frames: Vec<Vec<u8>>,
    /// What it said of each.
    pub said: Vec<Said>,
    /// Its text, line by line.
    pub text: Vec<String>,
}

impl Film {
    /// A film of a panel.
    pub fn draw(panel: Panel) -> Self {
        let x_m = -0.2;
        let mut eye = Eye::new(
            "hm01b0",
            &[
                format!("pose.distance_m={}", panel.distance_m),
                format!("panel.interval={}", panel.interval),
                format!("pose.x_m={x_m}"),
                format!("ambient.illuminance_lx={LUX}"),
            ],
        )
        .expect("a scene");
        let (symbols, pulse) = (symbols(panel.text), pulse(panel.interval));
        let mut here = Here::start();
        let mut exposures = vec![here.exposure(); DELAY_FRAMES];
        let (mut frames, mut said) = (vec![], Vec::<Said>::new());
        let mut followed_frames = 0.0;
        for number in 0..FRAMES {
            let is_found = said.last().is_some_and(|last| last.found > last.lost);
            if is_found && panel.drift_m != 0.0 {
                followed_frames += 1.0;
                let now_m = x_m + panel.drift_m * followed_frames;
                eye.change(&[format!("pose.x_m={now_m}")]).expect("a place");
            }
            let asked = request(number, exposures[number], &symbols, pulse);
            let pixels = eye.see(&asked).expect("the panel is in view");
            said.push(here.frame(&pixels));
            exposures.push(here.exposure());
            frames.push(pixels);
        }
        Self {
            frames,
            said,
            text: here.text(),
        }
    }

    /// As the board's program reads it: the number of frames, and their grey levels.
    pub fn write(&self, to: &mut impl Write) -> io::Result<()> {
        to.write_all(&(self.frames.len() as u32).to_le_bytes())?;
        self.frames.iter().try_for_each(|frame| to.write_all(frame))
    }
}

/// When each symbol begins, ns, and its LEDs.
fn symbols(text: &str) -> Vec<(f64, String)> {
    let code = Code::for_length(text.len());
    let mut framer = Framer::new(text.as_bytes(), code, false).expect("a short text");
    let symbol_ns = 1e12 / f64::from(SYMBOL_MILLIHERTZ);
    let count = (FRAMES as f64 * period_ns() / symbol_ns) as u32;
    let shown = (0..count).map(|number| {
        let begins_ns = 1e9 * (START_S + DARK_S) + f64::from(number) * symbol_ns;
        (begins_ns, digits(framer.next_panel()))
    });
    let dark = (0.0, digits(PanelFrame::default()));
    iter::once(dark).chain(shown).collect()
}

fn digits(panel: PanelFrame) -> String {
    format!("{:016x}", panel.bits())
}

fn period_ns() -> f64 {
    f64::from(MODE.frame_lines) * LINE_NS
}

fn request(number: usize, exposure: Exposure, symbols: &[(f64, String)], pulse: Cycles) -> FrameRequest {
    FrameRequest {
        number: number as u64,
        ns: 1e9 * START_S + number as f64 * period_ns(),
        width: MODE.width(),
        height: MODE.height(),
        binned: MODE.is_binned,
        line_nanos: LINE_NS,
        frame_nanos: period_ns(),
        exposure_lines: exposure.lines.into(),
        gain: f64::from(1 << exposure.gain_log2),
        black: BLACK_GREY.into(),
        symbols: symbols.to_vec(),
        pulse,
    }
}

/// The pulses by which the board's typical panel has the luminance that the table which ships asks for in this light.
fn pulse(interval: f64) -> Cycles {
    let (light, interval) = (Illuminance::saturating_from_num(LUX), Interval::saturating_from_num(interval));
    let l2a = L2aTable::default().l2a(light, interval);
    let duty = l2a.to_num::<f64>() * LUX * REFLECTANCE / FULL_CD_M2;
    Cycles {
        lit_cycles: (duty * f64::from(PERIOD_CYCLES)).round() as u32,
        period_cycles: PERIOD_CYCLES,
        low_current: false,
    }
}
