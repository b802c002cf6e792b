//! What of each number of an effect is said beside natural frequency and damping ratio: none to two of a
//! kind.

use heapless::Vec;
use postcard_schema::{schema::NamedType, Schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Most numbers of effects that a network says.
pub const MAX_NUMBERS: usize = 2;

/// One for each number that the network says, in its order. Small, and copied like the results it is in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Numbers<T> {
    count: u8,
    values: [T; MAX_NUMBERS],
}

impl<T> core::ops::Deref for Numbers<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values[..usize::from(self.count)]
    }
}

/// Those that find no room are left out.
impl<T: Copy + Default> FromIterator<T> for Numbers<T> {
    fn from_iter<I: IntoIterator<Item = T>>(all: I) -> Self {
        let mut numbers = Self::default();
        for (place, value) in numbers.values.iter_mut().zip(all) {
            *place = value;
            numbers.count += 1;
        }
        numbers
    }
}

impl<T: Schema> Schema for Numbers<T> {
    const SCHEMA: &'static NamedType = <Vec<T, MAX_NUMBERS> as Schema>::SCHEMA;
}

impl<T: Serialize> Serialize for Numbers<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de, T: Copy + Default + Deserialize<'de>> Deserialize<'de> for Numbers<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Vec::<T, MAX_NUMBERS>::deserialize(deserializer)?.into_iter().collect())
    }
}
