//! Writing a network to a device.

use crate::client::{Client, LinkError};
use crate::key::{challenge, hex, lost, sign_update};
use ed25519_compact::KeyPair;
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_shared::blob::{self, BlobError, Envelope, Payload};
use yawrig_shared::network::NetworkError;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{Refusal, Request, SlotState, CHUNK, NOBODYS_KEY, TRIAL_SAMPLES};

/// Told how far a transfer is.
pub trait Progress {
    fn written(&mut self, _bytes: usize, _of: usize) {}
    /// A release is going on; the device takes the network when it is over.
    fn waiting(&mut self) {}
}

/// Says nothing.
pub struct Silent;

impl Progress for Silent {}

/// A network file that has passed every check the device will make, too.
///
/// # Errors
/// Exit 5, naming the file and what is wrong with it.
pub fn read(path: &std::path::Path) -> Result<(Vec<u8>, Payload)> {
    let bytes = std::fs::read(path).map_err(|e| {
        Error::data(format!("cannot read {}: {e}", path.display()))
            .help(format!("make a network with `{}`", train()))
    })?;
    match blob::decode(&bytes) {
        Ok((envelope, payload)) if envelope.blob_length() == bytes.len() => Ok((bytes, payload)),
        Ok((envelope, _)) => Err(refuse(
            path,
            &format!("{} bytes follow the network", bytes.len() - envelope.blob_length()),
        )),
        Err(e) => Err(refuse(path, &say(&e))),
    }
}

fn refuse(path: &std::path::Path, why: &str) -> Error {
    Error::new(Exit::Flash, format!("{} is not a network to write: {why}", path.display()))
        .help(format!("make one with `{}`", train()))
}

fn train() -> String {
    settings::command("train", &[], &[("out", "network.yrn")])
}

/// Writes a blob, has it verified and run; the generation it was given.
///
/// # Errors
/// Exit 5. Whatever happens, the device runs its old network until the new one is whole; the error says which of
/// the two it runs where that is known, and else both.
pub fn write(client: &mut Client, blob: &[u8], progress: &mut dyn Progress) -> Result<u32> {
    write_signed(client, blob, None, progress)
}

/// The same with a signature, which a locked device wants.
///
/// # Errors
/// Exit 5, as [`write()`]; and where the device is locked with another key, or with any and there is none.
pub fn write_signed(
    client: &mut Client,
    blob: &[u8],
    key: Option<&KeyPair>,
    progress: &mut dyn Progress,
) -> Result<u32> {
    let status = client.status()?;
    if let Some(lock) = status.lock {
        may_write(client, &lock, key)?;
    }
    let newest = status.slots.iter().filter_map(|slot| match slot {
        SlotState::Valid { generation, .. } => Some(*generation),
        _ => None,
    });
    let generation = newest.fold(status.network.generation, u32::max).saturating_add(1);
    let mut blob = blob.to_vec();
    blob::set_generation(&mut blob, generation).map_err(|e| failed(client, &say(&e)))?;
    let id = Envelope::read(&blob).map_err(|e| failed(client, &say(&e)))?.payload_crc;
    let length = blob.len() as u32;
    // On a device without a lock nothing is signed.
    let mut signature = None;
    if let (Some(key), true) = (key, status.lock.is_some()) {
        let challenge = challenge(client).map_err(|error| why(client, error))?;
        let [permit, network] = sign_update(key, challenge, &blob);
        step(client, &Request::FlashPermit { length, signature: permit })?;
        signature = Some(network);
    }
    between_releases(client, &Request::FlashBegin { length }, progress)
        .map_err(|error| why(client, error))?;
    for (index, chunk) in blob.chunks(CHUNK).enumerate() {
        let bytes = heapless::Vec::from_slice(chunk)
            .map_err(|_| Error::internal("a chunk is longer than the wire's"))?;
        step(client, &Request::FlashChunk { offset: (index * CHUNK) as u32, bytes })?;
        progress.written((index * CHUNK) + chunk.len(), blob.len());
    }
    if let Some(signature) = signature {
        step(client, &Request::FlashSignature { signature })?;
    }
    let tried = between_releases(client, &Request::FlashTrial, progress);
    runs(client, tried, (generation, id), true)?;
    let committed = client.request(&Request::FlashCommit).map(drop);
    runs(client, committed, (generation, id), false)?;
    Ok(generation)
}

/// That this key opens this lock, asked before anything is written.
fn may_write(client: &Client, lock: &[u8; 32], key: Option<&KeyPair>) -> Result<()> {
    if *lock == NOBODYS_KEY {
        return Err(lost(client));
    }
    let have = match key {
        Some(key) if *key.pk == *lock => return Ok(()),
        Some(key) => format!("; the given one is {}", hex(&*key.pk)),
        None => String::new(),
    };
    let path = client.path();
    let why = format!("the device on {path} is locked with key {}{have}", hex(lock));
    let sign = settings::given("sign", "KEY");
    Err(Error::new(Exit::Flash, why)
        .help(format!("sign with {sign}, the file of that private key")))
}

/// That the device runs this network (its generation, its number), on trial or for good. From here on it may
/// have heard what it gave no answer to: it is asked what it runs.
fn runs(
    client: &mut Client,
    answered: std::result::Result<(), LinkError>,
    new: (u32, u32),
    on_trial: bool,
) -> Result<()> {
    if let Err(error @ (LinkError::Refused(_) | LinkError::Interrupted)) = answered {
        return Err(why(client, error));
    }
    let trial_s = TRIAL_SAMPLES as f32 / SAMPLE_RATE_HZ;
    let network = match client.status() {
        Ok(status) => status.network,
        Err(asked) => {
            let error = match answered {
                Err(error) => why(client, error),
                Ok(()) => failed(client, &asked.message),
            };
            return Err(error.help(if on_trial {
                format!(
                    "it runs its old network, or the new one on trial and in {trial_s} s the old one again: check the \
                     cable and run `yawrig flash` again"
                )
            } else {
                format!(
                    "it runs the new network, or in {trial_s} s the old one again: `yawrig device` shows which"
                )
            }));
        }
    };
    let is_new = (network.generation, network.id) == new;
    if is_new && network.on_trial == on_trial {
        return Ok(());
    }
    let error = match answered {
        Err(error) => why(client, error),
        Ok(()) => failed(client, &format!("it runs network {:08x}, not {:08x}", network.id, new.1)),
    };
    Err(match (is_new, network.on_trial) {
        (true, true) => error.help(format!(
            "it runs the new network on trial, and in {trial_s} s the old one again; then run `yawrig flash` again"
        )),
        (true, false) => error.help("it runs the new network"),
        (false, _) => error,
    })
}

/// How long a release may be waited for.
const RELEASE: Duration = Duration::from_secs(1800);
const ASK_AGAIN: Duration = Duration::from_millis(200);

/// A step that the device puts off while a release is going on.
fn between_releases(
    client: &mut Client,
    request: &Request,
    progress: &mut dyn Progress,
) -> std::result::Result<(), LinkError> {
    let begun = Instant::now();
    let mut said = false;
    loop {
        match client.request(request) {
            Err(LinkError::Refused(Refusal::Releasing)) if begun.elapsed() < RELEASE => {
                if !std::mem::replace(&mut said, true) {
                    progress.waiting();
                }
                interrupt::check().map_err(|_| LinkError::Interrupted)?;
                std::thread::sleep(ASK_AGAIN);
            }
            answer => return answer.map(drop),
        }
    }
}

fn step(client: &mut Client, request: &Request) -> Result<()> {
    client.request(request).map(|_| ()).map_err(|error| why(client, error))
}

fn why(client: &Client, error: LinkError) -> Error {
    match error {
        LinkError::Interrupted => Error::interrupted(),
        LinkError::Refused(refusal) => failed(client, &say_refusal(&refusal)),
        LinkError::Gone(why) => failed(client, &format!("it is gone: {why}")),
        LinkError::Silent { .. } => failed(client, "it does not answer any more"),
    }
}

fn failed(client: &Client, why: &str) -> Error {
    Error::new(Exit::Flash, format!("writing to the device on {} failed: {why}", client.path()))
        .help("the device keeps its old network; check the cable and run `yawrig flash` again")
}

fn say_refusal(refusal: &Refusal) -> String {
    match refusal {
        Refusal::Blob(e) => format!("it refused the network: {}", say(e)),
        Refusal::Stale { newest } => format!("it already runs generation {newest}"),
        Refusal::FlashOrder { expected_offset } => {
            format!(
                "it expected bytes from {expected_offset} on; was it written to from elsewhere?"
            )
        }
        Refusal::FlashWrite => "its flash did not take what was written".to_owned(),
        Refusal::NoTrial => "it has dropped the network: the confirmation came too late".to_owned(),
        Refusal::NotKept { .. } => "it was asked for an event that it does not keep".to_owned(),
        Refusal::Settings => "it refused its settings".to_owned(),
        Refusal::Releasing => "a release is going on that does not end".to_owned(),
        Refusal::Condition(_) => "it refused the condition".to_owned(),
        Refusal::Unsigned => "it is locked, and the network is not signed".to_owned(),
        Refusal::WrongSignature => "it is locked, and the signature is not its key's".to_owned(),
        Refusal::CannotLock | Refusal::LockedAlready | Refusal::NotLocked | Refusal::NotAKey => {
            "it was asked about its lock".to_owned()
        }
        Refusal::Linearity => "it was asked about its table".to_owned(),
        Refusal::TooOften { samples } => format!(
            "it was written to so often that its flash would wear out; it takes the next network in {} s",
            samples.div_ceil(SAMPLE_RATE_HZ as u32)
        ),
        Refusal::NoLog => "it was asked for its log".to_owned(),
    }
}

/// A blob's fault in words.
pub fn say(error: &BlobError) -> String {
    match error {
        BlobError::Truncated => "it is cut short".to_owned(),
        BlobError::NotABlob => "it is another kind of file".to_owned(),
        BlobError::Format { theirs } => {
            let age = if *theirs < blob::FORMAT { "an earlier" } else { "a later" };
            format!(
                "it is of format {theirs}, this version knows {} and {}: {age} yawrig wrote it",
                blob::FORMAT,
                blob::FORMAT_WITH_NUMBERS
            )
        }
        BlobError::TooLong => format!("it is longer than a slot ({} bytes)", blob::LONGEST),
        BlobError::EnvelopeCorrupt => "its envelope's checksum is wrong".to_owned(),
        BlobError::PayloadCorrupt => "its checksum is wrong".to_owned(),
        BlobError::Malformed => "its contents do not decode".to_owned(),
        BlobError::Network(NetworkError::Topology) => {
            "its topology is not one that runs here (41 inputs, 42 with the amplitude; 2 outputs and one \
             for each number of an effect)"
                .to_owned()
        }
        BlobError::Network(NetworkError::WeightCount) => {
            "its number of weights does not fit its topology".to_owned()
        }
        BlobError::Network(NetworkError::NotFinite) => {
            "a weight or scale is not a finite number".to_owned()
        }
        BlobError::GoldenMissing => "its golden vectors are missing".to_owned(),
        BlobError::GoldenDiffers { vector } => {
            format!("its golden vector {vector} does not come out")
        }
        BlobError::NoRoom => "it finds no room".to_owned(),
    }
}
