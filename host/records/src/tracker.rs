//! Tracker, the video analysis of Open Source Physics (.trk): of each point mass time, position in its axes, and
//! direction from their origin.

use super::table::Channel;
use quick_xml::events::{BytesStart, Event};
use quick_xml::Reader;
use std::f64::consts::TAU;

const PANEL: &[u8] = b"org.opensourcephysics.cabrillo.tracker.TrackerPanel";
/// The panel stands in so many bytes.
const HEAD: usize = 512;

pub(super) fn is_one(head: &[u8]) -> bool {
    let head = &head[..head.len().min(HEAD)];
    head.windows(PANEL.len()).any(|at| at == PANEL)
}

/// Axes in the picture: where their origin is, in pixels, the direction of x against the picture's, in degrees,
/// anticlockwise, and pixels per unit.
#[derive(Clone, Copy)]
struct Axes {
    origin: [f64; 2],
    angle_deg: f64,
    scale: [f64; 2],
}

impl Axes {
    /// A place in the picture, whose y points down, in these axes, whose y points up.
    fn of(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.angle_deg.to_radians().sin_cos();
        let (right, up) = (x - self.origin[0], self.origin[1] - y);
        [(right * cos + up * sin) / self.scale[0], (up * cos - right * sin) / self.scale[1]]
    }
}

/// A point mass: its name, and the numbers of its frames with where it is in each.
#[derive(Default)]
struct Mass {
    name: String,
    marks: Vec<(u32, [f64; 2])>,
}

#[derive(Default)]
struct Open {
    frame_ms: Option<f64>,
    unit: Option<String>,
    axes: Vec<Axes>,
    masses: Vec<Mass>,
}

impl Open {
    /// What stands in a property, by the objects and properties that it stands in.
    fn take(&mut self, path: &[String], text: &str) -> Option<()> {
        let number = || text.parse::<f64>().ok().filter(|value| value.is_finite());
        let [.., holder, name] = path else { return Some(()) };
        match (holder.as_str(), name.as_str()) {
            ("StepperClipControl", "delta_t") => self.frame_ms = Some(number()?),
            ("TrackerPanel", "length_unit") => self.unit = Some(text.to_owned()),
            ("PointMass", "name") => self.masses.last_mut()?.name = text.to_owned(),
            ("PointMass$FrameData", axis @ ("x" | "y")) => {
                let mark = self.masses.last_mut()?.marks.last_mut()?;
                mark.1[usize::from(axis == "y")] = number()?;
            }
            ("ImageCoordSystem$FrameData", name) => {
                let axes = self.axes.last_mut()?;
                match name {
                    "xorigin" => axes.origin[0] = number()?,
                    "yorigin" => axes.origin[1] = number()?,
                    "angle" => axes.angle_deg = number()?,
                    "xscale" => axes.scale[0] = number()?,
                    "yscale" => axes.scale[1] = number()?,
                    _ => {}
                }
            }
            _ => {}
        }
        Some(())
    }

    /// Enters an object, in the property `within`.
    fn enter(&mut self, class: &str, within: &str) -> Option<()> {
        match class {
            "PointMass" => self.masses.push(Mass::default()),
            "PointMass$FrameData" => {
                let frame = within.trim_matches(['[', ']']).parse().ok()?;
                self.masses.last_mut()?.marks.push((frame, [f64::NAN; 2]));
            }
            "ImageCoordSystem$FrameData" => {
                self.axes.push(Axes { origin: [0.0; 2], angle_deg: 0.0, scale: [1.0; 2] });
            }
            _ => {}
        }
        Some(())
    }

    fn channels(self) -> Result<Vec<Channel>, String> {
        let frame_s =
            self.frame_ms.filter(|ms| *ms > 0.0).ok_or("it does not say how long a frame lasts")?;
        let [axes] = self.axes[..] else {
            return Err(
                "its axes move from picture to picture; save the table of the point's track from \
                 Tracker"
                    .to_owned(),
            );
        };
        if axes.scale.contains(&0.0) {
            return Err("a scale of its axes is zero".to_owned());
        }
        // Without a calibration a unit of length is a pixel, whatever it is called.
        let unit = if axes.scale == [1.0; 2] { Some("px".to_owned()) } else { self.unit };
        let several = self.masses.iter().filter(|mass| !mass.marks.is_empty()).count() > 1;
        let mut channels = Vec::new();
        for mut mass in self.masses {
            mass.marks.retain(|(_, at)| at.iter().all(|v| v.is_finite()));
            mass.marks.sort_unstable_by_key(|(frame, _)| *frame);
            let places: Vec<[f64; 2]> = mass.marks.iter().map(|(_, at)| axes.of(*at)).collect();
            let mut turned = 0.0;
            let directions = places.iter().map(|[x, y]| {
                let direction = y.atan2(*x);
                turned = direction + ((turned - direction) / TAU).round() * TAU;
                turned.to_degrees()
            });
            let directions: Vec<f64> = directions.collect();
            let time_s = mass.marks.iter().map(|(frame, _)| f64::from(*frame) * frame_s / 1000.0);
            let mut add = |name: &str, unit: Option<&str>, values: Vec<f64>| {
                let name = if several { format!("{}/{name}", mass.name) } else { name.to_owned() };
                let unit = unit.map(str::to_owned);
                channels.push(Channel { name, unit, step_s: None, values: Ok(values) });
            };
            if !places.is_empty() {
                add("t", Some("s"), time_s.collect());
                add("x", unit.as_deref(), places.iter().map(|at| at[0]).collect());
                add("y", unit.as_deref(), places.iter().map(|at| at[1]).collect());
                add("direction", Some("deg"), directions);
            }
        }
        match channels.is_empty() {
            true => Err("there is no point mass with a track in it".to_owned()),
            false => Ok(channels),
        }
    }
}

/// An attribute of an element.
fn attribute(element: &BytesStart, name: &str) -> String {
    let found = element.try_get_attribute(name).ok().flatten();
    found.map(|found| found.value.into_owned()).unwrap_or_default()
}

pub(super) fn of_text(text: &str) -> Result<Vec<Channel>, String> {
    let mut reader = Reader::from_str(text);
    let mut open = Open::default();
    // Classes without their package, and properties' names.
    let mut path: Vec<String> = Vec::new();
    loop {
        let at = reader.buffer_position();
        let wrong = |of: &[String]| format!("at byte {at}: {} is no number", of.join("/"));
        match reader.read_event().map_err(|e| format!("at byte {at}: {e}"))? {
            Event::Start(element) => {
                let name = match element.name().as_ref() {
                    "object" => {
                        let class = attribute(&element, "class");
                        let class = class.rsplit('.').next().unwrap_or_default().to_owned();
                        let within = path.last().cloned().unwrap_or_default();
                        open.enter(&class, &within).ok_or_else(|| wrong(&path))?;
                        class
                    }
                    _ => attribute(&element, "name"),
                };
                path.push(name);
            }
            Event::Text(text) if !text.trim().is_empty() => {
                open.take(&path, text.trim()).ok_or_else(|| wrong(&path))?;
            }
            Event::End(_) => {
                path.pop();
            }
            Event::Eof if !path.is_empty() => {
                return Err("it ends within an element: it was cut".to_owned())
            }
            Event::Eof => return open.channels(),
            _ => {}
        }
    }
}
