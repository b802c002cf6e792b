//! The verdict on a campaign: which effects its releases need together, where each comes from, and what it
//! does to the derivatives.

use crate::at_once::AtOnce;
use crate::derivatives::campaign::Campaign as Made;
use crate::derivatives::condition::{settings, Identified};
use crate::derivatives::table::Point;
use crate::derivatives::Computed;
use crate::diagnosis::answer::{
    BeforeAndAfter, Coefficient, Condition, Diagnosed, Diagnosis, HeldOut, Options, Status, Step,
};
use crate::diagnosis::buffeting::Buffeted;
use crate::diagnosis::campaign_fit::{Campaign, Shared, SharedEffect};
use crate::diagnosis::origin::{self, Origin, Plan};
use crate::diagnosis::releases::{self, ReleaseAnswers, Releases};
use crate::diagnosis::verdict::{Chosen, SECOND_ORDER};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{Fitted, Modal, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::identify::{identify, Method, Settings};
use crate::quantity::Quantity;
use crate::record::Record;
use std::collections::BTreeMap;
use std::path::Path;

/// Standard deviation of ln q beyond which nothing is known of it.
const MOST_LOG_DEVIATION: f64 = 3.0;

pub(super) fn of_campaign(made: &Made, records: &[Record], options: &Options) -> Result<Diagnosed> {
    let wind_speed_m_s = made.release.iter().map(|r| r.wind_speed_m_s).collect();
    let mut releases = Releases::of(records, wind_speed_m_s, options)?;
    let options = &options.of(&releases.decays[0]);
    let structure = Structure { zero_unknown: options.zero_unknown, ..Structure::default() };
    let judged = releases::judge(records, &mut releases, &structure, options)?;
    let campaign = Campaign { made, settings: settings(made), records, releases: &releases };
    let model = |model| {
        let shared = campaign.shared(model)?;
        let step = campaign.step(&shared);
        releases.check().map(|()| (shared, step))
    };
    let models: Vec<(Shared, (HeldOut, Step))> =
        judged.path.iter().map(model).collect::<Result<_>>()?;
    let (shared, steps): (Vec<Shared>, Vec<(HeldOut, Step)>) = models.into_iter().unzip();
    let forced = campaign.randomly_forced(&judged, shared.last().expect("a model"));
    let diagnosis = campaign.verdict(&judged, &shared, steps, forced)?;
    let mut path: Vec<Vec<Fitted>> = shared.into_iter().map(|model| model.joint.fits).collect();
    if diagnosis.effects.iter().any(Effect::is_random) {
        path.truncate(1);
    }
    Ok(Diagnosed { diagnosis, decays: releases.decays, singles: Vec::new(), path })
}

impl Campaign<'_> {
    fn verdict(
        &self,
        judged: &ReleaseAnswers,
        shared: &[Shared],
        steps: Vec<(HeldOut, Step)>,
        forced: Option<Vec<Buffeted>>,
    ) -> Result<Diagnosis> {
        let held_out = steps[0].0;
        let mut steps: Vec<Step> = steps.into_iter().map(|s| s.1).collect();
        // A release from a small angle need not predict one from a large: then a smaller model does so better.
        let mut least = f64::INFINITY;
        for step in &mut steps {
            least = least.min(step.held_out_over_noise);
            step.held_out_over_noise = least;
        }
        let last = shared.last().expect("a model");
        let plain = &shared[0].joint.fits;
        let effects: Vec<Effect> = last.effects.iter().map(|e| e.effect.clone()).collect();
        let chosen = Chosen {
            status: None,
            indistinguishable: judged.alone.indistinguishable(&effects),
            effects,
            held_out,
            steps,
            candidates: judged.alone.candidates(),
            model: SECOND_ORDER,
        };
        let entries = &self.made.release;
        let files: Vec<String> = entries.iter().map(|entry| entry.file.clone()).collect();
        let models: [&[Fitted]; 2] = [plain, &last.joint.fits];
        let mut out = Diagnosis::of(&files, &self.releases.decays, models, chosen);
        for (release, entry) in out.releases.iter_mut().zip(entries) {
            release.condition = Some(Condition {
                spring: entry.spring.clone(),
                axis: entry.axis,
                wind_speed_m_s: entry.wind_speed_m_s,
            });
        }
        match &forced {
            Some(forced) => self.add_forced(&mut out, forced),
            None => last.effects.iter().for_each(|effect| out.add(effect)),
        }
        let before = self.points(&self.linear(plain)?);
        let after = match out.effects.is_empty() {
            true => before.clone(),
            false => self.points(&self.identified(out.releases.iter().map(|r| r.modal))),
        };
        out.derivatives = before.zip(after).map(|(before, after)| BeforeAndAfter { before, after });
        Ok(out)
    }

    /// The verdict that a random moment moves the model.
    fn add_forced(&self, out: &mut Diagnosis, forced: &[Buffeted]) {
        let effect = Effect::random();
        // Where there is none the likelihood is flat in ln q, and gives no deviation.
        let intensity = |i: usize| {
            let q = forced[i].intensity;
            Some(Quantity::new(q, q * forced[i].deviations[0].min(MOST_LOG_DEVIATION)))
        };
        let seen = self.by_condition(intensity);
        let (origin, reason) = origin::decide(&seen, &effect.parameters()[0].unit);
        let plan = Plan::of_all(origin, forced.iter().map(|_| true)).of_each();
        let decays = &self.releases.decays;
        for (i, (release, b)) in out.releases.iter_mut().zip(forced).enumerate() {
            release.is_filtered(&decays[i], b.over_noise);
            release.has_no_definite_model(b.modal());
            release.parameters =
                intensity(i).map(|q| (effect.first_name(), q)).into_iter().collect();
        }
        // The plain mean over the releases it is in: weights by its own uncertainty would favour the weakest.
        let is_in =
            |i: &usize| origin != Origin::Aerodynamic || self.releases.wind_speed_m_s[*i] > 0.0;
        let levels: Vec<Quantity> = (0..forced.len()).filter(is_in).filter_map(intensity).collect();
        let n = levels.len().max(1) as f64;
        let level = Quantity::new(
            levels.iter().map(|q| q.value).sum::<f64>() / n,
            levels.iter().map(|q| q.u * q.u).sum::<f64>().sqrt() / n,
        );
        out.effects = vec![effect.clone()];
        out.indistinguishable.clear();
        let explained = out.releases.iter().all(|r| r.explained);
        let status = if explained { Status::Explained } else { Status::Unexplained };
        out.is_filtered(status, SECOND_ORDER);
        out.steps.truncate(1);
        out.is_forced(BTreeMap::from([(effect.first_name(), level)]));
        out.add(&SharedEffect { effect, origin, reason, plan, seen });
    }

    /// Each release as `derivatives` takes it, so that both say the same; where least squares has no answer,
    /// by its plain model.
    fn linear(&self, plain: &[Fitted]) -> Result<Vec<Identified>> {
        let fitted = self.identified(plain.iter().map(Fitted::modal));
        let found = self.records.iter().zip(fitted).map_at_once(|(record, fitted)| {
            self.releases.check()?;
            let found = identify(record, &[Method::LeastSquares], &Settings::default()).ok();
            Ok(found.and_then(Identified::of).unwrap_or(fitted))
        });
        found.collect()
    }

    /// The numbers of each release's free decay.
    fn identified(&self, modal: impl Iterator<Item = Modal>) -> Vec<Identified> {
        let of = |(modal, decay): (Modal, &FreeDecay)| {
            let begun_s = decay.release_time_s + decay.grid.start_s;
            let ended_s = decay.release_time_s + decay.grid.time_s(decay.grid.count);
            let Modal { natural_frequency_rad_s, damping_ratio } = modal;
            Identified::new(natural_frequency_rad_s, damping_ratio, begun_s, ended_s)
        };
        modal.zip(&self.releases.decays).map(of).collect()
    }

    /// The derivatives with these wn and zeta; `None` where there is no point to compute. Coefficients that
    /// releases share make their errors alike; the propagation takes them for independent.
    fn points(&self, identified: &[Identified]) -> Option<Vec<Point>> {
        let computed = Computed::new(self.made, identified).ok()?;
        Some(computed.table(Path::new(""), "least-squares").points)
    }
}

impl Diagnosis {
    fn add(&mut self, shared: &SharedEffect) {
        let id = shared.effect.to_string();
        let parameter = &shared.effect.parameters()[0];
        self.origin.insert(id.clone(), shared.origin);
        self.origin_reason.insert(id.clone(), shared.reason.clone());
        self.sharing.insert(id.clone(), shared.plan.name);
        let rows = shared.seen.iter().map(|seen| Coefficient {
            condition: Condition {
                spring: seen.spring.clone(),
                axis: seen.axis,
                wind_speed_m_s: seen.wind_speed_m_s,
            },
            name: parameter.name.to_string(),
            unit: parameter.unit.to_string(),
            quantity: seen.coefficient,
        });
        self.coefficients.insert(id, rows.collect());
    }
}
