//! Makes of the module that rustc built the one that a page loads, with the script between both: what
//! `wasm-bindgen --target web` does, whose version is then always that of the library in it. The module is packed
//! (`host/workbench/assets/unpack.js` unpacks it): by a quarter smaller than a server's gzip makes it, and from any server.
#![forbid(unsafe_code)]

use lzma_rust2::{LzmaOptions, LzmaWriter};
use std::error::Error;
use std::io::Write;
use std::path::Path;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> std::process::ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [module, folder] = &arguments[..] else {
        eprintln!("usage: yawrig-web-pack MODULE.wasm FOLDER");
        return std::process::ExitCode::from(2);
    };
    match made(module, Path::new(folder)) {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("yawrig-web-pack: {e:#}");
            std::process::ExitCode::FAILURE
        }
    }
}

fn made(module: &str, folder: &Path) -> Result<(), Box<dyn Error>> {
    let mut bindgen = Bindgen::new();
    bindgen.input_path(module).out_name("yawrig").typescript(false).remove_name_section(true);
    bindgen.web(true)?.generate(folder)?;
    let module = folder.join("yawrig_bg.wasm");
    std::fs::write(folder.join("yawrig.lzma"), packed(&std::fs::read(&module)?)?)?;
    std::fs::remove_file(module)?;
    Ok(())
}

fn packed(bytes: &[u8]) -> Result<Vec<u8>, Box<dyn Error>> {
    // A module's bytes are in no rows of two or four.
    let options = LzmaOptions { lc: 4, pb: 0, ..LzmaOptions::with_preset(9) };
    let mut writer =
        LzmaWriter::new_use_header(Vec::new(), &options, Some(bytes.len().try_into()?))?;
    writer.write_all(bytes)?;
    Ok(writer.finish()?)
}
