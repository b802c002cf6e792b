//! Plots as SVG, offline and without fonts of their own.

use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;
use yawrig_base::error::{Error, Result};

/// One set of axes with its curves.
#[derive(Clone, Debug)]
pub struct Plot {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub curves: Vec<Curve>,
}

impl Plot {
    /// The parts of the curves inside the frame, where an axis is limited.
    fn within(&self, x: &std::ops::Range<f64>, y: &std::ops::Range<f64>) -> Self {
        let mut plot = self.clone();
        if self.x.shown.is_some() || self.y.shown.is_some() {
            plot.curves = self.curves.iter().map(|curve| curve.within(x, y)).collect();
        }
        plot
    }
}

#[derive(Clone, Debug)]
pub struct Axis {
    pub label: String,
    pub logarithmic: bool,
    /// Names of 0, 1, 2 ..., in place of the numbers.
    pub names: Vec<String>,
    /// Limits of what is shown; curves end at the frame.
    pub shown: Option<(f64, f64)>,
}

impl Axis {
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), logarithmic: false, names: Vec::new(), shown: None }
    }

    pub fn logarithmic(label: impl Into<String>) -> Self {
        Self { logarithmic: true, ..Self::linear(label) }
    }

    /// Named categories at 0, 1, 2 ...
    pub fn named(label: impl Into<String>, names: Vec<String>) -> Self {
        Self { names, ..Self::linear(label) }
    }

    /// Limits the axis to the range of these values; without values, unlimited.
    pub fn over(mut self, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|v| v.is_finite())
            .fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        self.shown = (low <= high).then_some((low, high));
        self
    }

    /// The axis's ends for a drawing that reaches over `values`.
    fn range(&self, values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
        match self.shown {
            Some((low, high)) => range([low, high].into_iter(), self.logarithmic),
            None => range(values, self.logarithmic),
        }
    }

    fn tick(&self, v: f64) -> String {
        if self.names.is_empty() {
            return tick(v);
        }
        let whole = (v - v.round()).abs() < 1e-6 && v > -0.5;
        self.names.get(v.round() as usize).filter(|_| whole).cloned().unwrap_or_default()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Computed here.
    Line,
    /// The thesis's numbers, a truth or a limit.
    Dashed,
    /// Points alone.
    Points,
    /// A truth at each point: what lies between says nothing.
    Crosses,
    /// A line without points.
    Plain,
}

#[derive(Clone, Debug)]
pub struct Curve {
    pub name: String,
    pub points: Vec<(f64, f64)>,
    pub style: Style,
    /// Half lengths of bars about the points; none, or one for each.
    pub bars: Vec<f64>,
}

impl Curve {
    pub fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, style: Style::Line, bars: Vec::new() }
    }

    pub fn dashed(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, style: Style::Dashed, bars: Vec::new() }
    }

    pub fn points(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, style: Style::Points, bars: Vec::new() }
    }

    pub fn crosses(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { style: Style::Crosses, ..Self::points(name, points) }
    }

    pub fn plain(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, style: Style::Plain, bars: Vec::new() }
    }

    /// Points, each with its half length of a bar.
    pub fn bars(name: impl Into<String>, points: Vec<(f64, f64, f64)>) -> Self {
        let bars = points.iter().map(|p| p.2).collect();
        let points = points.into_iter().map(|(x, y, _)| (x, y)).collect();
        Self { name: name.into(), points, style: Style::Points, bars }
    }

    /// The part inside the frame; where a line leaves and comes back a NaN point breaks it.
    fn within(&self, x: &std::ops::Range<f64>, y: &std::ops::Range<f64>) -> Self {
        let mut inside = Self { points: Vec::new(), bars: Vec::new(), ..self.clone() };
        if matches!(self.style, Style::Points | Style::Crosses) {
            let seen =
                |p: &(f64, f64)| x.start <= p.0 && p.0 <= x.end && y.start <= p.1 && p.1 <= y.end;
            for (k, point) in self.points.iter().enumerate().filter(|(_, p)| seen(p)) {
                inside.points.push(*point);
                inside.bars.extend(self.bars.get(k));
            }
            return inside;
        }
        for ends in self.points.windows(2) {
            let Some((from, to)) = inside_part(ends[0], ends[1], x, y) else { continue };
            if inside.points.last() != Some(&from) {
                inside.points.extend([(f64::NAN, f64::NAN), from]);
            }
            inside.points.push(to);
        }
        inside
    }

    /// The drawing's range in y.
    fn extent(&self) -> impl Iterator<Item = f64> + '_ {
        let bar = |k: usize| self.bars.get(k).copied().filter(|b| b.is_finite()).unwrap_or(0.0);
        self.points.iter().enumerate().flat_map(move |(k, p)| [p.1 - bar(k), p.1 + bar(k)])
    }
}

/// The part of a straight line that lies inside (Liang and Barsky 1984).
fn inside_part(
    from: (f64, f64),
    to: (f64, f64),
    x: &std::ops::Range<f64>,
    y: &std::ops::Range<f64>,
) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    let sides = [
        (-dx, from.0 - x.start),
        (dx, x.end - from.0),
        (-dy, from.1 - y.start),
        (dy, y.end - from.1),
    ];
    for (step, room) in sides {
        if step < 0.0 {
            first = first.max(room / step);
        } else if step > 0.0 {
            last = last.min(room / step);
        } else if room.is_nan() || room < 0.0 {
            return None;
        }
    }
    let at = |share: f64| match share {
        0.0 => from,
        1.0 => to,
        share => (from.0 + share * dx, from.1 + share * dy),
    };
    (first <= last).then(|| (at(first), at(last)))
}

/// Okabe and Ito's, distinguishable for the colour-blind; without yellow.
pub const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(110, 110, 110),
    BLACK,
];
const SIZE: (u32, u32) = (980, 460);
/// Where the legend begins, and what one row and one letter of it take, in pixels.
const LEGEND_LEFT: i32 = 80;
const LEGEND_TOP: i32 = 44;
const LEGEND_ROW: i32 = 20;
const LEGEND_LETTER: i32 = 7;

/// All plots of a study, one below the other.
pub fn svg(plots: &[Plot]) -> Result<String> {
    svg_in_columns(plots, 1)
}

/// All plots, row by row.
pub fn svg_in_columns(plots: &[Plot], columns: usize) -> Result<String> {
    let rows = plots.len().div_ceil(columns).max(1);
    let mut text = String::new();
    let failed = |e: &dyn std::fmt::Display| Error::internal(format!("cannot draw a plot: {e}"));
    {
        let height = if columns > 1 { SIZE.1 * 3 / 4 } else { SIZE.1 };
        let size = (SIZE.0, height * rows as u32);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| failed(&e))?;
        for (area, plot) in root.split_evenly((rows, columns)).iter().zip(plots) {
            draw(area, plot).map_err(|e| failed(&e))?;
        }
        root.present().map_err(|e| failed(&e))?;
    }
    Ok(text)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// Least and largest, with a margin; on a logarithmic axis what is not positive does not count.
fn range(values: impl Iterator<Item = f64>, logarithmic: bool) -> std::ops::Range<f64> {
    let usable = values.filter(|v| v.is_finite() && (!logarithmic || *v > 0.0));
    let (low, high) = usable.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return if logarithmic { 0.1..10.0 } else { 0.0..1.0 };
    }
    if logarithmic {
        let margin = (high / low).powf(0.06).max(1.2);
        return low / margin..high * margin;
    }
    let margin = (0.06 * (high - low)).max(1e-9 + 1e-3 * high.abs());
    // An axis of errors or counts begins at zero where that costs little room.
    let low = if low >= 0.0 && low < 0.5 * high { 0.0 } else { low - margin };
    low..high + margin
}

fn draw(area: &Area<'_>, plot: &Plot) -> Drawn {
    let all = || plot.curves.iter().flat_map(|c| c.points.iter());
    let x = plot.x.range(all().map(|p| p.0));
    let y = plot.y.range(plot.curves.iter().flat_map(Curve::extent));
    let plot = &plot.within(&x, &y);
    match (plot.x.logarithmic, plot.y.logarithmic) {
        (false, false) => on_axes(area, plot, x, y),
        (true, false) => on_axes(area, plot, x.log_scale(), y),
        (false, true) => on_axes(area, plot, x, y.log_scale()),
        (true, true) => on_axes(area, plot, x.log_scale(), y.log_scale()),
    }
}

fn on_axes<X, Y>(area: &Area<'_>, plot: &Plot, x: X, y: Y) -> Drawn
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
    Y::CoordDescType: ValueFormatter<f64> + Ranged<ValueType = f64>,
{
    let places = legend_places(&plot.curves, area.dim_in_pixel().0 as i32);
    let rows = places.last().map_or(0, |(_, row)| row + 1);
    area.draw(&Text::new(plot.title.clone(), (LEGEND_LEFT, 10), ("sans-serif", 17)))?;
    let (_, below) = area.split_vertically(LEGEND_TOP + LEGEND_ROW * rows - 8);
    let mut chart = ChartBuilder::on(&below)
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(68)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc(&plot.x.label)
        .y_desc(&plot.y.label)
        .x_label_formatter(&|v| plot.x.tick(*v))
        .y_label_formatter(&|v| plot.y.tick(*v))
        .label_style(("sans-serif", 13))
        .draw()?;
    for (i, curve) in plot.curves.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let stroke = colour.stroke_width(2);
        let seen = |(x, y): &(f64, f64)| {
            x.is_finite()
                && y.is_finite()
                && (!plot.x.logarithmic || *x > 0.0)
                && (!plot.y.logarithmic || *y > 0.0)
        };
        let points = curve.points.iter().copied().filter(seen);
        for run in curve.points.split(|p| !seen(p)).map(|run| run.iter().copied()) {
            match curve.style {
                Style::Line | Style::Plain => chart.draw_series(LineSeries::new(run, stroke))?,
                Style::Dashed => chart.draw_series(DashedLineSeries::new(run, 6, 4, stroke))?,
                Style::Points => chart.draw_series(run.map(|p| dot(p, colour)))?,
                Style::Crosses => chart.draw_series(run.map(|p| cross(p, colour)))?,
            };
        }
        let bars = curve.points.iter().zip(&curve.bars).filter(|(p, b)| {
            (p.0.is_finite() && p.1.is_finite() && b.is_finite())
                && (!plot.y.logarithmic || p.1 - *b > 0.0)
        });
        chart.draw_series(bars.map(|(p, b)| {
            PathElement::new([(p.0, p.1 - b), (p.0, p.1 + b)], colour.stroke_width(2))
        }))?;
        if curve.points.len() <= 30 && curve.style == Style::Line {
            chart.draw_series(points.map(|p| dot(p, colour)))?;
        }
        if let Some(&(left, row)) = places.get(i) {
            legend(area, (left, LEGEND_TOP + LEGEND_ROW * row), curve, colour)?;
        }
    }
    Ok(())
}

fn dot<C>(at: C, colour: RGBColor) -> Circle<C, i32> {
    Circle::new(at, 3, colour.filled())
}

fn cross<C>(at: C, colour: RGBColor) -> Cross<C, i32> {
    Cross::new(at, 5, colour.stroke_width(2))
}

/// Left edge and row of each entry of the legend, one beside the other above the axes.
fn legend_places(curves: &[Curve], width: i32) -> Vec<(i32, i32)> {
    let (mut left, mut row) = (LEGEND_LEFT, 0);
    let place = |curve: &Curve| {
        let wide = 30 + LEGEND_LETTER * curve.name.chars().count() as i32 + 18;
        if left > LEGEND_LEFT && left + wide > width {
            (left, row) = (LEGEND_LEFT, row + 1);
        }
        let here = (left, row);
        left += wide;
        here
    };
    curves.iter().map(place).collect()
}

/// One entry of the legend.
fn legend(area: &Area<'_>, (left, y): (i32, i32), curve: &Curve, colour: RGBColor) -> Drawn {
    let stroke = colour.stroke_width(2);
    match curve.style {
        Style::Line | Style::Plain => {
            area.draw(&PathElement::new([(left, y), (left + 24, y)], stroke))?;
        }
        Style::Dashed => {
            for from in [0, 10, 20] {
                area.draw(&PathElement::new([(left + from, y), (left + from + 6, y)], stroke))?;
            }
        }
        Style::Points => area.draw(&dot((left + 12, y), colour))?,
        Style::Crosses => area.draw(&cross((left + 12, y), colour))?,
    }
    area.draw(&Text::new(curve.name.clone(), (left + 30, y - 6), ("sans-serif", 13)))?;
    Ok(())
}

/// A tick's number: plain where that is short.
fn tick(v: f64) -> String {
    match v.abs() {
        // Rounding residue at zero.
        a if a < 1e-14 => "0".to_owned(),
        a if !(1e-3..1e5).contains(&a) => format!("{v:.1e}").replace(".0e", "e"),
        _ => {
            let text = format!("{v:.4}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
    }
}

#[cfg(test)]
#[path = "plot_tests.rs"]
mod tests;
