//! What each number of a campaign usually is in its unit, and what it can be.

use super::super::campaign::Campaign;
use super::super::doubt::{Doubt, Kind};

/// A number's name, unit and ranges, outside of which it is doubted or refused.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// The file's section; empty in a release or for a spring.
    pub section: &'static str,
    /// The entry.
    pub name: &'static str,
    /// As it is written behind a number.
    pub unit: &'static str,
    /// Of wind tunnels and of rigs on tables.
    pub usual: [f64; 2],
    /// Of anything.
    pub possible: [f64; 2],
    /// Numbers in other units are so many times as large.
    units: &'static [(f64, &'static str)],
}

/// Of model, air and rig, in the order of the file.
pub const RANGES: [Range; 5] = [
    Range {
        section: "model",
        name: "length_m",
        unit: "m",
        usual: [0.1, 6.0],
        possible: [0.005, 50.0],
        units: &LENGTHS,
    },
    Range {
        section: "model",
        name: "frontal_area_m2",
        unit: "m2",
        usual: [5e-4, 5.0],
        possible: [1e-5, 100.0],
        units: &[(1e6, "mm2"), (1e4, "cm2")],
    },
    DENSITY,
    Range {
        section: "rig",
        name: "spring_arm_m",
        unit: "m",
        usual: [0.01, 2.0],
        possible: [1e-3, 20.0],
        units: &LENGTHS,
    },
    Range {
        section: "rig",
        name: "axis_offset_m",
        unit: "m",
        usual: [0.005, 1.0],
        possible: [1e-4, 20.0],
        units: &LENGTHS,
    },
];
const DENSITY: Range = Range {
    section: "air",
    name: "density_kg_m3",
    unit: "kg/m3",
    usual: [0.9, 1.4],
    possible: [0.05, 1100.0],
    units: &[(1e3, "g/m3"), (1e-3, "g/cm3")],
};
/// Of one spring. On two of the least usual ones, at an arm of 0.5 m, 1 kg m2 turns at 1 rad/s: few tunnels
/// wait longer.
pub const STIFFNESS: Range = Range {
    section: "",
    name: "spring_stiffness_n_per_m",
    unit: "N/m",
    usual: [2.0, 500_000.0],
    possible: [0.01, 1e7],
    units: &[(1e-3, "N/mm"), (1.0 / 9.806_65, "kgf/m"), (1e-2, "N/cm")],
};
/// With the wind on.
pub const WIND: Range = Range {
    section: "",
    name: "wind_speed_m_s",
    unit: "m/s",
    usual: [1.0, 70.0],
    possible: [0.01, 300.0],
    units: &[(3.6, "km/h")],
};
const LENGTHS: [(f64, &str); 3] = [(1e3, "mm"), (1e2, "cm"), (1.0 / 0.0254, "in")];

/// Endings of names behind a number that say a unit of speed, and m/s in one of it.
const SPEEDS: [(&str, f64); 6] = [
    ("kmh", 1.0 / 3.6),
    ("km-h", 1.0 / 3.6),
    ("km_h", 1.0 / 3.6),
    ("kph", 1.0 / 3.6),
    ("mph", 0.447_04),
    ("kn", 0.514_444),
];

/// Metres a second in one of the unit that `text` begins with, and the unit as it stands there.
pub fn speed_unit(text: &str) -> Option<(&'static str, f64)> {
    let text = text.trim_start_matches([' ', '_', '-']).to_ascii_lowercase();
    let ends = |unit: &str| {
        text.strip_prefix(unit).is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphabetic()))
    };
    SPEEDS.into_iter().find(|(unit, _)| ends(unit))
}

impl Range {
    /// The usual range in words.
    pub fn usual_text(&self) -> String {
        format!("{}; usual: {} to {}", self.unit, self.usual[0], self.usual[1])
    }

    fn doubt(&self, value: f64, of: &str) -> Option<Doubt> {
        let outside = |[least, most]: [f64; 2]| !(least..=most).contains(&value);
        if !outside(self.usual) {
            return None;
        }
        let is_usual = |x: &f64| (self.usual[0]..=self.usual[1]).contains(x);
        let unit = self.units.iter().find(|(factor, _)| is_usual(&(value / factor)));
        let asked = unit.map_or(String::new(), |(factor, unit)| {
            format!(": it would be {:.4} {} if it were in {unit}", value / factor, self.unit)
        });
        let Self { name, unit, usual: [least, most], possible, .. } = self;
        Some(
            Doubt::new(
                Kind::OutOfRange,
                format!("{name}{of} is {value} {unit}, usual are {least} to {most} {unit}{asked}"),
                format!("possible are {} to {} {unit}", possible[0], possible[1]),
            )
            .error_if(outside(*possible)),
        )
    }
}

/// Numbers out of range, by themselves and beside each other.
pub(super) fn doubts(campaign: &Campaign) -> Vec<Doubt> {
    let Campaign { model, air, rig, release, .. } = campaign;
    let values = [
        model.length_m,
        model.frontal_area_m2,
        air.density_kg_m3,
        rig.spring_arm_m,
        rig.axis_offset_m,
    ];
    let mut all = Vec::new();
    for (range, value) in RANGES.iter().zip(values) {
        let field = format!("{}.{}", range.section, range.name);
        all.extend(range.doubt(value, "").map(|doubt| doubt.field(&field)));
    }
    let mut springs: Vec<&str> = Vec::new();
    for (index, entry) in release.iter().enumerate() {
        if !springs.contains(&entry.spring.as_str()) {
            springs.push(&entry.spring);
            let of = format!(" of spring {}", entry.spring);
            let doubt = STIFFNESS.doubt(entry.spring_stiffness_n_per_m, &of);
            all.extend(doubt.map(|doubt| doubt.at(index, STIFFNESS.name)));
        }
        if let Some(density) = entry.density_kg_m3 {
            let doubt = DENSITY.doubt(density, &format!(" of {}", entry.file));
            all.extend(doubt.map(|doubt| doubt.at(index, DENSITY.name)));
        }
        if entry.wind_speed_m_s > 0.0 {
            let doubt = WIND.doubt(entry.wind_speed_m_s, &format!(" of {}", entry.file));
            all.extend(doubt.map(|doubt| doubt.at(index, WIND.name)));
            all.extend(
                named_otherwise(&entry.file, entry.wind_speed_m_s).map(|d| d.at(index, WIND.name)),
            );
        }
    }
    if !all.iter().any(|doubt| doubt.is_error) {
        all.extend(beside(campaign));
    }
    all.extend(uncertainties(campaign));
    all
}

/// A record's name that gives its wind speed in another unit.
fn named_otherwise(file: &str, wind_speed_m_s: f64) -> Option<Doubt> {
    let is_number = |c: char| c.is_ascii_digit() || c == '.' || c == ',';
    let starts = file
        .char_indices()
        .filter(|(at, c)| c.is_ascii_digit() && !file[..*at].ends_with(is_number));
    starts.into_iter().find_map(|(at, _)| {
        let digits: String = file[at..].chars().take_while(|c| is_number(*c)).collect();
        let said: f64 = digits.replace(',', ".").parse().ok()?;
        let (unit, m_s) = speed_unit(&file[at + digits.len()..])?;
        let is_it = (said - wind_speed_m_s).abs() < 0.01 * said;
        is_it.then(|| {
            Doubt::new(
                Kind::WindUnit,
                format!(
                    "{file} is called {digits}{unit}, which is {:.3} m/s, and wind_speed_m_s is {wind_speed_m_s}",
                    said * m_s
                ),
                format!("factor {:.4}", 1.0 / m_s),
            )
        })
    })
}

/// Sizes that do not go with the model's length.
fn beside(campaign: &Campaign) -> Vec<Doubt> {
    let (model, rig) = (&campaign.model, &campaign.rig);
    let length = model.length_m;
    let square = model.frontal_area_m2 / (length * length);
    let mut all = Vec::new();
    if !(0.005..=1.5).contains(&square) {
        all.push(
            Doubt::new(
                Kind::OutOfRange,
                format!(
                    "frontal_area_m2 is {} m2 for a length of {length} m: is the one in m2 and the other in m?",
                    model.frontal_area_m2
                ),
                format!("area over length squared {square:.3e}, a car's is 0.1"),
            )
            .field("model.frontal_area_m2")
            .error_if(!(1e-4..=20.0).contains(&square)),
        );
    }
    for (name, value, most) in
        [("axis_offset_m", rig.axis_offset_m, 1.0), ("spring_arm_m", rig.spring_arm_m, 2.0)]
    {
        let ratio = value / length;
        if ratio > most {
            let what = format!("{name} is {value} m for a model of {length} m: is it in m?");
            let evidence = format!("{ratio:.3} times its length");
            let doubt = Doubt::new(Kind::OutOfRange, what, evidence);
            all.push(doubt.field(&format!("rig.{name}")).error_if(ratio > 10.0 * most));
        }
    }
    all
}

/// Standard uncertainties as large as what they are of.
fn uncertainties(campaign: &Campaign) -> Vec<Doubt> {
    let Campaign { model, air, rig, release, .. } = campaign;
    let mut all = Vec::new();
    let mut of = |name: &str, value: f64, u: Option<f64>, index: Option<usize>| {
        let Some(u) = u.filter(|u| *u > 0.3 * value && value > 0.0) else { return };
        let what = format!(
            "{name} is {u}, the value itself {value}: is it in the value's unit, not in percent?"
        );
        let doubt = Doubt::new(Kind::OutOfRange, what, format!("{:.0} %", 100.0 * u / value));
        all.push(Doubt { release: index, ..doubt.field(name) });
    };
    of("model.length_u_m", model.length_m, model.length_u_m, None);
    of("model.frontal_area_u_m2", model.frontal_area_m2, model.frontal_area_u_m2, None);
    of("air.density_u_kg_m3", air.density_kg_m3, air.density_u_kg_m3, None);
    of("rig.spring_arm_u_m", rig.spring_arm_m, rig.spring_arm_u_m, None);
    of("rig.axis_offset_u_m", rig.axis_offset_m, rig.axis_offset_u_m, None);
    for (index, entry) in release.iter().enumerate() {
        of("wind_speed_u_m_s", entry.wind_speed_m_s, entry.wind_speed_u_m_s, Some(index));
        let (stiffness, u) = (entry.spring_stiffness_n_per_m, entry.spring_stiffness_u_n_per_m);
        of("spring_stiffness_u_n_per_m", stiffness, u, Some(index));
    }
    all
}
