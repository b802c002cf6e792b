//! The image that goes on ST's NUCLEO-F446RE, unmodified, executed: `tests/nucleo/machine.py` is the microcontroller. Beside
//! it the same firmware in this process, given the same bytes and readings: what both send must be the same, bit for bit.

mod accuracy;

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{
    encode, encode_raw, rig_id, Cause, Condition, Decoder, Event, HelloReply, Phase, Reply,
    Request, Settings, SlotState, Start, Status, CHUNK, HELLO_KEY,
};

const BOARD: &str = "nucleo-f446re";
/// What its image says of its clock.
const CLOCK_U_PPM: f32 = 29.0;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a folder above").to_owned()
}

/// The microcontroller with the image in it.
struct Machine {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
}

impl Machine {
    fn start() -> Self {
        let image = Command::new(root().join("firmware/boards/build")).arg(BOARD).output();
        let image = image.expect("the build script");
        assert!(image.status.success(), "{}", String::from_utf8_lossy(&image.stderr));
        let image = String::from_utf8(image.stdout).expect("a path");
        let python = root().join("target/nucleo/bin/python");
        assert!(python.exists(), "{} is not there: run tests/nucleo/install", python.display());
        let mut child = Command::new(python)
            .arg(root().join("tests/nucleo/machine.py"))
            .arg(image.trim())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("python");
        let stdin = child.stdin.take().expect("a pipe");
        let stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        Self { child, stdin, stdout }
    }

    fn ask(&mut self, command: &str) -> String {
        writeln!(self.stdin, "{command}").expect("it runs");
        let mut answer = String::new();
        self.stdout.read_line(&mut answer).expect("an answer");
        assert!(!answer.is_empty(), "the machine ended; its message stands above");
        answer.trim().to_owned()
    }

    /// What it sends, and what reset it by then.
    fn run(&mut self, command: &str) -> (Vec<u8>, Option<String>) {
        let answer = self.ask(command);
        let (sent, reset) = match answer.split_once(" reset ") {
            Some((sent, by)) => (sent, Some(by.to_owned())),
            None => (answer.as_str(), None),
        };
        let sent = sent.strip_prefix("sent").expect("what was sent").trim();
        (data_encoding::HEXLOWER.decode(sent.as_bytes()).expect("hexadecimal"), reset)
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The board and the firmware in this process, side by side.
struct Both {
    machine: Machine,
    here: Device<MemoryFlash>,
    sequence: u16,
    decoder: Decoder,
    events: Vec<Event>,
}

fn device(flash: MemoryFlash, cause: Cause) -> Device<MemoryFlash> {
    let mut device = Device::new(flash, BOARD);
    device.set_clock(CLOCK_U_PPM);
    device.set_start(Start { cause, crash: None });
    device
}

/// Conversions of a sample.
const CONVERSIONS: usize = 16;

/// The converter's 12 bits of each of a sample's conversions, which are not all the same.
fn converted(reading: u16) -> impl Iterator<Item = u16> {
    (0..CONVERSIONS as u16).map(move |k| reading.saturating_add(k % 3).saturating_sub(1).min(4095))
}

impl Both {
    fn start() -> Self {
        let machine = Machine::start();
        let here = device(MemoryFlash::new(), Cause::Power);
        let mut both =
            Self { machine, here, sequence: 0, decoder: Decoder::new(), events: Vec::new() };
        // It boots, and has nothing to say.
        assert_eq!(both.machine.run("run"), (Vec::new(), None));
        both
    }

    /// Bytes of the line, then conversions, sixteen a sample; what is sent, which is the same.
    fn give(&mut self, bytes: &[u8], conversions: &[u16]) -> Vec<u8> {
        if !bytes.is_empty() {
            self.machine.ask(&format!("line {}", data_encoding::HEXLOWER.encode(bytes)));
        }
        if !conversions.is_empty() {
            let text: String = conversions.iter().map(|c| format!("{c:04x}")).collect();
            self.machine.ask(&format!("samples {text}"));
        }
        let (there, reset) = self.machine.run("run");
        assert_eq!(reset, None);
        let mut here = Vec::new();
        let mut listen = |device: &mut Device<MemoryFlash>| {
            here.extend(std::iter::from_fn(|| device.transmit()));
        };
        bytes.iter().for_each(|byte| self.here.receive(*byte));
        listen(&mut self.here);
        for sample in conversions.chunks_exact(CONVERSIONS) {
            self.here.sample(sample.iter().sum());
            self.here.work();
            listen(&mut self.here);
        }
        assert_eq!(there, here, "after {} conversions", conversions.len());
        there
    }

    /// Takes the events of what was sent; the reply, if there is one.
    fn understood(&mut self, sent: &[u8]) -> Option<Reply> {
        let mut reply = None;
        for byte in sent {
            let Some(frame) = self.decoder.push(*byte) else { continue };
            let frame = frame.expect("a whole frame");
            match (frame.message::<Reply>(), frame.message::<Event>()) {
                (Some(found), _) => reply = Some(found.expect("a reply")),
                (_, Some(event)) => self.events.push(event.expect("an event")),
                _ => {}
            }
        }
        reply
    }

    fn ask_while(&mut self, request: &Request, readings: &[u16]) -> Reply {
        self.sequence += 1;
        let frame = encode(self.sequence, request).expect("a frame");
        let conversions: Vec<u16> =
            readings.iter().flat_map(|reading| converted(*reading)).collect();
        let sent = self.give(&frame, &conversions);
        self.understood(&sent).unwrap_or_else(|| panic!("no answer to {request:?}"))
    }

    fn ask(&mut self, request: &Request) -> Reply {
        self.ask_while(request, &[])
    }

    fn status(&mut self) -> Status {
        match self.ask(&Request::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    fn play(&mut self, readings: &[u16]) {
        let conversions: Vec<u16> =
            readings.iter().flat_map(|reading| converted(*reading)).collect();
        self.convert(&conversions);
    }

    /// Whole samples' conversions, one by one.
    fn convert(&mut self, conversions: &[u16]) {
        let whole = conversions.len() / CONVERSIONS * CONVERSIONS;
        for some in conversions[..whole].chunks(1000 * CONVERSIONS) {
            let sent = self.give(&[], some);
            self.understood(&sent);
        }
    }

    /// Off and on again.
    fn power_cycle(&mut self) {
        assert_eq!(self.machine.ask("reset"), "ok");
        assert_eq!(self.machine.run("run"), (Vec::new(), None));
        let flash = std::mem::replace(&mut self.here, device(MemoryFlash::new(), Cause::Power))
            .into_flash();
        self.here = device(flash, Cause::Power);
        self.decoder = Decoder::new();
    }

    /// All that either keeps.
    fn flashes_agree(&mut self) {
        let flash = std::mem::replace(&mut self.here, device(MemoryFlash::new(), Cause::Power))
            .into_flash();
        let here = data_encoding::HEXLOWER.encode(flash.bytes());
        self.here = device(flash, Cause::Power);
        let there = self.machine.ask("flash");
        let there = there.strip_prefix("flash ").expect("its bytes");
        assert!(there == here, "the flashes differ");
    }
}

/// A release as a converter of 12 bits over 340 deg reads it: held for two seconds at 14 deg, let go.
fn release(wn: f64, zeta: f64, seconds: f64) -> Vec<u16> {
    let wd = wn * (1.0 - zeta * zeta).sqrt();
    // Noise of about a step, the same in every run.
    let mut state = 12_345_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 23) - 1.0
    };
    let reading = |k: u32| {
        let t = f64::from(k.saturating_sub(2000)) * 1e-3;
        let yaw_deg = 14.0 * (-zeta * wn * t).exp() * (wd * t).cos();
        (2048.0 + yaw_deg / (340.0 / 4096.0) + noise()).round().clamp(0.0, 4095.0) as u16
    };
    (0..(seconds * 1e3) as u32).map(reading).collect()
}

fn condition(speed_m_s: f64) -> Request {
    Request::Condition(Condition {
        rig: rig_id("K3", "mid"),
        wind: Wind { density_kg_m3: 1.2, speed_m_s },
        model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
        inertia_kg_m2: 0.101,
    })
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn it_boots_samples_a_campaign_s_releases_and_gives_the_emulated_device_s_bits() {
    let mut both = Both::start();
    let state = both.machine.ask("state");
    // TIM2's registers give sixteen conversions a millisecond of the clock that RCC's give; the line's rate is off by less than UART's 2 %.
    assert!(state.contains(" rate_hz=16000.0 ") && state.contains(" latency=2"), "{state}");
    let baud = state.split("baud=").nth(1).and_then(|text| text.split(' ').next());
    let baud: f64 = baud.expect("a rate").parse().expect("a number");
    assert!((baud / 115_200.0 - 1.0).abs() < 0.005, "{state}");

    let hello = both.give(&encode_raw(HELLO_KEY, 1, &[]).expect("a frame"), &[]);
    let mut decoder = Decoder::new();
    let body = hello.iter().find_map(|byte| {
        let frame = decoder.push(*byte)?.expect("a frame");
        (frame.key == HELLO_KEY).then(|| HelloReply::read(frame.body).expect("a hello"))
    });
    assert_eq!(body.expect("a hello").board, HelloReply::text(BOARD));
    let settings = Settings { degrees_per_count: 340.0 / 65_536.0, ..Settings::default() };
    assert_eq!(both.ask(&Request::Configure(settings)), Reply::Done);
    assert_eq!(both.status().settings, settings);

    for (speed_m_s, wn, zeta) in [(0.0, 12.0, 0.03), (10.0, 11.0, 0.04)] {
        assert_eq!(both.ask(&condition(speed_m_s)), Reply::Done);
        both.play(&release(wn, zeta, 12.0));
    }
    let refined: Vec<_> = both
        .events
        .iter()
        .filter_map(|event| match event {
            Event::Refined(refined) => Some(*refined),
            _ => None,
        })
        .collect();
    let windows = both.events.iter().filter(|event| matches!(event, Event::Window(_))).count();
    let held = |event: &Event| matches!(event, Event::Phase { phase: Phase::Held, .. });
    println!("{} events, {windows} windows, refined {refined:?}", both.events.len());
    assert!(windows >= 6 && both.events.iter().any(held), "{:?}", both.events);
    assert_eq!(refined.len(), 2, "{:?}", both.events);
    for (refined, wn) in refined.iter().zip([12.0, 11.0]) {
        assert!((refined.natural_frequency_rad_s.value / wn - 1.0).abs() < 2e-3, "{refined:?}");
    }
    assert!(refined[1].derivatives.is_some(), "{refined:?}");
    let status = both.status();
    assert_eq!((status.lost_samples, status.lost_events, status.lost_bytes), (0, 0, 0));
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn a_network_is_written_verified_committed_and_kept_while_it_samples() {
    let mut both = Both::start();
    let still = [2048_u16; 400];
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, 7).expect("a blob");
    // An erase takes 250 ms: the readings of that time are taken up after it, and none is lost.
    let begin = Request::FlashBegin { length: bytes.len() as u32 };
    assert_eq!(both.ask_while(&begin, &still), Reply::Done);
    for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
        let chunk = Request::FlashChunk {
            offset: (index * CHUNK) as u32,
            bytes: chunk.iter().copied().collect(),
        };
        assert_eq!(both.ask_while(&chunk, &still[..20]), Reply::Done);
    }
    assert_eq!(both.ask_while(&Request::FlashTrial, &still), Reply::Done);
    assert!(both.status().network.on_trial);
    assert_eq!(both.ask_while(&Request::FlashCommit, &still), Reply::Done);
    let status = both.status();
    assert_eq!((status.network.generation, status.network.on_trial), (7, false));
    assert_eq!((status.lost_samples, status.lost_bytes), (0, 0));
    both.power_cycle();
    let again = both.status();
    assert_eq!((again.network.generation, again.network.id), (7, status.network.id));
    assert!(again.slots.iter().any(|s| matches!(s, SlotState::Valid { generation: 7, .. })));
    // A spoilt one is refused, and the old one runs on.
    let spoilt_at = bytes.len() / 2;
    bytes[spoilt_at] ^= 1;
    assert_eq!(both.ask(&begin), Reply::Done);
    for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
        let bytes = chunk.iter().copied().collect();
        both.ask(&Request::FlashChunk { offset: (index * CHUNK) as u32, bytes });
    }
    assert!(matches!(both.ask(&Request::FlashTrial), Reply::Refused(_)));
    assert_eq!(both.status().network.generation, 7);
    // The lock: its key in a sector of its own.
    let key = *ed25519_compact::KeyPair::from_seed([7; 32].into()).pk;
    assert_eq!(both.ask(&Request::Lock { key }), Reply::Done);
    assert!(matches!(both.ask(&Request::Challenge), Reply::Challenge { .. }));
    both.power_cycle();
    assert_eq!(both.status().lock, Some(key));
    both.flashes_agree();
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn where_the_converter_stands_still_the_watchdog_starts_it_again() {
    let mut both = Both::start();
    both.play(&[2048; 1000]);
    assert_eq!(both.status().samples, 1000);
    // It answers meanwhile, and is not well all the same: 4 s, as the watchdog's registers have it.
    let (_, reset) = both.machine.run("stall 3900");
    assert_eq!(reset, None);
    both.machine.ask(&format!("samples {}", "0800".repeat(16)));
    assert_eq!(both.machine.run("run").1, None, "it was fed by a sample");
    let (_, reset) = both.machine.run("stall 3900");
    assert_eq!(reset, None);
    let (_, reset) = both.machine.run("stall 300");
    assert_eq!(reset.as_deref(), Some("watchdog"));
    both.here = device(MemoryFlash::new(), Cause::Watchdog);
    assert_eq!(both.machine.run("run"), (Vec::new(), None));
    let status = both.status();
    assert_eq!((status.samples, status.start.cause), (0, Cause::Watchdog));
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn where_the_converter_is_overrun_a_sample_is_lost_and_said_and_the_next_ones_are_right() {
    let mut both = Both::start();
    let settings = Settings { degrees_per_count: 340.0 / 65_536.0, ..Settings::default() };
    assert_eq!(both.ask(&Request::Configure(settings)), Reply::Done);
    let release = release(12.0, 0.03, 12.0);
    let (held, swing) = release.split_at(1500);
    both.play(held);
    assert_eq!(both.machine.ask("overrun"), "ok");
    both.machine.ask(&format!("samples {}", "0800".repeat(16)));
    assert_eq!(both.machine.run("run"), (Vec::new(), None));
    both.here.lost(1);
    both.play(swing);
    let windows = both.events.iter().filter(|event| matches!(event, Event::Window(_))).count();
    assert!(windows >= 3, "{:?}", both.events);
    let status = both.status();
    assert_eq!((status.samples, status.lost_samples), (1 + release.len() as u32, 1));
}

/// A status of the machine alone, which stands as it is after this.
fn start_of(both: &mut Both) -> Start {
    assert_eq!(both.machine.run("run"), (Vec::new(), None));
    let frame = encode(1, &Request::Status).expect("a frame");
    both.machine.ask(&format!("line {}", data_encoding::HEXLOWER.encode(&frame)));
    let (sent, _) = both.machine.run("run");
    let Some(Reply::Status(status)) = both.understood(&sent) else { panic!("no status") };
    status.start
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn after_a_fault_or_a_panic_it_starts_again_and_says_where_it_was() {
    let mut both = Both::start();
    let (_, reset) = both.machine.run("fault");
    assert_eq!(reset.as_deref(), Some("software"));
    let Start { cause, crash: Some(crash) } = start_of(&mut both) else { panic!("no crash") };
    // In the image's code, behind the sectors that hold networks.
    assert_eq!((cause, crash.file.as_str()), (Cause::Software, ""));
    assert!((0x0801_0000..0x0806_0000).contains(&crash.line), "{:#x}", crash.line);
    // Said once: power comes, and nothing is known of before.
    both.power_cycle();
    assert_eq!(both.status().start, Start { cause: Cause::Power, crash: None });
    // A panic of the program's own: what there is only one of has been taken already.
    let (_, reset) = both.machine.run("panic");
    assert_eq!(reset.as_deref(), Some("software"));
    let source = root().join("firmware/boards").join(BOARD).join("src/main.rs");
    let source = std::fs::read_to_string(source).expect("the program");
    let line =
        1 + source.lines().position(|line| line.contains("Peripherals::take()")).expect("it");
    let Start { cause, crash: Some(crash) } = start_of(&mut both) else { panic!("no crash") };
    assert_eq!((cause, crash.file.as_str()), (Cause::Software, "src/main.rs"));
    assert_eq!(crash.line as usize, line);
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn below_the_supply_at_which_flash_is_written_well_the_chip_holds_itself_in_reset() {
    let mut both = Both::start();
    assert_eq!(both.status().samples, 0);
    // As the option bytes come, but for the level of the brown-out reset: 2.7 V.
    let options = |both: &mut Both| {
        let state = both.machine.ask("state");
        state.split_whitespace().find_map(|pair| pair.strip_prefix("options=")).map(str::to_owned)
    };
    assert_eq!(options(&mut both).as_deref(), Some("0xfffaae1"));
    both.power_cycle();
    assert_eq!(both.status().samples, 0);
    assert_eq!(options(&mut both).as_deref(), Some("0xfffaae1"));
}
