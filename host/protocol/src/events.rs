//! Events in the order of their numbers, with those known to be missing.

use std::collections::VecDeque;
use yawrig_shared::wire::{Event, KEPT_EVENTS};

/// An event with its number on the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbered {
    pub number: u16,
    pub event: Event,
}

/// What has come, to be handed out without a gap.
#[derive(Debug, Default)]
pub struct Events {
    /// Number of the next to hand out; none before the first is known.
    next: Option<u16>,
    /// Those that have come and wait, by number.
    waiting: VecDeque<Numbered>,
    /// The last ones handed out, to know a frame that comes twice from a device that began anew.
    handed: VecDeque<Numbered>,
    /// Number of the next event that the device has not had yet, as far as known.
    end: Option<u16>,
    /// Those with a number that has passed: late, or the first ones of a device that began anew.
    doubtful: VecDeque<Numbered>,
    lost: u64,
}

impl Events {
    /// Events before this one are of no interest.
    pub fn begin(&mut self, next: Option<u16>) {
        *self = Self { next, end: next, lost: self.lost, ..Self::default() };
    }

    /// An event has come.
    pub fn put(&mut self, number: u16, event: Event) {
        let numbered = Numbered { number, event };
        let next = *self.next.get_or_insert(number);
        if self.handed.contains(&numbered) || self.waiting.contains(&numbered) {
            return;
        }
        if is_before(number, next) {
            if self.doubtful.len() == KEPT_EVENTS {
                self.doubtful.pop_front();
            }
            self.doubtful.push_back(numbered);
            return;
        }
        let at = self
            .waiting
            .partition_point(|w| w.number.wrapping_sub(next) < number.wrapping_sub(next));
        self.waiting.insert(at, numbered);
        self.had(number.wrapping_add(1));
    }

    /// Whether the device has to be asked if it began anew.
    pub fn in_doubt(&self) -> bool {
        !self.doubtful.is_empty()
    }

    /// It has not: what came late had been given up.
    pub fn goes_on(&mut self) {
        self.doubtful.clear();
    }

    /// It has, and counts from zero.
    pub fn began_anew(&mut self) {
        let doubtful = std::mem::take(&mut self.doubtful);
        self.begin(Some(0));
        doubtful.into_iter().for_each(|numbered| self.put(numbered.number, numbered.event));
    }

    /// The device says that `end` will be the number of its next event.
    pub fn had(&mut self, end: u16) {
        self.next.get_or_insert(end);
        if self.end.is_none_or(|known| is_before(known, end)) {
            self.end = Some(end);
        }
    }

    /// The next event in order, if it is there.
    pub fn take(&mut self) -> Option<Numbered> {
        let next = self.next?;
        let first = self.waiting.front().copied().filter(|first| first.number == next)?;
        self.waiting.pop_front();
        self.next = Some(next.wrapping_add(1));
        if self.handed.len() == KEPT_EVENTS {
            self.handed.pop_front();
        }
        self.handed.push_back(first);
        Some(first)
    }

    /// The number of the event that is missing before any other can be handed out.
    pub fn missing(&self) -> Option<u16> {
        let (next, end) = (self.next?, self.end?);
        let here = self.waiting.front().is_some_and(|first| first.number == next);
        (!here && is_before(next, end)).then_some(next)
    }

    /// The missing one is not kept any more; the oldest that is kept is this one.
    pub fn give_up(&mut self, oldest: u16) {
        let (Some(next), Some(end)) = (self.next, self.end) else { return };
        let to = match self.waiting.front() {
            Some(first) if is_before(first.number, oldest) => first.number,
            _ if is_before(next, oldest) && !is_before(end, oldest) => oldest,
            _ => self.waiting.front().map_or(end, |first| first.number),
        };
        self.lost += u64::from(to.wrapping_sub(next));
        self.next = Some(to);
    }

    /// Number of the next event to hand out, once known.
    pub fn expected(&self) -> Option<u16> {
        self.next
    }

    /// Events that were lost for good.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

/// In numbers that wrap around.
fn is_before(a: u16, b: u16) -> bool {
    (a.wrapping_sub(b) as i16) < 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use yawrig_shared::wire::Phase;

    fn event(at_sample: u32) -> Event {
        Event::Phase { phase: Phase::Held, release: 0, at_sample }
    }

    fn handed(events: &mut Events) -> Vec<u16> {
        std::iter::from_fn(|| events.take()).map(|e| e.number).collect()
    }

    #[test]
    fn a_gap_is_asked_for_and_closed_in_order() {
        let mut events = Events::default();
        // Numbers wrap around in the middle of it.
        events.put(65_534, event(1));
        events.put(1, event(4));
        assert_eq!(handed(&mut events), [65_534]);
        assert_eq!(events.missing(), Some(65_535));
        events.put(0, event(3));
        assert_eq!(events.missing(), Some(65_535));
        events.put(65_535, event(2));
        assert_eq!(handed(&mut events), [65_535, 0, 1]);
        assert_eq!((events.missing(), events.lost()), (None, 0));
    }

    #[test]
    fn the_last_events_are_missed_by_what_the_device_says_it_had() {
        let mut events = Events::default();
        events.had(7);
        assert_eq!(events.missing(), None);
        events.had(9);
        assert_eq!(events.missing(), Some(7));
        events.give_up(8);
        assert_eq!((events.missing(), events.lost()), (Some(8), 1));
        events.put(8, event(8));
        assert_eq!(handed(&mut events), [8]);
        assert_eq!(events.missing(), None);
    }

    #[test]
    fn what_cannot_be_had_any_more_is_counted_and_passed_over() {
        let mut events = Events::default();
        events.put(3, event(3));
        assert_eq!(handed(&mut events), [3]);
        events.put(100, event(100));
        assert_eq!(events.missing(), Some(4));
        events.give_up(70);
        assert_eq!((events.missing(), events.lost()), (Some(70), 66));
        // A device that keeps nothing at all.
        events.give_up(101);
        assert_eq!(events.lost(), 96);
        assert_eq!(handed(&mut events), [100]);
    }

    #[test]
    fn a_frame_that_comes_twice_is_taken_once_and_a_reset_begins_anew() {
        let mut events = Events::default();
        for _ in 0..2 {
            events.put(5, event(50));
            events.put(6, event(60));
        }
        assert_eq!(handed(&mut events), [5, 6]);
        events.put(6, event(60));
        assert!(handed(&mut events).is_empty() && !events.in_doubt());
        events.put(1, event(4));
        assert!(handed(&mut events).is_empty() && events.in_doubt());
        events.began_anew();
        assert_eq!(events.missing(), Some(0));
        events.put(0, event(3));
        assert_eq!(handed(&mut events), [0, 1]);
        assert_eq!((events.missing(), events.lost()), (None, 0));
    }

    #[test]
    fn an_event_that_was_given_up_and_comes_late_is_passed_over() {
        let mut events = Events::default();
        events.put(5, event(50));
        events.put(7, event(70));
        assert_eq!(handed(&mut events), [5]);
        events.give_up(7);
        assert_eq!((handed(&mut events), events.lost()), (vec![7], 1));
        events.put(6, event(60));
        assert!(events.in_doubt());
        events.goes_on();
        events.put(8, event(80));
        assert_eq!((handed(&mut events), events.lost()), (vec![8], 1));
        assert!(!events.in_doubt());
    }
}
