//! The device: samples and bytes in, bytes out.

mod answers;
mod logging;
mod trial;

use crate::journal::Journal;
use crate::line::Line;
use crate::linearity::{identity, Linearity};
use crate::lock::Challenge;
use crate::log;
use crate::measuring::{Context, Measuring};
use crate::memory::{Kept, Memory};
use crate::refining::Refining;
use crate::sensor::{ratio, About};
use crate::sensors::potentiometer::Potentiometer;
use crate::slots::{Slot, Store};
use crate::stream::Stream;
use crate::wear::Wear;
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::blob::{EffectIds, Envelope, Provenance};
use yawrig_shared::network::Network;
use yawrig_shared::wire::{self, Cause, Decoder, Event, Flags, Phase, Settings, Signature, Start};

/// What the samples are of where nothing else was said.
const POTENTIOMETER: wire::Sensor = Potentiometer::<16, 12>::SENSOR;

/// A minute.
const SAMPLES_TO_RECOVER: u32 = 60_000;

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
/// ([`crate::slots`]), and takes what is behind them for its log ([`crate::journal`]).
#[derive(Debug)]
pub struct Device<F, const LOCKABLE: bool = true> {
    decoder: Decoder,
    // Apart from the decoder, whose frame is still borrowed when it is acted on.
    core: Core<F, LOCKABLE>,
}

#[derive(Debug)]
struct Core<F, const LOCKABLE: bool> {
    board: &'static str,
    commit: &'static str,
    measuring: Measuring,
    refining: Refining,
    linearity: Linearity,
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
    wear: Wear,
    /// Number of the lock as this start has raised it, and how many challenges it has given.
    raised: Option<u32>,
    challenges: u32,
    session: u32,
    start: Start,
    restarts: u8,
    sensor: wire::Sensor,
    /// Releases of which all that is to be remembered was given out; one with a refined result still to come
    /// is none.
    remembered: Option<u32>,
    lost_bytes: u32,
    line: Line,
    journal: Journal,
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
        Self::empty(flash, board)
    }
}

impl<F: NorFlash> Device<F, false> {
    /// As [`Device::stopped`], one that cannot be locked: checking signatures takes 14 kB of code.
    #[inline(always)]
    pub fn without_lock(flash: F, board: &'static str) -> Self {
        Self::empty(flash, board)
    }
}

impl<F: NorFlash, const LOCKABLE: bool> Device<F, LOCKABLE> {
    #[inline(always)]
    fn empty(flash: F, board: &'static str) -> Self {
        Self {
            decoder: Decoder::new(),
            core: Core {
                board,
                commit: "",
                measuring: Measuring::new(Settings::default()),
                refining: Refining::new(),
                linearity: Linearity::new(),
                store: Store::empty(flash),
                network: Network::empty(),
                running: None,
                trial: None,
                signature: None,
                challenge: None,
                permit: None,
                update: None,
                wear: Wear::new(),
                raised: None,
                challenges: 0,
                session: 0,
                start: Start { cause: Cause::Unknown, crash: None },
                restarts: 0,
                sensor: POTENTIOMETER,
                remembered: Some(0),
                lost_bytes: 0,
                line: Line::new(),
                journal: Journal::new(),
                stream: Stream::new(),
            },
        }
    }

    /// Takes up the newest network of the flash, or the one compiled in, and what else the flash keeps; in
    /// [safe mode](Device::is_safe) nothing of it.
    pub fn start(&mut self) {
        if self.is_safe() {
            return self.core.take_up_kept();
        }
        self.core.mend_lock();
        self.core.take_up_kept();
        self.core.take_up_linearity();
        self.core.take_up_log();
    }

    /// Whether it began so often without being asked that it only answers, until power comes or the reset button
    /// is pressed: what it keeps, or what comes from the sensor, may be what makes it fail. It takes no
    /// samples then, and a board gives it no memory. A network that is written replaces both that are kept.
    pub fn is_safe(&self) -> bool {
        wire::is_safe(self.core.restarts)
    }

    /// Whether it has just run for so long after starts that nobody asked for that the next one is the first
    /// again.
    pub fn has_recovered(&mut self) -> bool {
        let recovered = self.core.restarts > 0 && self.samples() >= SAMPLES_TO_RECOVER;
        if recovered {
            self.core.restarts = 0;
        }
        recovered
    }

    /// Says of which commit the image is, where its build knew: the first answer to a host has it.
    pub fn set_commit(&mut self, commit: &'static str) {
        self.core.commit = commit;
    }

    /// Says how well the board knows its sampling clock, as a relative standard uncertainty in millionths;
    /// exact, if not said. The host's settings may say better.
    pub fn set_clock(&mut self, u_ppm: f32) {
        self.core.measuring.set_board_clock(u_ppm);
    }

    /// Says how this run began, where the board knows, and how many starts in a row nobody asked for: before
    /// [`Device::start`].
    pub fn set_start(&mut self, start: Start, restarts: u8) {
        log::start(self.core.board, &start);
        (self.core.start, self.core.restarts) = (start, restarts);
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
        self.core.take_up_linearity();
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
        Some(Memory::new(&Kept { network, releases, reference, refined_reference }))
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
        if self.is_safe() {
            return;
        }
        self.core.pass(1);
        let full_scale_counts = self.core.measuring.settings().full_scale_counts;
        let counts = self.core.linearity.corrected(counts, full_scale_counts);
        self.core.show(counts);
        let (measuring, mut context) = self.core.split();
        measuring.sample(counts, flags, &mut context);
    }

    /// `count` samples before the next one were lost. Few are bridged, many end the release.
    pub fn lost(&mut self, count: u32) {
        if self.is_safe() {
            return;
        }
        log::lost(count);
        self.core.pass(count);
        let (measuring, mut context) = self.core.split();
        measuring.lost(count, &mut context);
    }

    /// Goes on with what is not urgent, by some thousand instructions. Called after each sample: the samples
    /// are its clock, so that events come in the same order wherever it runs.
    pub fn work(&mut self) {
        // Not with a piece of a refined estimate.
        if !self.is_refining() {
            self.core.keep_log();
        }
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
        let left = self.is_refining() || self.core.is_log_behind();
        let busy = self.core.measuring.is_over() && left;
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

    /// Which board and sensor a table is of.
    fn identity(&self) -> u32 {
        identity(self.board, &self.sensor)
    }

    /// The table that the flash keeps, if it is of this board and sensor.
    #[inline(never)]
    fn take_up_linearity(&mut self) {
        let identity = self.identity();
        self.linearity.recall(self.store.flash(), identity);
        self.refining.set_table(self.linearity.damping_u());
    }

    /// The sample goes to the host where that listens.
    fn show(&mut self, counts: u16) {
        let settings = self.measuring.settings();
        self.stream.sample(self.measuring.now(), counts, settings, &mut self.line);
    }
}
