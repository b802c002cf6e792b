//! Of every board: puts its memory.x where the linker script of cortex-m-rt looks for it, and asks for that
//! script.

use std::{env, fs, path::PathBuf};

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("memory.x", out.join("memory.x")).expect("the board has one, and OUT_DIR is writable");
    println!("cargo:rustc-link-search={}", out.display());
    // Here rather than in .cargo/config.toml, where a RUSTFLAGS of the user's would displace it.
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    if env::var_os("CARGO_FEATURE_LOG").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=../build.rs");
}
