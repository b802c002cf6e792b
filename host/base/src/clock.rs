//! What time it is.

use std::time::SystemTime;

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
