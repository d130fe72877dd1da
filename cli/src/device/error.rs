//! Errors between a computer and a board.

use link::l2a_table::image::ImageError;
use link::serial::{Refusal, VERSION};
use link::symbol_rate::SymbolRate;

use crate::pin::PinError;

/// Why a board did not execute a request. Only errors on opening name the port; for others the caller adds it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DeviceError {
    /// There is no such port.
    #[error("there is no port {port}: plug the transmitter in; `vocc device list` shows all ports")]
    NoSuchPort {
        /// Its name.
        port: String,
    },
    /// Another program uses it.
    #[error("port {port} is busy: close the other program that uses it")]
    Busy {
        /// Its name.
        port: String,
    },
    /// Permission denied.
    #[error(
        "port {port} may not be opened: become a member of the group that owns it (on Debian \
         `sudo adduser $USER dialout`, then log in anew)"
    )]
    Forbidden {
        /// Its name.
        port: String,
    },
    /// Not a usable port.
    #[error("{port} cannot be opened as a serial port ({why}): `vocc device list` shows all ports")]
    NoPort {
        /// Its name.
        port: String,
        /// The system's error.
        why: String,
    },
    /// The port closed while in use.
    #[error("the connection broke ({why}): plug the transmitter in again, and repeat the command")]
    Disconnected {
        /// The system's error.
        why: String,
    },
    /// No byte arrives.
    #[error(
        "nothing answers after {tries} tries: is the transmitter on, and is this its port? Another --baud or a longer --timeout may help"
    )]
    Silent {
        /// Attempts.
        tries: u32,
    },
    /// Bytes arrive, but no answer.
    #[error("the device is not a transmitter, or uses another --baud: {bytes} bytes came in {tries} tries, without a valid frame")]
    NoTransmitter {
        /// Bytes received.
        bytes: usize,
        /// Attempts.
        tries: u32,
    },
    /// The protocol version differs.
    #[error(
        "the transmitter uses protocol {theirs}, this program {VERSION}: update the {}",
        if *.theirs < VERSION { "transmitter's firmware" } else { "program" }
    )]
    Version {
        /// Its version.
        theirs: u8,
    },
    /// The message schema differs.
    #[error(
        "the board's firmware {firmware} has other messages than this program (schema {theirs:08x}, here {ours:08x}): update the older one"
    )]
    Schema {
        /// Its schema.
        theirs: u32,
        /// This program's.
        ours: u32,
        /// Its firmware's version.
        firmware: String,
    },
    /// The board is a receiver, and the command is for transmitters.
    #[error(
        "{board} is a receiver, and this command is for transmitters: receivers know `vocc device status`, `watch`, `snapshot` and `rate`; \
         check the port"
    )]
    IsReceiver {
        /// Board name.
        board: String,
    },
    /// The board is a transmitter, and the command is for receivers.
    #[error("{board} is a transmitter, and this command is for receivers: check the port")]
    IsTransmitter {
        /// Board name.
        board: String,
    },
    /// A receiver refused.
    #[error("the receiver refuses: {0}")]
    ReceiverRefused(#[from] rx_pipeline::standalone::Refusal),
    /// The answer does not match the request.
    #[error("the board's answer does not match the request: update the older side")]
    Unexpected,
    /// The firmware predates the request.
    #[error(
        "its firmware is too old to report its symbol rate, which is {} a second: flash the current one (docs/hardware.md)",
        SymbolRate::DEFAULT
    )]
    NoSymbolRate,
    /// The firmware predates carriers.
    #[error(
        "its firmware is too old to show a carrier, and nothing was changed: flash the current one (docs/hardware.md), or leave \
         --carrier-cycles out"
    )]
    NoCarrier,
    /// The firmware predates keys.
    #[error("its firmware is too old to sign messages, and nothing was changed: flash the current one (docs/hardware.md)")]
    NoKey,
    /// The firmware predates locks.
    #[error("its firmware is too old to be locked, and nothing was changed: flash the current one (docs/hardware.md)")]
    NoLock,
    /// The firmware predates the hash of its program, or cannot read it.
    #[error("it does not report the hash of its program: flash the present firmware of a transmitter (docs/hardware.md)")]
    NoProgramHash,
    /// There is no PIN.
    #[error(transparent)]
    Pin(#[from] PinError),
    /// The firmware predates test panels.
    #[error("its firmware is too old to show test panels, and nothing was changed: flash the current one (docs/hardware.md)")]
    NoTest,
    /// A test panel's time is too short for the symbol rate.
    #[error(
        "--step {step_s} is too short at {symbol_rate_hz} symbols a second: a test panel needs {least_s:.2} s or more; give a longer \
         --step, or raise the symbol rate by `vocc device rate`"
    )]
    ShortStep {
        /// Its time, s.
        step_s: f64,
        /// The least, s.
        least_s: f64,
        /// The rate in use.
        symbol_rate_hz: f64,
    },
    /// The board answers, and shows no new symbols.
    #[error("it answers, and its symbols stand still: it showed no new one in {0} s; restart it, and repeat the test")]
    Halted(
        /// Time waited, s.
        u64,
    ),
    /// The board counts its symbols from 0 again.
    #[error("it restarted during the test: look at its supply and at `vocc device status`, and repeat the test")]
    Restarted,
    /// The firmware predates the intensity limit.
    #[error(
        "its firmware is too old for max_cd and led_diameter_m, and nothing was changed: flash the current one (docs/hardware.md), or \
         leave both out"
    )]
    NoIntensityLimit,
    /// A transmitter refused.
    #[error("the transmitter refuses: {0}")]
    Refused(#[from] Refusal),
    /// A table transfer never completed.
    #[error("the table was not transferred in {attempts} attempts, the last time because {last}: check the cable")]
    Table {
        /// Attempts.
        attempts: u32,
        /// The last reason.
        last: String,
    },
    /// The transmitter's table is invalid.
    #[error("the transmitter's table cannot be used: {0}")]
    Image(#[from] ImageError),
}

impl DeviceError {
    /// This error, or the meaning of a request that the firmware does not know.
    pub fn if_unknown(self, meaning: Self) -> Self {
        match self {
            Self::Refused(Refusal::Unknown) => meaning,
            other => other,
        }
    }
}
