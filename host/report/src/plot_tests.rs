use super::*;

#[test]
fn every_curve_is_drawn_and_named() {
    let plot = Plot {
        title: "errors".into(),
        x: Axis::linear("epochs"),
        y: Axis::logarithmic("error"),
        curves: vec![
            Curve::line("ours", vec![(1.0, 1e-3), (2.0, 1e-6), (3.0, 0.0)]),
            Curve::dashed("thesis", vec![(1.0, 1e-2), (3.0, 1e-3)]),
            Curve::points("truth", vec![(2.0, 2e-3)]),
        ],
    };
    let text = svg(&[plot.clone(), plot]).unwrap();
    for word in ["errors", "epochs", "ours", "thesis", "truth"] {
        assert_eq!(text.matches(&format!("{word}\n")).count(), 2, "{word}");
    }
    assert!(!text.contains("NaN") && !text.contains("http://fonts"));
}

#[test]
fn a_line_that_leaves_what_is_shown_ends_at_the_frame() {
    let away = Curve::plain("away", vec![(0.0, 0.0), (1.0, 4.0), (2.0, 0.0), (9.0, 0.0)]);
    let cut = away.within(&(0.5..3.0), &(-1.0..3.0));
    let runs: Vec<&[(f64, f64)]> =
        cut.points.split(|p| p.0.is_nan()).filter(|run| !run.is_empty()).collect();
    assert_eq!(runs, [&[(0.5, 2.0), (0.75, 3.0)][..], &[(1.25, 3.0), (2.0, 0.0), (3.0, 0.0)]]);
    let bars = Curve::bars("bars", vec![(0.0, 0.0, 1.0), (1.0, 1.0, 2.0), (1.0, 5.0, 3.0)]);
    let cut = bars.within(&(0.5..3.0), &(-1.0..3.0));
    assert_eq!((cut.points, cut.bars), (vec![(1.0, 1.0)], vec![2.0]));
}

#[test]
fn nothing_to_draw_is_an_empty_plot() {
    let plot = Plot {
        title: "none".into(),
        x: Axis::linear("x"),
        y: Axis::logarithmic("y"),
        curves: vec![Curve::line("nothing", vec![(1.0, f64::NAN)])],
    };
    assert!(svg(&[plot]).unwrap().contains("none"));
}

#[test]
fn the_page_gives_every_colour_its_own() {
    let style = include_str!("../assets/report.css");
    for colour in COLOURS.into_iter().chain([WHITE]) {
        let hex = format!("\"#{:02X}{:02X}{:02X}\"", colour.0, colour.1, colour.2);
        for what in ["fill", "stroke"] {
            assert!(
                style.contains(&format!("svg [{what}={hex}] {{ {what}: var(--")),
                "{what} {hex}"
            );
        }
    }
}
