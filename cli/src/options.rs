//! Options that several commands share, and what they mean.

use std::fs::File;
use std::io::Read;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use clap::Args;
use link::framing::MESSAGE_MAX;
use rx_pipeline::detect::Detector;
use sim::detectors::{DETECTORS, DetectorChoice};
use sim::scene::Scene;

/// Options of every command.
#[derive(Args)]
pub struct Shared {
    /// Overrule a scene key, such as pose.distance_m=70 (repeatable).
    #[arg(long = "set", value_name = "KEY=VALUE", global = true)]
    pub set: Vec<String>,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1, global = true)]
    pub seed: u64,
    /// Threads, 1 to 1024; all processors by default.
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print JSON and nothing else on standard output.
    #[arg(long, global = true)]
    pub json: bool,
}

impl Shared {
    /// The scene of that name or file, with the overrides.
    pub fn scene(&self, name: &str) -> anyhow::Result<Scene> {
        Ok(Scene::load(name, &self.set)?)
    }
}

/// A detector's name.
pub fn detector(name: &str) -> Result<DetectorChoice, String> {
    let known = || DETECTORS.map(|(name, _)| name).join(", ");
    DETECTORS
        .iter()
        .find(|(known, _)| *known == name)
        .map(|&(_, choice)| choice)
        .ok_or_else(|| format!("no detector {name:?}: choose one of {}", known()))
}

/// A flag that Ctrl-C clears, so that work ends with what is finished.
pub fn until_interrupted() -> anyhow::Result<impl Fn() -> bool> {
    let going = Arc::new(AtomicBool::new(true));
    let flag = Arc::clone(&going);
    ctrlc::set_handler(move || flag.store(false, Ordering::Relaxed))
        .context("cannot watch for Ctrl-C")?;
    Ok(move || going.load(Ordering::Relaxed))
}

/// A message, from the command line or from a file.
#[derive(Args)]
#[group(multiple = false)]
pub struct Message {
    /// The message, 1 to 1024 bytes.
    #[arg(long, value_name = "T")]
    message: Option<String>,
    /// A file that holds the message, 1 to 1024 bytes of any kind.
    #[arg(long, value_name = "FILE")]
    message_file: Option<PathBuf>,
}

impl Message {
    /// The message's bytes; none where none is given.
    pub fn bytes(&self) -> anyhow::Result<Option<Vec<u8>>> {
        match (&self.message, &self.message_file) {
            (Some(text), _) => Ok(Some(text.clone().into_bytes())),
            (None, Some(path)) => {
                let mut bytes = Vec::new();
                // One byte too many is enough to be refused.
                let limit = MESSAGE_MAX as u64 + 1;
                File::open(path)
                    .and_then(|file| file.take(limit).read_to_end(&mut bytes))
                    .with_context(|| format!("cannot read the message from {}", path.display()))?;
                Ok(Some(bytes))
            }
            (None, None) => Ok(None),
        }
    }
}

/// The detector of a choice that needs no frames to learn from.
pub fn untrained(choice: DetectorChoice) -> anyhow::Result<Detector> {
    choice.untrained().context(
        "the detector fisher learns from frames whose bits are known, and here are none: choose kmeans, kmeans-raw or otsu, or run `vocc link` or `vocc evaluate`",
    )
}
