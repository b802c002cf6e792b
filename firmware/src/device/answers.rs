//! What the host asks for, and what it is answered.

use super::Core;
use crate::line::Asked;
use crate::lock::{self, Challenge, Lock};
use crate::log;
use crate::slots::Slot;
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::wire::{
    self, Frame, HelloReply, LinearityPart, NetworkStatus, Refusal, Reply, Request, Status,
    HELLO_KEY,
};

/// `yawrig 0.1.0 0a1b2c3d+`: version, commit (and a plus where files had been changed since); `debug` in place of it
/// where that is how it was built.
fn firmware(commit: &str) -> heapless::String<24> {
    let mut said = heapless::String::new();
    let build = if cfg!(debug_assertions) { "debug" } else { commit };
    for part in [concat!("yawrig ", env!("CARGO_PKG_VERSION")), " ", build] {
        // What finds no room is left out.
        let _ = said.push_str(part);
    }
    said.truncate(said.trim_end().len());
    said
}

impl<F: NorFlash, const LOCKABLE: bool> Core<F, LOCKABLE> {
    pub(super) fn obey(&mut self, frame: &Frame<'_>) {
        let Frame { key, sequence, .. } = *frame;
        let asked = Asked::new(frame);
        if key == HELLO_KEY {
            let hello = HelloReply {
                protocol: wire::REVISION,
                messages_key: wire::MESSAGES_KEY,
                firmware: HelloReply::text(&firmware(self.commit)),
                board: HelloReply::text(self.board),
            };
            if let Ok(reply) = wire::encode_raw(HELLO_KEY, sequence, &hello.write()) {
                self.line.reply_raw(asked, reply);
            }
            return;
        }
        if self.line.repeat(asked) {
            return;
        }
        let Some(Ok(request)) = frame.message::<Request>() else { return };
        let reply = match self.answer(request) {
            Ok(reply) => reply,
            Err(refusal) => Reply::Refused(refusal),
        };
        self.line.reply(asked, &reply);
    }

    fn answer(&mut self, request: Request) -> Result<Reply, Refusal> {
        match request {
            Request::Status => return Ok(Reply::Status(self.status())),
            Request::Event { number } => {
                let kept = self.line.kept(number);
                return kept
                    .map(|event| Reply::Event(*event))
                    .map_err(|oldest| Refusal::NotKept { oldest });
            }
            Request::Configure(settings) => {
                let (measuring, mut context) = self.split();
                measuring.configure(settings, &mut context)?;
            }
            Request::Condition(condition) => {
                // What is over was made under the one before.
                self.keep_all_of_log();
                let (measuring, mut context) = self.split();
                measuring.set_condition(condition, &mut context)?;
            }
            Request::FlashBegin { length } => {
                if self.trial.is_some() {
                    self.may_swap()?;
                    self.roll_back();
                }
                self.signature = None;
                self.update = self.permitted(length)?;
                let running = self.running.as_ref().and_then(|running| running.slot);
                if self.store.wants_erase(running) {
                    self.wear.erase(self.measuring.now())?;
                }
                self.store.begin(length, running)?;
            }
            Request::FlashPermit { .. } | Request::Unlock { .. } if !LOCKABLE => {
                return Err(Refusal::WrongSignature);
            }
            Request::FlashPermit { length, signature } => {
                let challenge = self.challenge.take().ok_or(Refusal::WrongSignature)?;
                lock::check_update(self.store.flash(), challenge, length, &signature)?;
                self.permit = Some((challenge, length));
            }
            Request::FlashChunk { offset, bytes } => self.store.chunk(offset, &bytes)?,
            Request::FlashSignature { signature } => self.signature = Some(signature),
            Request::FlashTrial => self.try_out()?,
            Request::FlashCommit => {
                let committed = self.store.commit();
                match committed {
                    Ok(()) => self.trial = None,
                    Err(_) => self.give_up_trial(),
                }
                committed?;
                // The other may be what makes it fail, whatever its generation.
                let slot = self.running.as_ref().and_then(|running| running.slot);
                if let Some(slot) = slot.filter(|_| wire::is_safe(self.restarts)) {
                    self.store.erase(slot.other())?;
                }
            }
            Request::Lock { .. } if !LOCKABLE => return Err(Refusal::CannotLock),
            Request::Lock { key } => self.lock(&key)?,
            Request::Challenge => {
                let challenge = self.challenge()?;
                self.challenge = Some(challenge);
                let Challenge { number, nonce } = challenge;
                return Ok(Reply::Challenge { number, nonce });
            }
            Request::Unlock { signature } => {
                let challenge = self.challenge.take().ok_or(Refusal::WrongSignature)?;
                lock::unlock(self.store.flash(), challenge, &signature)?;
            }
            Request::Session { number } => {
                if self.session == 0 {
                    self.session = number;
                }
            }
            Request::EndRelease { after_samples } => {
                let (measuring, mut context) = self.split();
                measuring.end_after(after_samples, &mut context);
            }
            Request::Stream { samples } => self.stream.extend(samples),
            Request::SetLinearity(part) => self.set_linearity(&part)?,
            Request::Linearity { at } => return Ok(Reply::Linearity(self.linearity.part(at))),
            Request::Log { from } => return self.log_entry(from).map(Reply::Log),
        }
        Ok(Reply::Done)
    }

    /// What a start does for the lock.
    pub(super) fn mend_lock(&mut self) {
        if LOCKABLE && lock::mend(self.store.flash()) {
            log::lock_lost();
        }
    }

    fn kept_lock(&mut self) -> Option<Lock> {
        if LOCKABLE {
            lock::read(self.store.flash())
        } else {
            None
        }
    }

    /// Takes part of a table. Who may not write networks may not change results by it either.
    fn set_linearity(&mut self, part: &LinearityPart) -> Result<(), Refusal> {
        self.may_swap()?;
        if self.kept_lock().is_some() {
            return Err(Refusal::Unsigned);
        }
        let identity = self.identity();
        let put = self.linearity.put(self.store.flash(), identity, part);
        self.refining.set_table(self.linearity.damping_u());
        // Corrected otherwise, the model seems to have moved: it is looked at anew.
        let (measuring, mut context) = self.split();
        let settings = *measuring.next_settings();
        put.and(measuring.configure(settings, &mut context))
    }

    /// The challenge upon which this update was permitted; none on a device without a lock.
    fn permitted(&mut self, length: u32) -> Result<Option<Challenge>, Refusal> {
        let permit = self.permit.take();
        if self.kept_lock().is_none() {
            return Ok(None);
        }
        match permit {
            Some((challenge, permitted)) if permitted == length => Ok(Some(challenge)),
            _ => Err(Refusal::Unsigned),
        }
    }

    /// Locks it. A network on trial, or half written, was not signed.
    fn lock(&mut self, key: &[u8; 32]) -> Result<(), Refusal> {
        if self.trial.is_some() {
            self.may_swap()?;
        }
        lock::lock(self.store.flash(), key)?;
        self.roll_back();
        self.store.abandon();
        Ok(())
    }

    /// A challenge that was never given before.
    fn challenge(&mut self) -> Result<Challenge, Refusal> {
        let lock = self.kept_lock().ok_or(Refusal::NotLocked)?;
        // Before this start the nonces of this number may have been given, too.
        if self.raised != Some(lock.number) {
            self.raised = Some(lock::renew(self.store.flash())?);
        }
        self.challenges = self.challenges.wrapping_add(1);
        Ok(Challenge { number: self.raised.unwrap_or(lock.number), nonce: self.challenges })
    }

    fn status(&mut self) -> Status {
        let running = self.running.as_ref();
        Status {
            network: NetworkStatus {
                id: running.map_or(0, |r| r.id),
                generation: running.map_or(0, |r| r.generation),
                topology: running.map_or(Default::default(), |_| self.network.topology.clone()),
                slot: running.and_then(|r| r.slot).map(|slot| slot as u8),
                on_trial: self.trial.is_some(),
                effects: running.map_or(Default::default(), |r| r.effects.clone()),
                numbers: running.map_or(Default::default(), |_| self.network.number_names.clone()),
            },
            slots: Slot::BOTH.map(|slot| self.store.state(slot)),
            lock: self.kept_lock().map(|lock| lock.key),
            settings: *self.measuring.next_settings(),
            clock_u_ppm: self.measuring.clock_u_ppm(),
            phase: self.measuring.phase(),
            samples: self.measuring.now(),
            lost_samples: self.measuring.lost_samples(),
            lost_events: self.line.lost_events(),
            refining: self.refining.is_busy(),
            lost_bytes: self.lost_bytes,
            session: self.session,
            next_event: self.line.next_event(),
            condition: self.measuring.condition(),
            reference: self.measuring.reference(),
            refined_reference: self.refining.reference(),
            learnt: self.measuring.learning().learnt(),
            linearity: self.linearity.known(),
            start: self.start.clone(),
            restarts: self.restarts,
            sensor: self.sensor,
        }
    }
}
