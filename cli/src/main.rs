//! `vocc`, the command line of optical camera communication between vehicles.
//!
//! Arguments, files and printing only: `sim` simulates the camera, `studies` computes results, `rx-pipeline` reads frames, and
//! `tx-firmware` shows panels. Each layer uses those below it:
//!
//! - [`commands`]: one module each: arguments in, library calls, answers out; [`options`]: arguments that several commands share;
//! - [`report`]: reports on results, on disk and during the work;
//! - [`stop`]: Ctrl-C; [`plot`]: charts; [`numbers`]: number formats; [`output`]: standard output; [`progress`]: standard error;
//! - [`frames`] reads films, [`camera`] reads camera files, [`pictures`] and [`npy`] write frames, [`show`] draws readings onto them;
//! - [`results`] and [`checkpoint`] save the finished part of long runs, [`checksum`] detects later changes to it;
//! - [`files`] writes files whole or not at all, if [`outputs`] permits the place;
//! - [`keys`]: signing keys and trusted keys;
//! - [`device`] talks to transmitters and receiving boards.

// These macros panic on a closed stream; `output` does not.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod camera;
mod checkpoint;
mod checksum;
mod commands;
mod device;
mod files;
mod frames;
mod keys;
mod loopback;
mod npy;
mod numbers;
mod options;
mod output;
mod outputs;
mod pictures;
mod pin;
mod plot;
mod pose;
mod progress;
mod recording;
mod report;
mod results;
mod show;
mod stop;

use std::io::Write;
use std::process::ExitCode;

use anyhow::Context;
use clap::{Parser, Subcommand};

use options::SharedOptions;
use output::Verdict;

/// Optical camera communication between vehicles: simulate, evaluate, send and receive.
///
/// Without a command: a short link run on the scene `paper`.
#[derive(Parser)]
#[command(
    version,
    about,
    after_help = "Exit status: 0 done; 1 done, and the answer is no; 2 bad input or usage."
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    shared: SharedOptions,
}

#[derive(Subcommand)]
enum Command {
    /// Send a message over a simulated road, and report whether it arrives.
    Link(commands::link::Arguments),
    /// Render one camera frame.
    Render(commands::render::Arguments),
    /// Labelled frames, as arrays or pictures, for your own detector.
    Frames(commands::frames::Arguments),
    /// The effects that a scene requires, and why.
    Plan(commands::plan::Arguments),
    /// Bit error rate and variances at one setting, by Monte Carlo.
    Evaluate(commands::evaluate::Arguments),
    /// The paper's figures, and a report on its claims.
    ///
    /// Bits are detected by k-means, as in the paper. Figure 22 is also drawn with the other detectors.
    Figures(commands::figures::Arguments),
    /// Bit error rates at all settings of a plan, as a table and a plot; on this computer or a cluster.
    Sweep(commands::sweep::Arguments),
    /// Error against computing time, for each step that has alternatives.
    Accuracy(commands::accuracy::Arguments),
    /// Add up the shards of an evaluation, a sweep or a table.
    Merge(commands::merge::Arguments),
    /// The best ratios of LED to ambient light (L2A), as the table that a transmitter carries.
    Optimize(commands::optimize::Arguments),
    /// The L2A table: show and check it, write it to a transmitter, read and compare it.
    Table(commands::table::Arguments),
    /// The panels that the transmitter shows for a message, one a line: 16 hexadecimal digits, bit 8·row + column, 1 for On.
    Transmit(commands::transmit::Arguments),
    /// The bits of single pictures.
    Decode(commands::decode::Arguments),
    /// Messages from a film, a folder of pictures or a stream.
    Receive(commands::receive::Arguments),
    /// Transmitters and receiving boards at serial ports: list, watch, configure, send messages.
    Device(commands::device::Arguments),
    /// Keys that sign messages: make one, show public ones.
    Keys(commands::keys::Arguments),
    /// Print a preset as a scene file to start from.
    Scene(commands::scene::Arguments),
}

/// The stack of a command in bytes: the usual size for a program.
const STACK_BYTES: usize = 8 << 20;

fn main() -> ExitCode {
    match Arguments::try_parse() {
        Ok(Arguments { command, shared }) => {
            let answer = on_a_whole_stack(|| run(command, &shared));
            stop::done();
            end(answer)
        }
        Err(told) if told.use_stderr() => {
            // The argument may be a file name with control characters.
            let text = told.render().to_string();
            if text.chars().any(|c| reception::bytes::is_control(c) && c != '\n') {
                output::tell(text.trim_end());
            } else {
                let _ = told.print();
            }
            ExitCode::from(2)
        }
        // Help, or the version.
        Err(told) => end(print(&told)),
    }
}

fn print(told: &clap::Error) -> anyhow::Result<Verdict> {
    let printed = told.print().and_then(|()| std::io::stdout().flush());
    Ok(output::unless_left(printed, (), || ()).map(|()| Verdict::Yes)?)
}

/// Converts the answer to the exit status, and prints an error.
fn end(answer: anyhow::Result<Verdict>) -> ExitCode {
    match answer {
        Ok(Verdict::Yes) => ExitCode::SUCCESS,
        Ok(Verdict::No) => ExitCode::from(1),
        Err(error) => {
            output::tell(format_args!("vocc: {}", output::explain(&error)));
            ExitCode::from(2)
        }
    }
}

/// Runs on a thread whose stack is mapped at once. The main thread's grows, and a signal ends the program if memory is then lacking.
fn on_a_whole_stack(run: impl FnOnce() -> anyhow::Result<Verdict> + Send) -> anyhow::Result<Verdict> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new()
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, run)
            .context("cannot start the thread of the command")?;
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn run(command: Option<Command>, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    stop::watch()?;
    // Built here because later users could not report a failure. 0: one thread per processor.
    rayon::ThreadPoolBuilder::new()
        .num_threads(shared.threads.unwrap_or_default().into())
        .build_global()
        .context("cannot start threads: ask for fewer with --threads")?;
    match command {
        None => commands::link::demonstrate(shared),
        Some(Command::Link(arguments)) => commands::link::run(&arguments, shared),
        Some(Command::Render(arguments)) => commands::render::run(&arguments, shared),
        Some(Command::Frames(arguments)) => commands::frames::run(&arguments, shared),
        Some(Command::Plan(arguments)) => commands::plan::run(&arguments, shared),
        Some(Command::Evaluate(arguments)) => commands::evaluate::run(&arguments, shared),
        Some(Command::Figures(arguments)) => commands::figures::run(&arguments, shared),
        Some(Command::Sweep(arguments)) => commands::sweep::run(&arguments, shared),
        Some(Command::Accuracy(arguments)) => commands::accuracy::run(&arguments, shared),
        Some(Command::Merge(arguments)) => commands::merge::run(&arguments, shared),
        Some(Command::Optimize(arguments)) => commands::optimize::run(&arguments, shared),
        Some(Command::Table(arguments)) => commands::table::run(&arguments, shared),
        Some(Command::Transmit(arguments)) => commands::transmit::run(&arguments, shared),
        Some(Command::Decode(arguments)) => commands::decode::run(&arguments, shared),
        Some(Command::Receive(arguments)) => commands::receive::run(&arguments, shared),
        Some(Command::Device(arguments)) => commands::device::run(&arguments, shared),
        Some(Command::Keys(arguments)) => commands::keys::run(&arguments, shared),
        Some(Command::Scene(arguments)) => commands::scene::run(&arguments),
    }
}
