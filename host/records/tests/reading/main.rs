//! Files as people and their programs write them.

mod as_written;
mod dialects;
mod formats;
