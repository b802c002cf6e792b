//! A board at the browser's plug: what its page has read goes in, what is to be written to it comes out, and its
//! client is the program's own (`yawrig_protocol`). A worker of its own holds it, so that a diagnosis that is under way
//! keeps no result waiting.
//!
//! Nothing here waits: it is gone on with whenever bytes have come and some time has passed.

mod line;

use js_sys::{Function, Uint8Array};
use line::{Stream, Wire};
use serde::Deserialize;
use serde_json::{json, Value};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::JsValue;
use yawrig_base::clock::Instant;
use yawrig_base::error::{Error, Result};
use yawrig_protocol::client::Client;
use yawrig_protocol::flash::{self, Progress};
use yawrig_protocol::live::item::{Item, Next};
use yawrig_protocol::live::releases::{Cut, Releases};
use yawrig_protocol::live::session::{Board, Follow, Session};
use yawrig_protocol::{about, advice};
use yawrig_session::followed::{trace_json, Seen, Stretch};
use yawrig_shared::axis::Axis;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{rig_id, Condition, Event};

/// How long something is waited for before orders are looked at.
const PATIENCE: Duration = Duration::from_millis(20);
/// Between two messages to the page.
const BETWEEN: Duration = Duration::from_millis(100);

/// What a user does with the board.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
enum Order {
    Mark {
        text: String,
    },
    /// What the coming releases are made under.
    Condition(Under),
    /// Writes this network to it.
    #[serde(skip)]
    Network {
        name: String,
        bytes: Vec<u8>,
    },
}

/// What releases are made under, as it is asked for.
#[derive(Deserialize)]
struct Under {
    spring: String,
    axis: String,
    wind_speed_m_s: f64,
    density_kg_m3: f64,
    length_m: f64,
    frontal_area_m2: f64,
    inertia_kg_m2: Option<f64>,
}

/// The client under way.
struct Talk {
    wire: Rc<RefCell<Wire>>,
    orders: Rc<RefCell<VecDeque<Order>>>,
    told: Rc<RefCell<Told>>,
    under_way: Pin<Box<dyn Future<Output = ()>>>,
}

thread_local! {
    static TALK: RefCell<Option<Talk>> = const { RefCell::new(None) };
}

/// Speaks to the board on a port that has just been opened and is called `name`. `says` is called with what is to be done:
/// `send` and bytes for the port, `news` and JSON for what is shown, `keep` and a line of the session's log, `record` and
/// a release as JSON.
#[wasm_bindgen]
pub fn board_begin(name: &str, says: Function) {
    let wire = Rc::new(RefCell::new(Wire::new(name, says)));
    let orders = Rc::default();
    let told = Rc::new(RefCell::new(Told::new(wire.clone())));
    let under_way = Box::pin(run(wire.clone(), Rc::clone(&orders), told.clone()));
    TALK.set(Some(Talk { wire, orders, told, under_way }));
    board_turn();
}

/// These bytes have been read.
#[wasm_bindgen]
pub fn board_came(bytes: &[u8]) {
    with(|talk| talk.wire.borrow_mut().came(bytes));
    board_turn();
}

/// The port is gone: unplugged, or it failed.
#[wasm_bindgen]
pub fn board_gone(why: &str) {
    with(|talk| talk.wire.borrow_mut().gone(why));
    board_turn();
}

/// The port is there again, and open.
#[wasm_bindgen]
pub fn board_back() {
    with(|talk| talk.wire.borrow_mut().back());
    board_turn();
}

/// Goes on; called every few hundredths of a second.
#[wasm_bindgen]
pub fn board_turn() {
    let is_over = with(|talk| {
        let mut context = Context::from_waker(Waker::noop());
        talk.under_way.as_mut().poll(&mut context) == Poll::Ready(())
    });
    if is_over == Some(true) {
        TALK.set(None);
    }
}

/// What the user does, as JSON.
///
/// # Errors
/// What is wrong with it, as JSON.
#[wasm_bindgen]
pub fn board_order(order: &str) -> std::result::Result<(), String> {
    let order = serde_json::from_str(order).map_err(|e| fault(&Error::internal(e.to_string())))?;
    ordered(order)
}

/// A network's file to be written to it.
///
/// # Errors
/// As JSON: that it is no network, or that no board is there.
#[wasm_bindgen]
pub fn board_network(name: &str, bytes: Vec<u8>) -> std::result::Result<(), String> {
    flash::checked(&bytes).map_err(|why| {
        let what = format!("{name} is not a network to write: {why}");
        fault(&Error::usage(what).help("choose a file that yawrig train has written"))
    })?;
    ordered(Order::Network { name: name.to_owned(), bytes })
}

/// The board is left; the release that has just ended is kept as far as its samples have come.
#[wasm_bindgen]
pub fn board_end() {
    if let Some(talk) = TALK.take() {
        talk.told.borrow_mut().rest();
    }
}

fn with<T>(what: impl FnOnce(&mut Talk) -> T) -> Option<T> {
    TALK.with_borrow_mut(|talk| talk.as_mut().map(what))
}

fn ordered(order: Order) -> std::result::Result<(), String> {
    with(|talk| talk.orders.borrow_mut().push_back(order))
        .ok_or_else(|| fault(&Error::usage("no board is followed").help("connect one first")))
}

fn fault(error: &Error) -> String {
    json!({"message": error.message, "help": error.help}).to_string()
}

/// A board behind the page's stream.
struct Plugged {
    client: Client<Stream>,
    wire: Rc<RefCell<Wire>>,
}

impl Board for Plugged {
    type Line = Stream;

    fn client(&mut self) -> &mut Client<Stream> {
        &mut self.client
    }

    fn port(&mut self) -> String {
        self.client.path().to_owned()
    }

    fn may_come_back(&self) -> bool {
        true
    }

    async fn reopen(&mut self) -> Result<Option<String>> {
        if self.wire.borrow().is_gone() {
            return Err(Error::device("it is not there"));
        }
        self.client = Client::open(Stream::new(&self.wire)).await?;
        Ok(None)
    }
}

async fn run(
    wire: Rc<RefCell<Wire>>,
    orders: Rc<RefCell<VecDeque<Order>>>,
    told: Rc<RefCell<Told>>,
) {
    let ended = follow(&wire, &orders, &told).await;
    let mut told = told.borrow_mut();
    told.rest();
    told.seen.fault = ended.err();
    told.tell(false);
}

async fn follow(
    wire: &Rc<RefCell<Wire>>,
    orders: &RefCell<VecDeque<Order>>,
    told: &RefCell<Told>,
) -> Result<()> {
    let client = Client::open(Stream::new(wire)).await?;
    let mut session = Session::new(Plugged { client, wire: wire.clone() }, Follow::Trace).await?;
    about(&mut session, told).await?;
    loop {
        let mut patience = PATIENCE;
        while let Some(item) = session.next(patience).await? {
            patience = Duration::ZERO;
            told.borrow_mut().take(&item);
        }
        // Not held while it is obeyed: others are given meanwhile.
        let order = orders.borrow_mut().pop_front();
        if let Some(order) = order
            && let Err(error) = obey(order, &mut session, told).await
        {
            let text = format!("{}\n{}", error.message, error.help);
            told.borrow_mut().log(json!({"event": "refused"}), &text);
        }
        let mut told = told.borrow_mut();
        if told.sent.elapsed() >= BETWEEN {
            told.tell(true);
        }
    }
}

async fn obey(order: Order, session: &mut Session<Plugged>, told: &RefCell<Told>) -> Result<()> {
    match order {
        Order::Mark { text } => session.mark(&text),
        Order::Condition(under) => {
            let (condition, next) = under.condition()?;
            session.set_condition(condition).await?;
            session.note(Item::Condition { at: session.now(), next });
        }
        Order::Network { name, bytes } => {
            let client = session.bench().client();
            told.borrow_mut().log(json!({"event": "writing"}), &format!("writing {name} …"));
            told.borrow_mut().tell(true);
            let mut progress = Writing { told, name: &name, said: 0 };
            let generation = flash::write(client, &bytes, None, &mut progress).await?;
            let text = format!("{name} is written, verified and runs: generation {generation}");
            told.borrow_mut().log(json!({"event": "written", "generation": generation}), &text);
            about(session, told).await?;
        }
    }
    Ok(())
}

/// Who the board is and how it is, with what should be changed of it.
async fn about(session: &mut Session<Plugged>, told: &RefCell<Told>) -> Result<()> {
    let client = session.bench().client();
    let status = client.status().await?;
    let identity = &client.identity;
    let (text, doubt) = (about::text(identity, &status), advice::of(&identity.board, &status));
    told.borrow().news(&json!({"kind": "about", "text": text, "warning": doubt}));
    Ok(())
}

impl Under {
    fn condition(self) -> Result<(Condition, Next)> {
        let Self { spring, axis, .. } = self;
        let axis: Axis = axis.parse().map_err(|()| {
            Error::usage(format!("{axis:?} is no axis")).help("choose mid or front")
        })?;
        let condition = Condition {
            rig: rig_id(&spring, axis.name()),
            wind: Wind { density_kg_m3: self.density_kg_m3, speed_m_s: self.wind_speed_m_s },
            model: Model { length_m: self.length_m, frontal_area_m2: self.frontal_area_m2 },
            inertia_kg_m2: self.inertia_kg_m2.unwrap_or(0.0),
        };
        let next = Next {
            spring,
            axis,
            wind_speed_m_s: self.wind_speed_m_s,
            density_kg_m3: self.density_kg_m3,
            at: String::new(),
            inertia_kg_m2: self.inertia_kg_m2,
            place: None,
            not_counted: None,
        };
        Ok((condition, next))
    }
}

/// How far a network is written.
struct Writing<'a> {
    told: &'a RefCell<Told>,
    name: &'a str,
    /// Tenths that were told.
    said: usize,
}

impl Progress for Writing<'_> {
    fn written(&mut self, bytes: usize, of: usize) {
        let tenths = 10 * bytes / of.max(1);
        if tenths > self.said {
            self.said = tenths;
            let share = bytes as f64 / of as f64;
            let news = json!({"kind": "writing", "name": self.name, "share": share});
            self.told.borrow().news(&news);
        }
    }

    fn waiting(&mut self) {
        let text = "a release is going on: the board takes the network when it is over";
        let mut told = self.told.borrow_mut();
        told.log(json!({"event": "waiting"}), text);
        told.tell(true);
    }
}

/// What the page is told, and what it keeps.
struct Told {
    wire: Rc<RefCell<Wire>>,
    seen: Seen,
    releases: Releases,
    /// Not sent yet.
    fresh: Vec<Stretch>,
    lines: Vec<Value>,
    sent: Instant,
}

impl Told {
    fn new(wire: Rc<RefCell<Wire>>) -> Self {
        let mut seen = Seen::default();
        seen.begin(wire.borrow().name(), None);
        let (fresh, lines) = Default::default();
        Self { wire, seen, releases: Releases::default(), fresh, lines, sent: Instant::now() }
    }

    fn news(&self, news: &Value) {
        self.wire.borrow().say("news", &news.to_string().into());
    }

    fn take(&mut self, item: &Item) {
        // Results first of all: they are kept before they are shown.
        if !matches!(item, Item::Samples { .. }) {
            self.wire.borrow().say("keep", &item.to_json().to_string().into());
        }
        let (line, fresh) = self.seen.take(item);
        self.fresh.extend(fresh);
        self.lines.extend(line);
        self.releases.take(item);
        self.releases.due(item).iter().for_each(|cut| self.record(cut));
        if matches!(item, Item::Event { event: Event::Release(_) | Event::Refined(_), .. }) {
            self.tell(true);
        }
    }

    /// No more samples will come.
    fn rest(&mut self) {
        self.releases.rest().iter().for_each(|cut| self.record(cut));
    }

    /// A release's samples, as a file.
    fn record(&self, cut: &Cut) {
        let mut text = String::from("time_s,yaw_deg\n");
        for (time_s, yaw_deg) in &cut.rows {
            text += &format!("{time_s:.3},{yaw_deg:.6}\n");
        }
        let record = json!({
            "release": cut.release, "missing_samples": cut.missing_samples, "text": text,
        });
        self.wire.borrow().say("record", &record.to_string().into());
    }

    /// A line of the log that belongs to no item.
    fn log(&mut self, line: Value, text: &str) {
        let line = self.seen.log(line, text);
        self.wire.borrow().say("keep", &line.to_string().into());
        self.lines.push(line);
    }

    fn tell(&mut self, is_on: bool) {
        self.sent = Instant::now();
        let fresh = std::mem::take(&mut self.fresh);
        let lines = std::mem::take(&mut self.lines);
        let news = json!({
            "kind": "live",
            "state": self.seen.to_json(is_on),
            "trace": trace_json(fresh.iter()),
            "lines": lines,
        });
        self.news(&news);
    }
}

/// Bytes as the page has them.
fn array(bytes: &[u8]) -> JsValue {
    Uint8Array::from(bytes).into()
}
