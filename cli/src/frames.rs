//! Frames as cameras give them: files or a stream, of any depth, in colour or not, made into the 8-bit grey that the receiver reads.
//!
//! | part | makes |
//! |---|---|
//! | [`files`] | the frames of a folder, and the numbers that their names give them |
//! | [`names`] | what a file is, and which frame, by its name |
//! | [`film`] | the frames of a film, by ffmpeg |
//! | [`live`] | what cameras, addresses and named pipes are called, and how ffmpeg reads them |
//! | [`cameras`] | the cameras of this computer |
//! | [`waiting`] | frames that came and were not read yet |
//! | [`foreign`] | what helps where a source is neither |
//! | [`stamps`] | when the frames of a folder were taken, where that is told |
//! | [`picture`] | grey of a PNG, JPEG or PGM file |
//! | [`mosaic`] | one channel of the mosaic before a sensor's colour filters |
//!
//! What is the same for frames from elsewhere, one channel of colours, 8 bits of more, y4m and raw bytes, is in
//! [`reception`].

pub mod cameras;
pub mod files;
pub mod film;
pub mod foreign;
pub mod live;
mod mosaic;
mod names;
pub mod picture;
pub mod stamps;
pub mod waiting;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
pub use mosaic::Mosaic as Bayer;
use reception::colour::Channel;

/// How the pixels of files are to be taken.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct PixelArguments {
    /// The channel to read from colours: the brightest of each pixel, or one of red, green, blue or grey.
    #[arg(long, value_name = "CHANNEL", value_parser = channel())]
    pub channel: Option<Channel>,
    /// The sensor's colour filters, if frames are its raw mosaic: RGGB, BGGR, GRBG or GBRG, from the top-left pixel on.
    #[arg(long, value_name = "FILTERS")]
    pub bayer: Option<Bayer>,
    /// Bits of a sample in pictures of more than 8 bits, 9 to 16. Default: as many as the first and some other pictures need.
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
    /// What these do not say, by others.
    pub fn or(self, others: Self) -> Self {
        Self {
            channel: self.channel.or(others.channel),
            bayer: self.bayer.or(others.bayer),
            depth: self.depth.or(others.depth),
        }
    }
}
