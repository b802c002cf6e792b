//! What a recording takes on the disk, and what is left there.

use std::path::Path;
use yawrig_protocol::live::item::size;
use yawrig_shared::window::SAMPLE_RATE_HZ;

/// Bytes of a sample: its row of the trace, and once more of a release's record.
const SAMPLE_BYTES: u64 = 2 * "1234.567,12.345678\n".len() as u64;

/// So many bytes are left free by a trace: what an hour of a rig takes. Results and the records of releases
/// go on with them.
pub const RESERVE_BYTES: u64 = SAMPLE_BYTES * SAMPLE_RATE_HZ as u64 * 3600;

/// Most that an hour of a session takes, of a rig that swings `speed` times as fast as a real one.
pub fn bytes_an_hour(speed: f64) -> f64 {
    RESERVE_BYTES as f64 * speed
}

/// Bytes that are free where this file or folder is or will be; none where the system does not say.
pub fn free_bytes(place: &Path) -> Option<u64> {
    let there = place.ancestors().find(|folder| folder.exists()).unwrap_or(Path::new("."));
    system::free_bytes(there)
}

#[cfg(unix)]
mod system {
    pub fn free_bytes(there: &std::path::Path) -> Option<u64> {
        let about = rustix::fs::statvfs(there).ok()?;
        Some(about.f_bavail.saturating_mul(about.f_frsize))
    }
}

#[cfg(not(unix))]
mod system {
    pub fn free_bytes(_: &std::path::Path) -> Option<u64> {
        None
    }
}

/// What a session in `place` takes, in words.
pub fn takes(place: &Path, speed: f64) -> String {
    let hour = size(bytes_an_hour(speed));
    match free_bytes(place) {
        Some(free) => format!("up to {hour} an hour, {} are free", size(free as f64)),
        None => format!("up to {hour} an hour"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_free_is_asked_where_the_file_will_be() {
        let folder = tempfile::tempdir().unwrap();
        let there = free_bytes(folder.path());
        assert_eq!(there.is_some(), cfg!(unix));
        assert_eq!(free_bytes(&folder.path().join("not/yet/made")).is_some(), there.is_some());
        assert_eq!(free_bytes(Path::new("nothing-here")).is_some(), there.is_some());
        // A row of each is as long in the files.
        assert_eq!(bytes_an_hour(1.0), 2.0 * 19.0 * 3.6e6);
        let said = [1.368e8, 1.368e10, 2e12].map(size);
        assert_eq!(said, ["137 MB", "13.7 GB", "2.0 TB"]);
    }
}
