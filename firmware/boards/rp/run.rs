//! What the boards with Raspberry Pi's processors do alike, once their clocks run.

use super::chip::{HAD_POWER_ON, HAD_RUN_LOW};
use super::hal::usb::UsbBus;
use super::hal::{pac, Adc, Watchdog};
use super::reset::cause;
use super::rom::BootRom;
use super::sampling::Sampling;
use super::{flash::Slots, serial_number};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr::{addr_of, addr_of_mut};
use cortex_m::peripheral::SYST;
use cortex_m_rt::{exception, ExceptionFrame};
use embedded_hal::digital::OutputPin;
use usb_device::bus::UsbBusAllocator;
use usb_device::device::{StringDescriptors, UsbDeviceBuilder, UsbDeviceState, UsbVidPid};
use usb_device::LangID;
use usbd_serial::{SerialPort, USB_CLASS_CDC};
use yawrig_firmware::crash::Note;
use yawrig_firmware::device::Device;
use yawrig_firmware::memory::Memory;
use yawrig_firmware::serial::{receive, send};
use yawrig_shared::wire::Start;

/// The board's crystal.
pub const CRYSTAL_HZ: u32 = 12_000_000;
/// It keeps to 30 ppm: as a standard uncertainty, over the root of three.
const CLOCK_U_PPM: f32 = 17.0;
/// Longer than a network's place takes to erase (1.6 s).
pub const WATCHDOG_MS: u32 = 4000;
/// Bytes of the line between two looks at the potentiometer.
const BYTES_AT_ONCE: u32 = 64;
/// Of pid.codes' neighbours at V-USB: a serial port that anyone may be.
const USB_IDS: UsbVidPid = UsbVidPid(0x16c0, 0x27dd);
/// PSM's WDSEL: what the watchdog resets, which is all but the two oscillators, as the HAL has it.
const ALL_BUT_OSCILLATORS: u32 = 0x0001_ffff;

/// What ended the run before; the reset leaves it as it is.
#[link_section = ".uninit.NOTE"]
static mut NOTE: MaybeUninit<Note> = MaybeUninit::uninit();

/// What the device is to remember after a reset.
#[link_section = ".uninit.MEMORY"]
static mut MEMORY: MaybeUninit<Memory> = MaybeUninit::uninit();

fn note(note: Note) {
    // SAFETY: one processor, no interrupt that has to do with it; plain numbers, for which any bits are a
    // value.
    unsafe { addr_of_mut!(NOTE).cast::<Note>().write_volatile(note) };
}

fn noted() -> Note {
    // SAFETY: as above.
    unsafe { addr_of!(NOTE).cast::<Note>().read_volatile() }
}

/// How the program began, from the registers that say so, and from its note, which is used up; and how many starts
/// in a row nobody asked for.
pub fn begun(chip_reset: u32, watchdog_reason: u32) -> (Start, u8) {
    let had = |bits| chip_reset & bits != 0;
    let cause = cause(had(HAD_POWER_ON), had(HAD_RUN_LOW), watchdog_reason);
    let (start, restarts, running) = noted().begin(cause);
    note(running);
    (start, restarts)
}

/// What is to be said of the board, and what it has; GP26 is an analogue input.
pub struct Board<L> {
    pub name: &'static str,
    pub number: u64,
    /// How it began, and how many starts in a row nobody asked for.
    pub start: (Start, u8),
    pub rom: BootRom,
    pub usb: UsbBusAllocator<UsbBus>,
    pub watchdog: Watchdog,
    pub led: L,
    pub adc: Adc,
    pub dma: pac::DMA,
    pub resets: pac::RESETS,
    pub tick: SYST,
    pub adc_hz: u32,
    pub processor_hz: u32,
}

pub fn run(board: Board<impl OutputPin>) -> ! {
    let Board { name, start, rom, usb, watchdog, mut led, dma, resets, .. } = board;
    let mut line = SerialPort::new(&usb);
    let number = serial_number::digits(board.number);
    let names = StringDescriptors::new(LangID::EN)
        .manufacturer("yawrig")
        .product("yawrig")
        .serial_number(core::str::from_utf8(&number).expect("digits"));
    let mut usb = UsbDeviceBuilder::new(&usb, USB_IDS)
        .strings(&[names])
        .expect("room for its names")
        .max_packet_size_0(64)
        .expect("one of the sizes")
        .device_class(USB_CLASS_CDC)
        .build();
    let mut device = Device::stopped(Slots::new(rom), name);
    device.set_commit(option_env!("YAWRIG_COMMIT").unwrap_or_default());
    device.set_start(start.0, start.1);
    device.start();
    if !device.is_safe() {
        // SAFETY: bytes, of which any is one; read and written here alone.
        device.recall(unsafe { &*addr_of!(MEMORY).cast::<Memory>() });
    }
    device.set_clock(CLOCK_U_PPM);
    resets.reset().modify(|_, w| w.dma().clear_bit());
    while resets.reset_done().read().dma().bit_is_clear() {}
    let mut sampling =
        Sampling::begin(board.adc.free(), dma, board.adc_hz, board.tick, board.processor_hz);
    loop {
        usb.poll(&mut [&mut line]);
        if usb.state() == UsbDeviceState::Configured {
            for _ in 0..BYTES_AT_ONCE {
                if !receive(&mut line, &mut device) {
                    break;
                }
            }
            for _ in 0..BYTES_AT_ONCE {
                if !send(&mut line, &mut device) {
                    break;
                }
            }
        }
        if sampling.take(&mut device) || device.is_safe() {
            watchdog.feed();
        }
        if device.has_recovered() {
            note(Note::NONE);
        }
        if let Some(memory) = device.memory() {
            // SAFETY: as above.
            unsafe { addr_of_mut!(MEMORY).cast::<Memory>().write_volatile(memory) };
        }
        let _ = led.set_state(device.is_lit().into());
    }
}

/// The watchdog starts the chip again at once, however early it is asked to.
fn start_again() -> ! {
    // SAFETY: nothing goes on after this.
    let (watchdog, power) = unsafe { (pac::WATCHDOG::steal(), pac::PSM::steal()) };
    // SAFETY: a bit for each part.
    power
        .wdsel()
        .write(|w| unsafe { w.bits(ALL_BUT_OSCILLATORS).xosc().clear_bit().rosc().clear_bit() });
    loop {
        watchdog.ctrl().modify(|_, w| w.trigger().set_bit());
    }
}

/// Starts again, with the networks of its flash, and says where it was.
#[panic_handler]
fn panicked(info: &PanicInfo) -> ! {
    let (file, line) = info.location().map_or(("", 0), |place| (place.file(), place.line()));
    note(noted().crashed(file, line));
    start_again()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    note(noted().crashed("", frame.pc()));
    start_again()
}
