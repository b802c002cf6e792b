//! A stored session shown again: played, paused, faster than life, from any time on.

use super::shown::{Order, Shown};
use super::teller::Teller;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::Arc;
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_link::live::item::{time_s, Item};
use yawrig_link::live::stored::Stored;
use yawrig_session::followed::Replay;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::Event;

/// Interval between checks of what is due.
const SLICE: Duration = Duration::from_millis(20);
/// How far before a release a jump to it goes, s.
const BEFORE_S: f64 = 1.0;
/// Allowed speeds, times real time.
const SPEEDS: [f64; 2] = [0.01, 1000.0];

/// What pages show of `stored` at its beginning.
///
/// # Errors
/// Exit 3 where nothing is in it.
pub fn replay_of(stored: &Stored) -> Result<Replay> {
    let empty = || {
        Error::data(format!("{}: nothing was stored in this session", stored.trace.display()))
            .help("choose another session")
    };
    let from = stored.items.iter().map(Item::at).min().ok_or_else(empty)?;
    let to = stored.items.iter().map(end_of).max().unwrap_or(from);
    Ok(Replay {
        file: stored.trace.display().to_string(),
        started: stored.started.clone(),
        is_finished: stored.finished,
        from_s: time_s(from),
        to_s: time_s(to),
        at_s: time_s(from),
        is_playing: true,
        speed: 1.0,
        places: stored.items.iter().filter_map(place).collect(),
    })
}

/// Sample number after its last.
fn end_of(item: &Item) -> u64 {
    match item {
        Item::Samples { first, yaw_deg } => first + yaw_deg.len() as u64,
        Item::Gap { first, count } => first.saturating_add(*count),
        other => other.at(),
    }
}

fn place(item: &Item) -> Option<(f64, String)> {
    match item {
        Item::Mark { at, text } => Some((time_s(*at), format!("mark: {text}"))),
        Item::Event { at, event: Event::Release(result), .. } => {
            let lasted = result.finished_sample.wrapping_sub(result.release_sample);
            let from_s = time_s(at.saturating_sub(u64::from(lasted))) - BEFORE_S;
            Some((from_s, format!("release {}", result.release)))
        }
        _ => None,
    }
}

struct Playing<'a> {
    shown: &'a Arc<Shown>,
    stored: &'a Stored,
    teller: Teller,
    /// Index of the item to be shown next.
    next: usize,
    replay: Replay,
}

/// Until the user leaves it.
///
/// # Errors
/// 130 where the user stops the program.
pub fn play(
    shown: &Arc<Shown>,
    stored: &Stored,
    replay: Replay,
    orders: &Receiver<Order>,
) -> Result<()> {
    let mut playing = Playing { shown, stored, teller: Teller::new(shown), next: 0, replay };
    playing.teller.tell();
    let mut since = Instant::now();
    loop {
        interrupt::check()?;
        match orders.recv_timeout(SLICE) {
            Ok(Order::Leave) | Err(RecvTimeoutError::Disconnected) => return Ok(()),
            Ok(order) => playing.obey(&order),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let went_by = since.elapsed();
        since = Instant::now();
        playing.go_on(went_by);
    }
}

impl Playing<'_> {
    fn obey(&mut self, order: &Order) {
        match order {
            // At the end, play starts again from the beginning.
            Order::Play if self.replay.at_s >= self.replay.to_s => {
                self.replay.is_playing = true;
                self.jump(self.replay.from_s);
            }
            Order::Play => self.replay.is_playing = true,
            Order::Pause => self.replay.is_playing = false,
            Order::Speed(speed) => self.replay.speed = speed.clamp(SPEEDS[0], SPEEDS[1]),
            Order::Jump(time_s) => self.jump(*time_s),
            // Of a device.
            Order::Record
            | Order::StopRecording
            | Order::Mark(_)
            | Order::Measure(_)
            | Order::Skip
            | Order::Back
            | Order::Leave => return,
        }
        self.tell_place();
        self.teller.tell();
    }

    /// Continues from `time_s`.
    fn jump(&mut self, time_s: f64) {
        self.replay.at_s = time_s.clamp(self.replay.from_s, self.replay.to_s);
        self.next = 0;
        let shown = self.due();
        self.tell_place();
        self.teller.begin_anew(self.stored.items[shown].iter());
    }

    /// Items whose time has come.
    fn due(&mut self) -> std::ops::Range<usize> {
        let now = (self.replay.at_s * f64::from(SAMPLE_RATE_HZ)).round() as u64;
        let begin = self.next;
        let waiting = self.stored.items[begin..].iter();
        self.next += waiting.take_while(|item| item.at() <= now).count();
        begin..self.next
    }

    fn go_on(&mut self, went_by: Duration) {
        if !self.replay.is_playing {
            return;
        }
        let Replay { at_s, to_s, speed, .. } = self.replay;
        self.replay.at_s = (at_s + went_by.as_secs_f64() * speed).min(to_s);
        for item in &self.stored.items[self.due()] {
            self.teller.show(item);
        }
        if self.replay.at_s >= to_s {
            self.replay.is_playing = false;
        }
        if self.teller.is_due() || !self.replay.is_playing {
            self.tell_place();
            self.teller.tell();
        }
    }

    fn tell_place(&self) {
        self.shown.seen(|seen| seen.replay = Some(self.replay.clone()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn a_replay_spans_all_that_was_stored_and_knows_its_marks() {
        let items = vec![
            Item::Samples { first: 5000, yaw_deg: vec![0.0; 50] },
            Item::Mark { at: 5020, text: "wind on".to_owned() },
            Item::Gap { first: 5050, count: 100 },
        ];
        let mut stored =
            Stored { trace: PathBuf::from("s.csv"), finished: true, started: None, items };
        let replay = replay_of(&stored).unwrap();
        assert_eq!((replay.from_s, replay.to_s, replay.at_s), (5.0, 5.15, 5.0));
        assert_eq!(replay.places, [(5.02, "mark: wind on".to_owned())]);
        stored.items.clear();
        let error = replay_of(&stored).unwrap_err();
        assert!(error.message.contains("s.csv") && !error.help.is_empty(), "{error}");
    }
}
