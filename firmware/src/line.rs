//! The serial line as the device sees it: a decoder, a queue of bytes to send, and the last reply.

use heapless::Deque;
use yawrig_shared::wire::{self, Encoded, Event, Message, Samples, KEPT_EVENTS, SAMPLES_KEY};

/// Bytes waiting for the line: about forty events.
const QUEUE: usize = 2048;
/// Room that events leave for a reply.
const RESERVE: usize = 256;
/// Room that samples leave for events and replies.
const RESERVE_FROM_SAMPLES: usize = QUEUE / 2;

/// Outgoing bytes, and what was answered last.
#[derive(Debug)]
pub struct Line {
    queue: Deque<u8, QUEUE>,
    last_reply: Option<(u32, u16, Encoded)>,
    /// The last events, so that a host can ask for those it missed.
    kept: Deque<Event, KEPT_EVENTS>,
    next_event: u16,
    lost_events: u32,
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}

impl Line {
    pub const fn new() -> Self {
        Self {
            queue: Deque::new(),
            last_reply: None,
            kept: Deque::new(),
            next_event: 0,
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

    /// Queues an event, and keeps it for when it is asked for again.
    pub fn event(&mut self, event: &Event) {
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
    pub fn reply<M: Message>(&mut self, key: u32, sequence: u16, reply: &M) {
        if let Ok(frame) = wire::encode(sequence, reply) {
            self.reply_raw(key, sequence, frame);
        }
    }

    /// Answers with a frame that is encoded already.
    pub fn reply_raw(&mut self, key: u32, sequence: u16, frame: Encoded) {
        self.send(&frame, 0);
        self.last_reply = Some((key, sequence, frame));
    }

    /// Sends the last reply again if it was to this very request.
    pub fn repeat(&mut self, key: u32, sequence: u16) -> bool {
        let Some((k, s, frame)) = self.last_reply.take() else { return false };
        let same = (k, s) == (key, sequence);
        if same {
            self.send(&frame, 0);
        }
        self.last_reply = Some((k, s, frame));
        same
    }

    /// Whether the frame found room beside what is reserved for others.
    // One copy: into each caller it would cost the image 2 KB.
    #[inline(never)]
    fn send(&mut self, frame: &Encoded, reserve: usize) -> bool {
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
