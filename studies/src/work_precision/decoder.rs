//! Messages that do not survive their noise: iterations, number formats and codes of the error correction.

use std::hint::black_box;

use labrador_ldpc::LDPCCode;
use labrador_ldpc::decoder::DecodeFrom;
use link::fec::{MAX_ITERATIONS, SUREST};
use link::panel::LLR_STEP;
use rand::Rng;

use super::Measurement;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{range, rounded, variant};
use super::point::Point;
use super::scale::Scale;
use super::steps::Steps;
use super::timing::Candidate;
use crate::statistics::share_95;
use sim::random::{Purpose, normal, stream};

/// Bytes of a message.
const MESSAGE: usize = 128;
/// Messages sent.
const MESSAGES: usize = 2000;
/// Messages whose decoding is timed.
const TIMED: usize = 24;
/// Most iterations.
const ITERATIONS: [usize; 8] = [1, 2, 3, 5, 10, 20, 50, MAX_ITERATIONS];
/// The code for the comparison of number formats.
const COMPARED: LDPCCode = LDPCCode::TC512;
/// Standard deviations of the noise on bits of ±1: 9 % of them wrong.
const COMPARED_NOISE: f64 = 0.75;
/// 3 % and 7 % wrong.
const NOISES: [(f64, &str); 2] = [(0.53, "3 %"), (0.68, "7 %")];
const CODES: [(LDPCCode, &str); 5] = [
    (LDPCCode::TC128, "TC128"),
    (LDPCCode::TC256, "TC256"),
    (LDPCCode::TC512, "TC512"),
    (LDPCCode::TM1280, "TM1280"),
    (LDPCCode::TM1536, "TM1536"),
];

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let mut diagrams = vec![steps.take("formats", |steps| formats(scale, steps))?];
    for (noise, wrong) in NOISES {
        diagrams.push(steps.take(wrong, |steps| codes(noise, wrong, scale, steps))?);
    }
    Ok(Measurement {
        method: format!(
            "Messages of {MESSAGE} bytes with Gaussian noise. A curve varies the maximum number of iterations, 1 to 100. *i8* is \
             `link::fec`; *f32* and *f64* see the same noise unrounded, *bit flipping* only its signs."
        ),
        reference: "The sent bytes.".into(),
        diagrams,
    })
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let worth = diagrams.first().map(worth_of_iterations);
    let rounding = diagrams.iter().flat_map(|formats| {
        ITERATIONS.into_iter().filter_map(|limit| {
            let [i8, f64] = ["i8", "f64"].map(|format| variant(formats, &format!("{format}, {limit}")));
            Some(i8?.error / f64?.error)
        })
    });
    format!(
        "i8 and {MAX_ITERATIONS} iterations. Eight bits lose {} times as many messages as 64, in a quarter of the memory of f32 and \
         without a floating-point unit. A high limit costs time only if it is needed: {}",
        range(rounding),
        worth.unwrap_or_default()
    )
}

/// The benefit of the most iterations over a tenth of them.
fn worth_of_iterations(formats: &Diagram) -> String {
    let [some, all] = [10, MAX_ITERATIONS].map(|limit| {
        let point = variant(formats, &format!("i8, {limit}"));
        point.map_or([f64::NAN; 2], |point| [point.error, point.ratio.median])
    });
    format!(
        "in TC512 with 9 % of the bits wrong, 10 iterations lose {} % of the messages and {MAX_ITERATIONS} lose {} %, in {} times the \
         time.",
        rounded(100.0 * some[0]),
        rounded(100.0 * all[0]),
        rounded(all[1] / some[1])
    )
}

/// One code in all number formats.
fn formats(scale: &Scale, steps: &mut Steps) -> Result<Diagram, PrecisionError> {
    let sent = Transmission::new(COMPARED, COMPARED_NOISE, scale);
    let mut candidates = sent.curve("i8", steps, || sent.decoder::<i8>())?;
    if let Some(default) = candidates.last_mut() {
        (default.point.is_default, default.point.is_baseline) = (true, true);
    }
    candidates.extend(sent.curve("f32", steps, || sent.decoder::<f32>())?);
    candidates.extend(sent.curve("f64", steps, || sent.decoder::<f64>())?);
    candidates.extend(sent.curve("bit flipping", steps, || sent.flipper())?);
    let title = "TC512 in four number formats, 9 % of bits wrong";
    Ok(diagram(title, candidates, scale))
}

/// All codes in 8 bits.
fn codes(noise: f64, wrong: &str, scale: &Scale, steps: &mut Steps) -> Result<Diagram, PrecisionError> {
    let sent = CODES.map(|(code, name)| (Transmission::new(code, noise, scale), name));
    let mut candidates = Vec::new();
    for (sent, name) in &sent {
        let mut curve = sent.curve(name, steps, || sent.decoder::<i8>())?;
        if let Some(default) = curve.last_mut() {
            default.point.is_default = true;
            default.point.is_baseline = sent.code == COMPARED;
        }
        candidates.extend(curve);
    }
    let title = format!("all codes in 8 bits, {wrong} of bits wrong");
    Ok(diagram(&title, candidates, scale))
}

fn diagram(title: &str, candidates: Vec<Candidate>, scale: &Scale) -> Diagram {
    let cost = format!("one message of {MESSAGE} bytes");
    Diagram::timed(title, ["share of messages lost", ""], cost, candidates, scale)
}

/// Messages as received.
struct Transmission {
    code: LDPCCode,
    noise: f64,
    blocks: Vec<Block>,
}

/// One block and its log-likelihood ratios, above 0 for a bit of 0.
struct Block {
    info: Vec<u8>,
    i8: Vec<i8>,
    f32: Vec<f32>,
    f64: Vec<f64>,
    hard: Vec<u8>,
}

impl Transmission {
    fn new(code: LDPCCode, noise: f64, scale: &Scale) -> Self {
        let blocks = scale.of(MESSAGES, 20) * (MESSAGE * 8 / code.k());
        let block = |number: usize| {
            let mut random = stream(scale.seed, number as u64, Purpose::Noise);
            Block::new(code, noise, &mut random)
        };
        Self {
            code,
            noise,
            blocks: (0..blocks).map(block).collect(),
        }
    }

    fn blocks_a_message(&self) -> usize {
        MESSAGE * 8 / self.code.k()
    }

    fn timed(&self) -> &[Block] {
        let most = TIMED * self.blocks_a_message();
        &self.blocks[..most.min(self.blocks.len())]
    }

    /// A decoder at all limits of [`ITERATIONS`].
    fn curve<'a>(&'a self, name: &str, steps: &mut Steps, decoder: impl Fn() -> Decode<'a>) -> Result<Vec<Candidate<'a>>, PrecisionError> {
        let mut decode = decoder();
        let mut needed = |blocks: &[Block]| {
            // A message is complete with the last of its blocks.
            let mut needed = blocks.iter().map(|block| decode(block, MAX_ITERATIONS));
            needed.try_fold(0, |most, own| Some(most.max(own?)))
        };
        let messages = self.blocks.chunks_exact(self.blocks_a_message());
        let step = format!("{name}, noise of {}", self.noise);
        let needed: Vec<Option<usize>> = steps.take(step, |_| Ok(messages.map(&mut needed).collect()))?;
        let candidate = |limit: usize| {
            let in_time = |needed: &&Option<usize>| needed.is_some_and(|needed| needed <= limit);
            let lost = (needed.len() - needed.iter().filter(in_time).count()) as f64;
            let count = needed.len() as f64;
            let point = Point::share(format!("{name}, {limit}"), lost, count, || share_95(lost, count)).on(name);
            let mut decode = decoder();
            let blocks = self.timed();
            let messages = blocks.len() as f64 / self.blocks_a_message() as f64;
            Candidate::new(point, messages, move || {
                for block in blocks {
                    black_box(decode(block, limit));
                }
            })
        };
        Ok(ITERATIONS.map(candidate).into())
    }

    /// Min-sum, with its working area.
    fn decoder<'a, T: Soft + 'a>(&'a self) -> Decode<'a> {
        let code = self.code;
        let mut output = vec![0; code.output_len()];
        let mut working = vec![T::zero(); code.decode_ms_working_len()];
        let mut signs = vec![0; code.decode_ms_working_u8_len()];
        Box::new(move |block, limit| {
            let llrs = T::of(block);
            let (found, passed) = code.decode_ms(llrs, &mut output, &mut working, &mut signs, limit);
            (found && output.starts_with(&block.info)).then_some(passed + 1)
        })
    }

    /// Bit flipping.
    fn flipper(&self) -> Decode<'_> {
        let code = self.code;
        let mut output = vec![0; code.output_len()];
        let mut working = vec![0; code.decode_bf_working_len()];
        Box::new(move |block, limit| {
            let (found, passed) = code.decode_bf(&block.hard, &mut output, &mut working, limit);
            (found && output.starts_with(&block.info)).then_some(passed + 1)
        })
    }
}

/// Decodes a block within a maximum of iterations: their number, or `None`.
type Decode<'a> = Box<dyn FnMut(&Block, usize) -> Option<usize> + 'a>;

impl Block {
    fn new(code: LDPCCode, noise: f64, random: &mut impl Rng) -> Self {
        let mut word = vec![0; code.n() / 8];
        let (info, _) = word.split_at_mut(code.k() / 8);
        random.fill_bytes(info);
        let info = info.to_vec();
        code.encode(&mut word);
        let bit = |bit: usize| word[bit / 8] >> (7 - bit % 8) & 1;
        let f64: Vec<f64> = (0..code.n())
            .map(|at| 1.0 - 2.0 * f64::from(bit(at)) + noise * normal(random))
            .map(|received| 2.0 * received / (noise * noise))
            .collect();
        let surest = f64::from(SUREST);
        let eight_bits = |llr: &f64| {
            let steps = (llr / f64::from(LLR_STEP)).round();
            steps.clamp(-surest, surest) as i8
        };
        let mut hard = vec![0; code.n() / 8];
        for (at, llr) in f64.iter().enumerate() {
            hard[at / 8] |= u8::from(*llr < 0.0) << (7 - at % 8);
        }
        Self {
            info,
            i8: f64.iter().map(eight_bits).collect(),
            f32: f64.iter().map(|&llr| llr as f32).collect(),
            f64,
            hard,
        }
    }
}

/// A number format of soft values.
trait Soft: DecodeFrom {
    fn of(block: &Block) -> &[Self];
}

impl Soft for i8 {
    fn of(block: &Block) -> &[Self] {
        &block.i8
    }
}

impl Soft for f32 {
    fn of(block: &Block) -> &[Self] {
        &block.f32
    }
}

impl Soft for f64 {
    fn of(block: &Block) -> &[Self] {
        &block.f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_iterations_lose_less_and_eight_bits_nothing() {
        let scale = Scale { share: 0.1, ..Scale::TINY };
        let sent = Transmission::new(COMPARED, COMPARED_NOISE, &scale);
        let lost = |curve: Vec<Candidate>| -> Vec<Point> { curve.into_iter().map(|candidate| candidate.point).collect() };
        let steps = &mut Steps::unkept();
        let eight_bits = lost(sent.curve("i8", steps, || sent.decoder::<i8>()).unwrap());
        let exact = lost(sent.curve("f64", steps, || sent.decoder::<f64>()).unwrap());
        let hard = lost(sent.curve("bit flipping", steps, || sent.flipper()).unwrap());
        assert!(eight_bits.is_sorted_by(|a, b| a.error >= b.error));
        assert!(eight_bits[2].error > 2.0 * eight_bits[7].error);
        let [low, high] = exact[7].error_95.unwrap();
        assert!((low..=high).contains(&eight_bits[7].error), "{low} to {high}");
        assert!(hard[7].error > 2.0 * high);
    }

    #[test]
    fn a_limit_is_that_of_the_decoder() {
        let sent = Transmission::new(COMPARED, COMPARED_NOISE, &Scale::TINY);
        let mut decode = sent.decoder::<i8>();
        for block in &sent.blocks {
            if let Some(needed) = decode(block, MAX_ITERATIONS) {
                assert_eq!(decode(block, needed), Some(needed));
                assert_eq!(decode(block, needed - 1), None);
            }
        }
    }
}
