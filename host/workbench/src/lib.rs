//! The loop of criticism by hand, on a page in the browser.
//!
//! A request is answered from what is known ([`yawrig_session`]); what takes longer is queued (`work`) and
//! done by one thread (`jobs`), which tells the pages when it is ready (`news`). The page asks no other host for anything, and this server answers no other page (`access`).
#![forbid(unsafe_code)]

mod access;
mod api;
mod app;
mod assets;
mod campaign;
mod dropped;
mod folder;
mod jobs;
mod live;
mod news;
mod options;
mod server;
mod still;
mod work;

pub use options::ServeOptions;
pub use still::write as write_still;
pub use yawrig_session::Opened;

use std::net::Ipv4Addr;
use std::sync::Arc;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;

/// Serves the page until the user stops it; `ready` is given its address.
///
/// # Errors
/// Exit 2 or 3 where the files cannot be used, 4 where the port cannot be had, 130 on Ctrl-C.
pub fn serve(options: &ServeOptions, ready: impl FnOnce(&str) -> Result<()>) -> Result<()> {
    let session = yawrig_session::Session::new(&options.opened)?;
    let ip = options.allow_remote.unwrap_or(Ipv4Addr::LOCALHOST.into());
    let listener = server::bound(ip, options.port)?;
    let address = listener
        .local_addr()
        .map_err(|e| Error::internal(format!("cannot serve the page: {e}")))?;
    let access = access::Access::new(address)?;
    let url = access.url();
    if !ip.is_loopback() {
        yawrig_base::say!(
            "warning: everyone who can reach {address} and has the address below can change this model; \
             nothing is encrypted"
        );
    }
    let app = Arc::new(app::App::new(access, session)?);
    let worker = {
        let app = app.clone();
        std::thread::spawn(move || jobs::work(&app))
    };
    ready(&url)?;
    if let Some(device) = &options.device {
        app.follow(device, 1.0)?;
    }
    yawrig_base::say!("the page is at that address for as long as this runs; Ctrl-C ends it");
    if options.open {
        open(&url);
    }
    let done = server::run(listener, &app);
    app.live.end();
    if interrupt::requested() {
        // A fit that is under way asks often; a step that is being written is written whole.
        let _ = worker.join();
    }
    done
}

/// In the user's browser.
fn open(url: &str) {
    let (program, before): (_, &[_]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("rundll32", &["url.dll,FileProtocolHandler"]),
        _ => ("xdg-open", &[]),
    };
    let started = std::process::Command::new(program)
        .args(before)
        .arg(url)
        .stdin(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn();
    if let Err(e) = started {
        yawrig_base::say!(
            "cannot start a browser ({program}: {e}); open the address above yourself"
        );
    }
}
