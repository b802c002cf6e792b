//! The yawrig device on Raspberry Pi's Pico 2: the potentiometer's wiper at GP26, the host at the USB plug.
//!
//! The LED is on while the model is held, blinks fast while it rings, and now and then while the device
//! waits.
#![no_std]
#![no_main]

mod chip;
#[path = "../../rp/flash.rs"]
mod flash;
#[path = "../../rp/reset.rs"]
mod reset;
#[path = "../../rp/rom.rs"]
mod rom;
#[path = "../../rp/run.rs"]
mod run;
#[path = "../../rp/sampling.rs"]
mod sampling;
#[path = "../../rp/serial_number.rs"]
mod serial_number;
#[path = "../../rp/timing.rs"]
mod timing;

use cortex_m_rt::entry;
// Carries the log to the debug plug.
#[cfg(feature = "log")]
use defmt_rtt as _;
use hal::block::ImageDef;
use hal::clocks::init_clocks_and_plls;
use hal::fugit::ExtU32;
use hal::otp::read_ecc_word;
use hal::pac::TIMER0 as TIMER;
use hal::usb::UsbBus;
use hal::{pac, Adc, Clock, Sio, Timer, Watchdog};
use rom::BootRom;
use rp235x_hal as hal;
use run::{begun, run, Board, CRYSTAL_HZ, WATCHDOG_MS};
use usb_device::bus::UsbBusAllocator;

/// Tells the boot ROM that this is a program.
#[link_section = ".start_block"]
#[used]
static IMAGE: ImageDef = ImageDef::secure_exe();

/// CHIPID0 to CHIPID3, the first rows of the one-time programmable memory (RP2350 datasheet, 13.10), the
/// first one last.
fn number() -> u64 {
    (0..4).rev().fold(0, |number, row| number << 16 | u64::from(read_ecc_word(row).unwrap_or(0)))
}

/// Where the boot ROM leaves the function that sets up reading as it found best; to be run in RAM (RP2350
/// datasheet, 5.4.8.10).
const SETUP: usize = 0x400e_0000;

#[entry]
fn main() -> ! {
    let mut chip = pac::Peripherals::take().expect("main runs once");
    let core = cortex_m::Peripherals::take().expect("main runs once");
    let reset = chip.POWMAN.chip_reset().read().bits();
    let start = begun(reset, chip.WATCHDOG.reason().read().bits());
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
    let (adc_hz, processor_hz) =
        (clocks.adc_clock.freq().to_Hz(), clocks.system_clock.freq().to_Hz());
    // It stands still while a debugger halts the processor, as it does after a reset.
    watchdog.start(WATCHDOG_MS.millis());
    // Out of its reset; it runs from there on.
    Timer::new_timer0(chip.TIMER0, &mut chip.RESETS, &clocks);
    let sio = Sio::new(chip.SIO);
    let pins =
        hal::gpio::Pins::new(chip.IO_BANK0, chip.PADS_BANK0, sio.gpio_bank0, &mut chip.RESETS);
    let _wiper = hal::adc::AdcPin::new(pins.gpio26.into_floating_input());
    let usb = UsbBus::new(chip.USB, chip.USB_DPRAM, clocks.usb_clock, true, &mut chip.RESETS);
    // SAFETY: the only one; nothing here starts the other core.
    let rom = unsafe { BootRom::new() };
    run(Board {
        name: "pico2",
        number: number(),
        start,
        rom,
        usb: UsbBusAllocator::new(usb),
        watchdog,
        led: pins.gpio25.into_push_pull_output(),
        adc: Adc::new(chip.ADC, &mut chip.RESETS),
        dma: chip.DMA,
        resets: chip.RESETS,
        tick: core.SYST,
        adc_hz,
        processor_hz,
    })
}
