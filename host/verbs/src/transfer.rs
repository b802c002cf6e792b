//! `derivatives --transfer`: both columns against reduced frequency as one cause, in words, in files.

use super::common::{bare, wrapped};
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::at::At;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::{Point, Table};
use yawrig_core::derivatives::transfer::{AtPoint, Refused, Transfer};
use yawrig_core::derivatives::Computed;
use yawrig_core::diagnosis::wind::Dimensionless;
use yawrig_core::quantity::Quantity;
use yawrig_text::quoted;

/// Names in the folder that it is written to.
const PICTURE: &str = "transfer.svg";
const EFFECT: &str = "wake_lag.toml";
/// Of each lag in it: what multiplies the state, its rate and itself.
const NAMES: [(&str, &str, &str); 2] = [("c", "p", "x"), ("c2", "p2", "z")];

#[derive(Args, Debug, Clone)]
pub struct TransferArgs {
    /// Fit Cn_beta and Cn_r of all springs and wind speeds as one cause, a transfer function with up to two
    /// lags, and say whether quasi-steady derivatives would do
    #[arg(long, conflicts_with = "table")]
    pub transfer: bool,
    /// Where the transfer function is drawn (transfer.svg) and its lag written as an effect (wake_lag.toml)
    #[arg(short, long, value_name = "FOLDER", requires = "transfer")]
    pub out: Option<PathBuf>,
}

/// A method's table, with its transfer functions where these were asked for.
#[derive(Serialize)]
pub struct Reported {
    #[serde(flatten)]
    pub table: Table,
    #[serde(flatten)]
    pub transfers: Option<Transfers>,
    /// By a model's effect that the air makes.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub dimensionless: BTreeMap<String, Dimensionless>,
}

/// The transfer functions of a table: of its first setting that has one, and of the others.
#[derive(Clone, Serialize)]
pub struct Transfers {
    transfer: Transfer,
    #[serde(rename = "transfer_others", skip_serializing_if = "Vec::is_empty")]
    others: Vec<Transfer>,
    #[serde(rename = "transfer_refused", skip_serializing_if = "Vec::is_empty")]
    refused: Vec<Refused>,
}

impl Transfers {
    /// # Errors
    /// Exit 3 where no setting has points enough.
    pub fn new(file: &CampaignFile, table: &Table) -> Result<Self> {
        let identified: Vec<Identified> =
            table.releases.iter().map(|release| release.identified.clone()).collect();
        let (mut found, mut refused) = (Vec::new(), Vec::new());
        for one in Computed::new(&file.campaign, &identified)?.transfers() {
            match one {
                Ok(one) => found.push(one),
                Err(why) => refused.push(why),
            }
        }
        if found.is_empty() {
            let Refused { why, help, .. } = refused.swap_remove(0);
            let message = format!("{}: no transfer function: {why}", file.path.display());
            return Err(Error::data(message).help(help));
        }
        Ok(Self { transfer: found.remove(0), others: found, refused })
    }

    fn all(&self) -> impl Iterator<Item = &Transfer> {
        std::iter::once(&self.transfer).chain(&self.others)
    }

    /// The picture and the effect in `folder`, of several settings in a folder each.
    ///
    /// # Errors
    /// Exit 3 where they cannot be written.
    pub fn write(&self, folder: &Path, file: &CampaignFile, table: &Table) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        for (k, transfer) in self.all().enumerate() {
            let its = match k {
                0 => folder.to_owned(),
                k => folder.join(format!("setting-{}", k + 1)),
            };
            files::make_folder(&its)?;
            let mut write = |name: &str, text: String| -> Result<()> {
                let path = its.join(name);
                files::write_atomically(&path, text.as_bytes())?;
                written.push(path);
                Ok(())
            };
            write(PICTURE, yawrig_report::transfer(table, transfer).file()?)?;
            if let Some(text) = effect(file, table, transfer) {
                write(EFFECT, text)?;
            }
        }
        Ok(written)
    }

    /// As a reader wants it.
    pub fn text(&self, file: &CampaignFile, table: &Table, written: &[PathBuf]) -> String {
        let mut text: Vec<String> = self.all().map(|t| of_setting(file, table, t)).collect();
        text.extend(self.refused.iter().map(|refused| {
            let why = format!("{}no transfer function: {}", heading(&refused.at), refused.why);
            wrapped(&why, 80, "  ").join("\n")
        }));
        if !written.is_empty() {
            let names: Vec<String> =
                written.iter().map(|path| quoted(&path.display().to_string())).collect();
            text.push(format!("Written: {}", names.join(", ")));
        }
        let is_effect = |path: &&PathBuf| path.ends_with(EFFECT);
        text.extend(written.iter().find(is_effect).and_then(|path| {
            let transfer = self.all().find(|transfer| transfer.lags > 0)?;
            let lags = lags(file, table, transfer);
            let numbers = lags.iter().zip(NAMES).map(|(lag, (c, p, _))| {
                format!("{c}={},{p}={}", digits(lag.moment.value), digits(lag.rate.value))
            });
            let numbers = numbers.collect::<Vec<_>>().join(",");
            let effect = quoted(&format!("{}:{numbers}", path.display()));
            Some(format!("A rig with it: yawrig simulate --campaign lagged --effect {effect}"))
        }));
        text.join("\n\n")
    }

    /// What the transfer function has at a point of the table, and its numbers: lags, parameters, chi squared.
    pub fn cells(&self, point: &Point) -> Option<(&AtPoint, usize, String)> {
        let transfer = self.all().find(|transfer| transfer.at == point.at)?;
        let its = transfer.points.iter().find(|at| is_of(at, point))?;
        let named = transfer.parameters.named();
        let numbers: Vec<String> =
            named.iter().map(|(name, q)| format!("{name}={}+-{}", q.value, q.u)).collect();
        let judged = transfer.chosen;
        let chi = format!("chi_squared={} degrees={}", judged.chi_squared, judged.degrees);
        Some((its, transfer.lags, format!("{} {chi}", numbers.join(" "))))
    }
}

fn is_of(at: &AtPoint, point: &Point) -> bool {
    at.spring == point.spring && at.wind_speed_m_s == point.wind_speed_m_s
}

fn heading(at: &At) -> String {
    match at.is_empty() {
        true => String::new(),
        false => format!("At {at}: "),
    }
}

fn of_setting(file: &CampaignFile, table: &Table, transfer: &Transfer) -> String {
    let formula = match transfer.lags {
        0 => "Cn = a0 + a1 s'",
        1 => "Cn = a0 + a1 s' + a2 s'/(s' + b)",
        _ => "Cn = a0 + a1 s' + a2 s'/(s' + b) + a3 s'/(s' + b2)",
    };
    let mut text = vec![format!(
        "{}As one transfer function, {formula},\ns' = s l/V, at km: s' = i 2 km",
        heading(&transfer.at)
    )];
    text.extend(transfer.sentences.iter().flat_map(|said| wrapped(said, 80, "  ")));
    let parameters = transfer.parameters.named().into_iter().map(|(name, q)| {
        let shown =
            if q.u.is_finite() { q.to_string() } else { format!("{:.3}, a limit", q.value) };
        format!("  {name:<3} {shown}")
    });
    text.extend(parameters);
    text.extend(in_time(file, table, transfer));
    text.push(String::new());
    text.push(rows(table, transfer).trim_fmt());
    text.push(
        "off: measured less transfer function, in the measured standard uncertainty.".to_owned(),
    );
    text.join("\n")
}

fn rows(table: &Table, transfer: &Transfer) -> comfy_table::Table {
    let mut rows = bare(&["spring", "V m/s", "km", "Cn_beta", "off", "Cn_r", "off"]);
    for at in &transfer.points {
        let its = |p: &&Point| p.at == transfer.at && is_of(at, p);
        let off = |fitted: Quantity, of: fn(&Point) -> Quantity| {
            table.points.iter().find(its).map_or(String::new(), |point| {
                format!("{:+.1}", (of(point).value - fitted.value) / of(point).u)
            })
        };
        rows.add_row([
            at.spring.clone(),
            format!("{:.2}", at.wind_speed_m_s),
            format!("{:.3}", at.reduced_frequency),
            at.cn_beta.to_string(),
            off(at.cn_beta, |p| p.cn_beta),
            at.cn_r.to_string(),
            off(at.cn_r, |p| p.cn_r),
        ]);
    }
    rows
}

/// A lag in time: its state, x' = r - rate V x, makes the moment `moment` V^2 x over Izz.
struct Lag {
    moment: Quantity,
    rate: Quantity,
}

fn lags(file: &CampaignFile, table: &Table, transfer: &Transfer) -> Vec<Lag> {
    let Some(inertia) = table.inertia_kg_m2.mid else { return Vec::new() };
    let model = &file.campaign.model;
    let scale = 0.5 * file.campaign.air.density_kg_m3 * model.frontal_area_m2 * model.length_m
        / inertia.value;
    let times = |q: Quantity, by: f64| Quantity::new(by * q.value, by * q.u);
    let each = transfer.parameters.lags().into_iter();
    each.map(|[a, b]| Lag { moment: times(a, scale), rate: times(b, model.length_m.recip()) })
        .collect()
}

/// How a lag is put into a model.
fn in_time(file: &CampaignFile, table: &Table, transfer: &Transfer) -> Vec<String> {
    let each = lags(file, table, transfer).into_iter().enumerate().map(|(k, lag)| {
        let (_, _, x) = NAMES[k];
        format!(
            "  in time: moment/Izz = {} V^2 {x} rad/s2, d{x}/dt = r - {} V {x}",
            digits(lag.moment.value),
            digits(lag.rate.value)
        )
    });
    each.collect()
}

/// Six digits of a number, whatever its size.
fn digits(x: f64) -> String {
    format!("{x:.5e}").parse().map_or_else(|_| x.to_string(), |rounded: f64| format!("{rounded:?}"))
}

/// The lags as an effect of the user's own; none without a lag.
fn effect(file: &CampaignFile, table: &Table, transfer: &Transfer) -> Option<String> {
    let (mut moment, mut states, mut parameters) = (Vec::new(), String::new(), String::new());
    for (lag, (c, p, x)) in lags(file, table, transfer).iter().zip(NAMES) {
        moment.push(format!("{c} * wind^2 * {x}"));
        let _ = write!(
            states,
            "[[state]]\nname = \"{x}\"\nunit = \"rad\"\nrate = \"r - {p} * wind * {x}\"   # d{x}/dt\nstart = \"0\"\n"
        );
        let ([c_start, p_start], [c_u, p_u]) = (
            [lag.moment.value, lag.rate.value].map(digits),
            [lag.moment.u, lag.rate.u].map(digits),
        );
        let _ = write!(
            parameters,
            "{c} = {{ unit = \"1/m2\", start = {c_start} }}   # u {c_u}\n\
             {p} = {{ unit = \"1/m\", start = {p_start}, min = 0.0 }}   # u {p_u}\n"
        );
    }
    let text = format!(
        "# The lag of the wind's moment in {}, from its derivatives against reduced frequency.\n\
         # Beside it the model's own natural frequency and damping hold a0 and a1. A fit in which each condition has\n\
         # its own of these does not determine it: the lag shows between the springs.\n\
         id = \"wake_lag\"\ntitle = \"A wind moment that follows the yaw rate late\"\n\
         moment = \"{}\"   # rad/s2\n{states}[parameters]\n{parameters}",
        file.path.file_name()?.to_string_lossy().replace('\n', " "),
        moment.join(" + ")
    );
    (!moment.is_empty()).then_some(text)
}
