//! Counts what the device executes; `tests/budgets` runs it.
//!
//! For QEMU with `-icount shift=10` only: there every instruction takes 1024 ns of emulated time,
//! so that SysTick, at 25 MHz, tells how many were executed, the same number in every run.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::SYST;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use yawrig_firmware::device::Device;
use yawrig_firmware::BUILT_IN;
use yawrig_mps2_an386::{flash, swing};
use yawrig_shared::blob;
use yawrig_shared::features::{Inputs, FEATURES};
use yawrig_shared::linearity::{Head, Table, KNOTS};
use yawrig_shared::network::forward;
use yawrig_shared::potentiometer::{Decoder, Encoder};
use yawrig_shared::wire::{Decoder as FrameDecoder, Event};

/// 1024 ns an instruction at 40 ns a tick: 128 / 5 ticks.
const TICKS: u32 = 128;
const INSTRUCTIONS: u32 = 5;
const RELOAD: u32 = 0x00ff_ffff;

/// Inputs, components, hidden nodes, outputs.
const ON_COMPONENTS: [u8; 4] = [FEATURES as u8, 10, 6, 2];
/// Instructions an everyday sample may take.
const EVERYDAY: u32 = 400;

struct Counter {
    timer: SYST,
    /// Ticks that counting nothing takes.
    nothing: u32,
}

impl Counter {
    fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        let mut counter = Self { timer, nothing: 0 };
        counter.nothing = counter.ticks(|| ());
        counter
    }

    #[inline(always)]
    fn ticks(&mut self, work: impl FnOnce()) -> u32 {
        self.timer.clear_current();
        let before = SYST::get_current();
        work();
        let after = SYST::get_current();
        // It counts down; a turn is 655 000 instructions.
        assert!(!self.timer.has_wrapped(), "the work is too long to count");
        before.wrapping_sub(after) & RELOAD
    }

    #[inline(always)]
    fn count(&mut self, work: impl FnOnce()) -> u32 {
        let ticks = self.ticks(work) - self.nothing;
        (ticks * INSTRUCTIONS + TICKS / 2) / TICKS
    }
}

/// Counts over many goes of one kind of work.
#[derive(Default)]
struct Tally {
    goes: u32,
    total: u32,
    most: u32,
}

impl Tally {
    fn add(&mut self, count: u32) {
        self.goes += 1;
        self.total += count;
        self.most = self.most.max(count);
    }

    fn mean(&self) -> u32 {
        (self.total + self.goes / 2) / self.goes.max(1)
    }
}

#[entry]
fn main() -> ! {
    let peripherals = cortex_m::Peripherals::take().expect("main runs once");
    let mut counter = Counter::new(peripherals.SYST);
    let (_, payload) = blob::decode(BUILT_IN).expect("a network is compiled in");
    let network = payload.network;
    hprintln!("topology {:?}", network.topology.as_slice());

    let inputs: Inputs =
        payload.golden[0].inputs.iter().map(|bits| f32::from_bits(*bits)).collect();
    let inference = counter.count(|| {
        let topology = black_box(&network.topology);
        black_box(forward(topology, network.linear_layers, &network.weights, black_box(&inputs)));
    });
    hprintln!("inference {}", inference);
    let estimate = counter.count(|| {
        black_box(black_box(&network).estimate_inputs(black_box(&inputs)));
    });
    hprintln!("inference_in_physical_units {}", estimate);
    // Ten principal components first; the work does not depend on the weights' values.
    let weights = [0.01_f32; 42 * 10 + 11 * 6 + 7 * 2];
    let projected = counter.count(|| {
        let topology = black_box(&ON_COMPONENTS);
        black_box(forward(topology, 1, black_box(&weights), black_box(&inputs[..FEATURES])));
    });
    hprintln!("inference_on_components {}", projected);

    hprintln!("sample_correction {}", correction(&mut counter));
    release(&mut counter);
    debug::exit(debug::EXIT_SUCCESS);
    unreachable!("QEMU was asked to exit")
}

/// What a table for the converter adds to a sample, at most.
fn correction(counter: &mut Counter) -> u32 {
    let (knots, learned_from) = (KNOTS as u16, 8);
    let head = Head {
        first_counts: 30_000,
        spacing_bits: 4,
        unit_bits: 1,
        knots,
        learned_from,
        damping_u: 0.0,
    };
    let mut table = Table::new();
    table.begin(&head);
    table.put(0, &[-3; KNOTS]);
    let mut tally = Tally::default();
    for counts in (28_000..40_000_u16).step_by(7) {
        tally.add(counter.count(|| {
            black_box(black_box(&table).corrected(black_box(counts)));
        }));
    }
    tally.most
}

/// Lets go of a model and counts what the samples cost.
fn release(counter: &mut Counter) {
    // SAFETY: called once.
    let slots = unsafe { flash::erased() };
    let mut device = Device::without_lock(slots, "mps2-an386");
    device.start();
    let mut encoder = Encoder::default();
    let mut decoder = Decoder::default();
    let mut decoding = Tally::default();
    // All samples; those after which nothing was sent; a window's estimate; anything else.
    let [mut all, mut quiet, mut window, mut other] = [(); 4].map(|()| Tally::default());
    let mut refining = Tally::default();
    let mut above = 0;
    for index in 0..swing::SAMPLES {
        let counts = swing::counts(index);
        let mut bytes = heapless::Vec::<u8, 16>::new();
        encoder.encode(index, counts, &mut bytes);
        let mut sample = None;
        decoding.add(counter.count(|| {
            for byte in black_box(&bytes) {
                sample = black_box(decoder.decode(*byte));
            }
        }));
        let sample = sample.expect("an encoded sample");
        let count = counter.count(|| device.sample(black_box(sample.counts)));
        all.add(count);
        above += u32::from(count > EVERYDAY);
        let found = sent(&mut device);
        if device.is_refining() {
            refining.add(counter.count(|| device.work()));
        }
        match found {
            None => quiet.add(count),
            Some(Event::Window(_)) => window.add(count),
            Some(_) => other.add(count),
        }
    }
    assert!(window.goes > 0, "windows are closed");
    // Its start, the release and what was refined.
    let mut logging = Tally::default();
    (0..3).for_each(|_| logging.add(counter.count(|| device.work())));
    hprintln!("sample_decoding_mean {}", decoding.mean());
    hprintln!("sample_mean {}", all.mean());
    hprintln!("sample_above_everyday {}", above);
    hprintln!("sample_window_most {}", window.most);
    hprintln!("sample_crossing_most {}", quiet.most);
    hprintln!("sample_other_most {}", other.most);
    hprintln!("refined {}", refining.total);
    hprintln!("refined_piece_most {}", refining.most);
    hprintln!("refined_pieces {}", refining.goes);
    hprintln!("log_entry_most {}", logging.most);
}

/// The last event the device has sent since it was asked before.
fn sent(device: &mut Device<&'static mut flash::Flash, false>) -> Option<Event> {
    let mut decoder = FrameDecoder::new();
    let mut last = None;
    while let Some(byte) = device.transmit() {
        if let Some(Ok(frame)) = decoder.push(byte) {
            last = frame.message::<Event>().and_then(Result::ok).or(last);
        }
    }
    last
}
