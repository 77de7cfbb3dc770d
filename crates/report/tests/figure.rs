//! What every figure must be: well-formed, self-contained, labelled, the same bytes twice; what cannot be drawn is refused.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

use granchain_report::figure::{
    Axis, Bar, Colour, Dash, ErrorPoint, Figure, FigureError, Layer, Map, Marker, Panel, Polygon, Stroke, trace,
};
use granchain_signal::Series;

/// A bit of everything: dense trace, dashes, marks, band, error bars, histogram, map with contour, log axis.
fn everything() -> Figure {
    let burst = |phase: f64, gain: f64| {
        Series::new(
            0.0,
            1e-7,
            (0..6000)
                .map(|i| f64::from(i) * 1e-7)
                .map(|t| {
                    let envelope = 1.0 - (-t / 100e-6_f64).exp();
                    gain * envelope
                        * ((t * 73e3 * std::f64::consts::TAU + phase).sin()
                            + 0.6 * (t * 24.33e3 * std::f64::consts::TAU).sin())
                })
                .collect(),
        )
    };
    let (recorded, simulated) = (burst(0.0, 0.18), burst(0.3, 0.17));
    let time = Axis::new("Time", "µs").times(1e6);
    let velocity = Axis::new("Velocity", "mm/s").times(1e3);
    let whole = Panel::new(time.clone(), velocity.clone())
        .titled("(a) Velocity of the last bead, recorded and simulated")
        .line("recorded", trace(&recorded), Stroke::new(Colour::Black).width(1.2))
        .line("simulated", trace(&simulated), Stroke::new(Colour::Vermillion));
    let zoom = Panel::new(time.range(300e-6, 360e-6), velocity)
        .titled("(b) Four periods")
        .line("recorded", trace(&recorded), Stroke::new(Colour::Black).width(1.2))
        .line("simulated", trace(&simulated), Stroke::new(Colour::Vermillion).dash(Dash::Dashed))
        .mark_y(0.0, "", Stroke::new(Colour::Grey).width(0.5));
    let spectrum = |width: f64| {
        (1..900)
            .map(|i| f64::from(i) * 0.5e3)
            .map(|f| {
                let line = |f0: f64, a: f64| a / (1.0 + ((f - f0) / width).powi(2));
                (f, 1e-5 + line(73e3, 0.1) + line(24.33e3, 0.05) + line(48.67e3, 0.03) + line(146e3, 0.01))
            })
            .collect::<Vec<_>>()
    };
    let lines = Panel::new(
        Axis::new("Frequency", "kHz").times(1e-3).range(0.0, 250e3),
        Axis::new("Amplitude", "mm/s").times(1e3).logarithmic(),
    )
    .titled("(c) Spectrum")
    .line("recorded", spectrum(600.0), Stroke::new(Colour::Black).width(1.2))
    .line("simulated", spectrum(900.0), Stroke::new(Colour::Vermillion).dash(Dash::Dashed))
    .mark_x(73e3 / 3.0, "1/3")
    .mark_x(73e3 / 2.0, "1/2")
    .mark_x(73e3 * 2.0 / 3.0, "2/3")
    .mark_x(73e3, "1")
    .mark_x(146e3, "2");
    let sweep: Vec<_> = (0..25).map(|i| 0.3 + 0.05 * f64::from(i)).collect();
    let points = sweep.iter().map(|a| ErrorPoint::vertical(*a, 0.5 * a, 0.45 * a, 0.6 * a)).collect();
    let peaks = Panel::new(Axis::new("Amplitude scale α", "1"), Axis::new("Positive peak", "mm/s").times(1e3))
        .titled("(d) Sweep")
        .band("recorded ± 2σ", vec![(0.3, 0.27, 0.31), (1.5, 0.27, 0.31)], Colour::SkyBlue)
        .error_points("simulated", points, Colour::Vermillion, Marker::Disc)
        .points("published", vec![(0.5, 0.296)], Colour::Blue, Marker::Diamond);
    let grid: Vec<f64> = (0..40).map(|i| f64::from(i) / 39.0).collect();
    let (alpha, damping): (Vec<_>, Vec<_>) =
        (grid.iter().map(|g| 0.45 + 0.1 * g).collect(), grid.iter().map(|g| 0.1 * 9f64.powf(*g)).collect());
    let values = damping
        .iter()
        .flat_map(|c: &f64| {
            alpha.iter().map(move |a: &f64| {
                -(((a - 0.5) / 0.02).powi(2) + ((c / 0.3).ln() / 0.3).powi(2) + 40.0 * (a - 0.5) * (c / 0.3).ln())
            })
        })
        .collect::<Vec<_>>();
    let map = Map { x: alpha, y: damping, values };
    let objective = Panel::new(Axis::new("Amplitude scale α", "1"), Axis::new("Linear damping", "N·s/m").logarithmic())
        .titled("(e) Objective")
        .layer(Layer::HeatMap {
            label: "ln likelihood below best (–)".into(),
            map: map.clone(),
            range: Some((-20.0, 0.0)),
        })
        .layer(Layer::Contour { label: "90 % region".into(), map, level: -4.6, stroke: Stroke::new(Colour::Black) })
        .points(
            "runs",
            (0..200)
                .map(|i| (0.45 + 0.0005 * f64::from(i), 0.1 * 9f64.powf(f64::from(i * 37 % 200) / 200.0)))
                .collect(),
            Colour::Orange,
            Marker::Dot,
        )
        .points("fit", vec![(0.5, 0.3)], Colour::Vermillion, Marker::Cross);
    let histogram = Panel::new(Axis::new("Width of interval (ln)", "1"), Axis::new("Twins", "count"))
        .titled("(f) Widths")
        .layer(Layer::Bars {
            label: "α".into(),
            bars: (0..12)
                .map(|i| Bar {
                    from: 0.02 * f64::from(i),
                    to: 0.02 * f64::from(i + 1),
                    height: f64::from((i * 7) % 11),
                })
                .collect(),
            colour: Colour::Blue,
        });
    Figure::new("A bit of everything <&>")
        .sized(174.0, 2)
        .panel(whole)
        .panel(zoom)
        .panel(lines)
        .panel(peaks)
        .panel(objective)
        .panel(histogram)
}

fn plain(axis_x: Axis, axis_y: Axis, points: Vec<(f64, f64)>) -> Figure {
    Figure::new("test").panel(Panel::new(axis_x, axis_y).line("", points, Stroke::new(Colour::Black)))
}

#[test]
fn a_figure_is_well_formed_xml_without_anything_outside_itself() {
    let svg = everything().to_svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    assert_eq!(document.root_element().tag_name().name(), "svg");
    for node in document.descendants() {
        for attribute in node.attributes() {
            assert!(!attribute.value().contains("http"), "{attribute:?}");
            assert!(!attribute.name().contains("href"), "{attribute:?}");
        }
        assert!(!matches!(node.tag_name().name(), "script" | "image" | "style" | "foreignObject"));
    }
    assert!(svg.len() < 150_000, "{} bytes", svg.len());
}

#[test]
fn the_same_figure_gives_the_same_bytes() {
    assert_eq!(everything().to_svg().unwrap(), everything().to_svg().unwrap());
    assert!(everything().to_png().unwrap() == everything().to_png().unwrap());
}

#[test]
fn every_axis_shows_its_unit() {
    let figure = everything();
    let svg = figure.to_svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let texts: Vec<_> =
        document.descendants().filter(|node| node.has_tag_name("text")).filter_map(|node| node.text()).collect();
    for axis in figure.panels.iter().flat_map(|panel| [&panel.x, &panel.y]) {
        let unit = if axis.unit == "1" { "–" } else { &axis.unit };
        assert!(
            texts.iter().any(|text| text.starts_with(&axis.label) && text.ends_with(&format!("{unit})"))),
            "{axis:?}"
        );
    }
}

#[test]
fn an_axis_without_a_unit_is_refused() {
    let figure = plain(Axis::new("Time", ""), Axis::new("Velocity", "m/s"), vec![(0.0, 0.0), (1.0, 1.0)]);
    assert!(matches!(figure.to_svg(), Err(FigureError::UnnamedAxis { panel: 1, axis: "x", .. })));
}

#[test]
fn values_that_cannot_be_placed_are_refused_with_their_position() {
    let time = || Axis::new("Time", "s");
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let figure = plain(time(), Axis::new("Velocity", "m/s"), vec![(0.0, 0.0), (1.0, bad)]);
        let error = figure.to_svg().unwrap_err();
        assert!(matches!(error, FigureError::Unplaceable { panel: 1, layer: 1, index: 1, .. }), "{error}");
        assert_eq!(figure.to_png().unwrap_err().to_string(), error.to_string());
    }
    let figure = plain(time(), Axis::new("Amplitude", "m/s").logarithmic(), vec![(0.0, 1.0), (1.0, 0.0)]);
    assert!(matches!(figure.to_svg(), Err(FigureError::Unplaceable { expected: "positive number", .. })));
    assert!(matches!(Figure::new("empty").to_svg(), Err(FigureError::NoPanel { .. })));
    let figure = plain(time(), Axis::new("Velocity", "m/s"), Vec::new());
    assert!(matches!(figure.to_svg(), Err(FigureError::NoExtent { .. })));
    let figure = plain(time().range(2.0, 1.0), Axis::new("Velocity", "m/s"), vec![(0.0, 0.0)]);
    assert!(matches!(figure.to_svg(), Err(FigureError::BadRange { .. })));
}

#[test]
fn a_label_cannot_break_out_of_the_figure() {
    let panel = Panel::new(Axis::new("Time <script>\n\u{1}", "s\"><x"), Axis::new("a & b", "]]>"))
        .line("</text><script>", vec![(0.0, 0.0), (1.0, 1.0)], Stroke::new(Colour::Black))
        .mark_x(0.5, "<!--");
    let svg = Figure::new("</title><script>\u{7}").panel(panel).to_svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    assert!(document.descendants().all(|node| node.tag_name().name() != "script" && !node.is_comment()));
    assert!(document.descendants().any(|node| node.text() == Some("</text><script>")));
}

#[test]
fn a_curve_stays_inside_its_frame() {
    let figure = plain(
        Axis::new("x", "1").range(0.0, 1.0),
        Axis::new("y", "1").range(0.0, 1.0),
        vec![(-1.0, -3.0), (0.5, 0.5), (9.0, 0.6)],
    );
    let svg = figure.to_svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let curve = document.descendants().find(|node| node.attribute("stroke") == Some("#000000")).unwrap();
    let start = curve.attribute("d").unwrap().trim_start_matches('M').split(['l', 'h', 'v']).next().unwrap();
    let (x, y): (f64, f64) = start.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).unwrap();
    let size: Vec<f64> =
        document.root_element().attribute("viewBox").unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
    assert!(x > 0.0 && x < size[2] && y > 0.0 && y < size[3], "{start} outside {size:?}");
}

#[test]
fn a_png_has_the_printed_size_at_288_dots_per_inch() {
    let png = plain(Axis::new("x", "1"), Axis::new("y", "1"), vec![(0.0, 0.0), (1.0, 1.0)]).to_png().unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(&png)).read_info().unwrap();
    let (width, _) = reader.info().size();
    assert_eq!(width, (85.0_f64 / 25.4 * 72.0 * 4.0).ceil() as u32);
}

#[test]
fn equal_scales_make_a_square_square_whatever_the_ticks() {
    let square =
        Polygon { corners: vec![(0.1, 30.1), (0.5, 30.1), (0.5, 30.5), (0.1, 30.5)], fill: (Colour::Blue, 1.0) };
    // 0.0004 m are 0.4 mm: one unit, two factors.
    let millimetres = square.corners.iter().map(|(x, y)| (*x, 1e-3 * y)).collect();
    for (y, corners) in [
        (Axis::new("y", "mm").range(30.0, 33.0), square.corners.clone()),
        (Axis::new("y", "mm").times(1e3).range(0.030, 0.033), millimetres),
    ] {
        let polygons = vec![Polygon { corners, ..square.clone() }];
        let panel = Panel::new(Axis::new("x", "mm").range(0.0, 2.0), y)
            .equal_scales()
            .layer(Layer::Polygons { label: String::new(), polygons });
        let svg = Figure::new("test").panel(panel).to_svg().unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let drawn = document.descendants().find(|node| node.attribute("fill") == Some("#0072B2")).unwrap();
        let steps = drawn.attribute("d").unwrap();
        let length = |letter: char| -> i64 {
            let digits = steps.split(letter).nth(1).unwrap();
            let end = digits.find(|c: char| c.is_alphabetic()).unwrap_or(digits.len());
            digits[..end].parse::<i64>().unwrap().abs()
        };
        // Tenths of a point, each corner rounded.
        assert!((length('h') - length('v')).abs() <= 2 && length('h') > 200, "{steps}");
    }
}

#[test]
fn a_map_shows_its_scale_and_refuses_what_is_no_number() {
    let figure = |values| {
        let map = Map { x: vec![0.0, 1.0], y: vec![0.0, 1.0], values };
        let layer = Layer::HeatMap { label: "Von Mises stress (MPa)".into(), map, range: Some((0.0, 10.0)) };
        Figure::new("test").panel(Panel::new(Axis::new("z", "mm"), Axis::new("r", "mm")).layer(layer))
    };
    let svg = figure(vec![-5.0, 99.0, 1.0, 2.0]).to_svg().unwrap();
    // Light and dark end of the shades; the bar's title upwards at the right.
    assert!(svg.contains("#FAFCFF") && svg.contains("#08306B") && svg.contains("Von Mises stress (MPa)"));
    let refused = figure(vec![f64::NAN, 1.0, 2.0, 3.0]).to_svg().unwrap_err();
    assert!(matches!(refused, FigureError::Unplaceable { layer: 1, index: 0, .. }), "{refused}");
}

/// Writes the figure where a person can look at it.
#[test]
#[ignore = "only renders target/figures/everything.{svg,png} to look at"]
fn render_everything() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("figures");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("everything.svg"), everything().to_svg().unwrap()).unwrap();
    std::fs::write(folder.join("everything.png"), everything().to_png().unwrap()).unwrap();
}
