//! Files of private signing keys, of trusted public keys, and of the counters last seen of these; and the verdict on a signature.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use link::framing::{KeyId, Signature};
use link::signing::{KEY_BYTES, KeyError, PublicKey, SecretKey, TrustedKey, Verdict, verdict};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::SignedMessage;
use crate::bytes::{hex, is_control};

/// Maximum length of a key's name in characters.
const NAME_MAX: usize = 64;

/// Why a file has no usable keys.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// The file is unreadable.
    #[error("cannot read {}", .0.display())]
    Unreadable(PathBuf, #[source] std::io::Error),
    /// The file is not a private key.
    #[error("{} holds no private key as made by `vocc keys new`", .0.display())]
    NoSecret(PathBuf, #[source] toml::de::Error),
    /// The file is not a list of public keys.
    #[error("{} holds no public keys as made by `vocc keys show KEY.toml >> keys.toml`", .0.display())]
    NoPublic(PathBuf, #[source] toml::de::Error),
    /// A private key where a public one is expected.
    #[error("{} holds a private key, which only its owner needs: `vocc keys show` prints the public one", .0.display())]
    Secret(PathBuf),
    /// The file has no key.
    #[error("{} holds no key: add some with `vocc keys show KEY.toml >> keys.toml`", .0.display())]
    Empty(PathBuf),
    /// Other users of this computer can sign too.
    #[error(
        "{} can be read by other users, who could sign with it: `chmod 600` it, and if they may have read it, make a new key",
        .0.display()
    )]
    Open(PathBuf),
    /// The digits are not a key.
    #[error(
        "{}: the key {name:?} is not {} hexadecimal digits: take the file from a backup, or make a new key",
        .path.display(), 2 * KEY_BYTES
    )]
    Digits {
        /// The file.
        path: PathBuf,
        /// The key's name.
        name: String,
    },
    /// The digits are not a valid key.
    #[error("{}: the key {name:?}: {why}", .path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// The key's name.
        name: String,
        /// The reason.
        why: KeyError,
    },
    /// The seed of a new key is invalid.
    #[error(transparent)]
    Seed(#[from] KeyError),
    /// The public and the private half do not match.
    #[error("{}: the public key is not that of the private one: take the file from a backup, or make a new key", .0.display())]
    Halves(PathBuf),
    /// Two keys with the same id, so that the signer is ambiguous.
    #[error("{}: the keys {first:?} and {second:?} have the same id, {id}: remove or replace one of them", .path.display())]
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
    /// The name is not printable on one line.
    #[error("{0:?} is not a name for a key: give 1 to {NAME_MAX} characters without control characters")]
    Name(String),
    /// The counters file is unreadable.
    #[error(
        "{} holds no counters such as `vocc receive --counters` writes: give another file. If you remove it, replayed films are not \
         recognised until it has grown",
        .0.display()
    )]
    NoCounters(PathBuf, #[source] toml::de::Error),
    /// It cannot be written as TOML.
    #[error("keys or counters cannot be written as TOML: {0}")]
    Unwritten(#[from] toml::ser::Error),
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
    /// Required even if empty, so that a damaged file is detected.
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
    ///
    /// # Errors
    /// [`KeyFileError::Unwritten`].
    pub fn to_toml(&self) -> Result<String, KeyFileError> {
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
    /// The contents of a private key's file, for an owner and a random seed. Other users must not read it.
    ///
    /// # Errors
    /// [`KeyFileError::Name`] and [`KeyFileError::Seed`].
    pub fn new_file(name: &str, seed: [u8; KEY_BYTES]) -> Result<(NamedKey, String), KeyFileError> {
        check_name(name)?;
        let key = SecretKey::from_seed(seed)?.public();
        let text = toml::to_string(&SecretFile {
            name: name.into(),
            public: hex(&key.to_bytes()),
            secret: hex(&seed),
        })?;
        let text = format!("# A private key: anyone who has it can sign as its owner. `vocc keys show` prints the public one.\n{text}");
        let name = name.into();
        Ok((NamedKey { name, key }, text))
    }

    /// Reads the key in a file.
    ///
    /// # Errors
    /// If the file holds no private key, or other users can read it.
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

/// Trusted keys, with their owners and last counters. Without any, signatures are not checked.
#[derive(Debug, Default)]
pub struct Trust {
    names: Vec<String>,
    keys: Vec<TrustedKey>,
    counters: Option<PathBuf>,
    has_unkept: bool,
}

impl Trust {
    /// Reads a file of public keys, and one of counters, which may be missing.
    ///
    /// # Errors
    /// If a file holds something else.
    pub fn read(path: &Path, counters: Option<PathBuf>) -> Result<Self, KeyFileError> {
        let keys = public_keys(path)?;
        let seen = counters.as_deref().map(CountersFile::read).transpose()?.unwrap_or_default();
        Ok(Self {
            counters,
            ..Self::of(keys, &seen)
        })
    }

    /// The public keys in the text of such a file, which `source` names in errors. Counters are kept in memory only.
    ///
    /// # Errors
    /// If the text holds something else.
    pub fn parse(text: &str, source: &str) -> Result<Self, KeyFileError> {
        Ok(Self::of(public_keys_of(text, Path::new(source))?, &CountersFile::default()))
    }

    fn of(keys: Vec<NamedKey>, seen: &CountersFile) -> Self {
        let trusted = |named: &NamedKey| TrustedKey::new(named.key, seen.last.get(&hex(&named.key.to_bytes())).copied());
        Self {
            keys: keys.iter().map(trusted).collect(),
            names: keys.into_iter().map(|named| named.name).collect(),
            ..Self::default()
        }
    }

    /// Takes over the greatest counters of the same keys from `earlier`.
    pub fn remember(&mut self, earlier: &Self) {
        for trusted in &mut self.keys {
            let seen = earlier.keys.iter().find(|earlier| earlier.key() == trusted.key());
            let last = seen.and_then(TrustedKey::last).max(trusted.last());
            *trusted = TrustedKey::new(trusted.key(), last);
        }
    }

    /// Whether signatures are checked.
    pub fn is_checking(&self) -> bool {
        !self.keys.is_empty()
    }

    /// The verdict on a signature. A proven counter counts as seen from now on; [`Self::take_counters`] returns it for the file.
    pub fn verdict(&mut self, signed: &SignedMessage) -> Verdict {
        let (signer, counter) = (signed.signature.key, signed.signature.counter);
        if !self.is_checking() {
            return Verdict::Unchecked { signer, counter };
        }
        let verdict = verdict(&mut self.keys, &signed.data, &signed.signature);
        self.has_unkept |= matches!(verdict, Verdict::Proven { .. });
        verdict
    }

    /// A key's owner.
    pub fn name(&self, id: KeyId) -> Option<&str> {
        let place = self.keys.iter().position(|trusted| trusted.key().id() == id)?;
        self.names.get(place).map(String::as_str)
    }

    /// A verdict as text, with the name of a trusted key.
    pub fn text(&self, verdict: &Verdict) -> String {
        let signer = verdict
            .claim()
            .and_then(|(signer, _)| Some((signer.to_string(), self.name(signer)?)));
        match signer {
            Some((signer, name)) => verdict.to_string().replacen(&signer, &format!("{name} ({signer})"), 1),
            None => verdict.to_string(),
        }
    }

    /// Adds a verdict to a JSON object, with the name of a trusted key.
    pub fn add_json(&self, told: &mut Value, verdict: &Verdict) {
        add_verdict(told, verdict);
        if let Some((signer, _)) = verdict.claim() {
            told["signer_name"] = self.name(signer).into();
        }
    }

    /// The counters' file and its new contents after a proof. Replace the file as a whole.
    ///
    /// # Errors
    /// If the current file holds something else.
    pub fn take_counters(&mut self) -> Result<Option<(&Path, String)>, KeyFileError> {
        let has_unkept = core::mem::take(&mut self.has_unkept);
        let Some(path) = self.counters.as_deref().filter(|_| has_unkept) else {
            return Ok(None);
        };
        // Another receiver may have written the file since.
        let mut seen = CountersFile::read(path)?;
        for (key, last) in self.keys.iter().filter_map(|trusted| Some((trusted.key(), trusted.last()?))) {
            let kept = seen.last.entry(hex(&key.to_bytes())).or_default();
            *kept = last.max(*kept);
        }
        let text = toml::to_string(&seen)?;
        let text = format!("# The greatest counter of each key that `vocc receive` has seen.\n{text}");
        Ok(Some((path, text)))
    }
}

/// Adds a verdict to a JSON object, with the key and the counter that the signature names.
pub fn add_verdict(told: &mut Value, verdict: &Verdict) {
    told["verdict"] = verdict.name().into();
    if let Some((signer, counter)) = verdict.claim() {
        told["signer"] = signer.to_string().into();
        told["counter"] = counter.into();
    }
}

/// The counter of a new signature: seconds since 1970, unless the clock is not set.
pub fn counter_now() -> Option<u32> {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).ok()?;
    u32::try_from(now.as_secs()).ok()
}

/// The public keys in a file.
///
/// # Errors
/// If the file has none, or two of one name.
pub fn public_keys(path: &Path) -> Result<Vec<NamedKey>, KeyFileError> {
    public_keys_of(&read(path)?, path)
}

/// The public keys in the text of a file; `path` names it in errors.
fn public_keys_of(text: &str, path: &Path) -> Result<Vec<NamedKey>, KeyFileError> {
    let file: PublicFile = toml::from_str(text).map_err(|error| match toml::from_str::<SecretFile>(text) {
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

/// Removes the quoted line from an error, because it may contain the secret.
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
