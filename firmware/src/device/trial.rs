//! Which network runs: the newest that was kept, or one on trial until the host confirms it.

use super::{Core, Running};
use crate::log;
use crate::BUILT_IN;
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::blob;
use yawrig_shared::source::in_memory;
use yawrig_shared::wire::{is_safe, Forgotten, Refusal, TRIAL_SAMPLES};

impl<F: NorFlash, const LOCKABLE: bool> Core<F, LOCKABLE> {
    /// Time goes by: a network on trial that nobody confirms is given up.
    pub(super) fn pass(&mut self, samples: u32) {
        if let Some(left) = self.trial {
            match left.checked_sub(samples) {
                Some(left) => self.trial = Some(left),
                None => self.give_up_trial(),
            }
        }
    }

    /// The network on trial cannot be confirmed any more. It goes at once, or with the end of the release.
    pub(super) fn give_up_trial(&mut self) {
        if self.trial.is_some() {
            self.store.abandon();
            self.trial = Some(0);
            // Else asked again with the next sample.
            if !self.measuring.is_releasing() {
                self.roll_back();
            }
        }
    }

    /// All windows of a release are one network's.
    pub(super) fn may_swap(&self) -> Result<(), Refusal> {
        if self.measuring.is_releasing() {
            return Err(Refusal::Releasing);
        }
        Ok(())
    }

    /// Back from a network on trial to the one before.
    pub(super) fn roll_back(&mut self) {
        if self.trial.take().is_some() {
            self.store.abandon();
            self.take_up_kept();
        }
    }

    /// What was learnt goes to the flash, but not while a release goes on, which erasing might cost samples.
    /// Of a network on trial nothing is kept: the one before may come back.
    pub(super) fn keep_learnt(&mut self) {
        let busy = self.measuring.is_releasing() || self.refining.is_busy();
        if busy || self.trial.is_some() {
            return;
        }
        self.keep_due(self.running_id());
    }

    /// What is not in the flash yet of what was learnt of this network.
    fn keep_due(&mut self, network: u32) {
        if !self.measuring.learning().is_due() {
            return;
        }
        let kept = self.measuring.learning_mut().keep(self.store.flash(), network);
        if kept.is_err() {
            log::not_kept();
        }
    }

    /// Zero where none runs.
    pub(super) fn running_id(&self) -> u32 {
        self.running.as_ref().map_or(0, |running| running.id)
    }

    /// The newest network of the flash, or the one compiled in.
    #[inline(never)]
    pub(super) fn take_up_kept(&mut self) {
        self.read_kept();
        let network = self.running_id();
        if is_safe(self.restarts) {
            return;
        }
        self.measuring.learning_mut().recall(self.store.flash(), network);
    }

    fn read_kept(&mut self) {
        self.measuring.network_changed();
        let newest = match is_safe(self.restarts) {
            true => None,
            false => self.store.newest(&mut self.network),
        };
        self.running = match newest {
            Some((slot, envelope, provenance)) => {
                Some(Running::new(envelope, provenance, Some(slot)))
            }
            None => blob::decode_into(&mut in_memory(BUILT_IN), &mut self.network)
                .ok()
                .map(|(envelope, provenance)| Running::new(envelope, provenance, None)),
        };
    }

    /// Verifies the network that was written and runs it on trial. The one before is read again where it is
    /// refused.
    pub(super) fn try_out(&mut self) -> Result<(), Refusal> {
        if self.trial.is_some() {
            return Err(Refusal::FlashOrder { expected_offset: 0 });
        }
        self.may_swap()?;
        let newest = self.running.as_ref().map_or(0, |running| running.generation);
        let before = self.running_id();
        let signature = self.signature.as_ref();
        match self.store.verify(newest, &mut self.network, self.update, signature) {
            Ok((slot, envelope, provenance)) => {
                // For when the one before comes back.
                self.keep_due(before);
                self.measuring.network_changed();
                self.measuring.learning_mut().forget(Forgotten::Network);
                self.running = Some(Running::new(envelope, provenance, Some(slot)));
                self.trial = Some(TRIAL_SAMPLES);
                Ok(())
            }
            Err(refusal) => {
                // The same network as before: what was learnt of it holds.
                self.read_kept();
                Err(refusal)
            }
        }
    }
}
