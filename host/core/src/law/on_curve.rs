//! Formulas fitted to the curves of a measured law.

use super::forms::{moment, Form, FormParameter, Formula, Role, FORMS};
use super::tables::Point;
use crate::diagnosis::likelihood::BREADTH;
use crate::par_map::ParMap;
use nalgebra::{DMatrix, DVector};
use yawrig_expression::OwnEffect;

/// A formula on a curve: its parameters there, and how far it is from it.
pub(super) struct OnCurve {
    pub(super) formula: Formula,
    pub(super) values: Vec<f64>,
    pub(super) misfit: f64,
}

/// A form compiled by itself, one of angle and rate as the law of the rate that it is like.
fn alone(form: &'static Form) -> Option<OwnEffect> {
    let one = Formula { forms: vec![form] };
    one.effect(&one.typical(), (1.0, 1.0), |f| f.alike.unwrap_or(f.moment))
}

/// What a form takes from b'' at `x`, rad/s2.
fn opposing(form: &Form, alone: &OwnEffect, p: &[f64], x: f64, wn: f64) -> f64 {
    let (b, r) = if form.is_stiffness { (x, 0.0) } else { (0.0, x) };
    -moment(alone, p, b, r, wn)
}

fn products(lists: &[Vec<f64>]) -> Vec<Vec<f64>> {
    lists.iter().fold(vec![Vec::new()], |all, list| {
        all.iter()
            .flat_map(|head| list.iter().map(move |x| [head.as_slice(), &[*x]].concat()))
            .collect()
    })
}

/// A curve that formulas are fitted to.
pub(super) struct Target<'a> {
    points: Vec<&'a Point>,
    u: Vec<f64>,
    reach: f64,
    wn: f64,
}

impl<'a> Target<'a> {
    /// No point counts as better known than a hundredth of the largest moment of `curve`, for a formula need
    /// not go through each bend of a spline.
    pub(super) fn new(curve: &'a [Point], wn: f64) -> Self {
        let largest = curve.iter().fold(0.0f64, |m, p| m.max(p.moment_rad_s2.value.abs()));
        let points: Vec<&Point> = curve.iter().filter(|p| p.at != 0.0).collect();
        let u = points.iter().map(|p| p.moment_rad_s2.u.max(0.01 * largest)).collect();
        Self { points, u, reach: curve.last().map_or(1.0, |p| p.at), wn }
    }

    /// `forms` fitted beside a linear term, which natural frequency or damping ratio takes.
    fn fitted(&self, forms: &[&'static Form]) -> Option<OnCurve> {
        let tried = |p: &FormParameter| match p.role {
            Role::Size => vec![1.0],
            Role::Plain(tried) => tried.to_vec(),
            Role::OfReach(tried) => tried.iter().map(|x| x * self.reach).collect(),
        };
        let lists: Vec<Vec<f64>> = forms.iter().flat_map(|f| f.parameters).map(tried).collect();
        let Self { points, u, wn, .. } = self;
        let formula = Formula { forms: forms.to_vec() };
        let single: Vec<OwnEffect> = forms.iter().map(|form| alone(form)).collect::<Option<_>>()?;
        let mut best: Option<OnCurve> = None;
        for values in products(&lists) {
            // Each form at a size of one, and the linear term.
            let a = DMatrix::from_fn(points.len(), forms.len() + 1, |i, j| {
                let x = points[i].at;
                if j == forms.len() {
                    return x / u[i];
                }
                let begin: usize = forms[..j].iter().map(|f| f.parameters.len()).sum();
                let p = &values[begin..begin + forms[j].parameters.len()];
                opposing(forms[j], &single[j], p, x, *wn) / u[i]
            });
            let y = DVector::from_fn(points.len(), |i, _| points[i].moment_rad_s2.value / u[i]);
            let svd = a.clone().svd(true, true);
            let Ok(sizes) = svd.solve(&y, 1e-9) else { continue };
            let wrong = (0..forms.len()).any(|j| !forms[j].is_stiffness && sizes[j] <= 0.0);
            let misfit = (a * &sizes - y).norm_squared() / points.len() as f64;
            if wrong || !misfit.is_finite() || best.as_ref().is_some_and(|b| b.misfit <= misfit) {
                continue;
            }
            let mut found = values.clone();
            let mut begin = 0;
            for (j, form) in forms.iter().enumerate() {
                found[begin] *= sizes[j];
                begin += form.parameters.len();
            }
            best = Some(OnCurve { formula: formula.clone(), values: found, misfit });
        }
        best
    }

    /// The formulas of a kind that are nearest; without a sine where the motion is no angle.
    pub(super) fn nearest(&self, is_stiffness: bool, of_angle: bool) -> Vec<OnCurve> {
        let is_one = |f: &&Form| f.is_stiffness == is_stiffness && (of_angle || !f.is_of_angle());
        let forms: Vec<&'static Form> = FORMS.iter().filter(is_one).collect();
        let sorted = |mut all: Vec<OnCurve>, most: usize| {
            all.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
            all.truncate(most);
            all
        };
        let single = forms.iter().filter_map(|form| self.fitted(&[form])).collect();
        let pairs: Vec<[&'static Form; 2]> = forms
            .iter()
            .enumerate()
            .flat_map(|(k, a)| forms[..k].iter().map(move |b| [*b, *a]))
            .filter(|[a, b]| a.adds_to(b))
            .collect();
        let sums = pairs.iter().par_map(|pair| self.fitted(pair)).flatten().collect();
        let mut out = sorted(single, BREADTH);
        out.extend(sorted(sums, BREADTH));
        out
    }
}
