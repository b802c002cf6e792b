//! The device: samples and bytes in, bytes out.

use crate::line::{Asked, Line};
use crate::lock::{self, Challenge, Lock};
use crate::log;
use crate::measuring::{Context, Measuring};
use crate::memory::{Kept, Memory};
use crate::refining::Refining;
use crate::sensor::{ratio, About};
use crate::sensors::potentiometer::Potentiometer;
use crate::slots::{Slot, Store};
use crate::stream::Stream;
use crate::BUILT_IN;
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::blob::{self, EffectIds, Envelope, Provenance};
use yawrig_shared::network::Network;
use yawrig_shared::source::in_memory;
use yawrig_shared::wire::{
    self, Cause, Decoder, Event, Flags, Forgotten, Frame, HelloReply, NetworkStatus, Phase,
    Refusal, Reply, Request, Settings, Signature, Start, Status, HELLO_KEY, TRIAL_SAMPLES,
};

/// What the samples are of where nothing else was said.
const POTENTIOMETER: wire::Sensor = Potentiometer::<16, 12>::SENSOR;

/// What is known of the network that runs.
#[derive(Debug)]
struct Running {
    generation: u32,
    id: u32,
    slot: Option<Slot>,
    effects: EffectIds,
}

impl Running {
    fn new(envelope: Envelope, provenance: Provenance, slot: Option<Slot>) -> Self {
        let Envelope { generation, payload_crc: id, .. } = envelope;
        Self { generation, id, slot, effects: provenance.effects }
    }
}

/// Everything the device knows and does, generic over its flash, of which it needs four places
/// ([`crate::slots`]).
#[derive(Debug)]
pub struct Device<F, const LOCKABLE: bool = true> {
    decoder: Decoder,
    // Apart from the decoder, whose frame is still borrowed when it is acted on.
    core: Core<F, LOCKABLE>,
}

#[derive(Debug)]
struct Core<F, const LOCKABLE: bool> {
    board: &'static str,
    measuring: Measuring,
    refining: Refining,
    store: Store<F, LOCKABLE>,
    /// The only one in memory; to be used where there is something about it in `running`.
    network: Network,
    running: Option<Running>,
    /// Samples left for the host to confirm the network that runs; none: it is not on trial.
    trial: Option<u32>,
    /// Of the network that is being written.
    signature: Option<Signature>,
    /// The last challenge, good for one answer; the permit it was good for, with its length; the challenge of
    /// the update that is under way.
    challenge: Option<Challenge>,
    permit: Option<(Challenge, u32)>,
    update: Option<Challenge>,
    /// Number of the lock as this start has raised it, and how many challenges it has given.
    raised: Option<u32>,
    challenges: u32,
    session: u32,
    start: Start,
    sensor: wire::Sensor,
    /// Releases of which all that is to be remembered was given out; one with a refined result still to come
    /// is none.
    remembered: Option<u32>,
    lost_bytes: u32,
    line: Line,
    stream: Stream,
}

impl<F: NorFlash> Device<F> {
    /// A device that runs the newest network of its flash, or the one compiled in.
    pub fn new(flash: F, board: &'static str) -> Self {
        let mut device = Self::stopped(flash, board);
        device.start();
        device
    }

    /// The same before it has looked for its network. Made where it stays: it is larger than a stack should
    /// be.
    #[inline(always)]
    pub fn stopped(flash: F, board: &'static str) -> Self {
        Self::of(flash, board)
    }
}

impl<F: NorFlash> Device<F, false> {
    /// As [`Device::stopped`], one that cannot be locked: checking signatures takes 14 kB of code.
    #[inline(always)]
    pub fn without_lock(flash: F, board: &'static str) -> Self {
        Self::of(flash, board)
    }
}

impl<F: NorFlash, const LOCKABLE: bool> Device<F, LOCKABLE> {
    #[inline(always)]
    fn of(flash: F, board: &'static str) -> Self {
        Self {
            decoder: Decoder::new(),
            core: Core {
                board,
                measuring: Measuring::new(Settings::default()),
                refining: Refining::new(),
                store: Store::of(flash),
                network: Network::empty(),
                running: None,
                trial: None,
                signature: None,
                challenge: None,
                permit: None,
                update: None,
                raised: None,
                challenges: 0,
                session: 0,
                start: Start { cause: Cause::Unknown, crash: None },
                sensor: POTENTIOMETER,
                remembered: Some(0),
                lost_bytes: 0,
                line: Line::new(),
                stream: Stream::new(),
            },
        }
    }

    /// Takes up the newest network of the flash, or the one compiled in.
    pub fn start(&mut self) {
        self.core.take_up_kept();
    }

    /// Says how well the board knows its sampling clock, as a relative standard uncertainty in millionths;
    /// exact, if not said. The host's settings may say better.
    pub fn set_clock(&mut self, u_ppm: f32) {
        self.core.measuring.set_board_clock(u_ppm);
    }

    /// Says how this run began, where the board knows.
    pub fn set_start(&mut self, start: Start) {
        log::start(self.core.board, &start);
        self.core.start = start;
    }

    /// Says what the samples are of, where it is not a potentiometer that is read a thousand times a second.
    /// A sensor that knows its scale sets it.
    pub fn set_sensor(&mut self, about: &About) {
        let About { sensor, degrees_per_count, step_deg, full_scale_counts } = *about;
        self.core.sensor = sensor;
        let spread = ratio(sensor.rate_hz).map_or(1, |(_, spread)| spread);
        self.core.refining.set_readings(spread, step_deg);
        let (measuring, mut context) = self.core.split();
        measuring.set_spread(spread);
        let settings = *measuring.next_settings();
        let degrees_per_count = degrees_per_count.unwrap_or(settings.degrees_per_count);
        let settings = Settings { degrees_per_count, full_scale_counts, ..settings };
        // A sensor's own scale is in the range of those that may be set.
        let _ = measuring.configure(settings, &mut context);
    }

    /// What a board should keep where a reset leaves it ([`crate::memory`]), if it has changed since this was
    /// last asked.
    pub fn memory(&mut self) -> Option<Memory> {
        let (releases, reference) = self.core.measuring.kept();
        if self.core.remembered == Some(releases) {
            return None;
        }
        self.core.remembered = Some(releases);
        let network = self.core.running_id();
        let refined_reference = self.core.refining.kept();
        Some(Memory::of(&Kept { network, releases, reference, refined_reference }))
    }

    /// What was kept over a reset holds again, once it has started; the condition has to be said anew.
    pub fn recall(&mut self, memory: &Memory) {
        let Some(kept) = memory.read() else { return };
        let core = &mut self.core;
        core.measuring.recall(kept.releases, kept.reference);
        core.refining.recall(kept.refined_reference);
        core.remembered = Some(kept.releases);
        if core.running_id() != kept.network {
            core.measuring.network_changed();
        }
    }

    /// Where in a release it is.
    pub fn phase(&self) -> Phase {
        self.core.measuring.phase()
    }

    /// How a board's light stands: on while the model is held, blinking fast while it rings, and now and then
    /// else.
    pub fn is_lit(&self) -> bool {
        match self.phase() {
            Phase::Held => true,
            // 8 Hz, and a flash each second.
            Phase::Released | Phase::Ringing => self.samples() & 64 != 0,
            Phase::Waiting | Phase::Finished => self.samples() % 1024 < 32,
        }
    }

    /// The flash, to look at.
    pub fn flash(&mut self) -> &F {
        self.core.store.flash()
    }

    /// The flash, as a power cut leaves it.
    pub fn into_flash(self) -> F {
        self.core.store.into_flash()
    }

    /// The next sample of the converter, 1 ms after the one before.
    pub fn sample(&mut self, counts: u16) {
        self.flagged(counts, Flags::default());
    }

    /// The same with what its sensor says is the matter.
    pub fn flagged(&mut self, counts: u16, flags: Flags) {
        self.core.pass(1);
        self.core.show(counts);
        let (measuring, mut context) = self.core.split();
        measuring.sample(counts, flags, &mut context);
    }

    /// `count` samples before the next one were lost. Few are bridged, many end the release.
    pub fn lost(&mut self, count: u32) {
        log::lost(count);
        self.core.pass(count);
        let (measuring, mut context) = self.core.split();
        measuring.lost(count, &mut context);
    }

    /// Goes on with what is not urgent, by some thousand instructions. Called after each sample: the samples
    /// are its clock, so that events come in the same order wherever it runs.
    pub fn work(&mut self) {
        if let Some(refined) = self.core.refining.work() {
            self.core.measuring.refined(&refined);
            self.core.remembered = None;
            self.core.line.event(&Event::Refined(refined));
        }
        self.core.keep_learnt();
    }

    /// Whether there is such work.
    pub fn is_refining(&self) -> bool {
        self.core.refining.is_busy()
    }

    /// Called where there is nothing else to do: the same, once the host has said that the record is over and
    /// no sample comes any more. False where nothing is left.
    pub fn idle(&mut self) -> bool {
        let busy = self.core.measuring.is_over() && self.is_refining();
        if busy {
            self.work();
        }
        busy
    }

    /// What has happened since this was last asked, for the program around the device: phases, windows,
    /// results. The last [`wire::KEPT_EVENTS`] are kept; the host is told all of them beside this.
    pub fn events(&mut self) -> impl Iterator<Item = Event> + '_ {
        core::iter::from_fn(|| self.core.line.give())
    }

    /// A byte from the serial line.
    pub fn receive(&mut self, byte: u8) {
        if let Some(Ok(frame)) = self.decoder.push(byte) {
            self.core.obey(&frame);
        }
    }

    /// A byte from the serial line was lost; the frame it was in is dropped.
    pub fn overrun(&mut self) {
        self.decoder.overrun();
        self.core.lost_bytes = self.core.lost_bytes.saturating_add(1);
    }

    /// Samples since it started, those lost included: its clock.
    pub fn samples(&self) -> u32 {
        self.core.measuring.now()
    }

    /// Next byte for the serial line.
    pub fn transmit(&mut self) -> Option<u8> {
        self.core.line.transmit()
    }
}

impl<F: NorFlash, const LOCKABLE: bool> Core<F, LOCKABLE> {
    fn split(&mut self) -> (&mut Measuring, Context<'_>) {
        let running = self.running.as_ref();
        let network = running.map(|_| &self.network);
        let second_order = running.is_some_and(|running| running.effects.is_empty());
        let (line, refining) = (&mut self.line, &mut self.refining);
        (&mut self.measuring, Context { network, second_order, refining, line })
    }

    /// Time goes by: a network on trial that nobody confirms is given up.
    fn pass(&mut self, samples: u32) {
        if let Some(left) = self.trial {
            match left.checked_sub(samples) {
                Some(left) => self.trial = Some(left),
                None => self.give_up_trial(),
            }
        }
    }

    /// The network on trial cannot be confirmed any more. It goes at once, or with the end of the release.
    fn give_up_trial(&mut self) {
        if self.trial.is_some() {
            self.store.abandon();
            self.trial = Some(0);
            // Else asked again with the next sample.
            if !self.measuring.is_releasing() {
                self.roll_back();
            }
        }
    }

    /// All windows of a release are one network's.
    fn may_swap(&self) -> Result<(), Refusal> {
        if self.measuring.is_releasing() {
            return Err(Refusal::Releasing);
        }
        Ok(())
    }

    /// The sample goes to the host where that listens.
    fn show(&mut self, counts: u16) {
        let settings = self.measuring.settings();
        self.stream.sample(self.measuring.now(), counts, settings, &mut self.line);
    }

    /// Back from a network on trial to the one before.
    fn roll_back(&mut self) {
        if self.trial.take().is_some() {
            self.store.abandon();
            self.take_up_kept();
        }
    }

    /// What was learnt goes to the flash, but not while a release goes on, which erasing might cost samples.
    /// Of a network on trial nothing is kept: the one before may come back.
    fn keep_learnt(&mut self) {
        let busy = self.measuring.is_releasing() || self.refining.is_busy();
        if busy || self.trial.is_some() {
            return;
        }
        self.keep_due(self.running_id());
    }

    /// What is not in the flash yet of what was learnt of this network.
    fn keep_due(&mut self, network: u32) {
        if !self.measuring.learning().is_due() {
            return;
        }
        let kept = self.measuring.learning_mut().keep(self.store.flash(), network);
        if kept.is_err() {
            log::not_kept();
        }
    }

    /// Zero where none runs.
    fn running_id(&self) -> u32 {
        self.running.as_ref().map_or(0, |running| running.id)
    }

    /// The newest network of the flash, or the one compiled in.
    #[inline(never)]
    fn take_up_kept(&mut self) {
        self.read_kept();
        let network = self.running_id();
        self.measuring.learning_mut().recall(self.store.flash(), network);
    }

    fn read_kept(&mut self) {
        self.measuring.network_changed();
        self.running = match self.store.newest(&mut self.network) {
            Some((slot, envelope, provenance)) => {
                Some(Running::new(envelope, provenance, Some(slot)))
            }
            None => blob::decode_into(&mut in_memory(BUILT_IN), &mut self.network)
                .ok()
                .map(|(envelope, provenance)| Running::new(envelope, provenance, None)),
        };
    }

    /// Verifies the network that was written and runs it on trial. The one before is read again where it is
    /// refused.
    fn try_out(&mut self) -> Result<(), Refusal> {
        if self.trial.is_some() {
            return Err(Refusal::FlashOrder { expected_offset: 0 });
        }
        self.may_swap()?;
        let newest = self.running.as_ref().map_or(0, |running| running.generation);
        let before = self.running_id();
        let signature = self.signature.as_ref();
        match self.store.verify(newest, &mut self.network, self.update, signature) {
            Ok((slot, envelope, provenance)) => {
                // For when the one before comes back.
                self.keep_due(before);
                self.measuring.network_changed();
                self.measuring.learning_mut().forget(Forgotten::Network);
                self.running = Some(Running::new(envelope, provenance, Some(slot)));
                self.trial = Some(TRIAL_SAMPLES);
                Ok(())
            }
            Err(refusal) => {
                // The same network as before: what was learnt of it holds.
                self.read_kept();
                Err(refusal)
            }
        }
    }

    fn obey(&mut self, frame: &Frame<'_>) {
        let Frame { key, sequence, .. } = *frame;
        let asked = Asked::of(frame);
        if key == HELLO_KEY {
            let hello = HelloReply {
                protocol: wire::REVISION,
                messages_key: wire::MESSAGES_KEY,
                firmware: HelloReply::text(concat!("yawrig ", env!("CARGO_PKG_VERSION"))),
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
        }
        Ok(Reply::Done)
    }

    fn kept_lock(&mut self) -> Option<Lock> {
        if LOCKABLE {
            lock::read(self.store.flash())
        } else {
            None
        }
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
            start: self.start.clone(),
            sensor: self.sensor,
        }
    }
}
