//! What time it is.

#[cfg(not(target_family = "wasm"))]
pub use std::time::Instant;
use std::time::SystemTime;
/// The library's is none in a browser's module.
#[cfg(target_family = "wasm")]
pub use web_time::Instant;

/// In a browser's module its own clock's: the library's is none there.
#[cfg(target_family = "wasm")]
pub fn now() -> SystemTime {
    use web_time::web::SystemTimeExt;
    web_time::SystemTime::now().to_std()
}

#[cfg(not(target_family = "wasm"))]
pub fn now() -> SystemTime {
    SystemTime::now()
}
