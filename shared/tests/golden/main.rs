//! Bytes that must not change without a change of version: a device in the field and a program
//! on the host may be of different ages.
//!
//! The expected bytes beside this file are written anew, after a deliberate change, by
//! `YAWRIG_BLESS=1 cargo test -p yawrig-shared --test golden`; look at the difference before you
//! commit it.

mod blobs;
mod messages;

use std::fmt::Write as _;

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn compare(name: &str, actual: &str) {
    let path = format!("{}/tests/golden/{name}", env!("CARGO_MANIFEST_DIR"));
    if std::env::var_os("YAWRIG_BLESS").is_some() {
        std::fs::write(&path, actual).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(actual, expected, "{path} differs");
}
