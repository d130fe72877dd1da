use super::*;
use crate::standalone::tests::{BINNED, QVGA};
use core::cell::Cell;
use core::convert::Infallible;
use embedded_hal::i2c::{ErrorKind, ErrorType, NoAcknowledgeSource, Operation};
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// A delay that returns at once and adds up the time.
struct Wait(Rc<Cell<u64>>);

impl DelayNs for Wait {
    fn delay_ns(&mut self, ns: u32) {
        self.0.set(self.0.get() + u64::from(ns));
    }
}

/// A camera's registers; those in `stuck` do not change.
struct Fake {
    registers: BTreeMap<u16, u8>,
    stuck: Option<u16>,
    is_there: bool,
    order: std::vec::Vec<u16>,
    waited_ns: Rc<Cell<u64>>,
    /// The end of the reset, in time waited.
    resets_until_ns: u64,
}

impl Fake {
    fn new() -> Self {
        Self {
            registers: BTreeMap::from([(0, 0x01), (1, 0xb0), (AUTO_EXPOSURE, 1)]),
            stuck: None,
            is_there: true,
            order: std::vec::Vec::new(),
            waited_ns: Rc::default(),
            resets_until_ns: 0,
        }
    }
}

#[derive(Debug)]
struct NoAnswer;

impl embedded_hal::i2c::Error for NoAnswer {
    fn kind(&self) -> ErrorKind {
        ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)
    }
}

impl From<Infallible> for NoAnswer {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

impl ErrorType for &mut Fake {
    type Error = NoAnswer;
}

impl I2c for &mut Fake {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), NoAnswer> {
        if !self.is_there || address != ADDRESS {
            return Err(NoAnswer);
        }
        assert!(self.waited_ns.get() >= self.resets_until_ns, "it resets");
        match operations {
            [Operation::Write([high, low, value])] => {
                let register = u16::from_be_bytes([*high, *low]);
                self.order.push(register);
                if register == SOFTWARE_RESET {
                    self.resets_until_ns = self.waited_ns.get() + 100_000_000;
                }
                if self.stuck != Some(register) {
                    self.registers.insert(register, *value);
                }
            }
            [Operation::Write([high, low]), Operation::Read(buffer)] => {
                let register = u16::from_be_bytes([*high, *low]);
                buffer[0] = self.registers.get(&register).copied().unwrap_or(0);
            }
            other => panic!("no camera takes {} operations", other.len()),
        }
        Ok(())
    }
}

const EXPOSURE: Exposure = Exposure {
    lines: 0x0123,
    gain_log2: 2,
};

fn start(fake: &mut Fake, mode: Mode) -> Result<(), CameraError> {
    let wait = Wait(fake.waited_ns.clone());
    Hm01b0::new(fake, wait, mode).start(EXPOSURE)
}

#[test]
fn a_camera_is_set_up_and_streams_last() {
    for (mode, step, binning, frame_lines) in [(Mode::QVGA, 1, 0, 266), (Mode::BINNED, 3, 3, 603)] {
        let mut fake = Fake::new();
        start(&mut fake, mode).unwrap();
        let held = |register: u16| fake.registers[&register];
        assert_eq!([held(0x0202), held(0x0203)], [0x01, 0x23]);
        assert_eq!(held(0x0205), 2 << 4);
        assert_eq!(u16::from_be_bytes([held(0x0340), held(0x0341)]), frame_lines);
        assert_eq!([held(0x0383), held(0x0387), held(0x0390)], [step, step, binning]);
        assert_eq!([held(0x2100), held(0x1008), held(0x0100)], [0, 0, 1]);
        assert_eq!(fake.order.last(), Some(&MODE_SELECT));
    }
}

#[test]
fn what_is_wrong_is_said() {
    let start = |fake: &mut Fake| start(fake, Mode::QVGA);
    let mut silent = Fake::new();
    silent.is_there = false;
    assert_eq!(start(&mut silent), Err(CameraError::Silent));

    let mut other = Fake::new();
    other.registers.insert(1, 0x60);
    assert_eq!(start(&mut other), Err(CameraError::WrongId { id: 0x0160 }));

    let mut stuck = Fake::new();
    stuck.stuck = Some(AUTO_EXPOSURE);
    let expected = CameraError::Register {
        register: AUTO_EXPOSURE,
        written: 0,
        holds: 1,
    };
    assert_eq!(start(&mut stuck), Err(expected));
}

/// If a register of the read-out or the exposure does not keep its value, the first one is named, and no frames begin.
#[test]
fn each_setting_is_read_back() {
    for mode in [Mode::QVGA, Mode::BINNED] {
        for (register, written) in read_out(mode).into_iter().chain(exposing(EXPOSURE)) {
            let mut fake = Fake::new();
            let holds = !written;
            fake.registers.insert(register, holds);
            fake.stuck = Some(register);
            let expected = CameraError::Register { register, written, holds };
            assert_eq!(start(&mut fake, mode), Err(expected));
            assert_eq!(fake.registers[&MODE_SELECT], 0);
        }
    }
}

/// Datasheet: the line length and the frame length over the pixel clock make the frame rate.
#[test]
fn frames_come_as_often_as_said() {
    let modes = [Mode::QVGA, Mode::BINNED].map(|mode| mode.camera_mode().checked().unwrap());
    assert_eq!(modes.map(|mode| mode.period_us()), [33_338, 75_576]);
    assert_eq!(modes.map(|mode| mode.exposure_us(EXPOSURE)), [36_472; 2]);
}

/// The cameras in the receiver's tests are this one.
#[test]
fn the_receiver_is_tested_with_this_camera() {
    assert_eq!(Mode::QVGA.camera_mode(), QVGA);
    assert_eq!(Mode::BINNED.camera_mode(), BINNED);
}

/// No other module knows this camera: the receiver has any that a board implements.
#[test]
fn no_other_module_uses_this_driver() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = std::vec![sources.clone()];
    let mut looked_at = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(&sources).unwrap().with_extension("");
            if name.starts_with("hm01b0") || name == Path::new("lib") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(!text.contains("hm01b0"), "{} uses the driver", path.display());
            looked_at += usize::from(name.starts_with("standalone"));
        }
    }
    assert!(looked_at > 10, "{looked_at}");
}
