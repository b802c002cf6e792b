//! Whose steps a motion takes: its own, or those of another that hardly differs from it.

/// The steps that a motion took. Motions that hardly differ from it take the same, so that their difference
/// is one of the motions and none of the steps.
#[derive(Debug, Default)]
pub(crate) struct Steps {
    /// Steps that the walker was asked for, of each step of the grid.
    pub(crate) substeps: f64,
    /// Halvings of each step taken; none where the next one asked for begins.
    halvings: Vec<Option<u8>>,
}

/// Whose steps a motion takes.
pub(crate) enum Pace<'p> {
    Own,
    /// Its own, which are kept for others.
    Kept(&'p mut Steps),
    /// Another's, of which so many have been taken.
    Followed(&'p Steps, usize),
}

impl<'p> Pace<'p> {
    pub(crate) fn followed(steps: &'p Steps) -> Self {
        Self::Followed(steps, 0)
    }

    /// How often the next step is halved, where another motion says so.
    pub(super) fn next(&mut self) -> Option<usize> {
        let Self::Followed(steps, taken) = self else { return None };
        let next = (*steps.halvings.get(*taken)?)?;
        *taken += 1;
        Some(usize::from(next))
    }

    /// A step halved so often has been taken.
    pub(super) fn keep(&mut self, halvings: usize) {
        if let Self::Kept(steps) = self {
            steps.halvings.push(Some(halvings as u8));
        }
    }

    /// The walker has been where it was asked to.
    pub(super) fn end(&mut self) {
        match self {
            Self::Own => {}
            Self::Kept(steps) => steps.halvings.push(None),
            Self::Followed(steps, taken) => {
                let rest = steps.halvings.get(*taken..).unwrap_or_default();
                *taken += rest.iter().position(Option::is_none).map_or(0, |at| at + 1);
            }
        }
    }
}
