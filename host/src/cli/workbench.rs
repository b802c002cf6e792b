//! `workbench`: the loop of criticism by hand, on a page in the browser.

use clap::Args;
use std::net::IpAddr;
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_campaign::simulated::CAMPAIGN_FILE;
use yawrig_model::document::DEFAULT;
use yawrig_model::revise::quoted;
use yawrig_verbs::common::{print_line, EffectsArg};
use yawrig_verbs::identify::expanded;
use yawrig_workbench::{Opened, ServeOptions};

/// Criticise a model by hand, on a page that this machine serves to its own browser.
///
/// Prints the page's address; Ctrl-C ends it. Records, a campaign.toml, or a model.toml with its records:
/// what is done on the page is written as `fit`, `add`, `remove` and `history --return` write it.
#[derive(Args, Debug, Clone)]
pub struct Workbench {
    /// Records, a campaign.toml, a model.toml, or a folder with them; none: model.toml where there is one
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The model's file, made by the first step [default: the model.toml given, else model.toml]
    #[arg(short, long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    #[command(flatten)]
    pub effects: EffectsArg,
    /// The sensor was not zeroed: fit its zero, and leave out the constant moment
    #[arg(long)]
    pub unknown_zero: bool,
    /// Port of the page [default: a free one]
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    pub port: u16,
    /// Serve on this address instead of 127.0.0.1, for browsers elsewhere: the traffic is not encrypted
    #[arg(long, value_name = "ADDRESS")]
    pub allow_remote: Option<IpAddr>,
    /// Follow this device from the beginning: `emulated`, `qemu` or a serial port's path
    #[arg(short, long, value_name = "DEVICE")]
    pub device: Option<String>,
    /// Open the page in the browser
    #[arg(long)]
    pub open: bool,
    /// Write the page that needs no server into this folder instead: records are dropped on it and judged by
    /// the browser itself
    #[arg(long = "static", value_name = "FOLDER", conflicts_with_all = ["files", "model", "effects", "unknown_zero", "port", "allow_remote", "device", "open"])]
    pub still: Option<PathBuf>,
}

/// A folder stands for the model or the campaign in it, or else for its records.
fn opened(files: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut out = Vec::new();
    for file in files {
        let known = [DEFAULT, CAMPAIGN_FILE].map(|name| file.join(name));
        match known.into_iter().find(|known| known.is_file()) {
            Some(known) => out.push(known),
            None => out.extend(expanded(std::slice::from_ref(file))?),
        }
    }
    Ok(out)
}

impl Workbench {
    pub fn run(&self) -> Result<()> {
        if let Some(folder) = &self.still {
            let page = yawrig_workbench::write_still(folder)?;
            crate::say!(
                "any web server shows it; on this machine: python3 -m http.server --directory {}",
                quoted(&folder.display().to_string())
            );
            return print_line(&page.display().to_string());
        }
        let options = ServeOptions {
            opened: Opened {
                files: opened(&self.files)?,
                model: self.model.clone(),
                own: self.effects.effects()?,
                unknown_zero: self.unknown_zero,
            },
            port: self.port,
            allow_remote: self.allow_remote,
            device: self.device.clone(),
            open: self.open,
        };
        yawrig_workbench::serve(&options, print_line)
    }
}
