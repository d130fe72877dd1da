//! Streams of frames: raw grey bytes, or y4m as `ffmpeg -f yuv4mpegpipe` writes it, with 8 to 16 bits, in grey or colour.
//!
//! The crate y4m (0.8) reports a stream that is cut inside a frame as complete, and multiplies the sides in the header unchecked. Guarding
//! against both takes more lines than reading the format.

use std::collections::VecDeque;
use std::io::{BufRead, Read};

use crate::colour::{Channel, Standard};
use crate::combing::{Combing, FRAMES_MIN};

/// Maximum number of columns or rows of a frame.
pub const SIDE_MAX: usize = rx_pipeline::frame::SIDE_MAX;
/// The first bytes of a y4m stream.
const Y4M: &[u8] = b"YUV4MPEG2";
/// The first bytes of each of its frames.
const FRAME: &[u8] = b"FRAME";
/// Maximum number of frames to examine.
const AHEAD_MAX: usize = 32;
/// Maximum number of their bytes.
const AHEAD_BYTES_MAX: usize = 1 << 28;
/// Maximum length of a line in a y4m header.
const LINE_MAX: u64 = 1024;

/// Why a stream yields no frame.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// Reading failed.
    #[error("cannot read the stream")]
    Read(#[from] std::io::Error),
    /// The stream is empty.
    #[error("the stream has no frames: pipe y4m, or raw grey bytes with --raw WIDTHxHEIGHT")]
    Empty,
    /// The stream has another format.
    #[error(
        "the stream does not begin as y4m does, so the size of its frames is not known: give it with --raw WIDTHxHEIGHT, or pipe y4m, \
         such as from `ffmpeg -i FILM -f yuv4mpegpipe -`"
    )]
    NoY4m,
    /// Something other than a frame follows a frame.
    #[error("the y4m stream has other data where a frame should begin")]
    NoFrame,
    /// The stream ends too soon.
    #[error(
        "the stream ends inside a frame, after {filled} of {whole} bytes: check the size, {}x{}",
        size.0, size.1
    )]
    Cut {
        /// Bytes present of the last frame.
        filled: usize,
        /// Bytes of a frame.
        whole: usize,
        /// Columns and rows.
        size: (usize, usize),
    },
    /// The stream ends after a frame's luma.
    #[error("the stream ends inside a frame's colours")]
    CutColours,
    /// The header has no end.
    #[error(
        "the stream has no end of a line within {LINE_MAX} bytes where a y4m header should be; if its frames are raw, give their size with \
         --raw WIDTHxHEIGHT"
    )]
    LongLine,
    /// The header lacks a width or a height.
    #[error(
        "the y4m header {header:?} needs exactly one {tag} with a whole number of at least 1: write the stream again, by `ffmpeg -f \
         yuv4mpegpipe`"
    )]
    Side {
        /// The header.
        header: String,
        /// W or H.
        tag: &'static str,
    },
    /// The frames are larger than those that are read.
    #[error(
        "the frames have {width} × {height} pixels, and at most {SIDE_MAX} × {SIDE_MAX} are read: scale them, by `ffmpeg -i FILM -vf \
         scale={} -f yuv4mpegpipe -`, or cut them, by -vf crop=WIDTH:HEIGHT:LEFT:TOP, and pipe the result",
        // −2: the even number that keeps the aspect.
        if width > height { format!("{SIDE_MAX}:-2") } else { format!("-2:{SIDE_MAX}") }
    )]
    TooLarge {
        /// Their columns.
        width: u64,
        /// Their rows.
        height: u64,
    },
    /// The frames are interlaced, or may be: each has two times.
    #[error(
        "the film is {}: a frame of an interlaced film is two pictures of different times, a line from each in turn, and a panel may show \
         two symbols in it; make it a film of whole pictures by `ffmpeg -i FILM -vf bwdif=mode=send_field -f yuv4mpegpipe -`, which has \
         twice as many frames a second",
        if *is_seen { "interlaced" } else { "flagged as interlaced, and its first frames have too little motion to disprove it" }
    )]
    Interlaced {
        /// Whether a frame shows it; otherwise only the header says so.
        is_seen: bool,
    },
    /// The frames are of an unsupported kind.
    #[error("y4m frames of kind C{kind} cannot be read: make them grey by `ffmpeg … -pix_fmt gray -f yuv4mpegpipe -`")]
    Kind {
        /// The kind according to the header.
        kind: String,
    },
}

impl StreamError {
    /// Whether the stream is too short; the program that writes it may then know why.
    pub fn is_short(&self) -> bool {
        matches!(
            self,
            Self::Read(_) | Self::Empty | Self::LongLine | Self::Cut { .. } | Self::CutColours
        )
    }
}

/// A stream of grey frames of one size.
///
/// ```
/// use reception::{colour::Channel, stream::Stream};
/// let film = b"YUV4MPEG2 W2 H1 F30:1 Cmono\nFRAME\n\x10\x20".as_slice();
/// let mut stream = Stream::open(film, None, Channel::Brightest)?;
/// assert_eq!((stream.size(), stream.rate()), ((2, 1), Some(30.0)));
/// assert_eq!(stream.next_frame()?, Some([16, 32].as_slice()));
/// assert_eq!(stream.next_frame()?, None);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Stream<R> {
    input: R,
    size: (usize, usize),
    /// The layout of y4m frames; none for raw streams.
    video: Option<Video>,
    channel: Channel,
    grey: Vec<u8>,
    colours: Vec<u8>,
    /// The difference of the channel and luma for each pixel of a row.
    above: Vec<i16>,
    /// Frames that were examined when it was opened.
    ahead: VecDeque<Vec<u8>>,
}

/// The layout of y4m frames.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Video {
    /// Columns and rows of pixels that share a colour; none if there are no colours.
    sharing: Option<(usize, usize)>,
    /// Bits of a sample.
    bits: u32,
    /// Whether luma ranges from 16 to 235, not from 0 to 255.
    limited: bool,
    standard: Standard,
    /// Frames a second.
    rate: Option<f32>,
    /// Whether each frame consists of two pictures, according to the header.
    is_interlaced: bool,
}

impl<R: BufRead> Stream<R> {
    /// Opens a stream: y4m with its header, or raw frames of the given size. From colours it takes one `channel`.
    ///
    /// If the header says that the film is interlaced, the first frames are examined.
    ///
    /// # Errors
    /// [`StreamError::Interlaced`] unless these frames show that each is a single picture.
    pub fn open(input: R, raw: Option<(usize, usize)>, channel: Channel) -> Result<Self, StreamError> {
        let mut stream = Self::open_progressive(input, raw, channel)?;
        if stream.is_flagged() {
            stream.look_ahead()?;
        }
        Ok(stream)
    }

    /// Whether the header says that the film is interlaced.
    pub fn is_flagged(&self) -> bool {
        self.video.is_some_and(|video| video.is_interlaced)
    }

    /// Examines the first frames, and keeps them for [`Self::next_frame`].
    fn look_ahead(&mut self) -> Result<(), StreamError> {
        let most = (AHEAD_BYTES_MAX / (self.size.0 * self.size.1)).clamp(FRAMES_MIN as usize + 1, AHEAD_MAX);
        let mut combing = Combing::new(self.size.0);
        let mut ahead = VecDeque::<Vec<u8>>::new();
        while ahead.len() < most && !combing.are_single() && !combing.is_combed() {
            let Some(frame) = self.next_frame()? else { break };
            if let Some(before) = ahead.back() {
                combing.look(before, frame);
            }
            ahead.push_back(frame.to_vec());
        }
        self.ahead = ahead;
        match combing.are_single() {
            true => Ok(()),
            false => Err(StreamError::Interlaced {
                is_seen: combing.is_combed(),
            }),
        }
    }

    /// Opens a stream like [`open`](Self::open), but ignores interlacing in the header: each frame is one picture.
    pub fn open_progressive(mut input: R, raw: Option<(usize, usize)>, channel: Channel) -> Result<Self, StreamError> {
        let (size, video) = match raw {
            Some(size) => (size, None),
            None => {
                let header = line(&mut input)?.ok_or(StreamError::Empty)?;
                if !begins_with(&header, Y4M) {
                    return Err(StreamError::NoY4m);
                }
                let (size, video) = y4m_header(&String::from_utf8_lossy(&header))?;
                (size, Some(video))
            }
        };
        let samples = size.0 * size.1;
        let colours = video.map_or(0, |video| video.colours(size));
        let bytes = |samples: usize| samples * video.map_or(1, |video| video.bytes());
        Ok(Self {
            input,
            size,
            video,
            channel,
            grey: vec![0; bytes(samples)],
            colours: vec![0; bytes(colours)],
            above: vec![0; size.0],
            ahead: VecDeque::new(),
        })
    }

    /// Columns and rows of all frames.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// Frames a second, if the stream states them.
    pub fn rate(&self) -> Option<f32> {
        self.video?.rate
    }

    /// Bytes of a frame, without the line that precedes it.
    pub fn frame_bytes(&self) -> usize {
        self.grey.len() + self.colours.len()
    }

    /// The next frame; none at the end of the stream.
    pub fn next_frame(&mut self) -> Result<Option<&[u8]>, StreamError> {
        if let Some(frame) = self.ahead.pop_front() {
            let grey = &mut self.grey[..frame.len()];
            grey.copy_from_slice(&frame);
            return Ok(Some(grey));
        }
        if self.video.is_some() {
            match line(&mut self.input)? {
                None => return Ok(None),
                Some(start) if begins_with(&start, FRAME) => {}
                Some(_) => return Err(StreamError::NoFrame),
            }
        }
        let filled = fill(&mut self.input, &mut self.grey)?;
        if filled == 0 && self.video.is_none() {
            return Ok(None);
        }
        let whole = self.grey.len();
        if filled != whole {
            let size = self.size;
            return Err(StreamError::Cut { filled, whole, size });
        }
        if fill(&mut self.input, &mut self.colours)? != self.colours.len() {
            return Err(StreamError::CutColours);
        }
        let samples = self.size.0 * self.size.1;
        if let Some(video) = self.video {
            video.to_8_bits(&mut self.grey);
            video.to_8_bits(&mut self.colours);
            video.widen(&mut self.grey[..samples]);
            video.add_colours(self.channel, self.size, &mut self.grey, &self.colours, &mut self.above);
        }
        Ok(self.grey.get(..samples))
    }
}

impl Video {
    /// Number of colour samples in a frame.
    fn colours(self, (width, height): (usize, usize)) -> usize {
        self.sharing
            .map_or(0, |(columns, rows)| 2 * width.div_ceil(columns) * height.div_ceil(rows))
    }

    /// Bytes of a sample.
    fn bytes(self) -> usize {
        if self.bits > 8 { 2 } else { 1 }
    }

    /// Converts samples of more than 8 bits, low byte first, to 8 bits in the first half of their bytes.
    fn to_8_bits(self, bytes: &mut [u8]) {
        if self.bits <= 8 {
            return;
        }
        let (half, most) = (1u32 << (self.bits - 9), 255);
        for at in 0..bytes.len() / 2 {
            let sample = u32::from(bytes[2 * at]) | u32::from(bytes[2 * at + 1]) << 8;
            bytes[at] = ((sample + half) >> (self.bits - 8)).min(most) as u8;
        }
    }

    /// Replaces luma by the requested channel.
    fn add_colours(self, channel: Channel, (width, height): (usize, usize), grey: &mut [u8], colours: &[u8], above: &mut [i16]) {
        let Some((columns, rows)) = self.sharing else {
            return;
        };
        if channel == Channel::Grey {
            return;
        }
        let row = width.div_ceil(columns);
        let (blue, red) = colours.split_at(row * height.div_ceil(rows));
        let greys = grey[..width * height].chunks_exact_mut(width);
        for (y, grey) in greys.enumerate() {
            if y % rows == 0 {
                let at = y / rows * row;
                for (x, above) in above.iter_mut().enumerate() {
                    let at = at + x / columns;
                    *above = channel.above_luma(blue[at], red[at], self.standard);
                }
            }
            for (grey, &above) in grey.iter_mut().zip(&*above) {
                *grey = (i16::from(*grey) + above).clamp(0, 255) as u8;
            }
        }
    }

    /// Widens luma of 16 to 235 to 0 to 255, so that a clipped lamp is white.
    fn widen(self, luma: &mut [u8]) {
        if self.limited {
            for luma in luma {
                let above = u32::from(luma.saturating_sub(16));
                *luma = ((above * 255 + 109) / 219).min(255) as u8;
            }
        }
    }
}

/// Reads until the buffer is full or the input ends.
fn fill(input: &mut impl Read, buffer: &mut [u8]) -> Result<usize, StreamError> {
    let mut filled = 0;
    while filled < buffer.len() {
        match input.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(filled)
}

/// A line without its end; none at the end of the input.
fn line(input: &mut impl BufRead) -> Result<Option<Vec<u8>>, StreamError> {
    let mut line = Vec::new();
    input.take(LINE_MAX).read_until(b'\n', &mut line)?;
    if line.is_empty() {
        return Ok(None);
    }
    if line.pop() != Some(b'\n') {
        return Err(StreamError::LongLine);
    }
    Ok(Some(line))
}

/// Whether the first word of a header is `word`.
fn begins_with(header: &[u8], word: &[u8]) -> bool {
    let rest = header.strip_prefix(word);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(b" "))
}

/// The size and the layout of the frames.
fn y4m_header(header: &str) -> Result<((usize, usize), Video), StreamError> {
    let fields = |tag: &'static str| {
        let fields = header.split(' ').skip(1);
        fields.filter_map(move |field| field.strip_prefix(tag))
    };
    let field = |tag| fields(tag).next();
    let side = |tag: &'static str| -> Result<u64, StreamError> {
        let mut sides = fields(tag).filter(|side| side.bytes().all(|digit| digit.is_ascii_digit()));
        let side = sides
            .next()
            .and_then(|side| side.parse().ok())
            .filter(|&side| side > 0 && sides.next().is_none());
        side.ok_or_else(|| StreamError::Side {
            header: header.into(),
            tag,
        })
    };
    let (width, height) = match (side("W")?, side("H")?) {
        (width, height) if width.max(height) <= SIDE_MAX as u64 => (width as usize, height as usize),
        (width, height) => return Err(StreamError::TooLarge { width, height }),
    };
    let kind = field("C").unwrap_or("420");
    let (layout, bits) = depth(kind);
    let sharing = match layout {
        "mono" => None,
        "420" | "420jpeg" | "420paldv" | "420mpeg2" => Some((2, 2)),
        "422" => Some((2, 1)),
        "444" => Some((1, 1)),
        _ => return Err(StreamError::Kind { kind: kind.into() }),
    };
    let limited = match field("XCOLORRANGE=") {
        Some(range) => range == "LIMITED",
        None => sharing.is_some() && layout != "420jpeg",
    };
    let standard = if height > 576 { Standard::Bt709 } else { Standard::Bt601 };
    let video = Video {
        sharing,
        bits,
        limited,
        standard,
        rate: field("F").and_then(rate),
        is_interlaced: !matches!(field("I"), None | Some("p" | "?")),
    };
    Ok(((width, height), video))
}

/// Splits a kind of y4m frames into the sharing of colours and the bits of a sample: "420p10" has 10, "mono12" has 12.
fn depth(kind: &str) -> (&str, u32) {
    const DEEP: [u32; 5] = [9, 10, 12, 14, 16];
    for bits in DEEP {
        let digits = bits.to_string();
        if let Some(layout) = kind.strip_suffix(digits.as_str())
            && (layout == "mono" || layout.ends_with('p'))
        {
            return (layout.trim_end_matches('p'), bits);
        }
    }
    (kind, 8)
}

/// Parses a fraction such as "30000:1001" as a number above 0.
fn rate(text: &str) -> Option<f32> {
    let (frames, seconds) = text.split_once(':')?;
    let rate = frames.parse::<f32>().ok()? / seconds.parse::<f32>().ok()?;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(bytes: &[u8]) -> Result<Stream<&[u8]>, StreamError> {
        Stream::open(bytes, None, Channel::Brightest)
    }

    #[test]
    fn video_of_16_to_235_becomes_0_to_255() {
        let bytes = b"YUV4MPEG2 W4 H1 F30000:1001 C444\nFRAME\n\x00\x10\x7e\xeb\x80\x80\x80\x80\x80\x80\x80\x80";
        let mut stream = open(bytes).unwrap();
        assert!((stream.rate().unwrap() - 29.97).abs() < 0.01);
        assert_eq!(stream.next_frame().unwrap(), Some(&[0, 0, 128, 255][..]));
    }

    #[test]
    fn a_red_lamp_is_as_bright_as_its_red() {
        let bytes = b"YUV4MPEG2 W2 H2 C420jpeg\nFRAME\n\x52\x52\x20\xf0\x6f\xcb";
        let read = |channel| {
            let mut stream = Stream::open(&bytes[..], None, channel).unwrap();
            stream.next_frame().unwrap().unwrap().to_vec()
        };
        // In BT.601, red is 1.402·(203 − 128) = 105 above luma.
        assert_eq!(read(Channel::Brightest), [187, 187, 137, 255]);
        assert_eq!(read(Channel::Grey), [82, 82, 32, 240]);
        assert_eq!(read(Channel::Blue), [52, 52, 2, 210]);
    }

    #[test]
    fn frames_that_are_only_flagged_as_interlaced_may_be_read() {
        let bytes = b"YUV4MPEG2 W2 H1 It Cmono\nFRAME\n\x10\x20";
        assert!(matches!(open(bytes), Err(StreamError::Interlaced { is_seen: false })));
        let mut stream = Stream::open_progressive(&bytes[..], None, Channel::Brightest).unwrap();
        assert_eq!(stream.next_frame().unwrap(), Some(&[16, 32][..]));
        // Motion shows that each frame is one picture: the halves of the 32 × 32 pixels are white in turn.
        let mut bytes = b"YUV4MPEG2 W32 H32 It Cmono\n".to_vec();
        for frame in 0..40u8 {
            bytes.extend(b"FRAME\n");
            bytes.extend((0..32 * 32).map(|at| if (at / 512 == 0) == (frame % 2 == 0) { 200 } else { frame }));
        }
        let mut stream = open(&bytes).unwrap();
        assert!(stream.is_flagged());
        for frame in 0..40u8 {
            let grey = stream.next_frame().unwrap().unwrap();
            assert_eq!((grey[0], grey[1023]), if frame % 2 == 0 { (200, frame) } else { (frame, 200) });
        }
        assert_eq!(stream.next_frame().unwrap(), None);
        // If the stream ends before that, the end is the error.
        assert!(matches!(open(&bytes[..5 * 1030]), Err(StreamError::Cut { .. })));
    }

    #[test]
    fn deep_video_is_read() {
        for (kind, low) in [("Cmono10", 2), ("C420p10 XCOLORRANGE=FULL", 2), ("Cmono12", 4)] {
            let mut bytes = format!("YUV4MPEG2 W2 H1 {kind}\nFRAME\n").into_bytes();
            for sample in [1u16, 200] {
                bytes.extend((sample << low).to_le_bytes());
            }
            if kind.starts_with("C420") {
                bytes.extend([0, 2, 0, 2]);
            }
            let mut stream = open(&bytes).unwrap();
            assert_eq!(stream.next_frame().unwrap(), Some(&[1, 200][..]), "{kind}");
            assert_eq!(stream.next_frame().unwrap(), None);
        }
    }

    #[test]
    fn y4m_of_all_kinds_gives_its_brightness() {
        for (kind, colour) in [
            ("Cmono", 0),
            ("C420jpeg", 4),
            ("C422 XCOLORRANGE=FULL", 8),
            ("C444 XCOLORRANGE=FULL", 12),
            ("XCOLORRANGE=FULL", 4),
        ] {
            let mut bytes = format!("YUV4MPEG2 W3 H2 F25:1 {kind}\n").into_bytes();
            for frame in 0..2u8 {
                bytes.extend(b"FRAME\n");
                bytes.extend([10 + frame; 6]);
                bytes.extend(std::iter::repeat_n(128, colour));
            }
            let mut stream = open(bytes.as_slice()).unwrap();
            assert_eq!(stream.size(), (3, 2));
            assert_eq!(stream.next_frame().unwrap(), Some(&[10; 6][..]), "{kind}");
            assert_eq!(stream.next_frame().unwrap(), Some(&[11; 6][..]), "{kind}");
            assert_eq!(stream.next_frame().unwrap(), None);
        }
    }

    #[test]
    fn broken_streams_are_refused() {
        for bytes in [
            &b"P5 3 2"[..],
            b"",
            b"YUV4MPEG2 W3\n",
            b"YUV4MPEG2 W0 H2\n",
            b"YUV4MPEG2 W3 H2 C411\n",
            b"YUV4MPEG2 W3 H2 It Cmono\n",
            b"YUV4MPEG2 W3 H2 C420p11\n",
            b"YUV4MPEG29 W3 H2\n",
            b"YUV4MPEG2W3 H2\n",
            b"YUV4MPEG2 W3 H2",
            b"YUV4MPEG2 W+3 H2\n",
            b"YUV4MPEG2 W3 H2 W4\n",
            b"YUV4MPEG2\tW3\tH2\n",
            b"YUV4MPEG2 W3 H2\r\n",
            b"YUV4MPEG2 W18446744073709551615 H2\n",
            b"YUV4MPEG2 W18446744073709551616 H2\n",
        ] {
            assert!(open(bytes).is_err(), "{bytes:?}");
        }
        for (sides, scale) in [("W8193 H2", "8192:-2"), ("W2 H8193", "-2:8192")] {
            let why = open(format!("YUV4MPEG2 {sides}\n").as_bytes()).err().expect("an error").to_string();
            assert!(why.contains("8193") && why.contains(scale), "{why}");
        }
        let cut = b"YUV4MPEG2 W2 H1 Cmono\nFRAME\n\x01";
        assert!(open(cut).unwrap().next_frame().is_err());
        for strange in [&b"FRAM\n\x01\x02"[..], b"FRAMEX\n\x01\x02", b"\n", b"\nFRAME\n\x01\x02", b"FRAME"] {
            let bytes = [b"YUV4MPEG2 W2 H1 Cmono\n", strange].concat();
            let mut stream = open(bytes.as_slice()).unwrap();
            assert!(stream.next_frame().is_err(), "{strange:?}");
        }
        let mut raw = Stream::open(&[1, 2, 3][..], Some((2, 1)), Channel::Brightest).unwrap();
        assert_eq!(raw.next_frame().unwrap(), Some(&[1, 2][..]));
        assert!(raw.next_frame().is_err());
    }
}
