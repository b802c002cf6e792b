//! Readings on their way from an interrupt, which takes them on time, to the program, which writes flash,
//! talks and refines, and may be away for as long as the queue holds.
//!
//! ```
//! use yawrig_firmware::{device::Device, input::Input, queue::Queue, sensors::absolute::Absolute, slots::MemoryFlash};
//!
//! let mut queue = Queue::<u32, 1024>::new(); // a second of an encoder's that is read a thousand times a second
//! let (mut readings, mut waiting) = queue.split(); // the first is the interrupt's
//! let mut input = Input::new(Absolute::new(14, 1000, 0));
//! let mut device = Device::new(MemoryFlash::new(), "my board");
//! device.set_sensor(&input.about());
//!
//! readings.put(Some(8000)); // in the interrupt
//! readings.put(None); // the bus did not answer
//! waiting.give(&mut input, &mut device); // in the program's loop
//! assert_eq!(device.samples(), 2);
//! ```

use crate::device::Device;
use crate::input::Input;
use crate::sensor::Sensor;
use embedded_storage::nor_flash::NorFlash;
use heapless::spsc;

/// A reading, or that it was lost, and how many before it found no room.
type Entry<R> = (u32, Option<R>);

/// Room for one reading less than `N`.
pub struct Queue<R, const N: usize>(spsc::Queue<Entry<R>, N>);

impl<R, const N: usize> Default for Queue<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R, const N: usize> Queue<R, N> {
    /// An empty one.
    pub const fn new() -> Self {
        Self(spsc::Queue::new())
    }

    /// The interrupt's end and the program's.
    pub fn split(&mut self) -> (Readings<'_, R>, Waiting<'_, R>) {
        let (producer, consumer) = self.0.split();
        (Readings { queue: producer, without_room: 0 }, Waiting { queue: consumer })
    }
}

/// Where an interrupt puts readings.
pub struct Readings<'a, R> {
    queue: spsc::Producer<'a, Entry<R>>,
    without_room: u32,
}

impl<R> Readings<'_, R> {
    /// The next one; none: the sensor did not answer. What finds no room is counted, and comes before the
    /// next that does.
    pub fn put(&mut self, raw: Option<R>) {
        match self.queue.enqueue((self.without_room, raw)) {
            Ok(()) => self.without_room = 0,
            Err(_) => self.without_room = self.without_room.saturating_add(1),
        }
    }
}

/// Where the program takes them.
pub struct Waiting<'a, R> {
    queue: spsc::Consumer<'a, Entry<R>>,
}

impl<R> Waiting<'_, R> {
    /// Gives the device all that wait; whether one did.
    pub fn give<S, F, const LOCKABLE: bool>(
        &mut self,
        input: &mut Input<S>,
        device: &mut Device<F, LOCKABLE>,
    ) -> bool
    where
        S: Sensor<Raw = R>,
        F: NorFlash,
    {
        let mut came = false;
        while let Some((without_room, raw)) = self.queue.dequeue() {
            (0..without_room).for_each(|_| input.take(None, device));
            input.take(raw, device);
            came = true;
        }
        came
    }
}
