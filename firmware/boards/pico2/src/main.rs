//! The yawrig device on Raspberry Pi's Pico 2: the potentiometer's wiper at GP26, the host at the USB plug.
//!
//! The LED is on while the model is held, blinks fast while it rings, and now and then while the device waits.
#![no_std]
#![no_main]

mod flash;
mod reset;
mod rom;
mod sampling;
mod serial_number;
mod timing;

// Carries the log to the debug plug.
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr::{addr_of, addr_of_mut};
use cortex_m_rt::{entry, exception, ExceptionFrame};
#[cfg(feature = "log")]
use defmt_rtt as _;
use embedded_hal::digital::OutputPin;
use flash::Slots;
use reset::cause;
use rom::BootRom;
use rp235x_hal::block::ImageDef;
use rp235x_hal::clocks::init_clocks_and_plls;
use rp235x_hal::fugit::ExtU32;
use rp235x_hal::otp::read_ecc_word;
use rp235x_hal::usb::UsbBus;
use rp235x_hal::{pac, Adc, Clock, Sio, Timer, Watchdog};
use sampling::Sampling;
use usb_device::bus::UsbBusAllocator;
use usb_device::device::{StringDescriptors, UsbDeviceBuilder, UsbDeviceState, UsbVidPid};
use usb_device::LangID;
use usbd_serial::{SerialPort, USB_CLASS_CDC};
use yawrig_firmware::crash::Note;
use yawrig_firmware::device::Device;
use yawrig_firmware::memory::Memory;
use yawrig_firmware::serial::{receive, send};
use yawrig_shared::wire::Start;

/// Tells the boot ROM that this is a program.
#[link_section = ".start_block"]
#[used]
static IMAGE: ImageDef = ImageDef::secure_exe();

/// The board's crystal.
const CRYSTAL_HZ: u32 = 12_000_000;
/// It keeps to 30 ppm: as a standard uncertainty, over the root of three.
const CLOCK_U_PPM: f32 = 17.0;
/// Longer than a network's place takes to erase (1.6 s).
const WATCHDOG_MS: u32 = 4000;
/// Bytes of the line between two looks at the potentiometer.
const BYTES_AT_ONCE: u32 = 64;
/// Of pid.codes' neighbours at V-USB: a serial port that anyone may be.
const USB_IDS: UsbVidPid = UsbVidPid(0x16c0, 0x27dd);

/// What ended the run before; the reset leaves it as it is.
#[link_section = ".uninit.NOTE"]
static mut NOTE: MaybeUninit<Note> = MaybeUninit::uninit();

/// What the device is to remember after a reset.
#[link_section = ".uninit.MEMORY"]
static mut MEMORY: MaybeUninit<Memory> = MaybeUninit::uninit();

fn note(note: Note) {
    // SAFETY: one processor, no interrupts; plain numbers, for which any bits are a value.
    unsafe { addr_of_mut!(NOTE).cast::<Note>().write_volatile(note) };
}

#[entry]
fn main() -> ! {
    let mut chip = pac::Peripherals::take().expect("main runs once");
    // SAFETY: as above.
    let crash = unsafe { addr_of!(NOTE).cast::<Note>().read_volatile() }.read();
    note(Note::NONE);
    let reset = chip.POWMAN.chip_reset().read().bits();
    let start = Start { cause: cause(reset, chip.WATCHDOG.reason().read().bits()), crash };
    let mut watchdog = Watchdog::new(chip.WATCHDOG);
    let clocks = init_clocks_and_plls(
        CRYSTAL_HZ,
        chip.XOSC,
        chip.CLOCKS,
        chip.PLL_SYS,
        chip.PLL_USB,
        &mut chip.RESETS,
        &mut watchdog,
    )
    .expect("clocks");
    // It stands still while a debugger halts the processor, as it does after a reset.
    watchdog.start(WATCHDOG_MS.millis());
    let timer = Timer::new_timer0(chip.TIMER0, &mut chip.RESETS, &clocks);
    let sio = Sio::new(chip.SIO);
    let pins = rp235x_hal::gpio::Pins::new(
        chip.IO_BANK0,
        chip.PADS_BANK0,
        sio.gpio_bank0,
        &mut chip.RESETS,
    );
    let mut led = pins.gpio25.into_push_pull_output();
    let _wiper = rp235x_hal::adc::AdcPin::new(pins.gpio26.into_floating_input());
    let usb = UsbBusAllocator::new(UsbBus::new(
        chip.USB,
        chip.USB_DPRAM,
        clocks.usb_clock,
        true,
        &mut chip.RESETS,
    ));
    let mut line = SerialPort::new(&usb);
    let number = serial_number::digits([0, 1, 2, 3].map(|row| read_ecc_word(row).unwrap_or(0)));
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
    // SAFETY: the only one; nothing here handles an interrupt or starts the other core.
    let mut device = Device::stopped(Slots::new(unsafe { BootRom::new() }), "pico2");
    device.start();
    // SAFETY: bytes, of which any is one; read and written here alone.
    device.recall(unsafe { &*addr_of!(MEMORY).cast::<Memory>() });
    device.set_clock(CLOCK_U_PPM);
    device.set_start(start);
    let adc = Adc::new(chip.ADC, &mut chip.RESETS).free();
    chip.RESETS.reset().modify(|_, w| w.dma().clear_bit());
    while chip.RESETS.reset_done().read().dma().bit_is_clear() {}
    let mut sampling = Sampling::begin(adc, chip.DMA, timer, clocks.adc_clock.freq().to_Hz());
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
        if sampling.take(&mut device) {
            watchdog.feed();
        }
        if let Some(memory) = device.memory() {
            // SAFETY: as above.
            unsafe { addr_of_mut!(MEMORY).cast::<Memory>().write_volatile(memory) };
        }
        let _ = led.set_state(device.is_lit().into());
    }
}

/// The watchdog starts the chip again at once.
fn start_again() -> ! {
    // SAFETY: nothing goes on after this.
    let watchdog = unsafe { pac::WATCHDOG::steal() };
    loop {
        watchdog.ctrl().modify(|_, w| w.trigger().set_bit());
    }
}

/// Starts again, with the networks of its flash, and says where it was.
#[panic_handler]
fn panicked(info: &PanicInfo) -> ! {
    note(info.location().map_or(Note::NONE, |place| Note::new(place.file(), place.line())));
    start_again()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    note(Note::new("", frame.pc()));
    start_again()
}
