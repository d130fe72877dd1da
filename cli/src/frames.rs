//! Camera frames from files or a stream, of any depth and colour, converted to the 8-bit grey that the receiver reads.
//!
//! | module | content |
//! |---|---|
//! | [`files`] | the frames of a folder, and their numbers from file names |
//! | [`names`] | file type and frame number by name |
//! | [`film`] | frames of a film, by ffmpeg |
//! | [`address`] | URLs among the names of sources |
//! | [`live`] | names of cameras, addresses and pipes, and ffmpeg's options for them |
//! | [`secrets`] | passwords in addresses and options, hidden in all output |
//! | [`cameras`] | the cameras of this computer |
//! | [`waiting`] | queue of frames not read yet |
//! | [`foreign`] | advice for unrecognised sources |
//! | [`stamps`] | time stamps of a folder's frames |
//! | [`picture`] | grey of a PNG, JPEG or PGM file |
//! | [`mosaic`] | one channel of a colour filter mosaic |
//!
//! Channel selection, reduction to 8 bits, y4m and raw bytes are in [`reception`], because other programs use them too.

mod address;
pub mod cameras;
pub mod files;
pub mod film;
pub mod foreign;
pub mod live;
mod mosaic;
mod names;
pub mod picture;
pub mod secrets;
pub mod stamps;
pub mod waiting;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
pub use mosaic::Mosaic as Bayer;
use reception::colour::Channel;

/// How to read the pixels of files.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct PixelArguments {
    /// The channel to read from colour pictures: brightest (of each pixel), red, green, blue or grey.
    #[arg(long, value_name = "CHANNEL", value_parser = channel())]
    pub channel: Option<Channel>,
    /// The sensor's colour filters, if frames are its raw mosaic: RGGB, BGGR, GRBG or GBRG, from the top-left pixel on.
    #[arg(long, value_name = "FILTERS")]
    pub bayer: Option<Bayer>,
    /// Bits per sample in pictures of more than 8 bits, 9 to 16. Default: as many as the first and some other pictures need.
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(9..=16))]
    pub depth: Option<u8>,
}

fn channel() -> impl TypedValueParser<Value = Channel> {
    let names = Channel::NAMES.map(|(name, about, _)| match about {
        "" => PossibleValue::new(name),
        about => PossibleValue::new(name).help(about),
    });
    PossibleValuesParser::new(names).try_map(|name| name.parse::<Channel>())
}

impl PixelArguments {
    /// Fills unset options from `others`.
    pub fn or(self, others: Self) -> Self {
        Self {
            channel: self.channel.or(others.channel),
            bayer: self.bayer.or(others.bayer),
            depth: self.depth.or(others.depth),
        }
    }
}
