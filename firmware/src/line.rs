//! The serial line as the device sees it: a decoder, a queue of bytes to send, and the last reply.

use crate::log;
use heapless::{Deque, Vec};
use yawrig_shared::checksum::crc32;
use yawrig_shared::wire::{
    self, Encoded, Event, Frame, Message, Samples, KEPT_EVENTS, SAMPLES_KEY,
};

/// Bytes waiting for the line: about forty events.
const QUEUE: usize = 2048;
/// Room that events leave for a reply.
const RESERVE: usize = 256;
/// Room that samples leave for events and replies.
const RESERVE_FROM_SAMPLES: usize = QUEUE / 2;

/// Answers kept beside the last one, for who asks again when others have asked in between: those that are as
/// short as the answer to whatever changes something.
const ANSWERS: usize = 4;
const SHORT: usize = 40;

/// A request as it is known again: not by its number alone, which two programs may both use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    key: u32,
    sequence: u16,
    body: u32,
}

impl Asked {
    pub fn new(frame: &Frame<'_>) -> Self {
        Self { key: frame.key, sequence: frame.sequence, body: crc32(frame.body) }
    }
}

/// Outgoing bytes, and what was answered last.
#[derive(Debug)]
pub struct Line {
    queue: Deque<u8, QUEUE>,
    last_reply: Option<(Asked, Encoded)>,
    answers: Deque<(Asked, Vec<u8, SHORT>), ANSWERS>,
    /// The last events, so that a host can ask for those it missed.
    kept: Deque<Event, KEPT_EVENTS>,
    next_event: u16,
    /// Number of the next one that the program itself is to be given.
    next_given: u16,
    lost_events: u32,
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}

impl Line {
    // Or else it would be made on the stack and then copied.
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            queue: Deque::new(),
            last_reply: None,
            answers: Deque::new(),
            kept: Deque::new(),
            next_event: 0,
            next_given: 0,
            lost_events: 0,
        }
    }

    /// Next byte for the line.
    pub fn transmit(&mut self) -> Option<u8> {
        self.queue.pop_front()
    }

    /// Events that found no room; the gap in their sequence tells the host, which asks for them.
    pub fn lost_events(&self) -> u32 {
        self.lost_events
    }

    /// Number of the next event.
    pub fn next_event(&self) -> u16 {
        self.next_event
    }

    /// An event of before.
    ///
    /// # Errors
    /// The number of the oldest one that is kept.
    pub fn kept(&self, number: u16) -> Result<&Event, u16> {
        let oldest = self.next_event.wrapping_sub(self.kept.len() as u16);
        self.kept.iter().nth(usize::from(number.wrapping_sub(oldest))).ok_or(oldest)
    }

    /// The next event for the program itself.
    pub fn give(&mut self) -> Option<Event> {
        let mut next = self.next_given;
        let event = self.next_of(&mut next);
        self.next_given = next;
        event
    }

    /// The event of this number, which is raised by one; those that are not kept any more are passed over.
    pub fn next_of(&self, next: &mut u16) -> Option<Event> {
        if *next == self.next_event {
            return None;
        }
        let event = match self.kept(*next) {
            Ok(event) => *event,
            Err(oldest) => {
                *next = oldest;
                *self.kept(oldest).ok()?
            }
        };
        *next = next.wrapping_add(1);
        Some(event)
    }

    /// Queues an event, and keeps it for when it is asked for again.
    pub fn event(&mut self, event: &Event) {
        log::event(event);
        let sequence = self.next_event;
        self.next_event = self.next_event.wrapping_add(1);
        if self.kept.is_full() {
            self.kept.pop_front();
        }
        // There is room: just made.
        let _ = self.kept.push_back(*event);
        let sent = wire::encode(sequence, event).is_ok_and(|frame| self.send(&frame, RESERVE));
        self.lost_events += u32::from(!sent);
    }

    /// Queues samples where there is room; their numbers tell the host of those that found none.
    pub fn samples(&mut self, samples: &Samples) {
        let number = samples.first_sample as u16;
        if let Ok(frame) = wire::encode_raw(SAMPLES_KEY, number, &samples.write()) {
            self.send(&frame, RESERVE_FROM_SAMPLES);
        }
    }

    /// Answers a request, and keeps the answer for when it is asked for again.
    pub fn reply<M: Message>(&mut self, asked: Asked, reply: &M) {
        if let Ok(frame) = wire::encode(asked.sequence, reply) {
            self.reply_raw(asked, frame);
        }
    }

    /// Answers with a frame that is encoded already.
    pub fn reply_raw(&mut self, asked: Asked, frame: Encoded) {
        self.send(&frame, 0);
        if let Some((before, answer)) = &self.last_reply
            && let Ok(answer) = Vec::from_slice(answer)
        {
            if self.answers.is_full() {
                self.answers.pop_front();
            }
            // There is room: just made.
            let _ = self.answers.push_back((*before, answer));
        }
        self.last_reply = Some((asked, frame));
    }

    /// Sends a reply again if it was to this very request.
    pub fn repeat(&mut self, asked: Asked) -> bool {
        if let Some((before, frame)) = self.last_reply.take() {
            if before == asked {
                self.send(&frame, 0);
            }
            self.last_reply = Some((before, frame));
            if before == asked {
                return true;
            }
        }
        let known = self.answers.iter().find(|(before, _)| *before == asked);
        let Some(answer) = known.map(|(_, answer)| answer.clone()) else { return false };
        self.send(&answer, 0);
        true
    }

    /// Whether the frame found room beside what is reserved for others.
    // One copy: into each caller it would cost the image 2 KB.
    #[inline(never)]
    fn send(&mut self, frame: &[u8], reserve: usize) -> bool {
        let fits = self.queue.len() + frame.len() + reserve <= QUEUE;
        if fits {
            for &byte in frame {
                // There is room: just looked.
                let _ = self.queue.push_back(byte);
            }
        }
        fits
    }
}
