//! Checks licences and sources of all dependencies against `deny.toml`.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;
use vocc_tests::programs::{output, root};

#[derive(Deserialize)]
struct Deny {
    licenses: Licenses,
    sources: Sources,
}

#[derive(Deserialize)]
struct Licenses {
    allow: Vec<String>,
    exceptions: Vec<Exception>,
}

#[derive(Deserialize)]
struct Exception {
    #[serde(rename = "crate")]
    package: String,
    allow: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Sources {
    allow_registry: Vec<String>,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    license: Option<String>,
}

fn deny() -> Deny {
    let path = root().join("deny.toml");
    let text = std::fs::read_to_string(&path).expect("deny.toml");
    toml::from_str(&text).expect("what cargo-deny reads")
}

/// Whether the licences that `is_allowed` accepts satisfy an SPDX expression. `AND` binds tighter than `OR`; the old `/` means `OR`.
fn is_met(expression: &str, is_allowed: &dyn Fn(&str) -> bool) -> bool {
    let any = |text: &str| text.split(" OR ").any(|all| all.split(" AND ").all(|name| is_allowed(name.trim())));
    let expression = expression.replace(" / ", "/").replace('/', " OR ");
    // Replaces the innermost parentheses by an accepted or a rejected licence.
    match expression.rsplit_once('(') {
        None => any(&expression),
        Some((before, rest)) => {
            let (inside, after) = rest.split_once(')').expect("as many parentheses closed as open");
            let verdict = if any(inside) { "met" } else { "unmet" };
            is_met(&format!("{before}{verdict}{after}"), &|name| name == "met" || is_allowed(name))
        }
    }
}

#[test]
fn expressions_are_read_as_spdx_means_them() {
    let is_allowed = |name: &str| ["MIT", "Apache-2.0 WITH LLVM-exception", "Unicode-3.0"].contains(&name);
    for (expression, met) in [
        ("MIT", true),
        ("GPL-3.0-only", false),
        ("GPL-3.0-only OR MIT", true),
        ("Unlicense/MIT", true),
        ("Apache-2.0 / GPL-2.0", false),
        ("Apache-2.0 WITH LLVM-exception OR GPL-2.0", true),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", true),
        ("(MIT OR Apache-2.0) AND GPL-2.0", false),
        ("MIT AND (GPL-2.0 OR (Unicode-3.0 AND MIT))", true),
    ] {
        assert_eq!(is_met(expression, &is_allowed), met, "{expression}");
    }
}

#[test]
fn licences_are_allowed() {
    let Licenses { allow, exceptions } = deny().licenses;
    let version = output(Command::new("rustc").arg("-vV")).expect("a compiler");
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([
        "metadata",
        "--format-version",
        "1",
        "--locked",
        "--offline",
        "--filter-platform",
        host,
    ]);
    let metadata = output(&mut cargo).expect("metadata");
    let Metadata { packages } = serde_json::from_str(&metadata).expect("metadata");
    assert!(packages.len() > 100, "{} packages", packages.len());
    for Package { name, license } in &packages {
        let license = license.as_deref().unwrap_or("none");
        let own = exceptions.iter().filter(|exception| exception.package == *name);
        let allowed: Vec<&String> = allow.iter().chain(own.flat_map(|exception| &exception.allow)).collect();
        let is_allowed = |license: &str| allowed.iter().any(|allowed| *allowed == license);
        assert!(is_met(license, &is_allowed), "{name} is under {license}: see deny.toml");
    }
}

/// The lock files of all workspaces, including the boards'.
fn lock_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let entries = entries.map(|entry| entry.expect("an entry").path()).flat_map(|path| {
        let name = path.file_name().unwrap_or_default();
        let is_ours = !name.as_encoded_bytes().starts_with(b".") && name != "target" && name != "node_modules";
        match name == "Cargo.lock" {
            true => vec![path],
            false if is_ours && path.is_dir() => lock_files(&path),
            false => Vec::new(),
        }
    });
    entries.collect()
}

#[test]
fn packages_come_from_the_registry() {
    let allowed = deny().sources.allow_registry;
    let locks = lock_files(root());
    assert!(locks.len() > 3, "{locks:?}");
    for lock in locks {
        let text = std::fs::read_to_string(&lock).expect("a lock file");
        for source in text.lines().filter_map(|line| line.strip_prefix("source = ")) {
            let registry = source.trim_matches('"').strip_prefix("registry+");
            let is_allowed = registry.is_some_and(|registry| allowed.iter().any(|allowed| allowed == registry));
            assert!(is_allowed, "{}: {source}: see deny.toml", lock.display());
        }
    }
}
