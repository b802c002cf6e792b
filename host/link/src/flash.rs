//! Writing a network to a device of this machine.

use crate::client::{waited, Client};
use crate::key::Signer;
use ed25519_compact::KeyPair;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::settings;
use yawrig_protocol::flash::{self as protocol, checked, Sign};
pub use yawrig_protocol::flash::{say, Progress, Silent};
use yawrig_shared::blob::Payload;

/// A network file that has passed every check the device will make, too.
///
/// # Errors
/// Exit 5, naming the file and what is wrong with it.
pub fn read(path: &std::path::Path) -> Result<(Vec<u8>, Payload)> {
    let train = || settings::command("train", &[], &[("out", "network.yrn")]);
    let bytes = std::fs::read(path).map_err(|e| {
        Error::data(format!("cannot read {}: {e}", path.display()))
            .help(format!("make a network with `{}`", train()))
    })?;
    let payload = checked(&bytes).map_err(|why| {
        Error::new(Exit::Flash, format!("{} is not a network to write: {why}", path.display()))
            .help(format!("make one with `{}`", train()))
    })?;
    Ok((bytes, payload))
}

/// Writes a blob, has it verified and run; the generation it was given.
///
/// # Errors
/// Exit 5, as [`protocol::write()`].
pub fn write(client: &mut Client, blob: &[u8], progress: &mut dyn Progress) -> Result<u32> {
    write_signed(client, blob, None, progress)
}

/// The same with a signature, which a locked device wants.
///
/// # Errors
/// Exit 5, as [`protocol::write()`].
pub fn write_signed(
    client: &mut Client,
    blob: &[u8],
    key: Option<&KeyPair>,
    progress: &mut dyn Progress,
) -> Result<u32> {
    let signer = key.map(Signer);
    let sign = signer.as_ref().map(|signer| signer as &dyn Sign);
    waited(protocol::write(client, blob, sign, progress))
}
