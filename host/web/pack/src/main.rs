//! Makes of the module that rustc built the one that a page loads, with the script between both: what
//! `wasm-bindgen --target web` does, whose version is then always that of the library in it.
#![forbid(unsafe_code)]

use wasm_bindgen_cli_support::Bindgen;

fn main() -> std::process::ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [module, folder] = &arguments[..] else {
        eprintln!("usage: yawrig-web-pack MODULE.wasm FOLDER");
        return std::process::ExitCode::from(2);
    };
    let mut bindgen = Bindgen::new();
    bindgen.input_path(module).out_name("yawrig").typescript(false).remove_name_section(true);
    match bindgen.web(true).and_then(|bindgen| bindgen.generate(folder)) {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("yawrig-web-pack: {e:#}");
            std::process::ExitCode::FAILURE
        }
    }
}
