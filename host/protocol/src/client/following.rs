//! What a device says unasked: events in order, and the stream of its samples.

use super::{Client, LinkError};
use crate::events::Numbered;
use crate::line::Line;
use std::time::Duration;
use yawrig_base::clock::Instant;
use yawrig_base::interrupt;
use yawrig_shared::wire::{Refusal, Reply, Request, Samples};

/// How often a question is repeated for an event before it counts as lost.
const ROUNDS: u32 = 5;
/// After so long a silence the device is asked whether it has said anything.
const SILENCE: Duration = Duration::from_secs(1);

impl<L: Line> Client<L> {
    /// Asks for the next so many samples of the potentiometer; ask again before they are over.
    pub async fn stream(&mut self, samples: u32) -> std::result::Result<(), LinkError> {
        self.samples.get_or_insert_default();
        self.request(&Request::Stream { samples }).await.map(drop)
    }

    /// The next samples of the stream that have come. [`Self::next_event`] waits for more.
    pub fn next_samples(&mut self) -> Option<Samples> {
        self.samples.as_mut()?.pop_front()
    }

    /// The next event, waiting for it at most so long. What the line has lost is asked for again.
    pub async fn next_event(
        &mut self,
        patience: Duration,
    ) -> std::result::Result<Option<Numbered>, LinkError> {
        let deadline = Instant::now() + patience;
        loop {
            if let Some(event) = self.events.take() {
                return Ok(Some(event));
            }
            let unsure = self.session == 0 || self.events.in_doubt();
            if unsure && self.asked.is_none_or(|asked| asked.elapsed() > SILENCE) {
                self.asked = Some(Instant::now());
                let asked = match self.session {
                    0 => self.name_session().await,
                    _ => self.request(&Request::Status).await.map(|_| ()),
                };
                match asked {
                    Ok(()) => {
                        self.asked = None;
                        continue;
                    }
                    // Once more in a while.
                    Err(LinkError::Silent { .. } | LinkError::Refused(_)) => {}
                    Err(error) => return Err(error),
                }
            }
            if let Some(number) = self.events.missing() {
                self.fetch(number).await?;
                continue;
            }
            if self.heard.elapsed() > SILENCE {
                self.heard = Instant::now();
                match self.request(&Request::Status).await {
                    // It may be busy; a request that waits for its own answer reports the silence.
                    Ok(_) | Err(LinkError::Silent { .. } | LinkError::Refused(_)) => continue,
                    Err(error) => return Err(error),
                }
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if interrupt::requested() {
                return Err(LinkError::Interrupted);
            }
            let frames = self.frames;
            self.take(left.min(Duration::from_millis(100))).await?;
            if self.frames == frames && Instant::now() >= deadline {
                return Ok(None);
            }
        }
    }

    /// Asks again for an event that did not come.
    async fn fetch(&mut self, number: u16) -> std::result::Result<(), LinkError> {
        match self.request(&Request::Event { number }).await {
            Ok(Reply::Event(event)) => self.events.put(number, event),
            Ok(_) => self.events.give_up(number.wrapping_add(1)),
            Err(LinkError::Refused(Refusal::NotKept { oldest })) => self.events.give_up(oldest),
            // A bad line: once more, a few times; the results after it wait for this one.
            Err(LinkError::Silent { .. }) if self.rounds < ROUNDS => {
                self.rounds += 1;
                return Ok(());
            }
            Err(LinkError::Silent { .. }) => self.events.give_up(number.wrapping_add(1)),
            Err(error) => return Err(error),
        }
        self.rounds = 0;
        Ok(())
    }

    /// Number of the next event to hand out, once known.
    pub fn expected_event(&self) -> Option<u16> {
        self.events.expected()
    }

    /// Goes on with the events from this number to the one before `end`, as far as the device keeps them.
    pub fn resume(&mut self, from: u16, end: u16) {
        self.events.begin(Some(from));
        self.events.had(end);
    }

    /// Events lost for good since the line was opened: the device does not keep them any more.
    pub fn missed_events(&self) -> u64 {
        self.events.lost()
    }
}
