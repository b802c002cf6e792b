//! Another campaign's derivatives beside this one's.

use super::escape::escaped;
use super::table::table;
use super::{data, Beside, PointReport, Report};
use serde::Deserialize;
use std::fmt::Write as _;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_campaign::{evaluate, CampaignFile, Identify};
use yawrig_core::derivatives::condition::is_same_speed;
use yawrig_core::quantity::Quantity;

/// Of a report's data, which may hold numbers elsewhere that are not known.
#[derive(Deserialize)]
struct Known {
    title: String,
    points: Vec<PointReport>,
}

/// Of a campaign's file, whose records are identified by `identify`, or of a report that was made of one.
///
/// # Errors
/// Exit 3 where it is neither, or holds no derivatives.
pub fn read(path: &Path, method: &str, identify: &Identify) -> Result<Beside> {
    let named = path.display();
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let table = evaluate(&CampaignFile::read(path)?, method, identify)?;
        let points = table.points.iter().map(PointReport::from).collect();
        return Ok(Beside { name: format!("{} ({named})", table.model), points });
    }
    let none = |why: &dyn std::fmt::Display| {
        Error::data(format!("{named}: {why}")).help(format!(
            "name a campaign.toml, or the report of one, after {}",
            settings::name("beside")
        ))
    };
    let text = std::fs::read_to_string(path).map_err(|e| none(&e))?;
    let data = data::of(&text).ok_or_else(|| none(&"there is no report's data in it"))?;
    let other: Known = serde_json::from_str(data).map_err(|e| none(&e))?;
    match other.points.is_empty() {
        true => Err(none(&"there are no derivatives in it")),
        false => Ok(Beside { name: format!("{} ({named})", other.title), points: other.points }),
    }
}

/// Each point that both have: this less the other, and in standard uncertainties of the difference.
pub(super) fn section(report: &Report) -> String {
    let Some(beside) = &report.beside else { return String::new() };
    let mut rows = Vec::new();
    for point in &report.points {
        let is_it = |other: &&PointReport| {
            other.spring == point.spring
                && other.at == point.at
                && is_same_speed(other.wind_speed_m_s, point.wind_speed_m_s)
        };
        let Some(other) = beside.points.iter().find(is_it) else { continue };
        for (name, this, that) in [
            ("Cn_beta", Some(point.cn_beta), Some(other.cn_beta)),
            ("Cn_r", Some(point.cn_r), Some(other.cn_r)),
            ("Cy_beta", point.cy_beta, other.cy_beta),
            ("Cy_r", point.cy_r, other.cy_r),
        ] {
            let (Some(this), Some(that)) = (this, that) else { continue };
            let less = Quantity::new(this.value - that.value, this.u.hypot(that.u));
            rows.push([
                escaped(&format!("{} {}", point.spring, point.at)),
                name.to_owned(),
                this.to_string(),
                that.to_string(),
                less.to_string(),
                format!("{:+.1}", less.value / less.u),
            ]);
        }
    }
    let mut out = format!("<h3>Beside {}</h3>\n", escaped(&beside.name));
    if rows.is_empty() {
        out.push_str("<p>No spring was released at one wind speed in both.</p>\n");
        return out;
    }
    let header = ["spring", "", "here", "there", "difference", "difference / u"];
    let _ = writeln!(
        out,
        "{}<p class=\"note\">The uncertainty of a difference takes both as independent: instruments that both \
         share make it less.</p>",
        table(&header, 2, rows)
    );
    out
}
