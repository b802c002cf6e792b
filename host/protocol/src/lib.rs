//! How a device is spoken to, over any line: requests, replies and events, a network that is written, what it says
//! as it measures. Nothing here opens a port, waits by itself or has a thread: that is what a [`line::Line`] is for,
//! whether a port that a program reads or a stream that a page is given.

#![forbid(unsafe_code)]

pub mod about;
pub mod advice;
pub mod amplitude_trend;
pub mod client;
pub mod condition;
pub mod events;
pub mod flash;
pub mod follow;
pub mod line;
pub mod linearity;
pub mod live;
pub mod numbers;
