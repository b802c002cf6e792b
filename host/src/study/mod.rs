//! The thesis's studies (Ramli 2008, chapters 4 and 5), rerun: one file a study.
//!
//! Training and test draws come from fixed seeds: the same tables on every run and any number of threads.

mod conventional;
mod cycles;
pub mod decays;
mod hidden;
pub mod information;
mod inputs;
pub mod lab;
mod noise;
mod pca_components;
mod pca_estimates;
mod pca_rig;
mod pca_samples;
mod pca_structures;
pub mod report;
mod response;
mod rig_records;
mod samples;
mod second_layer;
mod starts;
mod validation;

pub use conventional::{SAMPLES as TABLE_4_7_SAMPLES, THESIS as TABLE_4_7};
pub use report::Report;

use lab::{Draws, Fit, Spec};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;

/// Whether a study is run in full or just to see that it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    Full,
    /// Few epochs and draws: its numbers mean nothing.
    Quick,
}

/// How a study is run.
pub struct Setting<'a> {
    pub size: Size,
    /// Told of each step.
    pub progress: &'a (dyn Fn(&str) + Sync),
}

impl Setting<'_> {
    fn of(&self, full: usize, quick: usize) -> usize {
        match self.size {
            Size::Full => full,
            Size::Quick => quick,
        }
    }

    /// Draws of a test set.
    fn tests(&self) -> usize {
        self.of(2000, 60)
    }

    fn epochs(&self, full: usize) -> usize {
        self.of(full, full.min(6))
    }

    fn draws(&self, full: usize) -> usize {
        self.of(full, full.min(150))
    }

    /// Trains each on its set, on all cores.
    fn fit_all(&self, what: &str, jobs: &[(&Draws, Spec)]) -> Result<Vec<Fit>> {
        let done = AtomicUsize::new(0);
        jobs.par_iter()
            .map(|(draws, spec)| {
                interrupt::check()?;
                let fit = lab::fit(draws, spec)?;
                let count = done.fetch_add(1, Ordering::Relaxed) + 1;
                (self.progress)(&format!("{what}: {count} of {} networks trained", jobs.len()));
                Ok(fit)
            })
            .collect()
    }
}

/// One study of the thesis.
pub struct Study {
    pub name: &'static str,
    /// Where the thesis has it.
    pub reruns: &'static str,
    run: fn(&Setting<'_>) -> Result<Report>,
}

const fn study(
    name: &'static str,
    reruns: &'static str,
    run: fn(&Setting<'_>) -> Result<Report>,
) -> Study {
    Study { name, reruns, run }
}

/// Every study, in the thesis's order.
pub static STUDIES: [Study; 15] = [
    study("starts", "random starts, Fig 4.5", starts::run),
    study("cycles", "cycles in a window, Fig 4.6", cycles::run),
    study("inputs", "points in a window, Fig 4.7", inputs::run),
    study("samples", "training samples, Table 4.1 and Fig 4.9", samples::run),
    study("hidden", "hidden nodes, Fig 4.10", hidden::run),
    study("second-layer", "a second hidden layer, Table 4.2 and Fig 4.11", second_layer::run),
    study("noise", "noise and structure, Figs 4.13 to 4.18 and Table 4.5", noise::run),
    study("conventional", "conventional method and network, Table 4.7", conventional::run),
    study("response", "variation through a response, Fig 4.20", response::run),
    study("validation", "derivatives validated, Figs 4.22 and 4.23", validation::run),
    study("pca-samples", "whole record: training samples, Fig 5.4", pca_samples::run),
    study("pca-components", "whole record: components, Figs 5.5 and 5.6", pca_components::run),
    study("pca-structures", "whole record: structures, Figs 5.9 and 5.10", pca_structures::run),
    study("pca-estimates", "whole record: estimates, Figs 5.12 and 5.13", pca_estimates::run),
    study("pca-rig", "components on rig records, Tables 5.3 and 5.4", pca_rig::run),
];

impl Study {
    /// The study of this name.
    ///
    /// # Errors
    /// Exit 2 for any other, with all names.
    pub fn named(name: &str) -> Result<&'static Self> {
        STUDIES.iter().find(|study| study.name == name).ok_or_else(|| {
            let names: Vec<&str> = STUDIES.iter().map(|study| study.name).collect();
            Error::usage(format!("there is no study `{name}`"))
                .help(format!("the studies are: {}; or `all`", names.join(", ")))
        })
    }

    /// Runs it.
    ///
    /// # Errors
    /// 130 where the user stops it, 6 where a training comes to nothing.
    pub fn run(&self, setting: &Setting<'_>) -> Result<Report> {
        (self.run)(setting)
    }

    fn report(
        &self,
        tables: Vec<report::Table>,
        findings: Vec<String>,
        plots: Vec<crate::plot::Plot>,
    ) -> Report {
        let (study, title) = (self.name.to_owned(), self.reruns.to_owned());
        Report { study, title, tables, findings, plots }
    }
}

/// The report of the study of this name.
fn reported(
    name: &str,
    tables: Vec<report::Table>,
    findings: Vec<String>,
    plots: Vec<crate::plot::Plot>,
) -> Result<Report> {
    Ok(Study::named(name)?.report(tables, findings, plots))
}

#[cfg(test)]
mod tests;
