//! The border between a page and yawrig: a file's bytes and what is asked of it go in, JSON comes back, the
//! same that the workbench's server answers and that the program prints.
//!
//! One worker of a page holds one such module. It asks no other host for anything and keeps nothing; what is
//! under way ends with the worker.
#![deny(unsafe_code)]

mod asked;
mod release;
mod session;

use js_sys::{Function, JsString};
use serde_json::json;
use session::Session;
use std::cell::RefCell;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::JsValue;
use yawrig_base::error::{Error, Result};
use yawrig_base::message::Listener;

thread_local! {
    static SAYS: RefCell<Option<Function>> = const { RefCell::new(None) };
    static SESSION: RefCell<Session> = RefCell::default();
}

/// Tells the page.
struct Page;

impl Listener for Page {
    fn message(&self, text: String) {
        SAYS.with_borrow(|says| {
            if let Some(says) = says {
                // A page that does not hear it misses a message.
                let _ = says.call1(&JsValue::NULL, &JsString::from(text));
            }
        });
    }
}

/// Before anything else: `says` is called with what is said while something is under way.
#[wasm_bindgen]
pub fn begin(says: Function) {
    SAYS.set(Some(says));
    yawrig_base::message::listen(&Page);
    yawrig_base::settings::spell(&yawrig::flags::Flags);
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
    told(SESSION.with_borrow_mut(|session| session.take(name, bytes)))
}

/// What is asked at `path`, with these settings as JSON.
///
/// # Errors
/// As [`take`].
#[wasm_bindgen]
pub fn answer(path: &str, asked: &str) -> std::result::Result<String, String> {
    told(SESSION.with_borrow_mut(|session| session.answer(path, asked)))
}

fn told(answered: Result<String>) -> std::result::Result<String, String> {
    answered.map_err(|error| {
        let Error { message, help, .. } = yawrig::flags::named(error);
        json!({"message": message, "help": help}).to_string()
    })
}
