//! Compares the codes by message length: measures every code over whole links and prints markdown tables.
//!
//! `cargo run --release -p vocc-link --example code_choice [TRIALS [SEED [bsc|awgn P]]]`
//!
//! By default, 200 trials, seed 1 and all channels; messages of more than 128 bytes have proportionally fewer trials. On two processors the
//! default takes a quarter of an hour, and `1000 1 bsc 0.02` takes two minutes.
//!
//! Each cell has the mean number of panels until the message is delivered and, in brackets, the percentage of messages that one repeat did
//! not deliver. It is `–` if at least half of the messages did not arrive in 10 repeats. Both numbers include sync, headers and everything
//! else: the example runs the real framer, a channel, and the real deframer.

#[allow(dead_code)]
#[path = "../tests/channel/mod.rs"]
mod channel;

use channel::{Channel, Noise};
use link::fec::Code;
use link::framing::{Deframer, Event, Framer, FramingError};

const LENGTHS: [usize; 10] = [8, 16, 24, 32, 40, 64, 72, 128, 256, 1024];
const CHANNELS: [Channel; 9] = [
    Channel::Bsc(0.005),
    Channel::Bsc(0.01),
    Channel::Bsc(0.02),
    Channel::Bsc(0.04),
    Channel::Bsc(0.08),
    Channel::Bsc(0.12),
    Channel::Awgn(0.04),
    Channel::Awgn(0.08),
    Channel::Awgn(0.12),
];
const REPEATS_MAX: u32 = 10;

struct Measured {
    mean_panels: Option<f64>,
    failed_in_one_repeat: f64,
}

/// The number of panels until one random message is delivered, if it arrives within [`REPEATS_MAX`] repeats.
fn panels_to_delivery(code: Code, length: usize, channel: Channel, noise: &mut Noise) -> Result<Option<u32>, FramingError> {
    let message = noise.bytes(length);
    let mut framer = Framer::new(&message, code, false)?;
    let mut deframer = Deframer::new();
    for index in 0..REPEATS_MAX * framer.panels_per_repeat() {
        let panel = channel.read_next(&mut framer, noise);
        if let Event::Delivered(delivery) = deframer.push(index, 0, &panel) {
            assert_eq!(delivery.message, message, "a wrong message was delivered");
            return Ok(Some(index + 1));
        }
    }
    Ok(None)
}

fn measure(code: Code, length: usize, channel: Channel, trials: u32, seed: u64) -> Result<Measured, FramingError> {
    let repeat = Framer::new(&vec![0; length], code, false)?.panels_per_repeat();
    let (mut delivered, mut at_once, mut panels) = (0_u32, 0_u32, 0_u64);
    for trial in 0..trials {
        let mut noise = Noise::new(seed ^ u64::from(trial) << 32 ^ length as u64);
        let needed = panels_to_delivery(code, length, channel, &mut noise)?;
        panels += u64::from(needed.unwrap_or(REPEATS_MAX * repeat));
        delivered += u32::from(needed.is_some());
        at_once += u32::from(needed.is_some_and(|needed| needed <= repeat));
    }
    Ok(Measured {
        mean_panels: (2 * delivered > trials).then_some(panels as f64 / f64::from(trials)),
        failed_in_one_repeat: f64::from(trials - at_once) / f64::from(trials),
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let trials: u32 = arguments.next().map_or(Ok(200), |given| given.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |given| given.parse())?;
    let channels = match (arguments.next().as_deref(), arguments.next()) {
        (None, _) => CHANNELS.to_vec(),
        (Some("bsc"), Some(p)) => vec![Channel::Bsc(p.parse()?)],
        (Some("awgn"), Some(p)) => vec![Channel::Awgn(p.parse()?)],
        _ => return Err("a channel is `bsc P` or `awgn P`, with P the hard bit error rate".into()),
    };
    println!("{trials} messages a cell, seed {seed}");
    std::thread::scope(|scope| {
        let tables: Vec<_> = channels
            .into_iter()
            .map(|channel| scope.spawn(move || table(channel, trials, seed)))
            .collect();
        for table in tables {
            println!("{}", table.join().map_err(|_| "a measurement broke off")??);
        }
        Ok(())
    })
}

/// The table of one channel.
fn table(channel: Channel, trials: u32, seed: u64) -> Result<String, FramingError> {
    let mut table = format!(
        "\n### {channel:?}\n\n| bytes | {} |\n",
        Code::ALL.map(|code| code.to_string()).join(" | ")
    );
    table += "|---|---|---|---|---|---|\n";
    for length in LENGTHS {
        let trials = (trials as usize * 128 / length.max(128)).max(1) as u32;
        let mut cells = Vec::new();
        for code in Code::ALL {
            let measured = measure(code, length, channel, trials, seed)?;
            let failed = 100.0 * measured.failed_in_one_repeat;
            let panels = measured.mean_panels.map_or("–".into(), |panels| format!("{panels:.1}"));
            cells.push(format!("{panels} ({failed:.1})"));
        }
        table += &format!("| {length} | {} |\n", cells.join(" | "));
    }
    Ok(table)
}
