//! Writing a network to a device.

use crate::error::{Error, Exit, Result};
use crate::link::client::{Client, LinkError};
use yawrig_shared::blob::{self, BlobError, Envelope, Payload};
use yawrig_shared::network::NetworkError;
use yawrig_shared::wire::{Refusal, Request, SlotState, CHUNK};

/// Told how far a transfer is.
pub trait Progress {
    fn written(&mut self, _bytes: usize, _of: usize) {}
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
            .help("make a network with `yawrig train --out network.yrn`")
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
        .help("make one with `yawrig train --out network.yrn`")
}

/// Writes a blob, has it verified and run; the generation it was given.
///
/// # Errors
/// Exit 5. Whatever happens, the device runs its old network until the new one is whole.
pub fn write(client: &mut Client, blob: &[u8], progress: &mut dyn Progress) -> Result<u32> {
    let status = client.status()?;
    let newest = status.slots.iter().filter_map(|slot| match slot {
        SlotState::Valid { generation, .. } => Some(*generation),
        _ => None,
    });
    let generation = newest.fold(status.network.generation, u32::max).saturating_add(1);
    let mut blob = blob.to_vec();
    blob::set_generation(&mut blob, generation).map_err(|e| failed(client, &say(&e)))?;
    let id = Envelope::read(&blob).map_err(|e| failed(client, &say(&e)))?.payload_crc;
    let length = blob.len() as u32;
    step(client, &Request::FlashBegin { length })?;
    for (index, chunk) in blob.chunks(CHUNK).enumerate() {
        let bytes = heapless::Vec::from_slice(chunk)
            .map_err(|_| Error::internal("a chunk is longer than the wire's"))?;
        step(client, &Request::FlashChunk { offset: (index * CHUNK) as u32, bytes })?;
        progress.written((index * CHUNK) + chunk.len(), blob.len());
    }
    step(client, &Request::FlashCommit)?;
    let running = client.status().map_err(|e| failed(client, &e.message))?.network;
    if (running.generation, running.id) != (generation, id) {
        return Err(failed(
            client,
            &format!("it runs network {:08x}, not {id:08x}, after the commit", running.id),
        ));
    }
    Ok(generation)
}

fn step(client: &mut Client, request: &Request) -> Result<()> {
    match client.request(request) {
        Ok(_) => Ok(()),
        Err(LinkError::Interrupted) => Err(Error::interrupted()),
        Err(LinkError::Refused(refusal)) => Err(failed(client, &say_refusal(&refusal))),
        Err(LinkError::Gone(why)) => Err(failed(client, &format!("it is gone: {why}"))),
        Err(LinkError::Silent { .. }) => Err(failed(client, "it does not answer any more")),
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
        Refusal::Settings => "it refused its settings".to_owned(),
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
                "it is of format {theirs}, this version knows {}: {age} yawrig wrote it",
                blob::FORMAT
            )
        }
        BlobError::TooLong => format!("it is longer than a slot ({} bytes)", blob::LONGEST),
        BlobError::EnvelopeCorrupt => "its envelope's checksum is wrong".to_owned(),
        BlobError::PayloadCorrupt => "its checksum is wrong".to_owned(),
        BlobError::Malformed => "its contents do not decode".to_owned(),
        BlobError::Network(NetworkError::Topology) => {
            "its topology is not one that runs here (41 inputs, 42 with the amplitude; 2 outputs)"
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
