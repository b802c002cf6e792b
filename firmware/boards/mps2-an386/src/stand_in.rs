//! Stands in for the device.

pub struct Device {
    samples: u32,
    lost: u32,
    sum: u32,
    out: [u8; 32],
    len: usize,
    sent: usize,
}

impl Device {
    pub fn new() -> Self {
        Self { samples: 0, lost: 0, sum: 0, out: [0; 32], len: 0, sent: 0 }
    }
    pub fn sample(&mut self, counts: u16) {
        self.samples += 1;
        self.sum = self.sum.wrapping_mul(31).wrapping_add(u32::from(counts));
    }
    pub fn lost(&mut self, n: u32) {
        self.lost = self.lost.wrapping_add(n);
    }
    pub fn receive(&mut self, byte: u8) {
        if byte == b'!' {
            panic!("asked to");
        }
        self.len = 0;
        self.sent = 0;
        self.push(byte);
        for v in [self.samples, self.lost, self.sum] {
            for k in (0..8).rev() {
                self.push(b"0123456789abcdef"[(v >> (4 * k)) as usize & 15]);
            }
            self.push(b' ');
        }
        self.push(b'\n');
    }
    fn push(&mut self, b: u8) {
        self.out[self.len] = b;
        self.len += 1;
    }
    pub fn transmit(&mut self) -> Option<u8> {
        if self.sent < self.len {
            self.sent += 1;
            Some(self.out[self.sent - 1])
        } else {
            None
        }
    }
}
