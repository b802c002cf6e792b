//! Who the device is, the first exchange. Its encoding never changes: it is fixed and not postcard's.

/// Who the device is. Never changes its encoding, which is fixed and not postcard's:
/// revision u16, key of all messages u32, then 24 bytes of text each for firmware and board, padded with
/// zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HelloReply {
    /// [`REVISION`](super::REVISION) of the device's messages.
    pub protocol: u16,
    /// Its [`MESSAGES_KEY`](super::MESSAGES_KEY).
    pub messages_key: u32,
    pub firmware: [u8; 24],
    pub board: [u8; 24],
}

/// The host's first question; its body is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hello;

impl HelloReply {
    pub const LENGTH: usize = 54;

    pub fn write(&self) -> [u8; Self::LENGTH] {
        let mut bytes = [0; Self::LENGTH];
        bytes[..2].copy_from_slice(&self.protocol.to_le_bytes());
        bytes[2..6].copy_from_slice(&self.messages_key.to_le_bytes());
        bytes[6..30].copy_from_slice(&self.firmware);
        bytes[30..].copy_from_slice(&self.board);
        bytes
    }

    pub fn read(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; Self::LENGTH] = bytes.try_into().ok()?;
        Some(Self {
            protocol: u16::from_le_bytes([bytes[0], bytes[1]]),
            messages_key: u32::from_le_bytes([bytes[2], bytes[3], bytes[4], bytes[5]]),
            firmware: bytes[6..30].try_into().ok()?,
            board: bytes[30..].try_into().ok()?,
        })
    }

    /// A text as the fixed field it is sent in; cut to 24 bytes.
    pub fn text(text: &str) -> [u8; 24] {
        let mut field = [0; 24];
        for (to, from) in field.iter_mut().zip(text.bytes()) {
            *to = from;
        }
        field
    }
}
