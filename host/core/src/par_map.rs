//! What is done for several at once, on all cores there are.

use rayon::prelude::*;
use std::sync::Mutex;
use std::vec::IntoIter;

/// Nothing is computed while a lock is held.
const UNLOCKED: &str = "no lock was held by what panicked";

/// Iterators whose items are mapped at once.
pub(crate) trait ParMap: Iterator + Sized {
    /// As `map`, in the same order; all of it is done when this returns.
    fn par_map<R: Send>(self, f: impl Fn(Self::Item) -> R + Sync) -> IntoIter<R>
    where
        Self::Item: Send,
    {
        let given: Vec<Mutex<Option<Self::Item>>> =
            self.map(|item| Mutex::new(Some(item))).collect();
        let done: Vec<Mutex<Option<R>>> = given.iter().map(|_| Mutex::new(None)).collect();
        par_each(given.len(), &|k| {
            let item = given[k].lock().expect(UNLOCKED).take().expect("an item is taken once");
            let result = f(item);
            *done[k].lock().expect(UNLOCKED) = Some(result);
        });
        let result =
            |done: Mutex<Option<R>>| done.into_inner().expect(UNLOCKED).expect("all are done");
        done.into_iter().map(result).collect::<Vec<R>>().into_iter()
    }
}

impl<I: Iterator> ParMap for I {}

/// The one place where work is parted: compiled once, whatever is done.
fn par_each(count: usize, job: &(dyn Fn(usize) + Sync)) {
    match count {
        0 => {}
        1 => job(0),
        _ => (0..count).into_par_iter().for_each(job),
    }
}
