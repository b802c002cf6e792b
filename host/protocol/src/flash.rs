//! Writing a network to a device.

use crate::client::{Client, LinkError};
use crate::line::Line;
use std::time::Duration;
use yawrig_base::clock::Instant;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_shared::blob::{self, BlobError, Envelope, Payload};
use yawrig_shared::network::NetworkError;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{
    Refusal, Reply, Request, Signature, SlotState, CHUNK, NOBODYS_KEY, TRIAL_SAMPLES,
};

/// Told how far a transfer is.
pub trait Progress {
    fn written(&mut self, _bytes: usize, _of: usize) {}
    /// A release is going on; the device takes the network when it is over.
    fn waiting(&mut self) {}
}

/// Says nothing.
pub struct Silent;

impl Progress for Silent {}

/// What signs a network for a locked device.
pub trait Sign {
    /// Whose signature it is.
    fn public(&self) -> [u8; 32];

    /// What the device wants of this blob, upon its challenge: a permit to begin, and a signature before the trial.
    fn sign_update(&self, challenge: (u32, u32), blob: &[u8]) -> [Signature; 2];
}

/// A network that has passed every check the device will make, too.
///
/// # Errors
/// What is wrong with it.
pub fn checked(bytes: &[u8]) -> std::result::Result<Payload, String> {
    match blob::decode(bytes) {
        Ok((envelope, payload)) if envelope.blob_length() == bytes.len() => Ok(payload),
        Ok((envelope, _)) => {
            Err(format!("{} bytes follow the network", bytes.len() - envelope.blob_length()))
        }
        Err(e) => Err(say(&e)),
    }
}

/// Bytes as hexadecimal digits, as keys are shown.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What is done about a lock that is [lost](NOBODYS_KEY).
pub const LOST_HELP: &str =
    "erase its whole flash over its debug plug or its boot loader, as the book says under \
    \"Who may write\"; then write firmware, network and lock anew";

/// Of a device whose lock is [lost](NOBODYS_KEY).
pub fn lost<L: Line>(client: &Client<L>) -> Error {
    let why = format!(
        "the device on {} is locked, and its flash has lost with which key: nobody's opens it",
        client.path()
    );
    Error::new(Exit::Flash, why).help(LOST_HELP)
}

/// A challenge of a locked device.
///
/// # Errors
/// Those of the line.
pub async fn challenge<L: Line>(
    client: &mut Client<L>,
) -> std::result::Result<(u32, u32), LinkError> {
    match client.request(&Request::Challenge).await? {
        Reply::Challenge { number, nonce } => Ok((number, nonce)),
        other => Err(LinkError::Gone(format!("it answered a challenge with {other:?}"))),
    }
}

/// Writes a blob, has it verified and run; the generation it was given. With a signature where it is given what
/// makes one, which a locked device wants.
///
/// # Errors
/// Exit 5, also where the device is locked with another key, or with any and there is none. Whatever happens, the
/// device runs its old network until the new one is whole; the error says which of the two it runs where that is
/// known, and else both.
pub async fn write<L: Line>(
    client: &mut Client<L>,
    blob: &[u8],
    key: Option<&dyn Sign>,
    progress: &mut dyn Progress,
) -> Result<u32> {
    let status = client.status().await?;
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
        let challenge = challenge(client).await.map_err(|error| why(client, error))?;
        let [permit, network] = key.sign_update(challenge, &blob);
        step(client, &Request::FlashPermit { length, signature: permit }).await?;
        signature = Some(network);
    }
    between_releases(client, &Request::FlashBegin { length }, progress)
        .await
        .map_err(|error| why(client, error))?;
    for (index, chunk) in blob.chunks(CHUNK).enumerate() {
        let bytes = heapless::Vec::from_slice(chunk)
            .map_err(|_| Error::internal("a chunk is longer than the wire's"))?;
        step(client, &Request::FlashChunk { offset: (index * CHUNK) as u32, bytes }).await?;
        progress.written((index * CHUNK) + chunk.len(), blob.len());
    }
    if let Some(signature) = signature {
        step(client, &Request::FlashSignature { signature }).await?;
    }
    let tried = between_releases(client, &Request::FlashTrial, progress).await;
    runs(client, tried, (generation, id), true).await?;
    let committed = client.request(&Request::FlashCommit).await.map(drop);
    runs(client, committed, (generation, id), false).await?;
    Ok(generation)
}

/// That this key opens this lock, asked before anything is written.
fn may_write<L: Line>(client: &Client<L>, lock: &[u8; 32], key: Option<&dyn Sign>) -> Result<()> {
    if *lock == NOBODYS_KEY {
        return Err(lost(client));
    }
    let have = match key {
        Some(key) if key.public() == *lock => return Ok(()),
        Some(key) => format!("; the given one is {}", hex(&key.public())),
        None => String::new(),
    };
    let path = client.path();
    let why = format!("the device on {path} is locked with key {}{have}", hex(lock));
    Err(Error::new(Exit::Flash, why).help((client.words().sign)()))
}

/// That the device runs this network (its generation, its number), on trial or for good. From here on it may
/// have heard what it gave no answer to: it is asked what it runs.
async fn runs<L: Line>(
    client: &mut Client<L>,
    answered: std::result::Result<(), LinkError>,
    new: (u32, u32),
    on_trial: bool,
) -> Result<()> {
    if let Err(error @ (LinkError::Refused(_) | LinkError::Interrupted)) = answered {
        return Err(why(client, error));
    }
    let words = client.words();
    let again = words.write_again;
    let trial_s = TRIAL_SAMPLES as f32 / SAMPLE_RATE_HZ;
    let network = match client.status().await {
        Ok(status) => status.network,
        Err(asked) => {
            let error = match answered {
                Err(error) => why(client, error),
                Ok(()) => failed(client, &asked.message),
            };
            return Err(error.help(if on_trial {
                format!(
                    "it runs its old network, or the new one on trial and in {trial_s} s the old one again: check the \
                     cable and {again}"
                )
            } else {
                format!(
                    "it runs the new network, or in {trial_s} s the old one again: {}", words.which_runs
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
            "it runs the new network on trial, and in {trial_s} s the old one again; then {again}"
        )),
        (true, false) => error.help("it runs the new network"),
        (false, _) => error,
    })
}

/// How long a release may be waited for.
const RELEASE: Duration = Duration::from_secs(1800);
const ASK_AGAIN: Duration = Duration::from_millis(200);

/// A step that the device puts off while a release is going on.
async fn between_releases<L: Line>(
    client: &mut Client<L>,
    request: &Request,
    progress: &mut dyn Progress,
) -> std::result::Result<(), LinkError> {
    let begun = Instant::now();
    let mut said = false;
    loop {
        match client.request(request).await {
            Err(LinkError::Refused(Refusal::Releasing)) if begun.elapsed() < RELEASE => {
                if !std::mem::replace(&mut said, true) {
                    progress.waiting();
                }
                interrupt::check().map_err(|_| LinkError::Interrupted)?;
                client.line().pause(ASK_AGAIN).await;
            }
            answer => return answer.map(drop),
        }
    }
}

async fn step<L: Line>(client: &mut Client<L>, request: &Request) -> Result<()> {
    client.request(request).await.map(|_| ()).map_err(|error| why(client, error))
}

fn why<L: Line>(client: &Client<L>, error: LinkError) -> Error {
    match error {
        LinkError::Interrupted => Error::interrupted(),
        LinkError::Refused(refusal) => failed(client, &say_refusal(&refusal)),
        LinkError::Gone(why) => failed(client, &format!("it is gone: {why}")),
        LinkError::Silent { .. } => failed(client, "it does not answer any more"),
    }
}

fn failed<L: Line>(client: &Client<L>, why: &str) -> Error {
    Error::new(Exit::Flash, format!("writing to the device on {} failed: {why}", client.path()))
        .help(format!(
            "the device keeps its old network; check the cable and {}",
            client.words().write_again
        ))
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
