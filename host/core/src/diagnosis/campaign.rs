//! What only the verdict on a campaign says: where each effect comes from, random forcing release by release,
//! and what the effects do to the derivatives.

use crate::derivatives::condition::Identified;
use crate::derivatives::table::{ByAxis, Point};
use crate::derivatives::Computed;
use crate::diagnosis::answer::{BeforeAndAfter, Coefficient, Condition, Diagnosis};
use crate::diagnosis::buffeting::{self, Buffeted};
use crate::diagnosis::campaign_fit::Campaign;
use crate::diagnosis::likelihood::are_explained;
use crate::diagnosis::origin::{self, Origin, Plan};
use crate::diagnosis::releases::ReleaseAnswers;
use crate::diagnosis::several_fit::{SharedEffect, Source, Together};
use crate::diagnosis::verdict::SECOND_ORDER;
use crate::diagnosis::wind::{self, Dimensionless, GrowsAs};
use crate::effects::{Effect, SourceKind};
use crate::error::Result;
use crate::fit::fitting::{Fitted, Modal};
use crate::fit::free_decay::FreeDecay;
use crate::identify::{identify, Method, Settings};
use crate::par_map::ParMap;
use crate::quantity::Quantity;
use std::collections::BTreeMap;
use std::path::Path;

impl Campaign<'_> {
    /// Random forcing of each release beside its plain model, where most name it and the effects of the
    /// `last` do not explain them.
    fn forcing(&self, judged: &ReleaseAnswers, last: &Together) -> Option<Vec<Buffeted>> {
        let explained = are_explained(&last.joint.fits, self.decays) && last.shared.len() < 2;
        if explained || !judged.alone.mostly(&Effect::random()) {
            return None;
        }
        let each = self.decays.iter().zip(&judged.path[0].fits);
        each.par_map(|(decay, plain)| buffeting::fit(decay, plain)).collect()
    }

    /// The verdict that a random moment moves the model.
    fn add_random(&self, found: &mut Diagnosis, forcing: &[Buffeted]) {
        let effect = Effect::random();
        // Where there is none the likelihood is flat in ln q and gives no deviation; beyond one of three
        // nothing is known of it.
        let limited = |q: Quantity| Quantity::new(q.value, q.u.min(3.0 * q.value));
        let intensity: Vec<Quantity> = forcing.iter().map(|f| limited(f.intensity)).collect();
        let seen = self.by_condition(|i| Some(intensity[i]));
        let (origin, reason) = origin::decide(&effect, &seen);
        let plan = Plan::of_all(origin, forcing.iter().map(|_| true)).of_each();
        let each = found.releases.iter_mut().zip(self.decays);
        for ((release, decay), (forcing, q)) in each.zip(forcing.iter().zip(&intensity)) {
            release.is_filtered(decay, forcing.over_noise);
            release.has_no_definite_model(forcing.modal);
            release.parameters = BTreeMap::from([(effect.first_name(), *q)]);
        }
        // The plain mean over the releases it is in: weights by its own uncertainty would favour the weakest.
        let is_in = |wind_speed_m_s: f64| origin != Origin::Aerodynamic || wind_speed_m_s > 0.0;
        let each = intensity.iter().zip(self.decays);
        let levels = each.filter(|(_, decay)| is_in(decay.wind_speed_m_s)).map(|(q, _)| q);
        let levels: Vec<&Quantity> = levels.collect();
        let n = levels.len().max(1) as f64;
        let level = Quantity::new(
            levels.iter().map(|q| q.value).sum::<f64>() / n,
            levels.iter().map(|q| q.u * q.u).sum::<f64>().sqrt() / n,
        );
        found.effects = vec![effect.clone()];
        found.indistinguishable.clear();
        found.steps.truncate(1);
        let explained = found.releases.iter().all(|r| r.explained);
        found.is_forced(explained, BTreeMap::from([(effect.first_name(), level)]), SECOND_ORDER);
        found.add(&SharedEffect {
            effect,
            plan,
            source: Some(Source { origin, reason, seen, grows: None }),
        });
    }

    /// Where the effects come from, each release's condition, and the derivatives by the `plain` model and by
    /// that of the verdict.
    pub(super) fn complete(
        &self,
        found: &mut Diagnosis,
        judged: &ReleaseAnswers,
        [plain, last]: [&Together; 2],
    ) -> Result<()> {
        match self.forcing(judged, last) {
            Some(forcing) => self.add_random(found, &forcing),
            None => last.shared.iter().for_each(|shared| found.add(shared)),
        }
        for (release, entry) in found.releases.iter_mut().zip(&self.made.release) {
            release.condition = Some(Condition::new(entry));
        }
        let (before, inertia) = self.points(&self.linear(&plain.joint.fits)?).unzip();
        let after = match found.effects.is_empty() {
            true => before.clone(),
            false => {
                let identified = self.identified(found.releases.iter().map(|r| r.modal));
                self.points(&identified).map(|(points, _)| points)
            }
        };
        for SharedEffect { effect, source, .. } in &last.shared {
            let of_air = found.source.get(effect.id()) == Some(&SourceKind::Aerodynamic);
            let (Some(Source { seen, .. }), Some(inertia), true) = (source, &inertia, of_air)
            else {
                continue;
            };
            let known = Dimensionless::new(effect, seen, self.made, inertia);
            found.dimensionless.extend(known.map(|d| (effect.to_string(), d)));
        }
        found.derivatives =
            before.zip(after).map(|(before, after)| BeforeAndAfter { before, after });
        Ok(())
    }

    /// Each release as `derivatives` takes it, so that both say the same; where least squares has no answer,
    /// by its plain model.
    fn linear(&self, plain: &[Fitted]) -> Result<Vec<Identified>> {
        let fitted = self.identified(plain.iter().map(Fitted::modal));
        let found = self.records.iter().zip(fitted).par_map(|(record, fitted)| {
            self.decays[0].stop.check()?;
            let found = identify(record, &[Method::LeastSquares], &Settings::default()).ok();
            Ok(found.and_then(Identified::from_identification).unwrap_or(fitted))
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
        modal.zip(self.decays).map(of).collect()
    }

    /// The derivatives with these wn and zeta; `None` where there is no point to compute. Coefficients that
    /// releases share make their errors alike; the propagation takes them for independent.
    fn points(&self, identified: &[Identified]) -> Option<(Vec<Point>, ByAxis<Quantity>)> {
        let computed = Computed::new(self.made, identified).ok()?;
        let table = computed.table(Path::new(""), "least-squares");
        Some((table.points, table.inertia_kg_m2))
    }
}

impl Diagnosis {
    /// Said which releases share an effect that is named, and of a campaign where it comes from.
    pub(super) fn add(&mut self, SharedEffect { effect, plan, source }: &SharedEffect) {
        if !self.effects.contains(effect) {
            return;
        }
        let id = effect.to_string();
        self.sharing.insert(id.clone(), plan.name);
        let Some(Source { origin, reason, seen, grows }) = source else { return };
        let grows = grows.or_else(|| GrowsAs::new(effect, seen));
        let taken = wind::source(effect, *origin, seen, grows);
        self.source.insert(id.clone(), taken);
        self.grows_as
            .extend(grows.filter(|_| *origin != Origin::Mechanical).map(|g| (id.clone(), g)));
        self.origin.insert(id.clone(), *origin);
        self.origin_reason.insert(id.clone(), reason.clone());
        let parameter = &effect.parameters()[0];
        let rows = seen.iter().map(|seen| Coefficient {
            condition: seen.condition.clone(),
            name: parameter.name.to_string(),
            unit: parameter.unit.to_string(),
            quantity: seen.coefficient,
        });
        self.coefficients.insert(id, rows.collect());
    }
}
