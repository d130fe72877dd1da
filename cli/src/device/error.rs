//! What can go wrong between a computer and a board.

use link::l2a_table::image::ImageError;
use link::serial::{Refusal, VERSION};
use link::symbol_rate::SymbolRate;

/// Why a board did not do what it was asked. Only errors of opening name the port; for others the caller adds it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DeviceError {
    /// There is no such port.
    #[error("there is no port {port}: plug the transmitter in; `vocc device list` shows the ports there are")]
    NoSuchPort {
        /// Its name.
        port: String,
    },
    /// Another program has it.
    #[error("port {port} is busy: end the other program that has it open")]
    Busy {
        /// Its name.
        port: String,
    },
    /// The user may not open it.
    #[error(
        "port {port} may not be opened: become a member of the group that owns it (on Debian \
         `sudo adduser $USER dialout`, then log in anew)"
    )]
    Forbidden {
        /// Its name.
        port: String,
    },
    /// It is something else.
    #[error("{port} cannot be opened as a serial port ({why}): `vocc device list` shows the ports there are")]
    NoPort {
        /// Its name.
        port: String,
        /// What the system says.
        why: String,
    },
    /// The port closed while it was in use.
    #[error("the connection broke ({why}): plug the transmitter in again, and repeat the command")]
    Disconnected {
        /// What the system says.
        why: String,
    },
    /// Nothing comes back.
    #[error(
        "nothing answers after {tries} tries: is the transmitter on, and is this its port? Another --baud or a longer --timeout may help"
    )]
    Silent {
        /// How often it was asked.
        tries: u32,
    },
    /// Something comes back, but no answer.
    #[error("what answers is not a transmitter, or not at this --baud: {bytes} bytes came in {tries} tries, and no frame among them")]
    NoTransmitter {
        /// How many bytes came.
        bytes: usize,
        /// How often it was asked.
        tries: u32,
    },
    /// It speaks another version.
    #[error(
        "the transmitter speaks protocol {theirs}, this program {VERSION}: update the {}",
        if *.theirs < VERSION { "transmitter's firmware" } else { "program" }
    )]
    Version {
        /// The version it speaks.
        theirs: u8,
    },
    /// It speaks another dialect of the same version.
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
    /// A receiver is there, and the command is for transmitters.
    #[error(
        "{board} is a receiver, and this is for transmitters: receivers know `vocc device status`, `watch`, `snapshot` and `rate`; \
         is this the port?"
    )]
    IsReceiver {
        /// The name of its board.
        board: String,
    },
    /// A transmitter is there, and the command is for receivers.
    #[error("{board} is a transmitter, and this is for receivers: is this the port?")]
    IsTransmitter {
        /// The name of its board.
        board: String,
    },
    /// A receiver refuses.
    #[error("the receiver refuses: {0}")]
    ReceiverRefused(#[from] rx_pipeline::standalone::Refusal),
    /// It answers something else than was asked for.
    #[error("the board answers something else than was asked for: update the older side")]
    Unexpected,
    /// It is older than the request.
    #[error(
        "its firmware is too old to be asked for its symbol rate, and shows {} a second: flash the present one (docs/hardware.md)",
        SymbolRate::DEFAULT
    )]
    NoSymbolRate,
    /// It is older than carriers.
    #[error(
        "its firmware is too old to show a carrier, and nothing was changed: flash the present one (docs/hardware.md), or leave \
         --carrier-cycles out"
    )]
    NoCarrier,
    /// It is older than keys.
    #[error("its firmware is too old to sign messages, and nothing was changed: flash the present one (docs/hardware.md)")]
    NoKey,
    /// It is older than the limit of its intensity.
    #[error(
        "its firmware is too old for max_cd and led_diameter_m, and nothing was changed: flash the present one (docs/hardware.md), or leave \
         both out"
    )]
    NoIntensityLimit,
    /// It refuses.
    #[error("the transmitter refuses: {0}")]
    Refused(#[from] Refusal),
    /// A table never came through whole.
    #[error("the table did not come through in {attempts} attempts, at last because {last}: check the cable")]
    Table {
        /// How often it was begun.
        attempts: u32,
        /// The last reason.
        last: String,
    },
    /// The transmitter holds a table that is none.
    #[error("the transmitter's table cannot be used: {0}")]
    Image(#[from] ImageError),
}
