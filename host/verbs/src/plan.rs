//! `plan`: which release next.

use super::choices::Derivative;
use super::common::{bar, bare, print_json, print_line, SCHEMA_VERSION};
use crate::answer::{Answer, Progress};
use clap::Args;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use yawrig_base::error::Result;
use yawrig_core::bic::MARGIN;
use yawrig_model::plan::{self, PlanRequest, Planned};

/// Rows printed.
const ROWS: usize = 12;

/// Say which release would tell rival models apart, and which would narrow a derivative's error
///
/// The rivals are the model and what does about as well in the place of one of its effects, or what --rival
/// names. Each is simulated at every release that the rig can make, every other is fitted to that within what
/// the records so far leave open, and the releases are ranked by how far they part them. What the rig can do
/// stands in a table [can] of the file (amplitudes_deg, seconds, natural_frequencies_rad_s, springs,
/// wind_speeds_m_s, axes); without it, it is what it has done at 0.25 to 2 times the amplitude and up to
/// twice the length.
#[allow(rustdoc::broken_intra_doc_links)] // `[can]` is TOML, and the text is the program's help.
#[derive(Args, Debug, Clone)]
pub struct Plan {
    /// A model's file, or a campaign
    #[arg(value_name = "MODEL|campaign.toml")]
    pub file: PathBuf,
    /// A model that competes, by its effects (EFFECT+EFFECT; measured_law: the model's; repeatable)
    #[arg(long = "rival", value_name = "EFFECTS")]
    pub rivals: Vec<String>,
    /// Of a campaign: the derivative whose error one more release is to narrow
    #[arg(long, value_enum, default_value_t)]
    pub derivative: Derivative,
    /// Print one JSON object
    #[arg(short, long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Object<'a> {
    schema_version: u32,
    #[serde(flatten)]
    planned: &'a Planned,
    seconds: f64,
}

impl Plan {
    pub fn run(&self) -> Result<()> {
        let begin = std::time::Instant::now();
        let asked = self.asked()?;
        yawrig_base::say!("fitting rivals");
        let bar = bar(0, "releases");
        let planned = plan::plan(&self.file, &asked, &|count| match count {
            Some(count) => bar.set_length(count as u64),
            None => bar.inc(1),
        })?;
        bar.finish_and_clear();
        if self.json {
            return print_json(&object(&planned, begin));
        }
        print_line(text(&planned).trim_end())
    }

    /// The answer that `--json` prints.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, progress: &Progress) -> Result<Answer> {
        let begin = std::time::Instant::now();
        let (done, all) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let planned = plan::plan(&self.file, &self.asked()?, &|count| match count {
            Some(count) => all.store(count, Ordering::Relaxed),
            None => {
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, all.load(Ordering::Relaxed));
            }
        })?;
        let sentence = format!("rivals: {}", planned.rivals.join(", "));
        Answer::new(&object(&planned, begin), sentence)
    }

    fn asked(&self) -> Result<PlanRequest> {
        let set = |text: &String| -> Vec<String> {
            text.split('+').filter(|e| *e != "second_order").map(str::to_owned).collect()
        };
        let rivals: Vec<Vec<String>> = self.rivals.iter().map(set).collect();
        if rivals.len() == 1 {
            return Err(yawrig_base::error::Error::usage(
                "one --rival alone has nothing to compete with",
            )
            .help("name two or more, or none: then they are looked for"));
        }
        Ok(PlanRequest { rivals, derivative: Some(self.derivative.of()) })
    }
}

fn object(planned: &Planned, begin: std::time::Instant) -> Object<'_> {
    let seconds = begin.elapsed().as_secs_f64();
    Object { schema_version: SCHEMA_VERSION, planned, seconds }
}

fn text(planned: &Planned) -> String {
    let mut out = format!("rivals: {}\n", planned.rivals.join(", "));
    for note in &planned.notes {
        let _ = writeln!(out, "{note}");
    }
    let header = [
        "amplitude (deg)",
        "length (s)",
        "wn (rad/s)",
        "made under",
        "parted by (sigma)",
        "decides (%)",
    ];
    let mut table = bare(&header);
    for ranked in planned.releases.iter().take(ROWS) {
        let r = &ranked.release;
        let made = match (&r.spring, r.axis, r.wind_speed_m_s) {
            (Some(spring), Some(axis), Some(wind)) => format!("{spring} {axis} {wind} m/s"),
            _ if r.repeated => "as before".to_owned(),
            _ => "another spring".to_owned(),
        };
        table.add_row([
            format!("{:.1}", r.amplitude_deg),
            format!("{:.1}", r.seconds),
            format!("{:.3}", r.natural_frequency_rad_s),
            made,
            format!("{:.1}", ranked.separation_sigma),
            format!("{:.0}", 100.0 * ranked.chance_to_decide),
        ]);
    }
    let _ = writeln!(out, "\n{}", table.trim_fmt());
    let _ = writeln!(
        out,
        "decides: that the wrong rivals' BIC over old and new records is worse by {MARGIN}, whichever is right"
    );
    if !planned.precision.is_empty() {
        let mut table = bare(&["one more release", "narrows", "from u", "to u"]);
        for n in planned.precision.iter().take(ROWS) {
            table.add_row([
                format!("{} {} {} m/s", n.spring, n.axis, n.wind_speed_m_s),
                format!("{} of {} at {} m/s", n.derivative, n.point_spring, n.point_wind_speed_m_s),
                format!("{:.2e}", n.u),
                format!("{:.2e}", n.u_after),
            ]);
        }
        let _ = writeln!(out, "\n{}", table.trim_fmt());
    }
    out
}
