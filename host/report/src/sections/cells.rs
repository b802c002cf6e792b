//! Drawings and quantities of a section.

use crate::charts::Chart;
use crate::escape::escaped;
use crate::plot::Plot;
use yawrig_base::error::Result;
use yawrig_core::quantity::Quantity;

/// A chart, each plot a drawing of its own: one is as high as a printed page has room for, several may not
/// be.
pub(super) fn figure(chart: &Chart) -> Result<String> {
    let alone = |plot: &Plot| {
        Chart { name: chart.name, caption: plot.title.clone(), plots: vec![plot.clone()] }.inline()
    };
    let drawings = chart.plots.iter().map(alone).collect::<Result<String>>()?;
    Ok(format!(
        "<figure>\n{drawings}<figcaption>{}</figcaption>\n</figure>\n",
        escaped(&chart.caption)
    ))
}

pub(super) fn shown(q: Option<Quantity>) -> String {
    q.map_or("-".to_owned(), quantity)
}

/// An uncertainty that is not known is not shown.
pub(super) fn quantity(q: Quantity) -> String {
    match q.u.is_finite() && q.u > 0.0 {
        true => q.to_string(),
        false => format!("{:.6}", q.value),
    }
}
