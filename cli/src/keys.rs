//! Options about key files, and new keys.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use link::signing::KEY_BYTES;
use reception::keys::{self, KeyFileError, NamedKey, OwnKey, Trust};

use crate::files;

/// Why no key was created.
#[derive(Debug, thiserror::Error)]
enum NewKeyError {
    #[error("{} exists, and may be a key in use: give another file", .0.display())]
    Exists(PathBuf),
    #[error("this system provides no random numbers for a key: {0}")]
    Random(getrandom::Error),
}

/// Creates a key in a new file that other users cannot read.
pub fn create(path: &Path, name: &str) -> anyhow::Result<NamedKey> {
    let mut seed = [0; KEY_BYTES];
    getrandom::fill(&mut seed).map_err(NewKeyError::Random)?;
    let (key, text) = OwnKey::new_file(name, seed)?;
    match files::write_secret(path, text.as_bytes()) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => bail!(NewKeyError::Exists(path.into())),
        written => written.with_context(|| format!("cannot write {}", path.display()))?,
    }
    Ok(key)
}

/// Replaces the counters' file after a proof.
pub fn keep_counters(trust: &mut Trust) -> anyhow::Result<()> {
    match trust.take_counters()? {
        Some((path, text)) => files::write(path, text),
        None => Ok(()),
    }
}

/// How a message is signed.
#[derive(Clone, Debug, clap::Args)]
pub struct SigningArguments {
    /// Sign the message with this private key (see `vocc keys new`); the signature is shown after each repeat.
    #[arg(long, value_name = "KEY.toml")]
    sign: Option<PathBuf>,
    /// The signature's counter. It must rise with each message of a key, so that receivers can detect a replayed film. Default: the seconds
    /// since 1970.
    #[arg(long, value_name = "N", requires = "sign")]
    counter: Option<u32>,
}

impl SigningArguments {
    /// The key's file, if given.
    pub fn file(&self) -> Option<PathBuf> {
        self.sign.clone()
    }

    /// The key and the counter to sign with, if a key is given.
    pub fn key(&self) -> anyhow::Result<Option<(OwnKey, u32)>> {
        let Some(path) = &self.sign else {
            return Ok(None);
        };
        let key = OwnKey::read(path)?;
        Ok(Some((key, counter_or_seconds(self.counter)?)))
    }
}

/// The counter of a signature: `given`, or the seconds since 1970.
pub fn counter_or_seconds(given: Option<u32>) -> anyhow::Result<u32> {
    given
        .or_else(keys::counter_now)
        .context("this computer's clock is not set: give the signature's counter with --counter")
}

/// The keys that a receiver trusts.
#[derive(Clone, Debug, clap::Args)]
pub struct TrustArguments {
    /// Check signatures with the public keys in this file. Each message is then reported as proven, unproven, forged, replayed, signed by
    /// an unknown key, or unsigned. `vocc keys show KEY.toml >> keys.toml` adds a key.
    #[arg(long, value_name = "KEYS.toml")]
    trust: Option<PathBuf>,
    /// Print, write and record only proven messages; report the others on standard error.
    #[arg(long, requires = "trust")]
    pub only_trusted: bool,
    /// Keep the greatest counter of each key in this file, to detect replays across runs.
    #[arg(long, value_name = "FILE", requires = "trust")]
    counters: Option<PathBuf>,
}

impl TrustArguments {
    /// The counters' file, if given.
    pub fn counters(&self) -> Option<PathBuf> {
        self.counters.clone()
    }

    /// The keys' file, if given.
    pub fn file(&self) -> Option<PathBuf> {
        self.trust.clone()
    }

    /// The trusted keys; none if signatures are not checked.
    pub fn trust(&self) -> Result<Trust, KeyFileError> {
        let read = |path| Trust::read(path, self.counters.clone());
        self.trust.as_deref().map_or_else(|| Ok(Trust::default()), read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use reception::SignedMessage;

    #[test]
    fn a_counter_that_another_receiver_has_written_meanwhile_is_not_lowered() {
        let folder = tempfile::tempdir().expect("a folder");
        let [key, trusted, counters] = ["key.toml", "keys.toml", "seen.toml"].map(|name| folder.path().join(name));
        let public = create(&key, "truck").expect("a key").to_toml().expect("text");
        std::fs::write(&trusted, public).expect("a file");
        let key = OwnKey::read(&key).expect("a key");
        let signed = |counter| SignedMessage {
            data: b"ice".to_vec(),
            signature: key.sign(b"ice", counter),
        };
        let trust = || Trust::read(&trusted, Some(counters.clone())).expect("keys");
        for (mut receiver, counter) in [trust(), trust()].into_iter().zip([9, 5]) {
            assert_eq!(receiver.verdict(&signed(counter)).name(), "proven");
            keep_counters(&mut receiver).expect("kept");
        }
        assert_eq!(trust().verdict(&signed(9)).name(), "replayed");
    }
}
