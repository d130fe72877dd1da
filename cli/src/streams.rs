//! Frames on standard input: raw grey bytes, or y4m as `ffmpeg -f yuv4mpegpipe` writes it.
//!
//! The crate y4m (0.8) takes a stream that is cut inside a frame for its end, and multiplies the sides in the header unchecked;
//! to guard it against both takes more lines than the format.

use std::io::{BufRead, Read};

use anyhow::{Context, bail, ensure};

/// The most columns or rows of a frame.
pub const SIDE_MAX: usize = 8192;
/// What a y4m stream begins with.
const Y4M: &[u8] = b"YUV4MPEG2";
/// What each of its frames begins with.
const FRAME: &[u8] = b"FRAME";
/// The longest line of a y4m header.
const LINE_MAX: u64 = 1024;

/// A stream of grey frames of one size.
pub struct Stream<R> {
    input: R,
    size: (usize, usize),
    /// Bytes of colour after each frame's brightness; none in raw streams.
    colour: Option<usize>,
    grey: Vec<u8>,
}

impl<R: BufRead> Stream<R> {
    /// Opens a stream: y4m by its own header, or raw frames of the size given.
    pub fn open(mut input: R, raw: Option<(usize, usize)>) -> anyhow::Result<Self> {
        let (size, colour) = match raw {
            Some(size) => (size, None),
            None => {
                let header = line(&mut input)?.unwrap_or_default();
                ensure!(
                    begins_with(&header, Y4M),
                    "frames on standard input have no size: give it with --raw WIDTHxHEIGHT, or pipe y4m, such as from \
                     `ffmpeg -i VIDEO -f yuv4mpegpipe -`"
                );
                let (size, colour) = y4m_header(&String::from_utf8_lossy(&header))?;
                (size, Some(colour))
            }
        };
        Ok(Self {
            input,
            size,
            colour,
            grey: vec![0; size.0 * size.1],
        })
    }

    /// Columns and rows of all frames.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The next frame; none at the stream's end.
    pub fn next_frame(&mut self) -> anyhow::Result<Option<&[u8]>> {
        if self.colour.is_some() {
            match line(&mut self.input)? {
                None => return Ok(None),
                Some(start) => ensure!(
                    begins_with(&start, FRAME),
                    "the y4m stream has something else where a frame should begin"
                ),
            }
        }
        let filled = fill(&mut self.input, &mut self.grey)?;
        if filled == 0 && self.colour.is_none() {
            return Ok(None);
        }
        let whole = self.grey.len();
        ensure!(
            filled == whole,
            "standard input ends inside a frame, after {filled} of {whole} bytes: check the size, {}x{}",
            self.size.0,
            self.size.1
        );
        if let Some(colour) = self.colour {
            let skipped = std::io::copy(
                &mut (&mut self.input).take(colour as u64),
                &mut std::io::sink(),
            )
            .context("cannot read standard input")?;
            ensure!(
                skipped == colour as u64,
                "standard input ends inside a frame's colours"
            );
        }
        Ok(Some(&self.grey))
    }
}

/// Reads until the buffer is full or the input ends.
fn fill(input: &mut impl Read, buffer: &mut [u8]) -> anyhow::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match input.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error).context("cannot read standard input"),
        }
    }
    Ok(filled)
}

/// One line without its end; none where the input has ended.
fn line(input: &mut impl BufRead) -> anyhow::Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    input
        .take(LINE_MAX)
        .read_until(b'\n', &mut line)
        .context("cannot read standard input")?;
    if line.is_empty() {
        return Ok(None);
    }
    ensure!(
        line.pop() == Some(b'\n'),
        "standard input has no end of a line within {LINE_MAX} bytes where a y4m header should be; if its frames are raw, give their \
         size with --raw WIDTHxHEIGHT"
    );
    Ok(Some(line))
}

/// Whether the first word of a header is this one.
fn begins_with(header: &[u8], word: &[u8]) -> bool {
    let rest = header.strip_prefix(word);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(b" "))
}

/// The size of the frames, and the bytes of colour in each.
fn y4m_header(header: &str) -> anyhow::Result<((usize, usize), usize)> {
    let field = |tag: char| {
        header
            .split(' ')
            .skip(1)
            .find_map(|field| field.strip_prefix(tag))
    };
    let side = |tag: char| -> anyhow::Result<usize> {
        let side = field(tag)
            .and_then(|side| side.parse().ok())
            .filter(|side| (1..=SIDE_MAX).contains(side));
        side.with_context(|| format!("the y4m header {header:?} has no {tag} of 1 to {SIDE_MAX}"))
    };
    let (width, height) = (side('W')?, side('H')?);
    let half = |length: usize| length.div_ceil(2);
    let colour = match field('C').unwrap_or("420") {
        "mono" => 0,
        "420" | "420jpeg" | "420paldv" | "420mpeg2" => 2 * half(width) * half(height),
        "422" => 2 * half(width) * height,
        "444" => 2 * width * height,
        other => bail!(
            "y4m frames of kind C{other} cannot be read: make them 8-bit grey by `ffmpeg … -pix_fmt gray -f yuv4mpegpipe -`"
        ),
    };
    Ok(((width, height), colour))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn y4m_of_all_kinds_gives_its_brightness() {
        for (kind, colour) in [
            ("Cmono", 0),
            ("C420jpeg", 4),
            ("C422", 8),
            ("C444", 12),
            ("", 4),
        ] {
            let mut bytes = format!("YUV4MPEG2 W3 H2 F25:1 {kind}\n").into_bytes();
            for frame in 0..2u8 {
                bytes.extend(b"FRAME\n");
                bytes.extend([10 + frame; 6]);
                bytes.extend(std::iter::repeat_n(128, colour));
            }
            let mut stream = Stream::open(bytes.as_slice(), None).unwrap();
            assert_eq!(stream.size(), (3, 2));
            assert_eq!(stream.next_frame().unwrap(), Some(&[10; 6][..]), "{kind}");
            assert_eq!(stream.next_frame().unwrap(), Some(&[11; 6][..]), "{kind}");
            assert_eq!(stream.next_frame().unwrap(), None);
        }
    }

    #[test]
    fn broken_streams_are_refused() {
        let open = |bytes: &'static [u8]| Stream::open(bytes, None);
        for bytes in [
            &b"P5 3 2"[..],
            b"",
            b"YUV4MPEG2 W3\n",
            b"YUV4MPEG2 W0 H2\n",
            b"YUV4MPEG2 W3 H2 C420p10\n",
            b"YUV4MPEG29 W3 H2\n",
            b"YUV4MPEG2W3 H2\n",
            b"YUV4MPEG2 W3 H2",
            b"YUV4MPEG2 W18446744073709551615 H2\n",
        ] {
            assert!(open(bytes).is_err(), "{bytes:?}");
        }
        let cut = b"YUV4MPEG2 W2 H1 Cmono\nFRAME\n\x01";
        assert!(open(cut).unwrap().next_frame().is_err());
        for strange in [
            &b"FRAM\n\x01\x02"[..],
            b"FRAMEX\n\x01\x02",
            b"\n",
            b"\nFRAME\n\x01\x02",
            b"FRAME",
        ] {
            let bytes = [b"YUV4MPEG2 W2 H1 Cmono\n", strange].concat();
            let mut stream = Stream::open(bytes.as_slice(), None).unwrap();
            assert!(stream.next_frame().is_err(), "{strange:?}");
        }
        let mut raw = Stream::open(&[1, 2, 3][..], Some((2, 1))).unwrap();
        assert_eq!(raw.next_frame().unwrap(), Some(&[1, 2][..]));
        assert!(raw.next_frame().is_err());
    }
}
