//! Bytes that need not lie in memory, such as those of a flash.

use core::ops::Range;
use postcard::de_flavors::Flavor;

/// Puts the bytes from an offset on into the room given; false where it cannot.
pub type Source<'a> = dyn FnMut(usize, &mut [u8]) -> bool + 'a;

/// Bytes that lie in memory.
pub fn in_memory(bytes: &[u8]) -> impl FnMut(usize, &mut [u8]) -> bool + '_ {
    |offset, room| {
        let found = bytes.get(offset..).and_then(|rest| rest.get(..room.len()));
        found.map(|found| room.copy_from_slice(found)).is_some()
    }
}

/// Bytes of a source as postcard reads them, one by one: a device has no room for all of them.
pub struct Bytes<'a> {
    source: &'a mut Source<'a>,
    at: usize,
    end: usize,
    /// What numbers are made of.
    piece: [u8; 8],
}

impl<'a> Bytes<'a> {
    pub fn new(source: &'a mut Source<'a>, places: Range<usize>) -> Self {
        Self { source, at: places.start, end: places.end, piece: [0; 8] }
    }

    pub fn is_empty(&self) -> bool {
        self.at == self.end
    }
}

impl<'a> Flavor<'a> for Bytes<'a> {
    type Remainder = Self;
    type Source = ();

    fn pop(&mut self) -> postcard::Result<u8> {
        self.try_take_n_temp(1).map(|byte| byte[0])
    }

    fn try_take_n(&mut self, _: usize) -> postcard::Result<&'a [u8]> {
        // Nothing of it stays in memory: texts are read byte by byte.
        Err(postcard::Error::DeserializeUnexpectedEnd)
    }

    fn try_take_n_temp<'b>(&'b mut self, count: usize) -> postcard::Result<&'b [u8]>
    where
        'a: 'b,
    {
        let left = self.end - self.at;
        let piece = self.piece.get_mut(..count).filter(|_| count <= left);
        let piece = piece.ok_or(postcard::Error::DeserializeUnexpectedEnd)?;
        if !(self.source)(self.at, piece) {
            return Err(postcard::Error::DeserializeUnexpectedEnd);
        }
        self.at += count;
        Ok(piece)
    }

    fn finalize(self) -> postcard::Result<Self> {
        Ok(self)
    }
}
