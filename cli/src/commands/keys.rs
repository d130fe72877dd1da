//! `vocc keys`: signing keys.

use std::path::PathBuf;

use reception::keys::{self, KeyFileError, NamedKey, OwnKey};

use crate::keys::create;
use crate::options::SharedOptions;
use crate::output::{self, Verdict, line, lines};

/// Arguments of `vocc keys`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    /// Create a private key in a new file that other users cannot read.
    New {
        /// The file.
        #[arg(value_name = "KEY.toml")]
        file: PathBuf,
        /// Name of the key's owner. Default: the name of the file.
        #[arg(long)]
        name: Option<String>,
    },
    /// Print the public key of a private one, or those of a file of trusted keys: `vocc keys show KEY.toml >> keys.toml`.
    Show {
        /// The file.
        #[arg(value_name = "KEY.toml")]
        file: PathBuf,
    },
}

/// Creates a key, or shows public keys.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    match &arguments.action {
        Action::New { file, name } => {
            let of_file = file.file_stem().unwrap_or_default().to_string_lossy();
            let key = create(file, name.as_deref().unwrap_or(&of_file))?;
            if shared.json {
                output::json(&as_json(&key))?;
            } else {
                line(&format!(
                    "key {} ({}) is in {}: keep it secret; `vocc keys show` prints what others need to trust it",
                    key.key.id(),
                    key.name,
                    output::name(file)
                ))?;
            }
        }
        Action::Show { file } => {
            let keys = match keys::public_keys(file) {
                Err(KeyFileError::Secret(_)) => vec![OwnKey::read(file)?.public],
                keys => keys?,
            };
            for key in keys {
                if shared.json {
                    output::json(&as_json(&key))?;
                } else {
                    lines(&key.to_toml()?)?;
                }
            }
        }
    }
    Ok(Verdict::Yes)
}

fn as_json(key: &NamedKey) -> serde_json::Value {
    serde_json::json!({
        "name": key.name, "signer": key.key.id().to_string(), "public": reception::bytes::hex(&key.key.to_bytes()),
    })
}
