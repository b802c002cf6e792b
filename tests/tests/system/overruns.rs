//! Bytes that come faster than the board takes them: its receive logic over a UART that is simulated, an
//! overrun put in at every byte of an update and of a stream of samples.

use embedded_io::{ErrorKind, ErrorType, Read, ReadReady};
use std::collections::VecDeque;
use yawrig_firmware::device::Device;
use yawrig_firmware::serial::{receive, receive_sample};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::blob;
use yawrig_shared::potentiometer::{Decoder, Encoder};
use yawrig_shared::wire::{
    self, Decoder as FrameDecoder, Refusal, Reply, Request, SlotState, Status, CHUNK,
};
use yawrig_tests::networks::sound;

/// Which of two bytes the UART keeps.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Keeps {
    Old,
    New,
}

/// A UART that holds one byte.
struct Uart {
    byte: Option<u8>,
    overrun: bool,
    keeps: Keeps,
}

impl Uart {
    fn new(keeps: Keeps) -> Self {
        Self { byte: None, overrun: false, keeps }
    }

    fn come(&mut self, byte: u8) {
        if self.byte.is_some() {
            self.overrun = true;
            if self.keeps == Keeps::Old {
                return;
            }
        }
        self.byte = Some(byte);
    }
}

impl ErrorType for Uart {
    type Error = ErrorKind;
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(self.byte.is_some() || self.overrun)
    }
}

impl Read for Uart {
    fn read(&mut self, room: &mut [u8]) -> Result<usize, ErrorKind> {
        if std::mem::take(&mut self.overrun) {
            return Err(ErrorKind::Other);
        }
        room[0] = self.byte.take().expect("only where there is one");
        Ok(1)
    }
}

/// The host's end: asks, and asks again under the same number where no answer comes.
struct Host {
    device: Device<MemoryFlash>,
    uart: Uart,
    sequence: u16,
    sent: usize,
    /// The board does not look while the byte after this one comes.
    late_at: Option<usize>,
    repeated: u32,
}

impl Host {
    fn new(keeps: Keeps, late_at: Option<usize>) -> Self {
        let device = Device::new(MemoryFlash::new(), "simulated");
        Self { device, uart: Uart::new(keeps), sequence: 0, sent: 0, late_at, repeated: 0 }
    }

    fn ask(&mut self, request: &Request) -> Reply {
        self.sequence += 1;
        let frame = wire::encode(self.sequence, request).expect("a frame");
        for attempt in 0..3 {
            self.repeated += u32::from(attempt > 0);
            for &byte in &frame {
                self.uart.come(byte);
                let late = self.late_at == Some(self.sent);
                self.sent += 1;
                if !late {
                    while receive(&mut self.uart, &mut self.device) {}
                }
            }
            while receive(&mut self.uart, &mut self.device) {}
            let mut decoder = FrameDecoder::new();
            while let Some(byte) = self.device.transmit() {
                if let Some(Ok(frame)) = decoder.push(byte)
                    && let (Some(Ok(reply)), true) =
                        (frame.message(), frame.sequence == self.sequence)
                {
                    return reply;
                }
            }
        }
        panic!("no answer to {request:?}, late at {:?}", self.late_at);
    }

    fn status(&mut self) -> Status {
        match self.ask(&Request::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    fn update(&mut self, blob: &[u8]) {
        let done = |reply, late| assert_eq!(reply, Reply::Done, "late at {late:?}");
        let late = self.late_at;
        done(self.ask(&Request::FlashBegin { length: blob.len() as u32 }), late);
        for (index, chunk) in blob.chunks(CHUNK).enumerate() {
            let bytes = chunk.iter().copied().collect();
            done(self.ask(&Request::FlashChunk { offset: (CHUNK * index) as u32, bytes }), late);
        }
        done(self.ask(&Request::FlashTrial), late);
        done(self.ask(&Request::FlashCommit), late);
    }
}

#[test]
fn an_update_survives_an_overrun_at_any_of_its_bytes() {
    let mut blob = sound();
    blob::set_generation(&mut blob, 1).expect("a blob");
    let mut plain = Host::new(Keeps::New, None);
    plain.update(&blob);
    let length = plain.sent;
    let (mut tried, mut repeated, mut lost) = (0, 0, 0);
    for keeps in [Keeps::Old, Keeps::New] {
        for at in 0..length {
            let mut host = Host::new(keeps, Some(at));
            host.update(&blob);
            let status = host.status();
            let valid = SlotState::Valid { generation: 1, id: status.network.id };
            assert_eq!(status.slots[0], valid, "{keeps:?}, late at {at}");
            assert!(!status.network.on_trial);
            assert!(status.lost_bytes <= 1, "{keeps:?}, late at {at}");
            lost += status.lost_bytes;
            (tried, repeated) = (tried + 1, repeated + host.repeated);
        }
    }
    println!("{tried} updates of {length} bytes, {lost} with an overrun: all done, {repeated} requests repeated");
    // After a frame's last byte none comes for a while; a byte lost from the zeros between frames costs
    // nothing.
    assert!(lost > tried * 95 / 100 && repeated > lost * 95 / 100, "{lost} {repeated} of {tried}");
}

/// A frame that is dropped is never acted on: not even where what is left of it were another request.
#[test]
fn a_request_with_a_lost_byte_is_not_carried_out() {
    let frame = wire::encode(1, &Request::FlashBegin { length: 5000 }).expect("a frame");
    for keeps in [Keeps::Old, Keeps::New] {
        // Neither the first nor the last two, which are zeros and the checksum's end before one.
        for at in 1..frame.len() - 2 {
            let mut host = Host::new(keeps, None);
            for (n, &byte) in frame.iter().enumerate() {
                host.uart.come(byte);
                if n != at {
                    while receive(&mut host.uart, &mut host.device) {}
                }
            }
            assert_eq!(host.device.transmit(), None, "{keeps:?}, late at {at}");
            host.sequence = 1;
            let chunk = Request::FlashChunk { offset: 0, bytes: [0; 4].into_iter().collect() };
            let refused = Reply::Refused(Refusal::FlashOrder { expected_offset: 0 });
            assert_eq!(host.ask(&chunk), refused, "{keeps:?}, late at {at}");
        }
    }
}

fn counts(index: u32) -> u16 {
    let time_s = f64::from(index.saturating_sub(500)) * 1e-3;
    // Steps of all widths, so that the stream holds every form of sample.
    let jump = if index.is_multiple_of(97) { 900.0 } else { 0.0 };
    (32_768.0 + 2400.0 * (-0.2 * time_s).exp() * (20.0 * time_s).cos() + jump) as u16
}

/// Every sample that reaches the device has its place in time, and those that do not are counted.
#[test]
fn a_stream_of_samples_says_what_an_overrun_cost() {
    const SAMPLES: u32 = 1500;
    let mut stream = Vec::new();
    let mut encoder = Encoder::default();
    (0..SAMPLES).for_each(|index| encoder.encode(index, counts(index), &mut stream));
    // After the last absolute sample nothing comes that could tell of a loss.
    let end = stream.len() - 2 * 256 - 40;
    for keeps in [Keeps::Old, Keeps::New] {
        let mut most = 0;
        for at in 12..end {
            let mut uart = Uart::new(keeps);
            let mut device = Device::new(MemoryFlash::new(), "simulated");
            let mut decoder = Decoder::default();
            for (n, &byte) in stream.iter().enumerate() {
                uart.come(byte);
                if n != at {
                    while receive_sample(&mut uart, &mut decoder, &mut device) {}
                }
            }
            while receive_sample(&mut uart, &mut decoder, &mut device) {}
            assert_eq!(device.samples(), SAMPLES, "{keeps:?}, late at {at}");
            let lost = status(&mut device).lost_samples;
            // The one whose byte is missing; where that takes the next one's head for its own end, and that
            // is an absolute one, all up to the absolute one after it.
            assert!((1..=1 + 256).contains(&lost), "{keeps:?}, late at {at}: {lost} lost");
            most = most.max(lost);
        }
        println!("{keeps:?} byte kept: {} places, at most {most} samples lost", end - 12);
    }
}

fn status(device: &mut Device<MemoryFlash>) -> Status {
    for byte in wire::encode(9, &Request::Status).expect("a frame") {
        device.receive(byte);
    }
    let mut said: VecDeque<u8> = std::iter::from_fn(|| device.transmit()).collect();
    let mut decoder = FrameDecoder::new();
    while let Some(byte) = said.pop_front() {
        if let Some(Ok(frame)) = decoder.push(byte)
            && let Some(Ok(Reply::Status(status))) = frame.message()
        {
            return status;
        }
    }
    panic!("no state");
}
