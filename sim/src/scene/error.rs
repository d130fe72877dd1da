//! Why a scene cannot be used.

use super::presets::PRESETS;
use super::range::RangeError;

/// Why a scene cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Neither a preset nor a file.
    #[error("no scene {name:?}: give a TOML file or one of the presets {}", PRESETS.map(|p| p.name).join(", "))]
    NotFound {
        /// The requested name.
        name: String,
    },
    /// The file cannot be read.
    #[error("cannot read scene {path:?}: {source}")]
    Read {
        /// The file.
        path: String,
        /// The cause.
        source: std::io::Error,
    },
    /// Not TOML, a key that does not exist, or a value of the wrong type.
    #[error("scene {name:?}: {source}")]
    Parse {
        /// The preset, the file or `--set`.
        name: String,
        /// The place and the fault.
        source: Box<toml::de::Error>,
    },
    /// An override that is not `KEY=VALUE` with a key of the scene.
    #[error("override {text:?}: {why}; write TABLE.KEY=VALUE, such as pose.distance_m=70")]
    Override {
        /// The override as given.
        text: String,
        /// Its fault.
        why: String,
    },
    /// A key that does not exist, or an incomplete one.
    #[error("scene key {key:?}: {why}")]
    Key {
        /// The key as given.
        key: String,
        /// Its fault.
        why: String,
    },
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] RangeError),
}
