//! A device followed, and all that its session says held against what the device got.

use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};
use yawrig_link::bench::{Bench, Target};
use yawrig_link::live::item::Item;
use yawrig_link::live::session::{Follow, Session};
use yawrig_rig::{Rig, Sensor, Start};
use yawrig_shared::wire::{Event, Settings};
use yawrig_tests::line::{Board, Line};
use yawrig_tests::PATIENCE;

/// Held, let go and swinging: what the potentiometer shows in so many seconds of releases.
pub fn counts(seconds: usize) -> Vec<u16> {
    let rig = Rig::default();
    let release = |number| {
        let condition = rig.conditions(10.0).nth(13).expect("a condition");
        let made = rig.release(&condition, &Start::default(), &Sensor::default(), number);
        made.expect("a release").samples.filter_map(|s| s.counts)
    };
    (0..).flat_map(release).take(1000 * seconds).collect()
}

/// The converter's count of an angle the session gives.
pub fn count(yaw_deg: f64) -> u16 {
    let Settings { degrees_per_count, zero_counts, .. } = Settings::default();
    ((yaw_deg / f64::from(degrees_per_count)).round() as i32 + i32::from(zero_counts)) as u16
}

/// What a session has said, held against what the device got.
#[derive(Default)]
pub struct Heard {
    pub items: Vec<Item>,
    pub samples: u64,
    pub missing: u64,
    pub next: Option<u64>,
    pub releases: usize,
}

impl Heard {
    /// `sent`: the counts, from the session's number 0 on.
    pub fn take(&mut self, item: Item, sent: &[u16]) {
        match &item {
            Item::Samples { first: number, yaw_deg } => {
                assert!(self.next.is_none_or(|next| next == *number), "{:?} {number}", self.next);
                for (n, yaw_deg) in (*number as usize..).zip(yaw_deg) {
                    assert_eq!(count(*yaw_deg), sent[n], "sample {n}");
                }
                self.samples += yaw_deg.len() as u64;
                self.next = Some(number + yaw_deg.len() as u64);
            }
            Item::Gap { first, count } => {
                assert_eq!(self.next, Some(*first));
                self.missing += count;
                self.next = Some(first + count);
            }
            Item::Event { event: Event::Release(_), .. } => self.releases += 1,
            _ => {}
        }
        self.items.push(item);
    }

    pub fn has(&self, what: impl Fn(&Item) -> bool) -> bool {
        self.items.iter().any(what)
    }
}

/// Goes on until it is so; `what` says what is waited for.
pub fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !is_so() {
        assert!(Instant::now() < end, "{what}");
    }
}

pub fn session(path: &Path) -> Session {
    let path = path.display().to_string();
    // A bad line may spoil the first words.
    let bench = (0..20).find_map(|_| Bench::open(&Target::Port(path.clone())).ok());
    Session::new(bench.expect("one hello of twenty gets through"), Follow::Trace).expect("a device")
}

pub struct Followed<'a> {
    pub session: Session,
    pub heard: Heard,
    pub sent: &'a [u16],
}

impl<'a> Followed<'a> {
    pub fn new(session: Session, sent: &'a [u16]) -> Self {
        Self { session, heard: Heard::default(), sent }
    }

    /// Takes what is there by now.
    pub fn hear(&mut self) {
        while let Some(item) = self.session.next(Duration::from_millis(1)).expect("no fault") {
            self.heard.take(item, self.sent);
        }
    }

    pub fn hear_until(&mut self, what: &str, is_so: impl Fn(&Heard) -> bool) {
        until(what, || {
            self.hear();
            is_so(&self.heard)
        });
    }

    /// Plays these to the board and hears all but the last of them.
    pub fn play(&mut self, line: &Line, board: &Board, range: Range<usize>) {
        let last = range.end as u64 - 50;
        line.play(board, &self.sent[range], || self.hear());
        self.hear_until("what is on its way", |heard| heard.next >= Some(last));
    }
}
