//! An AS5600 at GP4 and GP5 (I2C0), a display with an SSD1306 at GP6 and GP7 (I2C1); the network is the one
//! compiled in.
#![no_std]
#![no_main]
mod shown;
use core::fmt::Write;
use embassy_executor::{main, task, InterruptExecutor, Spawner};
use embassy_rp::i2c::{Async, Config, I2c, InterruptHandler};
use embassy_rp::{bind_interrupts, interrupt, interrupt::InterruptExt, peripherals::I2C0};
use embassy_time::{Duration, Ticker, Timer};
use panic_halt as _;
use ssd1306::{mode::DisplayConfig, prelude::*, I2CDisplayInterface, Ssd1306};
use static_cell::StaticCell;
use yawrig_firmware::queue::{Queue, Readings};
use yawrig_firmware::sensors::as5600::{As5600, Filter, ADDRESS, ASKED};
use yawrig_firmware::{device::Device, input::Input, slots::MemoryFlash};

bind_interrupts!(struct Interrupts { I2C0_IRQ => InterruptHandler<I2C0>; });
static SAMPLER: InterruptExecutor = InterruptExecutor::new();
static QUEUE: StaticCell<Queue<[u8; 3], 1024>> = StaticCell::new();
static DEVICE: StaticCell<Device<MemoryFlash>> = StaticCell::new();

#[embassy_rp::interrupt]
unsafe fn SWI_IRQ_0() {
    SAMPLER.on_interrupt();
}

#[task]
async fn sample(mut bus: I2c<'static, I2C0, Async>, mut readings: Readings<'static, [u8; 3]>) {
    let (mut tick, mut raw) = (Ticker::every(Duration::from_millis(1)), [0; 3]);
    loop {
        tick.next().await;
        let read = bus.write_read_async(ADDRESS, ASKED, &mut raw).await;
        readings.put(read.ok().map(|()| raw));
    }
}

#[main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(Default::default());
    let bus = I2c::new_async(chip.I2C0, chip.PIN_5, chip.PIN_4, Interrupts, Config::default());
    let wires = I2c::new_blocking(chip.I2C1, chip.PIN_7, chip.PIN_6, Config::default());
    let wires = I2CDisplayInterface::new(wires);
    let display = Ssd1306::new(wires, DisplaySize128x64, DisplayRotation::Rotate0);
    let mut display = display.into_terminal_mode();
    let _ = display.init();
    let mut input = Input::new(As5600::new(1000, Filter::default()));
    let device = DEVICE.init(Device::new(MemoryFlash::new(), "pico2, embassy"));
    device.set_sensor(&input.about());
    let (readings, mut waiting) = QUEUE.init(Queue::new()).split();
    interrupt::SWI_IRQ_0.set_priority(interrupt::Priority::P2);
    SAMPLER.start(interrupt::SWI_IRQ_0).spawn(sample(bus, readings).expect("the only one"));
    loop {
        waiting.give(&mut input, device);
        for text in device.events().filter_map(|event| shown::text(&event)) {
            let _ = (display.clear(), display.write_str(&text));
        }
        Timer::after_millis(5).await;
    }
}
