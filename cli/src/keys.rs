//! Key files: private signing keys, trusted public keys, and the counters last seen of these.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::{Context, bail};
use link::framing::{KeyId, Signature};
use link::signing::{KEY_BYTES, KeyError, PublicKey, SecretKey, TrustedKey, Verdict, verdict};
use reception::bytes::hex;
use serde::{Deserialize, Serialize};

use crate::files;
use crate::output::is_control;

/// Maximum length of a key's name in characters.
const NAME_MAX: usize = 64;

/// Why a file has no usable keys.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// The file is unreadable.
    #[error("cannot read {}", .0.display())]
    Unreadable(PathBuf, #[source] std::io::Error),
    /// The file is no private key.
    #[error("{} holds no private key such as `vocc keys new` makes", .0.display())]
    NoSecret(PathBuf, #[source] toml::de::Error),
    /// The file is no list of public keys.
    #[error("{} holds no public keys such as `vocc keys show KEY.toml >> keys.toml` collects", .0.display())]
    NoPublic(PathBuf, #[source] toml::de::Error),
    /// A private key where a public one is expected.
    #[error("{} holds a private key, which nobody but its owner needs: `vocc keys show` prints the public one", .0.display())]
    Secret(PathBuf),
    /// The file has no key.
    #[error("{} holds no key: add some with `vocc keys show KEY.toml >> keys.toml`", .0.display())]
    Empty(PathBuf),
    /// Other users of this computer can sign too.
    #[error("{} can be read by other users, who could sign with it: `chmod 600` it, and if they may have, make a new key", .0.display())]
    Open(PathBuf),
    /// The digits are no key.
    #[error("{}: the key {name:?} is not {} hexadecimal digits: take the file from a backup, or make a new key", .path.display(), 2 * KEY_BYTES)]
    Digits {
        /// The file.
        path: PathBuf,
        /// The key's name.
        name: String,
    },
    /// The digits are no valid key.
    #[error("{}: the key {name:?}: {why}", .path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// The key's name.
        name: String,
        /// The reason.
        why: KeyError,
    },
    /// The public and the private half do not match.
    #[error("{}: the public key is not that of the private one: take the file from a backup, or make a new key", .0.display())]
    Halves(PathBuf),
    /// Two keys with the same id, so that the signer is ambiguous.
    #[error("{}: the keys {first:?} and {second:?} have one name, {id}: leave out one of them, or make it anew", .path.display())]
    Twice {
        /// The file.
        path: PathBuf,
        /// The first key's name.
        first: String,
        /// The second key's name.
        second: String,
        /// The id of both.
        id: KeyId,
    },
    /// The file exists.
    #[error("{} is there already, and may be a key that is in use: name another file", .0.display())]
    Exists(PathBuf),
    /// The name is not printable on one line.
    #[error("{0:?} is no name for a key: give 1 to {NAME_MAX} characters without control characters")]
    Name(String),
    /// No random numbers are available.
    #[error("this system gives no random numbers for a key: {0}")]
    Random(getrandom::Error),
    /// The counters file is unreadable.
    #[error("{} holds no counters such as `vocc receive --counters` writes: name another file, or remove it, and films shown again will not be \
             noticed until it has grown", .0.display())]
    NoCounters(PathBuf, #[source] toml::de::Error),
}

/// Contents of a private key's file.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct SecretFile {
    name: String,
    public: String,
    secret: String,
}

/// Contents of a file of public keys.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct PublicFile {
    #[serde(default)]
    key: Vec<PublicEntry>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct PublicEntry {
    name: String,
    public: String,
}

/// Contents of a file with the highest counters seen, by public key.
#[derive(Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct CountersFile {
    /// Required even if empty, which makes a damaged file detectable.
    last: BTreeMap<String, u32>,
}

impl CountersFile {
    /// Reads a file; a missing one is empty.
    fn read(path: &Path) -> Result<Self, KeyFileError> {
        match read(path) {
            Ok(text) => toml::from_str(&text).map_err(|error| KeyFileError::NoCounters(path.into(), error)),
            Err(KeyFileError::Unreadable(_, error)) if error.kind() == ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(error),
        }
    }
}

/// A public key and its owner.
#[derive(Clone, Debug)]
pub struct NamedKey {
    /// The owner.
    pub name: String,
    /// The key.
    pub key: PublicKey,
}

impl NamedKey {
    /// An entry of a file of trusted keys.
    pub fn to_toml(&self) -> anyhow::Result<String> {
        let entry = PublicEntry {
            name: self.name.clone(),
            public: hex(&self.key.to_bytes()),
        };
        let text = toml::to_string(&PublicFile { key: vec![entry] })?;
        Ok(format!("# {}\n{text}", self.key.id()))
    }

    fn of(path: &Path, name: String, digits: &str) -> Result<Self, KeyFileError> {
        check_name(&name)?;
        let key = PublicKey::from_bytes(key_bytes(path, &name, digits)?).map_err(|why| KeyFileError::Key {
            path: path.into(),
            name: name.clone(),
            why,
        })?;
        Ok(Self { name, key })
    }
}

/// A private key and its owner.
#[derive(Debug)]
pub struct OwnKey {
    /// The public half and its owner.
    pub public: NamedKey,
    key: SecretKey,
}

impl OwnKey {
    /// Creates a key in a new file that other users cannot read.
    pub fn create(path: &Path, name: &str) -> anyhow::Result<NamedKey> {
        check_name(name)?;
        let mut seed = [0; KEY_BYTES];
        getrandom::fill(&mut seed).map_err(KeyFileError::Random)?;
        let key = SecretKey::from_seed(seed)?.public();
        let text = toml::to_string(&SecretFile {
            name: name.into(),
            public: hex(&key.to_bytes()),
            secret: hex(&seed),
        })?;
        let text = format!("# A private key: whoever has it signs as its owner. `vocc keys show` prints the public one.\n{text}");
        match files::write_secret(path, text.as_bytes()) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => bail!(KeyFileError::Exists(path.into())),
            written => written.with_context(|| format!("cannot write {}", path.display()))?,
        }
        let name = name.into();
        Ok(NamedKey { name, key })
    }

    /// Reads the key in a file.
    pub fn read(path: &Path) -> Result<Self, KeyFileError> {
        let text = read(path)?;
        let file: SecretFile = toml::from_str(&text).map_err(|error| KeyFileError::NoSecret(path.into(), without_secrets(error)))?;
        if is_open(path) {
            return Err(KeyFileError::Open(path.into()));
        }
        let public = NamedKey::of(path, file.name, &file.public)?;
        let key = SecretKey::from_seed(key_bytes(path, &public.name, &file.secret)?).map_err(|why| KeyFileError::Key {
            path: path.into(),
            name: public.name.clone(),
            why,
        })?;
        if key.public() == public.key {
            Ok(Self { public, key })
        } else {
            Err(KeyFileError::Halves(path.into()))
        }
    }

    /// The seed that configures a board with this key: as secret as the file.
    pub fn seed(&self) -> [u8; KEY_BYTES] {
        let bytes = self.key.to_bytes();
        core::array::from_fn(|place| bytes[place])
    }

    /// Signs a message.
    pub fn sign(&self, message: &[u8], counter: u32) -> Signature {
        self.key.sign(message, counter)
    }
}

/// How a message is signed.
#[derive(Clone, Debug, clap::Args)]
pub struct SigningArguments {
    /// Sign the message with this private key, which `vocc keys new` makes; the signature is shown after each repeat.
    #[arg(long, value_name = "KEY.toml")]
    sign: Option<PathBuf>,
    /// The signature's counter. It must rise with each message of a key, so that receivers detect a replayed film. Default: the seconds
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
    let now = || SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).ok();
    let seconds = || u32::try_from(now()?.as_secs()).ok();
    given
        .or_else(seconds)
        .context("this computer's clock is not set: give the signature's counter with --counter")
}

/// Whom a receiver trusts.
#[derive(Clone, Debug, clap::Args)]
pub struct TrustArguments {
    /// Check signatures with the public keys in this file. Each message is then reported as proven, unproven, forged, replayed, signed by
    /// an unknown key, or unsigned. `vocc keys show KEY.toml >> keys.toml` adds a key.
    #[arg(long, value_name = "KEYS.toml")]
    trust: Option<PathBuf>,
    /// Print, write and record only proven messages; standard error reports the others.
    #[arg(long, requires = "trust")]
    pub only_trusted: bool,
    /// Keep the greatest counter of each key in this file, so that replays of films from before this run are detected too.
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

    /// The trusted keys; `None` if signatures are not checked.
    pub fn trust(&self) -> Result<Option<Trust>, KeyFileError> {
        self.trust.as_ref().map(|path| Trust::read(path, self.counters.clone())).transpose()
    }
}

/// Trusted keys, with their owners and last counters.
pub struct Trust {
    names: Vec<String>,
    keys: Vec<TrustedKey>,
    counters: Option<PathBuf>,
}

impl Trust {
    /// Reads a file of public keys, and one of counters, which may be missing.
    pub fn read(path: &Path, counters: Option<PathBuf>) -> Result<Self, KeyFileError> {
        let keys = public_keys(path)?;
        let seen = counters.as_deref().map(CountersFile::read).transpose()?.unwrap_or_default();
        let trusted = |named: &NamedKey| TrustedKey::new(named.key, seen.last.get(&hex(&named.key.to_bytes())).copied());
        Ok(Self {
            keys: keys.iter().map(trusted).collect(),
            names: keys.into_iter().map(|named| named.name).collect(),
            counters,
        })
    }

    /// Verifies a signature. A proven counter is remembered for this run even if writing it fails; the second value is that error.
    pub fn verdict(&mut self, message: &[u8], signature: &Signature) -> (Verdict, anyhow::Result<()>) {
        let verdict = verdict(&mut self.keys, message, signature);
        let kept = match verdict {
            Verdict::Proven { .. } => self.keep(),
            _ => Ok(()),
        };
        (verdict, kept)
    }

    /// A key's owner.
    pub fn name(&self, id: KeyId) -> Option<&str> {
        let place = self.keys.iter().position(|trusted| trusted.key().id() == id)?;
        self.names.get(place).map(String::as_str)
    }

    fn keep(&self) -> anyhow::Result<()> {
        let Some(path) = &self.counters else {
            return Ok(());
        };
        // Another receiver may have written the file since.
        let mut seen = CountersFile::read(path)?;
        for (key, last) in self.keys.iter().filter_map(|trusted| Some((trusted.key(), trusted.last()?))) {
            let kept = seen.last.entry(hex(&key.to_bytes())).or_default();
            *kept = last.max(*kept);
        }
        let text = toml::to_string(&seen)?;
        files::write(
            path,
            format!("# The greatest counter that was seen of each key, by `vocc receive`.\n{text}"),
        )
    }
}

/// The public keys in a file, or the public half of a private key in it.
pub fn public_keys(path: &Path) -> Result<Vec<NamedKey>, KeyFileError> {
    let text = read(path)?;
    let file: PublicFile = toml::from_str(&text).map_err(|error| match toml::from_str::<SecretFile>(&text) {
        Ok(_) => KeyFileError::Secret(path.into()),
        Err(_) => KeyFileError::NoPublic(path.into(), without_secrets(error)),
    })?;
    let entries = file.key.into_iter();
    let keys: Vec<NamedKey> = entries
        .map(|entry| NamedKey::of(path, entry.name, &entry.public))
        .collect::<Result<_, _>>()?;
    if keys.is_empty() {
        return Err(KeyFileError::Empty(path.into()));
    }
    for (place, second) in keys.iter().enumerate() {
        if let Some(first) = keys[..place].iter().find(|first| first.key.id() == second.key.id()) {
            return Err(KeyFileError::Twice {
                path: path.into(),
                first: first.name.clone(),
                second: second.name.clone(),
                id: second.key.id(),
            });
        }
    }
    Ok(keys)
}

/// Checks that a name is printable on one line.
fn check_name(name: &str) -> Result<(), KeyFileError> {
    let is_fit = (1..=NAME_MAX).contains(&name.chars().count()) && !name.chars().any(is_control);
    if is_fit { Ok(()) } else { Err(KeyFileError::Name(name.into())) }
}

fn read(path: &Path) -> Result<String, KeyFileError> {
    std::fs::read_to_string(path).map_err(|error| KeyFileError::Unreadable(path.into(), error))
}

/// Removes the quoted line from an error, as it may contain the secret.
fn without_secrets(mut error: toml::de::Error) -> toml::de::Error {
    error.set_input(None);
    error
}

fn key_bytes(path: &Path, name: &str, digits: &str) -> Result<[u8; KEY_BYTES], KeyFileError> {
    let byte = |place: usize| u8::from_str_radix(digits.get(2 * place..2 * place + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..KEY_BYTES).map(byte).collect();
    let is_hex = digits.len() == 2 * KEY_BYTES && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    bytes
        .filter(|_| is_hex)
        .and_then(|bytes| bytes.try_into().ok())
        .ok_or_else(|| KeyFileError::Digits {
            path: path.into(),
            name: name.into(),
        })
}

/// Whether other users can read a file, on systems that report it.
pub fn is_open(path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::metadata(path).is_ok_and(|metadata| metadata.permissions().mode() & 0o077 != 0)
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_that_another_receiver_has_written_meanwhile_is_not_lowered() {
        let folder = tempfile::tempdir().expect("a folder");
        let [key, trusted, counters] = ["key.toml", "keys.toml", "seen.toml"].map(|name| folder.path().join(name));
        let public = OwnKey::create(&key, "truck").expect("a key").to_toml().expect("text");
        std::fs::write(&trusted, public).expect("a file");
        let key = OwnKey::read(&key).expect("a key");
        let trust = || Trust::read(&trusted, Some(counters.clone())).expect("keys");
        for (mut receiver, counter) in [trust(), trust()].into_iter().zip([9, 5]) {
            let (verdict, kept) = receiver.verdict(b"ice", &key.sign(b"ice", counter));
            assert!(matches!(verdict, Verdict::Proven { .. }) && kept.is_ok(), "{verdict}");
        }
        let (verdict, _) = trust().verdict(b"ice", &key.sign(b"ice", 9));
        assert_eq!(verdict.name(), "replayed");
    }
}
