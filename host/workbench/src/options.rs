//! What is served, and to whom.

use std::net::IpAddr;
use std::path::PathBuf;
use yawrig_core::effects::Effect;

/// As the command line has it.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    /// Records, a campaign or a model.
    pub files: Vec<PathBuf>,
    pub model: Option<PathBuf>,
    /// The user's own effects.
    pub own: Vec<Effect>,
    pub unknown_zero: bool,
    /// 0: a free one.
    pub port: u16,
    /// Another address than this machine's own.
    pub allow_remote: Option<IpAddr>,
    /// A device to follow from the beginning.
    pub device: Option<String>,
    /// In the browser, at once.
    pub open: bool,
}
