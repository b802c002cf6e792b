//! The supply below which the chip holds itself in reset. As it comes it runs down to 1.8 V, and words of the
//! flash that are programmed at less than 2.7 V are not what they should be: it is set to 2.7 V, once, in the
//! option bytes, which stay (RM0390, 3.6.4 and 3.8.6). It holds from the next reset on.

pub const KEYS: [u32; 2] = [0x0819_2a3b, 0x4c5d_6e7f];
/// What RM0390 calls OPTCR, as bits. The level is the highest where both of its bits are clear.
pub const LOCK: u32 = 1 << 0;
pub const START: u32 = 1 << 1;
pub const LEVEL: u32 = 0b11 << 2;

/// The option bytes' registers.
pub trait Options {
    fn control(&self) -> u32;
    fn set_control(&mut self, value: u32);
    fn unlock(&mut self, key: u32);
    fn is_busy(&self) -> bool;
}

/// Sets the level where it is another.
pub fn set(options: &mut impl Options) {
    let control = options.control();
    if control & LEVEL == 0 {
        return;
    }
    while options.is_busy() {}
    KEYS.into_iter().for_each(|key| options.unlock(key));
    let control = control & !(LEVEL | LOCK | START);
    options.set_control(control);
    options.set_control(control | START);
    while options.is_busy() {}
    options.set_control(control | LOCK);
}
