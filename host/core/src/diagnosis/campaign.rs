//! The verdict on a campaign: which effects its releases need together, where each comes from, and what it
//! does to the derivatives.

use crate::derivatives::campaign::Campaign as Made;
use crate::derivatives::condition::{settings, Identified};
use crate::derivatives::table::Point;
use crate::derivatives::Computed;
use crate::diagnosis::account;
use crate::diagnosis::answer::Left;
use crate::diagnosis::buffeting::Buffeted;
pub use crate::diagnosis::campaign_fit::HeldOut;
use crate::diagnosis::campaign_fit::{Campaign, Shared, SharedEffect, OWN};
use crate::diagnosis::compare::{self, Where};
use crate::diagnosis::diagnose::{Candidate, Modal, Options, Status, Step, SECOND_ORDER};
use crate::diagnosis::origin::{self, Origin, Plan};
use crate::diagnosis::releases::{self, left, mean_square, worst, ReleaseAnswers, Releases};
use crate::diagnosis::search::is_explained;
use crate::discrepancy::ABOVE_NOISE;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::at_amplitude::{at_amplitudes, AtAmplitude};
use crate::fit::fitting::Fitted;
use crate::fit::fitting::{Covariance, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::identify::{identify, Method, Settings};
use crate::quantity::Quantity;
use crate::record::{Record, Said};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use yawrig_shared::axis::Axis;

/// Standard deviation of ln q beyond which nothing is known of it.
const MOST_LOG_DEVIATION: f64 = 3.0;

/// All that is said about a campaign. Rms in deg over all releases, ratios to the noise floor of block means.
#[derive(Clone, Debug, Serialize)]
pub struct CampaignDiagnosis {
    /// What the records hold, where that is no angle in deg.
    #[serde(flatten)]
    pub said: Said,
    /// Standard deviation of the noise of one sample, all releases together.
    pub noise_rms_deg: f64,
    /// The same of the block means, to which `residual_over_noise` refers.
    pub mean_noise_deg: f64,
    /// The verdict for all releases.
    pub status: Status,
    /// In the order in which they help.
    pub effects: Vec<Effect>,
    /// An accepted effect and one that does as well in its place.
    pub indistinguishable: Vec<[Effect; 2]>,
    /// By effect.
    pub origin: BTreeMap<String, Origin>,
    /// By effect: what its origin was decided from, in words.
    pub origin_reason: BTreeMap<String, String>,
    /// By effect: which releases have one coefficient.
    pub sharing: BTreeMap<String, &'static str>,
    /// None for a campaign as a whole: see `releases`.
    pub modal: Option<Modal>,
    /// From the plain model to the final one, an effect more at each.
    pub steps: Vec<Step>,
    /// What `held_out_over_noise` was held out.
    pub held_out: HeldOut,
    /// Every effect alone, best first: the gains added of the releases (eight at most) that the plain model
    /// explains worst.
    pub candidates: Vec<Candidate>,
    /// By effect: the first of its numbers in each condition, free of all others.
    pub coefficients: BTreeMap<String, Vec<Coefficient>>,
    /// In the order of the campaign.
    pub releases: Vec<ReleaseVerdict>,
    /// Of the release that is explained worst.
    #[serde(rename = "where")]
    pub where_: Where,
    /// File of that release.
    pub where_release: String,
    /// What the final model leaves, all releases together.
    pub left: Left,
    /// The answer in one sentence.
    pub sentence: String,
    /// `null` where there is no point to compute.
    pub derivatives: Option<BeforeAndAfter>,
}

/// The size of an effect in one condition.
#[derive(Clone, Debug, Serialize)]
pub struct Coefficient {
    /// Name of the springs.
    pub spring: String,
    /// The axis that the model turns about.
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    /// Name of the parameter within the effect.
    pub name: String,
    /// Of the value and its u.
    pub unit: String,
    /// Fitted to the releases of this condition by themselves.
    #[serde(flatten)]
    pub quantity: Quantity,
}

/// What is said about one release of a campaign.
#[derive(Clone, Debug, Serialize)]
pub struct ReleaseVerdict {
    /// As the campaign names it.
    pub file: String,
    /// Name of the springs.
    pub spring: String,
    /// The axis that the model turns about.
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    /// Standard deviation of the noise of one sample.
    pub noise_rms_deg: f64,
    /// Of the final model.
    pub natural_frequency_rad_s: Quantity,
    /// Of the final model; negative where small oscillations grow.
    pub damping_ratio: Quantity,
    /// Of the plain model.
    pub before_over_noise: f64,
    /// Of the final model, its shared coefficients in common.
    pub residual_over_noise: f64,
    /// Whether the final model leaves no more than noise of it.
    pub explained: bool,
    /// Of the final model, from the largest amplitude to the smallest; none where it is random.
    pub at_amplitude: Vec<AtAmplitude>,
    /// Of the numbers of the final model; `None` where it has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
}

/// The derivatives from wn and zeta of the plain model and of the final one.
#[derive(Clone, Debug, Serialize)]
pub struct BeforeAndAfter {
    /// As the derivatives of the campaign are without a diagnosis: each release by one damped mode.
    pub before: Vec<Point>,
    /// By the final model of each release.
    pub after: Vec<Point>,
}

/// A diagnosis with the fits it rests on, in the order of the releases.
#[derive(Clone, Debug)]
pub struct DiagnosedCampaign {
    /// The answer.
    pub diagnosis: CampaignDiagnosis,
    /// The free decay of each release.
    pub decays: Vec<FreeDecay>,
    /// The second-order model of each.
    pub plain: Vec<Fitted>,
    /// The final one, its shared coefficients in common; a random moment left out.
    pub last: Vec<Fitted>,
}

/// Judges `records`, one for each release of `made` in its order.
///
/// # Errors
/// As [`diagnose_with_fits`].
pub fn diagnose_records(
    made: &Made,
    records: &[Record],
    options: &Options,
) -> Result<CampaignDiagnosis> {
    Ok(diagnose_with_fits(made, records, options)?.diagnosis)
}

/// Judges `records`, one for each release of `made` in its order, and keeps what was fitted.
///
/// # Errors
/// Naming the record without a free decay; interrupted.
pub fn diagnose_with_fits(
    made: &Made,
    records: &[Record],
    options: &Options,
) -> Result<DiagnosedCampaign> {
    let wind_speed_m_s = made.release.iter().map(|r| r.wind_speed_m_s).collect();
    let mut releases = Releases::of(records, wind_speed_m_s, options)?;
    let options = &options.of(&releases.decays[0]);
    let structure = Structure { zero_unknown: options.zero_unknown, ..Structure::default() };
    let judged = releases::judge(records, &mut releases, &structure, options)?;
    let campaign = Campaign { made, settings: settings(made), records, releases: &releases };
    let shared: Vec<Shared> =
        judged.path.iter().map(|model| campaign.shared(model)).collect::<Result<_>>()?;
    let forced = campaign.randomly_forced(&judged, shared.last().expect("a model"));
    let diagnosis = campaign.verdict(&judged, &shared, forced)?;
    let plain: Vec<Fitted> = shared[0].joint.fits.clone();
    let last = match &diagnosis.effects[..] {
        [only] if only.is_random() => plain.clone(),
        _ => shared.last().expect("a model").joint.fits.clone(),
    };
    Ok(DiagnosedCampaign { diagnosis, decays: releases.decays, plain, last })
}

impl Campaign<'_> {
    fn verdict(
        &self,
        judged: &ReleaseAnswers,
        shared: &[Shared],
        forced: Option<Vec<Buffeted>>,
    ) -> Result<CampaignDiagnosis> {
        let step = |shared| self.releases.check().map(|()| self.step(shared));
        let steps: Vec<(HeldOut, Step)> = shared.iter().map(step).collect::<Result<_>>()?;
        let last = shared.last().expect("a model");
        let plain = &shared[0].joint.fits;
        let decays = &self.releases.decays;
        let files: Vec<&str> = self.made.release.iter().map(|r| r.file.as_str()).collect();
        let left = left(plain, &last.joint.fits, decays, &files);
        let effects: Vec<Effect> = last.effects.iter().map(|e| e.effect.clone()).collect();
        let status = left.status(last.is_explained(decays), &effects);
        let mut after: Vec<(Quantity, Quantity)> =
            last.joint.fits.iter().map(wn_and_zeta).collect();
        let rows = plain.iter().zip(&last.joint.fits).enumerate();
        let mut releases: Vec<ReleaseVerdict> =
            rows.map(|(i, (plain, fit))| self.release(i, plain, fit)).collect();
        let worst = worst(&last.joint.fits, decays);
        let shown = |rms_rad: f64| decays[0].measurand.shown(rms_rad);
        let mut out = CampaignDiagnosis {
            said: decays[0].measurand.said(),
            noise_rms_deg: shown(mean_square(decays, |d| d.sample_noise_rad)),
            status,
            mean_noise_deg: shown(mean_square(decays, |d| d.noise_rad)),
            indistinguishable: judged.alone.indistinguishable(&effects),
            sentence: account::sentence(&effects, &left, SECOND_ORDER),
            effects,
            left,
            origin: BTreeMap::new(),
            origin_reason: BTreeMap::new(),
            sharing: BTreeMap::new(),
            modal: None,
            held_out: steps[0].0,
            steps: steps.into_iter().map(|s| s.1).collect(),
            candidates: judged.alone.candidates(),
            coefficients: BTreeMap::new(),
            where_: compare::locate(&decays[worst], &last.joint.fits[worst]),
            where_release: releases[worst].file.clone(),
            releases: Vec::new(),
            derivatives: None,
        };
        if let Some(forced) = &forced {
            for (i, b) in forced.iter().enumerate() {
                let [_, u_wn, u_zeta] = b.deviations;
                after[i] = (
                    Quantity::new(b.natural_frequency_rad_s, u_wn),
                    Quantity::new(b.damping_ratio, u_zeta),
                );
                releases[i].residual_over_noise = b.over_noise;
                releases[i].explained = b.over_noise <= ABOVE_NOISE;
                releases[i].at_amplitude.clear();
                releases[i].covariance = None;
                (releases[i].natural_frequency_rad_s, releases[i].damping_ratio) = after[i];
            }
            self.add_forced(&mut out, forced);
        } else {
            for effect in &last.effects {
                out.add(effect);
            }
        }
        out.releases = releases;
        let before = self.points(&self.linear(plain)?);
        let after = match out.effects.is_empty() {
            true => before.clone(),
            false => self.points(&self.identified(&after)),
        };
        out.derivatives = before.zip(after).map(|(before, after)| BeforeAndAfter { before, after });
        Ok(out)
    }

    /// The `i`th release with the plain model and with the last.
    fn release(&self, i: usize, plain: &Fitted, last: &Fitted) -> ReleaseVerdict {
        let (entry, decay) = (&self.made.release[i], &self.releases.decays[i]);
        let (natural_frequency_rad_s, damping_ratio) = wn_and_zeta(last);
        ReleaseVerdict {
            file: entry.file.clone(),
            spring: entry.spring.clone(),
            axis: entry.axis,
            wind_speed_m_s: entry.wind_speed_m_s,
            noise_rms_deg: decay.measurand.shown(decay.sample_noise_rad),
            natural_frequency_rad_s,
            damping_ratio,
            before_over_noise: plain.over_noise(decay),
            residual_over_noise: last.over_noise(decay),
            explained: is_explained(last, decay),
            at_amplitude: at_amplitudes(decay, last),
            covariance: last.named_covariance(),
        }
    }

    /// The verdict that a random moment moves the model.
    fn add_forced(&self, out: &mut CampaignDiagnosis, forced: &[Buffeted]) {
        let effect = Effect::random();
        // Where there is none the likelihood is flat in ln q, and gives no deviation.
        let intensity = |i: usize| {
            let q = forced[i].intensity;
            Some(Quantity::new(q, q * forced[i].deviations[0].min(MOST_LOG_DEVIATION)))
        };
        let seen = self.by_condition(intensity);
        let (origin, reason) = origin::decide(&seen, &effect.parameters()[0].unit);
        let groups = (0..forced.len()).map(Some).collect();
        let plan = Plan { name: OWN, groups };
        let decays = &self.releases.decays;
        let mean = |of: &dyn Fn(usize) -> f64| {
            ((0..decays.len()).map(|i| of(i).powi(2)).sum::<f64>() / decays.len() as f64).sqrt()
        };
        let over = mean(&|i| forced[i].over_noise);
        // The plain mean over the releases it is in: weights by its own uncertainty would favour the weakest.
        let is_in =
            |i: &usize| origin != Origin::Aerodynamic || self.releases.wind_speed_m_s[*i] > 0.0;
        let levels: Vec<Quantity> = (0..forced.len()).filter(is_in).filter_map(intensity).collect();
        let n = levels.len().max(1) as f64;
        let level = Quantity::new(
            levels.iter().map(|q| q.value).sum::<f64>() / n,
            levels.iter().map(|q| q.u * q.u).sum::<f64>().sqrt() / n,
        );
        out.steps.truncate(1);
        out.steps.push(Step {
            added: Some(effect.clone()),
            residual_rms_deg: mean(&|i| {
                decays[i].raw_rms_deg(forced[i].over_noise * decays[i].noise_rad)
            }),
            residual_over_noise: over,
            // The filter's innovations are one step ahead throughout.
            held_out_over_noise: over,
            parameters: BTreeMap::from([(effect.first_name(), level)]),
        });
        let explained = forced.iter().all(|b| b.over_noise <= ABOVE_NOISE);
        out.status = if explained { Status::Explained } else { Status::Unexplained };
        out.effects = vec![effect.clone()];
        out.indistinguishable.clear();
        out.left.is_of_innovations(over * out.mean_noise_deg, explained);
        out.sentence = account::sentence(&out.effects, &out.left, SECOND_ORDER);
        out.add(&SharedEffect { effect, origin, reason, plan, seen });
    }

    /// Each release as `derivatives` takes it, so that both say the same; where least squares has no answer,
    /// by its plain model.
    fn linear(&self, plain: &[Fitted]) -> Result<Vec<Identified>> {
        let fitted = self.identified(&plain.iter().map(wn_and_zeta).collect::<Vec<_>>());
        let found = self.records.par_iter().zip(fitted).map(|(record, fitted)| {
            self.releases.check()?;
            let found = identify(record, &[Method::LeastSquares], &Settings::default()).ok();
            Ok(found.and_then(Identified::of).unwrap_or(fitted))
        });
        found.collect()
    }

    /// wn and zeta of each release's free decay.
    fn identified(&self, modal: &[(Quantity, Quantity)]) -> Vec<Identified> {
        let of = |(&(wn, zeta), decay): (&(Quantity, Quantity), &FreeDecay)| {
            let begun_s = decay.release_time_s + decay.grid.start_s;
            let ended_s = decay.release_time_s + decay.grid.time_s(decay.grid.count);
            Identified::new(wn, zeta, begun_s, ended_s)
        };
        modal.iter().zip(&self.releases.decays).map(of).collect()
    }

    /// The derivatives with these wn and zeta; `None` where there is no point to compute. Coefficients that
    /// releases share make their errors alike; the propagation takes them for independent.
    fn points(&self, identified: &[Identified]) -> Option<Vec<Point>> {
        let computed = Computed::new(self.made, identified).ok()?;
        Some(computed.table(Path::new(""), "least-squares").points)
    }
}

impl CampaignDiagnosis {
    fn add(&mut self, shared: &SharedEffect) {
        let id = shared.effect.to_string();
        let parameter = &shared.effect.parameters()[0];
        self.origin.insert(id.clone(), shared.origin);
        self.origin_reason.insert(id.clone(), shared.reason.clone());
        self.sharing.insert(id.clone(), shared.plan.name);
        let rows = shared.seen.iter().map(|seen| Coefficient {
            spring: seen.spring.clone(),
            axis: seen.axis,
            wind_speed_m_s: seen.wind_speed_m_s,
            name: parameter.name.to_string(),
            unit: parameter.unit.to_string(),
            quantity: seen.coefficient,
        });
        self.coefficients.insert(id, rows.collect());
    }
}

fn wn_and_zeta(fit: &Fitted) -> (Quantity, Quantity) {
    (fit.natural_frequency_rad_s(), fit.damping_ratio())
}
