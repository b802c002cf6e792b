//! HDF5 (MATLAB's 7.3, too) and Parquet where they are left out: in a browser, whose module they would make
//! half as large again.

use super::table::Channel;
use bytes::Bytes;
use yawrig_core::record::Record;

/// # Errors
/// Always.
pub fn of_bytes(_: Bytes) -> Result<Vec<Channel>, String> {
    Err("HDF5, MATLAB from version 7.3 on and Parquet are not read in a browser".to_owned())
}

/// # Errors
/// Always.
pub fn bytes(_: &Record) -> std::io::Result<Vec<u8>> {
    Err(std::io::ErrorKind::Unsupported.into())
}

/// # Errors
/// Always.
pub fn mat_bytes(record: &Record) -> std::io::Result<Vec<u8>> {
    bytes(record)
}
