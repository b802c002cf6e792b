//! The device: samples and bytes in, bytes out.

use crate::line::Line;
use crate::measuring::{Context, Measuring};
use crate::slots::{Flash, Slot, Store};
use crate::stream::Stream;
use crate::BUILT_IN;
use yawrig_shared::blob::{self, EffectIds, Envelope, Payload};
use yawrig_shared::network::Network;
use yawrig_shared::wire::{
    self, Decoder, Frame, HelloReply, Message, NetworkStatus, Refusal, Reply, Request, Settings,
    Status, HELLO_KEY, TRIAL_SAMPLES,
};

/// The network that runs.
#[derive(Debug)]
struct Running {
    network: Network,
    generation: u32,
    id: u32,
    slot: Option<Slot>,
    effects: EffectIds,
}

impl Running {
    /// The newest network of the flash, or the one compiled in.
    fn kept<F: Flash>(store: &Store<F>) -> Option<Self> {
        match store.newest() {
            Some((slot, envelope, payload)) => Some(Self::new(envelope, payload, Some(slot))),
            None => blob::decode(BUILT_IN).ok().map(|(e, payload)| Self::new(e, payload, None)),
        }
    }

    fn new(envelope: Envelope, payload: Payload, slot: Option<Slot>) -> Self {
        let Envelope { generation, payload_crc: id, .. } = envelope;
        let effects = payload.provenance.effects;
        Self { network: payload.network, generation, id, slot, effects }
    }
}

/// Everything the device knows and does, generic over its flash.
#[derive(Debug)]
pub struct Device<F> {
    decoder: Decoder,
    // Apart from the decoder, whose frame is still borrowed when it is acted on.
    core: Core<F>,
}

#[derive(Debug)]
struct Core<F> {
    board: &'static str,
    measuring: Measuring,
    store: Store<F>,
    running: Option<Running>,
    /// Samples left for the host to confirm the network that runs; none: it is not on trial.
    trial: Option<u32>,
    line: Line,
    stream: Stream,
}

impl<F: Flash> Device<F> {
    /// A device that runs the newest network of its flash, or the one compiled in.
    pub fn new(flash: F, board: &'static str) -> Self {
        let store = Store::new(flash);
        let running = Running::kept(&store);
        let measuring = Measuring::new(Settings::default());
        let (line, stream) = (Line::new(), Stream::new());
        let core = Core { board, measuring, store, running, trial: None, line, stream };
        Self { decoder: Decoder::new(), core }
    }

    /// The flash, as a power cut leaves it.
    pub fn into_flash(self) -> F {
        self.core.store.into_flash()
    }

    /// The next sample of the converter, 1 ms after the one before.
    pub fn sample(&mut self, counts: u16) {
        self.core.pass(1);
        self.core.show(counts);
        let (measuring, mut context) = self.core.split();
        measuring.sample(counts, &mut context);
    }

    /// `count` samples before the next one were lost. Few are bridged, many end the release.
    pub fn lost(&mut self, count: u32) {
        self.core.pass(count);
        let (measuring, mut context) = self.core.split();
        measuring.lost(count, &mut context);
    }

    /// A byte from the serial line.
    pub fn receive(&mut self, byte: u8) {
        if let Some(Ok(frame)) = self.decoder.push(byte) {
            self.core.obey(&frame);
        }
    }

    /// Next byte for the serial line.
    pub fn transmit(&mut self) -> Option<u8> {
        self.core.line.transmit()
    }
}

impl<F: Flash> Core<F> {
    fn split(&mut self) -> (&mut Measuring, Context<'_>) {
        let network = self.running.as_ref().map(|running| &running.network);
        (&mut self.measuring, Context { network, line: &mut self.line })
    }

    /// Time goes by: a network on trial that nobody confirms is given up.
    fn pass(&mut self, samples: u32) {
        if let Some(left) = self.trial {
            match left.checked_sub(samples) {
                Some(left) => self.trial = Some(left),
                None => self.roll_back(),
            }
        }
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
            self.running = Running::kept(&self.store);
        }
    }

    fn obey(&mut self, frame: &Frame<'_>) {
        let Frame { key, sequence, .. } = *frame;
        if key == HELLO_KEY {
            let hello = HelloReply {
                protocol: u16::from(wire::VERSION),
                request_key: Request::KEY,
                firmware: HelloReply::text(concat!("yawrig ", env!("CARGO_PKG_VERSION"))),
                board: HelloReply::text(self.board),
            };
            if let Ok(reply) = wire::encode_raw(HELLO_KEY, sequence, &hello.write()) {
                self.line.reply_raw(key, sequence, reply);
            }
            return;
        }
        if self.line.repeat(key, sequence) {
            return;
        }
        let Some(Ok(request)) = frame.message::<Request>() else { return };
        let reply = match self.answer(request) {
            Ok(reply) => reply,
            Err(refusal) => Reply::Refused(refusal),
        };
        self.line.reply(key, sequence, &reply);
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
            Request::Configure(settings) => self.measuring.configure(settings)?,
            Request::Condition(condition) => self.measuring.set_condition(condition),
            Request::FlashBegin { length } => {
                self.roll_back();
                let running = self.running.as_ref().and_then(|running| running.slot);
                self.store.begin(length, running)?;
            }
            Request::FlashChunk { offset, bytes } => self.store.chunk(offset, &bytes)?,
            Request::FlashTrial => {
                let newest = self.running.as_ref().map_or(0, |running| running.generation);
                let (slot, envelope, payload) = self.store.verify(newest)?;
                self.running = Some(Running::new(envelope, payload, Some(slot)));
                self.trial = Some(TRIAL_SAMPLES);
            }
            Request::FlashCommit => {
                let committed = self.store.commit();
                if committed.is_err() {
                    self.roll_back();
                }
                self.trial = None;
                committed?;
            }
            Request::EndRelease { after_samples } => {
                let (measuring, mut context) = self.split();
                measuring.end_after(after_samples, &mut context);
            }
            Request::Stream { samples } => self.stream.extend(samples),
        }
        Ok(Reply::Done)
    }

    fn status(&self) -> Status {
        let running = self.running.as_ref();
        Status {
            network: NetworkStatus {
                id: running.map_or(0, |r| r.id),
                generation: running.map_or(0, |r| r.generation),
                topology: running.map_or(Default::default(), |r| r.network.topology.clone()),
                slot: running.and_then(|r| r.slot).map(|slot| slot as u8),
                on_trial: self.trial.is_some(),
                effects: running.map_or(Default::default(), |r| r.effects.clone()),
            },
            slots: Slot::BOTH.map(|slot| self.store.state(slot)),
            settings: *self.measuring.settings(),
            phase: self.measuring.phase(),
            samples: self.measuring.now(),
            lost_samples: self.measuring.lost_samples(),
            lost_events: self.line.lost_events(),
            next_event: self.line.next_event(),
            has_reference: self.measuring.has_reference(),
        }
    }
}
