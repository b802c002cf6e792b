//! What is served, and to whom.

use std::net::IpAddr;
use yawrig_session::Opened;

/// As the command line has it.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    pub opened: Opened,
    /// 0: a free one.
    pub port: u16,
    /// Another address than this machine's own.
    pub allow_remote: Option<IpAddr>,
    /// A device to follow from the beginning.
    pub device: Option<String>,
    /// In the browser, at once.
    pub open: bool,
}
