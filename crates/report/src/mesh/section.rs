//! The meridian section: z along the chain, r upwards.

use std::collections::BTreeMap;

use super::{Bench, RIGID, Standing, along_side, clamped_nodes, contact_nodes};
use crate::figure::{Axis, Colour, Figure, Layer, Marker, PAGE_WIDTH_MM, Panel, Stroke, extent};

/// A part of the section, shown closely.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// A few words above the frame.
    pub title: String,
    /// Smallest and largest z, m.
    pub z: (f64, f64),
    /// Smallest and largest r, m.
    pub r: (f64, f64),
}

impl Window {
    fn holds(&self, r: f64, z: f64) -> bool {
        (self.z.0..=self.z.1).contains(&z) && (self.r.0..=self.r.1).contains(&r)
    }
}

/// The whole chain with piston and support.
#[must_use]
pub fn chain(bench: &Bench<'_>) -> Figure {
    let ([_, low], [reach, high]) = bench.extent();
    let plates = bench.rigid_outlines();
    let ends = plates.iter().flatten().fold((low, high), |(low, high), [_, z]| (low.min(*z), high.max(*z)));
    let top = plates.iter().flatten().fold(reach, |top, [r, _]| top.max(*r));
    let whole = Window { title: String::new(), z: ends, r: (0.0, top) };
    let mut panel = panel(bench, &whole, Axis::new("z, from the piston's face", "mm").times(1e3), 0.12);
    panel.title = None;
    panel.x.range = Some((ends.0 - 0.02 * reach, ends.1 + 0.02 * reach));
    panel.y.range = Some((0.0, 1.05 * top));
    let title = "Section of the chain with its finite element mesh; the axis of symmetry is the lower edge";
    Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel)
}

/// Contacts closely, side by side.
#[must_use]
pub fn contacts(bench: &Bench<'_>, windows: &[Window]) -> Figure {
    let title = "Mesh at the contacts, with the surface nodes at which contact is checked";
    let mut figure = Figure::new(title).sized(PAGE_WIDTH_MM, windows.len().clamp(1, 2));
    for window in windows {
        let panel = panel(bench, window, Axis::new("z, from the piston's face", "mm").times(1e3), 0.2);
        figure = figure.panel(panel);
    }
    figure
}

fn panel(bench: &Bench<'_>, window: &Window, z: Axis, width: f64) -> Panel {
    let axes = (z.range(window.z.0, window.z.1), Axis::new("r", "mm").times(1e3).range(window.r.0, window.r.1));
    let mut panel = Panel::new(axes.0, axes.1).titled(window.title.clone()).equal_scales();
    let near = |points: &[(f64, f64)]| points.iter().any(|(z, r)| window.holds(*r, *z)) || crosses(points, window);
    for name in bench.names() {
        let outlines: Vec<_> = bench
            .bodies
            .iter()
            .filter(|body| body.name == name)
            .flat_map(|body| body.mesh.elements.iter().map(move |element| outline(body, element)))
            .filter(|corners| near(corners))
            .collect();
        if !outlines.is_empty() {
            panel = panel.shapes(name, outlines, bench.colour(name));
        }
    }
    let plates = bench.rigid_outlines().into_iter().map(|outline| outline.map(|[r, z]| (z, r)).to_vec());
    let plates: Vec<_> = plates.filter(|plate| near(plate)).collect();
    if !plates.is_empty() {
        panel = panel.shapes("rigid", plates, RIGID);
    }
    let strokes =
        bench.bodies.iter().flat_map(sides).map(|side| side.into_iter().map(along_and_out).collect::<Vec<_>>());
    let strokes: Vec<_> = strokes.filter(|points| near(points)).collect();
    panel =
        panel.layer(Layer::Strokes { label: String::new(), strokes, stroke: Stroke::new(Colour::Black).width(width) });

    let place = |body: &Standing<'_>, node: u32| along_and_out(body.place(node));
    let clamped: Vec<Vec<(f64, f64)>> = bench
        .bodies
        .iter()
        .map(|body| clamped_nodes(body.mesh).iter().map(|node| place(body, *node)).collect::<Vec<_>>())
        .filter(|points| near(points))
        .collect();
    if !clamped.is_empty() {
        let stroke = Stroke::new(Colour::Vermillion).width(1.6);
        panel = panel.layer(Layer::Strokes { label: "clamped".to_owned(), strokes: clamped, stroke });
    }
    if !window.title.is_empty() {
        let dots: Vec<(f64, f64)> = bench
            .bodies
            .iter()
            .flat_map(|body| contact_nodes(body.mesh).into_iter().map(move |node| place(body, node)))
            .filter(|(z, r)| window.holds(*r, *z))
            .collect();
        panel = panel.points("contact nodes", dots, Colour::Vermillion, Marker::Dot);
    }
    panel
}

/// Whether the box round the points meets the window.
fn crosses(points: &[(f64, f64)], window: &Window) -> bool {
    let meets = |(low, high): (f64, f64), (from, to): (f64, f64)| low <= to && high >= from;
    let of = |pick: fn(&(f64, f64)) -> f64| extent(points.iter().map(pick));
    meets(of(|point| point.0), window.z) && meets(of(|point| point.1), window.r)
}

/// Outline (z, r) of an element.
fn outline(body: &Standing<'_>, nodes: &[u32; 8]) -> Vec<(f64, f64)> {
    let place = |node: u32| body.place(node);
    (0..4)
        .flat_map(|i| along_side(place(nodes[i]), place(nodes[4 + i]), place(nodes[(i + 1) % 4])))
        .map(along_and_out)
        .collect()
}

/// A point (r, z) as figures of the section have it.
fn along_and_out([r, z]: [f64; 2]) -> (f64, f64) {
    (z, r)
}

/// Every side of a body once, as points (r, z).
fn sides(body: &Standing<'_>) -> Vec<Vec<[f64; 2]>> {
    let mut unique = BTreeMap::new();
    for nodes in &body.mesh.elements {
        for i in 0..4 {
            let (a, b) = (nodes[i], nodes[(i + 1) % 4]);
            unique.entry([a.min(b), a.max(b)]).or_insert(nodes[4 + i]);
        }
    }
    let points = |([a, b], middle): ([u32; 2], u32)| {
        let [a, middle, b] = [a, middle, b].map(|node| body.place(node));
        std::iter::once(a).chain(along_side(a, middle, b)).collect()
    };
    unique.into_iter().map(points).collect()
}
