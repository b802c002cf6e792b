//! The border between a page and yawrig: a file's bytes and what is asked of it go in, JSON comes back, the
//! same that the workbench's server answers and that the program prints.
//!
//! One worker of a page holds one such module. It asks no other host for anything and its files are in memory;
//! what is under way ends with the worker.
#![deny(unsafe_code)]

mod board;
mod printed;
mod session;

use js_sys::{Function, JsString};
use serde_json::json;
use session::Session;
use std::cell::RefCell;
use std::path::Path;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::JsValue;
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_base::message::Listener;
use yawrig_session::Told;

thread_local! {
    static SAYS: RefCell<Option<Function>> = const { RefCell::new(None) };
    static TELLS: RefCell<Option<Function>> = const { RefCell::new(None) };
    static SESSION: RefCell<Option<Session>> = const { RefCell::new(None) };
}

fn call(what: &RefCell<Option<Function>>, text: String) {
    if let Some(heard) = &*what.borrow() {
        // A page that does not hear it misses a message.
        let _ = heard.call1(&JsValue::NULL, &JsString::from(text));
    }
}

/// Tells the page.
struct Page;

impl Listener for Page {
    fn message(&self, text: String) {
        SAYS.with(|says| call(says, text));
    }
}

fn told() -> Box<Told> {
    Box::new(|news| TELLS.with(|tells| call(tells, news.to_string())))
}

/// Before anything else: `says` is called with what is said while something is under way, `tells` with news as
/// JSON.
#[wasm_bindgen]
pub fn begin(says: Function, tells: Function) {
    SAYS.set(Some(says));
    TELLS.set(Some(tells));
    yawrig_base::message::listen(&Page);
    yawrig_base::settings::spell(&yawrig_verbs::flags::Flags);
    std::panic::set_hook(Box::new(|why| {
        yawrig_base::message::message(format!("a fault in yawrig: {why}"))
    }));
}

/// Takes a file in, under its name.
///
/// # Errors
/// What is wrong with it and one thing to do, as JSON.
#[wasm_bindgen]
pub fn take(name: &str, bytes: Vec<u8>) -> std::result::Result<String, String> {
    asked(|session| Ok(session.take(name, bytes)?.to_string()))
}

/// These are the bytes of a file that was taken in or written before.
#[wasm_bindgen]
pub fn hold(name: &str, bytes: Vec<u8>) {
    disk::hold(Path::new(name), bytes);
}

/// The bytes of a file, which may have been written here; nothing where it is not there.
#[wasm_bindgen]
pub fn file(name: &str) -> Option<Vec<u8>> {
    disk::read(Path::new(name)).ok()
}

/// What is asked at `path`, with these settings as JSON.
///
/// # Errors
/// As [`take`].
#[wasm_bindgen]
pub fn answer(path: &str, settings: &str) -> std::result::Result<String, String> {
    asked(|session| session.answer(path, settings))
}

fn asked(what: impl FnOnce(&mut Session) -> Result<String>) -> std::result::Result<String, String> {
    let answered = SESSION.with_borrow_mut(|held| match held {
        Some(session) => what(session),
        None => what(held.insert(Session::new(told)?)),
    });
    answered.map_err(|error| {
        let Error { message, help, .. } = yawrig_verbs::flags::named(error);
        json!({"message": message, "help": help}).to_string()
    })
}
