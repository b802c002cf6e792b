//! What DMA has written round and round into a buffer, read after it.

/// Places before the writer that are left alone: it may come on while they are read.
pub const MARGIN: u32 = 8;

/// The reader of a ring of `N` places, `N` a power of two.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reader<const N: usize> {
    taken: u32,
}

impl<const N: usize> Reader<N> {
    pub const fn new() -> Self {
        Self { taken: 0 }
    }

    /// How many have been written, from the count of triggers and, read after it, where in the ring DMA
    /// writes next: the last may still have been on its way, or one more have come. `None` where the two do
    /// not agree: a conversion went missing.
    #[inline(always)]
    pub fn made(triggers: u32, position: u32) -> Option<u32> {
        match position.wrapping_sub(triggers) % N as u32 {
            0 => Some(triggers),
            1 => Some(triggers.wrapping_add(1)),
            ahead if ahead == N as u32 - 1 => Some(triggers.wrapping_sub(1)),
            _ => None,
        }
    }

    /// How many of `made` written in all are to be read.
    pub fn waiting(&self, made: u32) -> u32 {
        made.wrapping_sub(self.taken)
    }

    /// Of `made` written in all: how many were overwritten unread since the last call, now passed over, with
    /// those that belong to the same `group`.
    pub fn overwritten(&mut self, made: u32, group: u32) -> u32 {
        let kept = N as u32 - MARGIN;
        let lost = self.waiting(made).saturating_sub(kept).next_multiple_of(group);
        self.taken = self.taken.wrapping_add(lost);
        lost
    }

    /// Index of the next place to read, if one of `made` is left.
    pub fn next(&mut self, made: u32) -> Option<usize> {
        if self.taken == made {
            return None;
        }
        let at = self.taken as usize % N;
        self.taken = self.taken.wrapping_add(1);
        Some(at)
    }

    /// The same for a writer of which only the position is known.
    pub fn next_before(&mut self, position: u32) -> Option<usize> {
        let ahead = position.wrapping_sub(self.taken) % N as u32;
        self.next(self.taken.wrapping_add(ahead))
    }

    /// Whether there is such a place.
    pub fn has_before(&self, position: u32) -> bool {
        !position.wrapping_sub(self.taken).is_multiple_of(N as u32)
    }

    /// Whether such a writer has overtaken the reader, who then goes on where it writes. `wrapped`: it has
    /// begun anew at the ring's start since this was last asked. Twice round between two looks cannot be
    /// distinguished from once.
    pub fn overtaken(&mut self, wrapped: bool, position: u32) -> bool {
        let at = self.taken % N as u32;
        let overtaken = wrapped && position % N as u32 >= at;
        if overtaken {
            self.taken = self.taken.wrapping_add((position % N as u32) - at);
        }
        overtaken
    }

    /// Whether the writer stands before where the reader is: it has wrapped.
    pub fn is_behind(&self, position: u32) -> bool {
        position % (N as u32) < self.taken % N as u32
    }

    /// How many were never taken when everything begins anew after `triggers`.
    pub fn begin_anew(&mut self, triggers: u32) -> u32 {
        triggers.wrapping_sub(core::mem::take(&mut self.taken))
    }
}
