//! Which parameters the releases of a joint fit share.

use crate::fit::fitting::Structure;
use std::collections::HashMap;

/// Which releases have which numbers in common. Group numbers mean nothing but sameness.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Sharing {
    /// Of each release: those of one group have natural frequency and damping ratio in common.
    pub modal: Vec<usize>,
    /// Of each effect of the structure and each release: those of one group have the effect's coefficients in
    /// common; `None`: the release is without the effect.
    pub effects: Vec<Vec<Option<usize>>>,
}

impl Sharing {
    /// So many releases and effects with nothing in common.
    pub fn none(releases: usize, effects: usize) -> Self {
        let own = (0..releases).map(Some).collect();
        Self { modal: (0..releases).collect(), effects: vec![own; effects] }
    }

    /// With one more effect, shared as `groups` says.
    pub fn with(&self, groups: Vec<Option<usize>>) -> Self {
        let mut effects = self.effects.clone();
        effects.push(groups);
        Self { effects, ..self.clone() }
    }

    /// What `structure` is for one release.
    pub(crate) fn of_release(&self, structure: &Structure, release: usize) -> Structure {
        let has = |k: &usize| self.effects[*k][release].is_some();
        let effects =
            (0..structure.effects.len()).filter(has).map(|k| structure.effects[k].clone());
        Structure { effects: effects.collect(), ..structure.clone() }
    }
}

/// Where each release's numbers are among all.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    pub(crate) of: Vec<Vec<usize>>,
    pub(crate) count: usize,
}

impl Places {
    pub(crate) fn new(structure: &Structure, sharing: &Sharing) -> Self {
        /// An effect's place and the number's in it; a modal number has no effect.
        type Key = (Option<usize>, usize, usize);
        let mut known: HashMap<Key, usize> = HashMap::new();
        let mut count = 0;
        let mut place = |key: Option<Key>| {
            if let Some(&at) = key.as_ref().and_then(|key| known.get(key)) {
                return at;
            }
            known.extend(key.map(|key| (key, count)));
            count += 1;
            count - 1
        };
        let of = (0..sharing.modal.len())
            .map(|release| {
                let mut own = Vec::new();
                for number in 0..structure.own_numbers() {
                    let shared = number < 2;
                    own.push(place(shared.then_some((None, number, sharing.modal[release]))));
                }
                for (k, effect) in structure.effects.iter().enumerate() {
                    let Some(group) = sharing.effects[k][release] else { continue };
                    for number in 0..effect.parameters().len() {
                        let shared = !effect.belongs_to_release(number);
                        own.push(place(shared.then_some((Some(k), number, group))));
                    }
                }
                own
            })
            .collect();
        Self { of, count }
    }
}
