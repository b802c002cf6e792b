//! The yawrig device on Raspberry Pi's Pico: the potentiometer's wiper at GP26, the host at the USB plug.
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
mod unique_id;

use cortex_m_rt::entry;
// Carries the log to the debug plug.
#[cfg(feature = "log")]
use defmt_rtt as _;
use hal::clocks::init_clocks_and_plls;
use hal::fugit::ExtU32;
use hal::pac::TIMER;
use hal::usb::UsbBus;
use hal::{pac, Adc, Clock, Sio, Timer, Watchdog};
use rom::BootRom;
use rp2040_hal as hal;
use run::{begun, run, Board, CRYSTAL_HZ, WATCHDOG_MS};
use usb_device::bus::UsbBusAllocator;

/// The second stage of the boot, for flash as the board has it.
#[link_section = ".boot2"]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_W25Q080;

/// Where the second stage of the boot is, which sets up reading; called in RAM it returns (RP2040 datasheet,
/// 2.8.1.3).
const SETUP: usize = 0x1000_0000;

#[entry]
fn main() -> ! {
    let mut chip = pac::Peripherals::take().expect("main runs once");
    let core = cortex_m::Peripherals::take().expect("main runs once");
    let reset = chip.VREG_AND_CHIP_RESET.chip_reset().read().bits();
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
    Timer::new(chip.TIMER, &mut chip.RESETS, &clocks);
    // Before USB, whose way around RP2040-E5 (no connection on a busy bus, up to revision B1) takes GP15.
    let sio = Sio::new(chip.SIO);
    let pins =
        hal::gpio::Pins::new(chip.IO_BANK0, chip.PADS_BANK0, sio.gpio_bank0, &mut chip.RESETS);
    let _wiper = hal::adc::AdcPin::new(pins.gpio26.into_floating_input());
    let usb = UsbBus::new(
        chip.USBCTRL_REGS,
        chip.USBCTRL_DPRAM,
        clocks.usb_clock,
        true,
        &mut chip.RESETS,
    );
    // SAFETY: the only one; nothing here starts the other core.
    let mut rom = unsafe { BootRom::new() };
    run(Board {
        name: "pico",
        number: unique_id::read(&mut rom),
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
