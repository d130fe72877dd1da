//! The Pico 2's receiver on this computer: the same application, before a camera that exposes as it asks.

use link::camera::{Camera as Lens, Encoding};
use rx_pipeline::detect::Detector;
use rx_pipeline::hm01b0::{BLACK_GREY, CameraError, Exposure, Mode};
use rx_pipeline::receiver::{BlinkSearch, NoSearch, Proof, Receiver, ReceiverMemory, ReceiverSettings};
use rx_pipeline::standalone::{Application, Camera, Clock, Counters, Machine, PanelReceiver, Port, Settings};

/// As in the Pico 2's program: how it reads, and what it expects to read. Where these are others the two ends differ, and the test fails.
pub const MODE: Mode = Mode::QVGA;
pub const SYMBOL_MILLIHERTZ: u32 = 20_400;
const PIXELS: usize = 48 * 48;

type Reader = PanelReceiver<PIXELS, Box<ReceiverMemory<PIXELS>>, Vec<u8>>;

/// What a receiver says of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Said {
    pub readings: u32,
    pub found: u32,
    pub lost: u32,
    pub messages: u32,
    pub exposure: Exposure,
}

impl Said {
    fn of(counters: Counters, exposure: Exposure) -> Self {
        Self {
            readings: counters.readings,
            found: counters.found,
            lost: counters.lost,
            messages: counters.messages,
            exposure,
        }
    }
}

/// What it runs on here.
#[derive(Default)]
pub struct Bench {
    now_us: u64,
    text: Vec<u8>,
}

/// A receiver that has begun.
pub struct Here {
    application: Application<&'static mut Reader>,
    bench: Bench,
    frames: u64,
}

impl Here {
    pub fn start() -> Self {
        let settings = ReceiverSettings {
            camera: Lens {
                encoding: Encoding::LINEAR,
                black_grey: BLACK_GREY.into(),
                blur_sigma_px: 0.7,
                blur_aspect: 1.0,
                read_noise_e: Lens::USUAL_READ_NOISE_E as f32,
            },
            method: Detector::KMeans.into(),
            symbols_per_frame: 1.0,
        };
        let memory = Box::<ReceiverMemory<PIXELS>>::default();
        let room = vec![0; BlinkSearch::bytes(MODE.width(), MODE.height())];
        let reader = Box::leak(Box::new(PanelReceiver {
            receiver: Receiver::new(settings, memory, NoSearch).expect("a usable link"),
            settings,
            search: BlinkSearch::new(room),
            proof: Proof::new(1.0),
        }));
        let settings = Settings {
            mode: MODE,
            symbol_millihertz: SYMBOL_MILLIHERTZ,
            was_reset: false,
        };
        let mut application = Application::new(reader, settings).expect("a rate in its range");
        let mut bench = Bench::default();
        application.start(&mut bench);
        Self {
            application,
            bench,
            frames: 0,
        }
    }

    /// How the camera is to expose.
    pub fn exposure(&self) -> Exposure {
        self.application.exposure()
    }

    /// Takes in the next frame.
    pub fn frame(&mut self, pixels: &[u8]) -> Said {
        self.frames += 1;
        self.bench.now_us = self.frames * u64::from(MODE.period_us());
        let Self { application, bench, .. } = self;
        application.frame(pixels, bench.now_us, bench);
        Said::of(application.counters(), application.exposure())
    }

    /// What it wrote, line by line.
    pub fn text(&self) -> Vec<String> {
        let text = String::from_utf8_lossy(&self.bench.text);
        text.lines().map(str::to_owned).collect()
    }
}

impl Camera for Bench {
    fn start(&mut self, _: Exposure) -> Result<(), CameraError> {
        Ok(())
    }

    fn expose(&mut self, _: Exposure) -> Result<(), CameraError> {
        Ok(())
    }
}

impl Clock for Bench {
    fn micros(&self) -> u64 {
        self.now_us
    }
}

impl Port for Bench {
    fn read(&mut self) -> Option<u8> {
        None
    }

    fn write(&mut self, bytes: &[u8]) {
        self.text.extend_from_slice(bytes);
    }
}

impl Machine for Bench {
    const BOARD: &'static str = "receiver-bench";
    const FIRMWARE: &'static str = "0";

    fn alive(&mut self) {}

    fn lamp(&mut self, _: bool) {}

    fn stack_bytes(&self) -> u32 {
        0
    }

    fn cut_short(&self) -> u32 {
        0
    }
}
