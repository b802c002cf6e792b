//! Where the numbers of a fit are: which are shared by which releases or pieces, and the order of all.

use crate::fit::structure::{Structure, WN, YAW, ZERO};
use std::collections::HashMap;
use std::ops::Range;

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

/// Where the numbers of each block (a release, or a piece of one) are among all: first the natural frequencies
/// and damping ratios, then each block's state, then each release's zero of the sensor where it is unknown, then
/// the effects'. Those of one release are in the order of [`crate::fit::fitting::Fitted`].
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Of each block, of each of its numbers.
    places: Vec<Vec<usize>>,
    /// Of each block.
    release: Vec<usize>,
    states: Range<usize>,
    count: usize,
}

impl Layout {
    /// Of whole releases.
    pub(crate) fn of_releases(structure: &Structure, sharing: &Sharing) -> Self {
        let group = |effect: usize, number: usize, release: usize| {
            let group = sharing.effects[effect][release]?;
            let own = structure.effects[effect].belongs_to_release(number);
            Some(if own { [1, release] } else { [0, group] })
        };
        Self::new(structure, &sharing.modal, (0..sharing.modal.len()).collect(), group)
    }

    /// Of pieces, each of a `release`, all with all effects in common.
    pub(crate) fn of_pieces(structure: &Structure, modal: &[usize], release: Vec<usize>) -> Self {
        Self::new(structure, modal, release, |_, _, _| Some([0, 0]))
    }

    /// `group` of a number of an effect in a release: those of one are the same; `None` without the effect.
    fn new(
        structure: &Structure,
        modal: &[usize],
        release: Vec<usize>,
        group: impl Fn(usize, usize, usize) -> Option<[usize; 2]>,
    ) -> Self {
        let mut groups: Vec<usize> = Vec::new();
        for group in modal {
            if !groups.contains(group) {
                groups.push(*group);
            }
        }
        let states = 2 * groups.len()..2 * (groups.len() + release.len());
        let zeros = if structure.zero_unknown { modal.len() } else { 0 };
        let mut count = states.end + zeros;
        let mut of_effects: Vec<Vec<usize>> = vec![Vec::new(); modal.len()];
        for (k, effect) in structure.effects.iter().enumerate() {
            let mut known: HashMap<(usize, [usize; 2]), usize> = HashMap::new();
            for (i, own) in of_effects.iter_mut().enumerate() {
                for number in 0..effect.parameters().len() {
                    let Some(group) = group(k, number, i) else { continue };
                    own.push(*known.entry((number, group)).or_insert_with(|| {
                        count += 1;
                        count - 1
                    }));
                }
            }
        }
        let of_block = |(block, &i): (usize, &usize)| {
            let modal = 2 * groups.iter().position(|group| *group == modal[i]).unwrap_or(0);
            let state = states.start + 2 * block;
            let mut places = vec![modal, modal + 1, state, state + 1];
            places.extend(structure.zero_unknown.then_some(states.end + i));
            places.extend(&of_effects[i]);
            places
        };
        let places = release.iter().enumerate().map(of_block).collect();
        Self { places, release, states, count }
    }

    /// How many numbers there are.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Of each number of a block, its place among all.
    pub(crate) fn places(&self, block: usize) -> &[usize] {
        &self.places[block]
    }

    /// The first block of a release.
    pub(crate) fn block_of(&self, release: usize) -> Option<usize> {
        self.release.iter().position(|of| *of == release)
    }

    /// Among the numbers that are no state, the place of what is at `place` among all; none for a state.
    pub(crate) fn shared(&self, place: usize) -> Option<usize> {
        match place {
            before if before < self.states.start => Some(before),
            after => after.checked_sub(self.states.end).map(|k| self.states.start + k),
        }
    }

    /// The other way round.
    pub(crate) fn of_shared(&self, shared: usize) -> usize {
        shared + if shared < self.states.start { 0 } else { self.states.len() }
    }

    /// How many numbers are no state.
    pub(crate) fn shared_count(&self) -> usize {
        self.count - self.states.len()
    }

    /// Among those that are no state, where a number of a block is.
    pub(crate) fn shared_of(&self, block: usize, number: usize) -> Option<usize> {
        self.shared(self.places[block][number])
    }

    /// All numbers, from those that are no state and each block's state.
    pub(crate) fn all(&self, shared: &[f64], states: &[[f64; 2]]) -> Vec<f64> {
        let (modal, others) = shared.split_at(self.states.start);
        [modal, states.as_flattened(), others].concat()
    }

    /// The other way round.
    pub(crate) fn parted(&self, all: &[f64]) -> (Vec<f64>, Vec<[f64; 2]>) {
        let Range { start, end } = self.states;
        let states = all[start..end].chunks_exact(2).map(|state| [state[0], state[1]]);
        ([&all[..start], &all[end..]].concat(), states.collect())
    }

    /// A block's numbers, in the order of [`crate::fit::fitting::Fitted`].
    pub(crate) fn numbers(&self, block: usize, shared: &[f64], state: [f64; 2]) -> Vec<f64> {
        let number = |(j, &place): (usize, &usize)| match self.shared(place) {
            Some(at) => shared[at],
            None => state[j - YAW],
        };
        self.places[block].iter().enumerate().map(number).collect()
    }

    /// Among those that are no state, where a block's natural frequency is; its damping ratio is next.
    pub(crate) fn modal(&self, block: usize) -> usize {
        self.places[block][WN]
    }

    /// The zero of the sensor about which a block moves, among the numbers that are no state.
    pub(crate) fn zero(&self, block: usize, structure: &Structure) -> Option<usize> {
        structure.zero_unknown.then(|| self.shared_of(block, ZERO)).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;

    fn structure() -> Structure {
        let effects = vec![Effect::CubicStiffness, Effect::BaselineDrift];
        Structure { effects, zero_unknown: true, ..Structure::default() }
    }

    /// One release's numbers are in the order in which its model has them.
    #[test]
    fn one_release_is_in_its_own_order() {
        let layout = Layout::of_releases(&structure(), &Sharing::none(1, 2));
        let count = layout.count();
        assert_eq!(layout.places(0), (0..count).collect::<Vec<usize>>());
    }

    /// Of two conditions and three releases; a drift belongs to its release.
    #[test]
    fn what_is_shared_has_one_place() {
        let effects = vec![vec![Some(7); 3], vec![Some(7), None, Some(7)]];
        let layout = Layout::of_releases(&structure(), &Sharing { modal: vec![4, 9, 4], effects });
        let [a, b, c] = [0, 1, 2].map(|i| layout.places(i));
        assert_eq!((&a[..2], &b[..2]), (&c[..2], &[2, 3][..]));
        assert_eq!((a[5], a[5]), (b[5], c[5]));
        assert!(a[4] != b[4] && a[6] != c[6] && b.len() == 6);
    }

    /// Pieces share all but their states, which stand apart from the rest and come back.
    #[test]
    fn states_are_parted_from_what_pieces_share() {
        let structure = structure();
        let layout = Layout::of_pieces(&structure, &[0, 1], vec![0, 0, 1]);
        let shared: Vec<f64> = (0..layout.shared_count()).map(|k| k as f64).collect();
        let states = [[-1.0, -2.0], [-3.0, -4.0], [-5.0, -6.0]];
        let all = layout.all(&shared, &states);
        assert_eq!(layout.parted(&all), (shared.clone(), states.to_vec()));
        for (block, state) in states.into_iter().enumerate() {
            let numbers: Vec<f64> = layout.places(block).iter().map(|&at| all[at]).collect();
            assert_eq!(layout.numbers(block, &shared, state), numbers);
        }
        assert!((0..shared.len()).all(|k| layout.shared(layout.of_shared(k)) == Some(k)));
        assert_eq!((layout.modal(2), layout.zero(2, &structure)), (2, Some(5)));
    }
}
