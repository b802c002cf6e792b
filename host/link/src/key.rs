//! The keys a device is locked with: ed25519, the private one in a file that only its owner may read (on
//! Windows those who may read its folder).

use crate::client::{waited, Client, LinkError};
use ed25519_compact::{KeyPair, PublicKey, Seed};
use rand::TryRngCore;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::settings;
use yawrig_protocol::flash::{challenge, lost, Sign};
pub use yawrig_protocol::flash::{hex, LOST_HELP};
use yawrig_shared::wire::{
    network_message, unlock_message, update_message, Refusal, Request, Signature, NOBODYS_KEY,
};

/// First line of a private key's file.
const KIND: &str = "yawrig private key 1";

fn from_hex(text: &str) -> Option<[u8; 32]> {
    if text.len() != 64 || !text.is_ascii() {
        return None;
    }
    let mut bytes = [0; 32];
    for (byte, digits) in bytes.iter_mut().zip(text.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    }
    Some(bytes)
}

/// Writes a new private key to `path`; its public half.
///
/// # Errors
/// Exit 3: the file exists already, which is never overwritten, or cannot be written.
pub fn generate(path: &Path) -> Result<[u8; 32]> {
    let mut seed = [0; 32];
    rand::rngs::OsRng
        .try_fill_bytes(&mut seed)
        .map_err(|e| Error::internal(format!("the system gives no random numbers: {e}")))?;
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists => {
            Error::data(format!("{} exists, and a key is never overwritten", path.display()))
                .help("choose another name; with the old key gone its devices stay locked")
        }
        _ => yawrig_base::files::cannot_write(path, &e),
    })?;
    let text = format!("{KIND}\n{}\n", hex(&seed));
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(|e| {
        // Half a key is none.
        let _ = std::fs::remove_file(path);
        yawrig_base::files::cannot_write(path, &e)
    })?;
    Ok(*KeyPair::from_seed(Seed::new(seed)).pk)
}

/// The key pair of a file that [`generate`] has written.
///
/// # Errors
/// Exit 3: it cannot be read, or is something else.
pub fn read(path: &Path) -> Result<KeyPair> {
    let text = std::fs::read_to_string(path).map_err(|e| {
        Error::data(format!("cannot read the key {}: {e}", path.display())).help(MAKE)
    })?;
    let seed = match text.trim_end().split_once('\n') {
        Some((KIND, seed)) => from_hex(seed.trim()),
        _ => None,
    };
    let seed = seed.ok_or_else(|| {
        Error::data(format!("{} is not a private key of yawrig's", path.display())).help(MAKE)
    })?;
    Ok(KeyPair::from_seed(Seed::new(seed)))
}

const MAKE: &str = "make a key with `yawrig keygen key.txt`";

/// A public key, by its digits or from the file of its private half.
///
/// # Errors
/// Exit 3, as [`read`].
pub fn public(key: &str) -> Result<[u8; 32]> {
    match from_hex(key) {
        Some(bytes) => Ok(bytes),
        None => Ok(*read(Path::new(key))?.pk),
    }
}

/// A key pair that signs networks.
pub struct Signer<'a>(pub &'a KeyPair);

impl Sign for Signer<'_> {
    fn public(&self) -> [u8; 32] {
        *self.0.pk
    }

    fn sign_update(&self, (number, nonce): (u32, u32), blob: &[u8]) -> [Signature; 2] {
        let permit = update_message(number, nonce, blob.len() as u32);
        let network = [&network_message(number, nonce)[..], blob].concat();
        [sign(self.0, &permit), sign(self.0, &network)]
    }
}

fn sign(key: &KeyPair, message: &[u8]) -> Signature {
    key.sk.sign(message, None).iter().copied().collect()
}

/// Locks a device.
///
/// # Errors
/// Exit 5 where it refuses; 4 or 7 where it is not there.
pub fn lock(client: &mut Client, key: &[u8; 32]) -> Result<()> {
    if PublicKey::from_slice(key).and_then(|key| key.validate()).is_err() {
        return Err(Error::data("these digits are not a public key").help(MAKE));
    }
    not_lost(client)?;
    client.request(&Request::Lock { key: *key }).map(drop).map_err(|e| why(client, e))
}

/// Opens a locked device.
///
/// # Errors
/// Exit 5 where it refuses: it is locked with another key, or not locked.
pub fn unlock(client: &mut Client, key: &KeyPair) -> Result<()> {
    not_lost(client)?;
    let (number, nonce) = waited(challenge(client)).map_err(|e| why(client, e))?;
    let signature = sign(key, &unlock_message(number, nonce));
    client.request(&Request::Unlock { signature }).map(drop).map_err(|e| why(client, e))
}

fn not_lost(client: &mut Client) -> Result<()> {
    match client.status()?.lock {
        Some(NOBODYS_KEY) => Err(lost(client)),
        _ => Ok(()),
    }
}

fn why(client: &Client, error: LinkError) -> Error {
    let LinkError::Refused(refusal) = error else { return client.explain(error, "its lock") };
    let (what, help) = match refusal {
        Refusal::LockedAlready => {
            let unlock = settings::command("device unlock", &[], &[("key", "KEY")]);
            ("it is locked already", format!("open it first: `{unlock}`"))
        }
        Refusal::CannotLock => ("it has no lock", "use a board that has one".to_owned()),
        Refusal::NotLocked => ("it is not locked", "there is nothing to do".to_owned()),
        Refusal::WrongSignature => {
            let (device, key) = (settings::command("device", &[], &[]), settings::name("key"));
            let help = format!("`{device}` shows which; name the file of that one with {key}");
            ("it is locked with another key", help)
        }
        Refusal::FlashWrite => {
            ("its flash did not take the lock", "try again; it is as it was".to_owned())
        }
        other => return client.explain(LinkError::Refused(other), "its lock"),
    };
    Error::new(Exit::Flash, format!("the device on {} refused: {what}", client.path())).help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_its_owner_s_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key.txt");
        let made = generate(&path).unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let permissions = std::fs::metadata(&path).unwrap().permissions();
            assert_eq!(permissions.mode() & 0o777, 0o600);
        }
        assert_eq!(*read(&path).unwrap().pk, made);
        assert_eq!(public(path.to_str().unwrap()).unwrap(), made);
        assert_eq!(public(&hex(&made)).unwrap(), made);
        let before = std::fs::read(&path).unwrap();
        assert_eq!(generate(&path).unwrap_err().exit, Exit::Data);
        assert_eq!(std::fs::read(&path).unwrap(), before);
        assert_ne!(generate(&folder.path().join("other.txt")).unwrap(), made);
    }

    #[test]
    fn what_is_no_key_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no-key");
        let half = format!("{KIND}\n{}\n", "ab".repeat(31));
        for text in ["", "YRN1", KIND, &half, &"0".repeat(64)] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(read(&path).unwrap_err().exit, Exit::Data, "{text}");
        }
        assert_eq!(read(&folder.path().join("absent")).unwrap_err().exit, Exit::Data);
    }
}
