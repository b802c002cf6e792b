//! The yawrig device on ST's NUCLEO-F446RE: the potentiometer's wiper at A0, the host at the ST-Link's serial
//! port.
//!
//! The LED (LD2) is on while the model is held, blinks fast while it rings, and now and then while the device
//! waits. It needs the 8 MHz that the ST-Link gives (the board's default): the processor's own clock is off
//! by up to 1 %, and so would every natural frequency be. Without them the watchdog starts it again and
//! again, the LED dark.
#![no_std]
#![no_main]

mod brown_out;
mod flash;
mod link;
mod registers;
mod reset;
mod sampling;

// Carries the log to the debug plug.
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr::{addr_of, addr_of_mut};
use cortex_m::peripheral::SCB;
use cortex_m_rt::{entry, exception, ExceptionFrame};
#[cfg(feature = "log")]
use defmt_rtt as _;
use flash::Slots;
use link::Link;
use registers::Registers;
use reset::cause;
use sampling::Sampling;
use stm32f4xx_hal::pac::Peripherals;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::watchdog::IndependentWatchdog;
use yawrig_firmware::crash::Note;
use yawrig_firmware::device::Device;
use yawrig_firmware::memory::Memory;
use yawrig_firmware::serial::{receive, send};

/// Longer than a sector takes to erase (1.1 s), even where the watchdog's own clock is fast by half.
const WATCHDOG_MS: u32 = 4000;
/// The ST-Link's 8 MHz come from a crystal that keeps to 50 ppm: as a standard uncertainty, over the root of
/// three.
const CLOCK_U_PPM: f32 = 29.0;
/// RCC_CSR, RM0390, 6.3.21: forgets the causes of resets.
const CSR_CLEAR: u32 = 1 << 24;
/// Bytes of the line between two looks at the potentiometer.
const BYTES_AT_ONCE: u32 = 64;

/// What ended the run before; the reset leaves it as it is.
#[link_section = ".uninit.NOTE"]
static mut NOTE: MaybeUninit<Note> = MaybeUninit::uninit();

/// What the device is to remember after a reset.
#[link_section = ".uninit.MEMORY"]
static mut MEMORY: MaybeUninit<Memory> = MaybeUninit::uninit();

fn note(note: Note) {
    // SAFETY: one processor, whose interrupt has nothing to do with it; plain numbers, for which any bits are
    // a value.
    unsafe { addr_of_mut!(NOTE).cast::<Note>().write_volatile(note) };
}

fn noted() -> Note {
    // SAFETY: as above.
    unsafe { addr_of!(NOTE).cast::<Note>().read_volatile() }
}

#[entry]
fn main() -> ! {
    let peripherals = Peripherals::take().expect("main runs once");
    let (start, restarts, running) = noted().begin(cause(peripherals.RCC.csr().read().bits()));
    note(running);
    // SAFETY: the bit that makes the next reset's cause readable.
    peripherals.RCC.csr().modify(|r, w| unsafe { w.bits(r.bits() | CSR_CLEAR) });
    let mut watchdog = IndependentWatchdog::new(peripherals.IWDG);
    // Else a debugger that halts the processor would see it start again.
    watchdog.stop_on_debug(&peripherals.DBGMCU, true);
    watchdog.start(WATCHDOG_MS.millis());
    let clock = Config::hse(8.MHz()).bypass_hse_oscillator().sysclk(84.MHz()).pclk1(42.MHz());
    let mut rcc = peripherals.RCC.freeze(clock);
    let pins = peripherals.GPIOA.split(&mut rcc);
    let mut led = pins.pa5.into_push_pull_output();
    let _wiper = pins.pa0.into_analog();
    let mut link =
        Link::begin(peripherals.USART2, (pins.pa2, pins.pa3), peripherals.DMA1, &mut rcc);
    let mut registers = Registers::new(peripherals.FLASH);
    brown_out::set(&mut registers);
    let mut device = Device::stopped(Slots::new(registers), "nucleo-f446re");
    device.set_commit(option_env!("YAWRIG_COMMIT").unwrap_or_default());
    device.set_start(start, restarts);
    device.start();
    if !device.is_safe() {
        // SAFETY: bytes, of which any is one; read and written here alone.
        device.recall(unsafe { &*addr_of!(MEMORY).cast::<Memory>() });
    }
    device.set_clock(CLOCK_U_PPM);
    let mut sampling = Sampling::begin(
        peripherals.ADC1,
        peripherals.ADC_COMMON,
        peripherals.DMA2,
        peripherals.TIM2,
        peripherals.TIM5,
        cortex_m::Peripherals::take().expect("main runs once"),
        &mut rcc,
    );
    loop {
        for _ in 0..BYTES_AT_ONCE {
            if !receive(&mut link, &mut device) {
                break;
            }
        }
        send(&mut link, &mut device);
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
        led.set_state(device.is_lit().into());
    }
}

/// Starts again, with the networks of its flash, and says where it was.
#[panic_handler]
fn panicked(info: &PanicInfo) -> ! {
    let (file, line) = info.location().map_or(("", 0), |place| (place.file(), place.line()));
    note(noted().crashed(file, line));
    SCB::sys_reset()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    note(noted().crashed("", frame.pc()));
    SCB::sys_reset()
}
