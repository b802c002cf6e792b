//! The transfer function of a table's derivatives, drawn.

use super::charts::Chart;
use super::plot::{Axis, Curve, Plot};
use yawrig_core::derivatives::table::{Point, Table};
use yawrig_core::derivatives::transfer::{CurvePoint, Transfer};
use yawrig_core::quantity::Quantity;

/// Both columns against reduced frequency: what was measured, the curve and its band.
pub fn transfer(table: &Table, transfer: &Transfer) -> Chart {
    type Of<T> = fn(&T) -> Quantity;
    let plot = |(name, label, of, on): (&str, &str, Of<Point>, Of<CurvePoint>)| {
        let points = table.points.iter().filter(|point| point.at == transfer.at);
        let bar = |p: &Point| (p.reduced_frequency, of(p).value, 2.0 * of(p).u);
        let line = |k: f64| -> Vec<(f64, f64)> {
            let at = |p: &CurvePoint| (p.reduced_frequency, on(p).value + k * on(p).u);
            transfer.curve.iter().map(at).collect()
        };
        let lags = match transfer.lags {
            0 => "quasi-steady".to_owned(),
            1 => "one lag".to_owned(),
            n => format!("{n} lags"),
        };
        // The band's two edges are one curve, broken by what is no number.
        let band = [line(-2.0), vec![(f64::NAN, f64::NAN)], line(2.0)].concat();
        Plot {
            title: format!("{name} per rad"),
            x: Axis::linear("reduced frequency km = pi f l / V"),
            y: Axis::linear(label),
            curves: vec![
                Curve::bars("measured, k = 2", points.map(bar).collect()),
                Curve::plain(lags, line(0.0)),
                Curve::dashed("its k = 2", band),
            ],
        }
    };
    let columns: [(&str, &str, Of<Point>, Of<CurvePoint>); 2] = [
        ("Cn_beta", "Cn_beta", |p| p.cn_beta, |p| p.cn_beta),
        ("Cn_r", "Cn_r - Cn_betadot", |p| p.cn_r, |p| p.cn_r),
    ];
    Chart {
        name: "transfer",
        caption: "Both derivatives as one transfer function, its band two standard uncertainties (k = 2).".to_owned(),
        plots: columns.map(plot).to_vec(),
    }
}
