//! What is known of the converter's and the sensor's error: the [table](Table) that samples are corrected by
//! before anything else sees them.
//!
//! The host learns it and writes it; the flash keeps it ([`crate::records`]) with the board and the sensor it
//! is of, and with another of either it is not used. In memory there is one: while another is being written
//! none is used, and what does not come whole is read back from the flash.
//!
//! ```text
//! in the flash: 0 board and sensor u32   4 first u16   6 spacing u8   7 unit u8   8 knots u16   10 learned from u16   12 damping's u f32   16 a correction i8 each knot
//! ```

use crate::records::{append_table, read_table, TABLE};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::checksum::crc32_of;
use yawrig_shared::linearity::{Head, Table, KNOTS};
use yawrig_shared::wire::{self, Absent, LinearityPart, Refusal, Sensor};

/// Bytes before the corrections.
const HEAD: usize = 16;
const _: () = assert!(HEAD + KNOTS == TABLE);

/// The table of this device.
#[derive(Debug)]
pub struct Linearity {
    table: Table,
    used: bool,
    /// While one is being written: the knot that is to come.
    next: Option<u16>,
    absent: Option<Absent>,
}

impl Default for Linearity {
    fn default() -> Self {
        Self::new()
    }
}

/// A number for a board and its sensor.
pub fn identity(board: &str, sensor: &Sensor) -> u32 {
    crc32_of(&[board.as_bytes(), &[sensor.kind as u8], &sensor.rate_hz.to_le_bytes()])
}

impl Linearity {
    /// None yet.
    #[inline(always)]
    pub const fn new() -> Self {
        Self { table: Table::new(), used: false, next: None, absent: None }
    }

    /// What of a reading is the angle's; an end of the converter stays one.
    #[inline]
    pub fn corrected(&self, counts: u16, full_scale_counts: u16) -> u16 {
        if !self.used || counts == 0 || counts >= full_scale_counts {
            return counts;
        }
        self.table.corrected(counts).clamp(1, full_scale_counts.saturating_sub(1).max(1))
    }

    /// What the table's uncertainty does to a damping ratio, relative.
    pub fn damping_u(&self) -> f32 {
        if self.used {
            self.table.head().damping_u
        } else {
            0.0
        }
    }

    /// What is known, for who asks.
    pub fn known(&self) -> wire::Linearity {
        if !self.used {
            return wire::Linearity { absent: self.absent, ..wire::Linearity::default() };
        }
        let Head { knots, learned_from, .. } = *self.table.head();
        let largest_counts = self.table.largest_counts();
        wire::Linearity { knots, learned_from, largest_counts, absent: None }
    }

    /// Its part from a knot on; one without knots is all there is.
    pub fn part(&self, at: u16) -> LinearityPart {
        let mut part =
            LinearityPart { head: Head::default(), at, corrections: heapless::Vec::new() };
        if self.used {
            part.head = *self.table.head();
            let all = self.table.corrections().iter().skip(usize::from(at));
            part.corrections.extend(all.take(part.corrections.capacity()).copied());
        }
        part
    }

    /// Takes up what the flash has kept of this board and sensor.
    #[inline(never)]
    pub fn recall<F: NorFlash>(&mut self, flash: &mut F, identity: u32) {
        (self.used, self.next, self.absent) = (false, None, None);
        let mut bytes = [0; TABLE];
        match read_table(flash, &mut bytes) {
            Ok(true) => {}
            Ok(false) => return,
            Err(_) => {
                self.absent = Some(Absent::Damaged);
                return;
            }
        }
        let [i0, i1, i2, i3, a0, a1, spacing_bits, unit_bits, k0, k1, l0, l1, u0, u1, u2, u3, corrections @ ..] =
            &bytes;
        let head = Head {
            first_counts: u16::from_le_bytes([*a0, *a1]),
            spacing_bits: *spacing_bits,
            unit_bits: *unit_bits,
            knots: u16::from_le_bytes([*k0, *k1]),
            learned_from: u16::from_le_bytes([*l0, *l1]),
            damping_u: f32::from_le_bytes([*u0, *u1, *u2, *u3]),
        };
        // It was erased.
        if head.knots == 0 {
            return;
        }
        self.table.begin(&head);
        for (at, byte) in corrections.iter().take(usize::from(head.knots)).enumerate() {
            self.table.put(at, &[*byte as i8]);
        }
        let mine = u32::from_le_bytes([*i0, *i1, *i2, *i3]) == identity;
        self.used = mine && self.table.is_sound();
        if !self.used {
            self.absent = Some(if mine { Absent::Damaged } else { Absent::Sensor });
        }
    }

    /// Another part of a table; with the last one it is kept, and used.
    ///
    /// # Errors
    /// [`Refusal::Linearity`] for what is no table or comes out of order, and the flash's; then what the
    /// flash has kept is used again.
    pub fn put<F: NorFlash>(
        &mut self,
        flash: &mut F,
        identity: u32,
        part: &LinearityPart,
    ) -> Result<(), Refusal> {
        let taken = self.take(flash, identity, part);
        if taken.is_err() {
            self.recall(flash, identity);
        }
        taken
    }

    fn take<F: NorFlash>(
        &mut self,
        flash: &mut F,
        identity: u32,
        part: &LinearityPart,
    ) -> Result<(), Refusal> {
        let LinearityPart { head, at, corrections } = part;
        if *at == 0 {
            (self.used, self.next, self.absent) = (false, Some(0), Some(Absent::Unfinished));
            self.table.begin(head);
        }
        let erases = head.knots == 0;
        let follows = self.next == Some(*at) && self.table.head() == head;
        if !follows || erases != corrections.is_empty() {
            return Err(Refusal::Linearity);
        }
        if !self.table.put(usize::from(*at), corrections) {
            return Err(Refusal::Linearity);
        }
        let next = at + corrections.len() as u16;
        self.next = Some(next);
        if next < head.knots {
            return Ok(());
        }
        if !erases && !self.table.is_sound() {
            return Err(Refusal::Linearity);
        }
        self.keep(flash, identity)?;
        (self.used, self.next, self.absent) = (!erases, None, None);
        Ok(())
    }

    #[inline(never)]
    fn keep<F: NorFlash>(&self, flash: &mut F, identity: u32) -> Result<(), Refusal> {
        let mut bytes = [0; TABLE];
        let head = self.table.head();
        bytes[..4].copy_from_slice(&identity.to_le_bytes());
        bytes[4..6].copy_from_slice(&head.first_counts.to_le_bytes());
        (bytes[6], bytes[7]) = (head.spacing_bits, head.unit_bits);
        bytes[8..10].copy_from_slice(&head.knots.to_le_bytes());
        bytes[10..12].copy_from_slice(&head.learned_from.to_le_bytes());
        bytes[12..HEAD].copy_from_slice(&head.damping_u.to_le_bytes());
        for (byte, correction) in bytes[HEAD..].iter_mut().zip(self.table.corrections()) {
            *byte = *correction as u8;
        }
        append_table(flash, &bytes)
    }
}
