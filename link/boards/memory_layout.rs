//! The build script of all boards: gives the linker the memory layout of the target chip.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let has = |feature: &str| env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let layout = if has("RP2350") {
        "memory-rp2350.x"
    } else if has("RP2040") {
        "memory-rp2040.x"
    } else {
        "memory.x"
    };
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set")?);
    fs::copy(layout, out.join("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=--nmagic");
    // Code and constants in one part, so that no byte between them is left to the program that flashes.
    println!("cargo:rustc-link-arg-bins=--no-rosegment");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    if layout == "memory-rp2040.x" {
        println!("cargo:rustc-link-arg-bins=-Tlink-rp.x");
    }
    if has("DEFMT") {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    println!("cargo:rerun-if-changed={layout}");
    Ok(())
}
