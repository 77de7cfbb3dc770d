//! The von Mises stress around the contact that presses hardest.

use std::collections::BTreeMap;

use super::{
    figure::{Axis, Cell, Colour, Figure, Fill, Layer, Marker, Panel, Polygon, Stroke},
    number::engineering,
};
use granchain_model::{
    fea::{
        PeakStress,
        element::{interpolate, von_mises},
        mesh::Shape,
    },
    response::{CellKind, FieldBody},
};

/// Half the width of the region shown, in contact radii.
const REACH: f64 = 3.0;
/// Depth of a rigid face shown, in contact radii.
const RIGID_DEPTH: f64 = 0.4;
/// Pieces of elements across the region, at least.
const PIECES: f64 = 36.0;
/// Pieces along the side of an element, at least and at most.
const PIECES_A_SIDE: (usize, usize) = (2, 32);

/// The stress in both bodies around the contact at that instant, in the deformed state, mirrored about the axis at a pole.
///
/// Each element is cut into pieces on which the stress components, interpolated from its nodes with its shape functions, give the von Mises
/// stress. A state without a body or with a contact of no extent has no cells and is refused when it is drawn.
#[must_use]
pub fn figure(peak: &PeakStress) -> Figure {
    let window = Window::around(peak);
    let Window { reach, middle, depth, mirrored } = window;
    let mut cells = Vec::new();
    let mut outlines = Vec::new();
    let mut largest: Option<(f64, f64, f64)> = None;
    for body in peak.bodies.iter().flatten() {
        let near = |place| window.fraction(place);
        let seen = |nodes: &Vec<u32>| {
            let places: Vec<(f64, f64)> = nodes.iter().map(|&node| near(placed(body, node))).collect();
            meets_window(&places).then(|| extent(&places))
        };
        let elements: Vec<(f64, Vec<u32>)> =
            elements(body).into_iter().filter_map(|nodes| Some((seen(&nodes)?, nodes))).collect();
        // The same number in all elements: neighbours then share the corners of their pieces, and no seam shows.
        let widest = elements.iter().map(|(extent, _)| *extent).fold(0.0, f64::max);
        let count = ((0.5 * widest * PIECES).ceil() as usize).clamp(PIECES_A_SIDE.0, PIECES_A_SIDE.1);
        for (_, nodes) in &elements {
            pieces(body, nodes, count, &window, &mut cells, &mut largest);
        }
        for (a, middle, b) in outer_sides(body) {
            let points = [a, middle, b].map(|node| placed(body, node));
            if !meets_window(&points.map(near)) || (points[0][0] == 0.0 && points[2][0] == 0.0) {
                continue;
            }
            for sign in signs(mirrored) {
                outlines.push(points.iter().map(|[r, z]| (sign * r, z - depth)).collect());
            }
        }
    }
    let words = format!(
        "contact {} ({}–{}) at {}, {}",
        peak.contact,
        peak.names[0],
        peak.names[1],
        engineering(peak.time, "s", 4),
        engineering(peak.force, "N", 3)
    );
    let colours = Axis::new("Von Mises stress", "GPa").times(1e-9).range(0.0, largest.map_or(0.0, |at| at.2));
    let r = Axis::new("r", "µm").times(1e6).range(middle - reach, middle + reach).named_ticks(ticks(middle, reach));
    let rigid = peak.bodies.each_ref().map(Option::is_none);
    let ends = [-1.0, 1.0].map(|sign| {
        let depth = if rigid[usize::from(sign > 0.0)] { RIGID_DEPTH * peak.radius } else { reach };
        sign * depth
    });
    let z = Axis::new("z from the contact", "µm").times(1e6).range(ends[0], ends[1]).named_ticks(ticks(0.0, reach));
    let mut panel = Panel::new(r, z).titled(words.clone()).equal_scales().layer(Layer::Field { colours, cells });
    for (_, depth) in rigid.into_iter().zip(ends).filter(|(rigid, _)| *rigid) {
        let (left, right) = (middle - reach, middle + reach);
        let corners = vec![(left, 0.0), (right, 0.0), (right, depth), (left, depth)];
        let polygons = vec![Polygon { corners, fill: Fill::Tint(Colour::Grey, 0.45) }];
        panel = panel.layer(Layer::Polygons { label: "rigid".into(), polygons, range: None });
    }
    let stroke = Stroke::new(Colour::Black).width(0.5);
    panel = panel.layer(Layer::Strokes { label: String::new(), strokes: outlines, stroke });
    if let Some((r, z, stress)) = largest {
        let at: Vec<(f64, f64)> = signs(mirrored && r > 0.0).map(|sign| (sign * r, z)).collect();
        panel = panel.points(format!("largest: {}", engineering(stress, "Pa", 3)), at, Colour::Black, Marker::Cross);
    }
    Figure::new(format!(
        "Von Mises stress at the instant of the largest contact force, {words}; contact radius {}, deformed state",
        engineering(peak.radius, "m", 3)
    ))
    .panel(panel)
}

/// The region shown.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// Half its width, m.
    reach: f64,
    /// r of its middle, m.
    middle: f64,
    /// z of its middle, m.
    depth: f64,
    /// Whether it is mirrored about the axis.
    mirrored: bool,
}

impl Window {
    fn around(peak: &PeakStress) -> Self {
        let reach = REACH * peak.radius;
        let [centre, depth] = peak.place;
        // The band on a ring does not see the axis.
        let mirrored = centre < reach;
        Self { reach, middle: if mirrored { 0.0 } else { centre }, depth, mirrored }
    }

    /// A place (r, z) in half widths from the middle.
    fn fraction(&self, [r, z]: [f64; 2]) -> (f64, f64) {
        ((r - self.middle) / self.reach, (z - self.depth) / self.reach)
    }
}

/// Ticks every 1, 2 or 5 × 10ⁿ µm within `reach` (m) of `middle`, three to nine of them, named in µm.
fn ticks(middle: f64, reach: f64) -> Vec<(f64, String)> {
    let half = 0.5e6 * reach;
    // Nothing to name where there is no extent: such a figure is refused.
    if !(half.is_finite() && half > 0.0) {
        return Vec::new();
    }
    let exponent = half.log10().floor() as i32;
    let power = 10f64.powi(exponent);
    let step = power
        * if half >= 5.0 * power {
            5.0
        } else if half >= 2.0 * power {
            2.0
        } else {
            1.0
        };
    let digits = usize::try_from(-exponent).unwrap_or(0);
    let name = |value: f64| format!("{value:.digits$}").replace('-', "−");
    let first = (1e6 * (middle - reach) / step).ceil() as i64;
    let last = (1e6 * (middle + reach) / step).floor() as i64;
    (first..=last).map(|i| (1e-6 * step * i as f64, name(step * i as f64))).collect()
}

fn signs(mirrored: bool) -> impl Iterator<Item = f64> {
    [1.0, -1.0].into_iter().take(if mirrored { 2 } else { 1 })
}

/// Where a node is now (r, z), m.
fn placed(body: &FieldBody, node: u32) -> [f64; 2] {
    let ([r, z], [u, w]) = (body.mesh.points[node as usize], body.displacement[node as usize]);
    [r + u, body.offset + z + w]
}

/// Nodes of every element.
fn elements(body: &FieldBody) -> Vec<Vec<u32>> {
    let mut rest = &body.mesh.connectivity[..];
    body.mesh
        .kinds
        .iter()
        .map(|kind| {
            let (own, others) = rest.split_at(kind.nodes().min(rest.len()));
            rest = others;
            own.to_vec()
        })
        .collect()
}

/// Sides of one element only: corner, middle, corner.
fn outer_sides(body: &FieldBody) -> Vec<(u32, u32, u32)> {
    let mut sides: BTreeMap<(u32, u32), (u32, usize)> = BTreeMap::new();
    for nodes in elements(body) {
        let corners = nodes.len() / 2;
        for i in 0..corners {
            let (a, b) = (nodes[i], nodes[(i + 1) % corners]);
            sides.entry((a.min(b), a.max(b))).or_insert((nodes[corners + i], 0)).1 += 1;
        }
    }
    sides.into_iter().filter(|(_, (_, count))| *count == 1).map(|((a, b), (middle, _))| (a, middle, b)).collect()
}

/// Whether the box round points in half widths of the window meets it.
fn meets_window(points: &[(f64, f64)]) -> bool {
    let meets = |pick: fn(&(f64, f64)) -> f64| {
        let values = || points.iter().map(pick);
        values().fold(f64::INFINITY, f64::min) <= 1.0 && values().fold(f64::NEG_INFINITY, f64::max) >= -1.0
    };
    meets(|point| point.0) && meets(|point| point.1)
}

/// Longer side of the box round points.
fn extent(points: &[(f64, f64)]) -> f64 {
    let spread = |pick: fn(&(f64, f64)) -> f64| {
        let values = || points.iter().map(pick);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    spread(|point| point.0).max(spread(|point| point.1))
}

/// `count`² pieces of one element; `largest` is the (r, z, stress) of the largest stress met in the window.
fn pieces(
    body: &FieldBody,
    nodes: &[u32],
    count: usize,
    window: &Window,
    cells: &mut Vec<Cell>,
    largest: &mut Option<(f64, f64, f64)>,
) {
    let shape =
        if nodes.len() == CellKind::QuadraticTriangle.nodes() { Shape::Triangle6 } else { Shape::Quadrilateral8 };
    let at = |i: usize, j: usize| {
        let (x, y) = (i as f64 / count as f64, j as f64 / count as f64);
        let weights = match shape {
            Shape::Triangle6 => interpolate(shape, x, y),
            Shape::Quadrilateral8 => interpolate(shape, 2.0 * x - 1.0, 2.0 * y - 1.0),
        };
        let (mut place, mut stress) = ([0.0; 2], [0.0; 4]);
        for (&node, weight) in nodes.iter().zip(weights.value) {
            place.iter_mut().zip(placed(body, node)).for_each(|(sum, part)| *sum += weight * part);
            stress.iter_mut().zip(body.stress[node as usize]).for_each(|(sum, part)| *sum += weight * part);
        }
        (place[0], place[1] - window.depth, von_mises(stress))
    };
    let mut add = |corners: &[(f64, f64, f64)]| {
        cells.push(Cell(corners.to_vec()));
        if window.mirrored {
            // In the same sense again, so that both halves join without a seam.
            cells.push(Cell(corners.iter().rev().map(|(r, z, stress)| (-r, *z, *stress)).collect()));
        }
    };
    for i in 0..count {
        let columns = if shape == Shape::Triangle6 { count - i } else { count };
        for j in 0..columns {
            match shape {
                Shape::Quadrilateral8 => add(&[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]),
                Shape::Triangle6 => {
                    add(&[at(i, j), at(i + 1, j), at(i, j + 1)]);
                    if i + j + 2 <= count {
                        add(&[at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                    }
                }
            }
            let found = at(i, j);
            let seen = found.1.abs() <= window.reach && (found.0 - window.middle).abs() <= window.reach;
            if seen && largest.is_none_or(|so_far| found.2 > so_far.2) {
                *largest = Some(found);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_on_both_sides() {
        let names = |middle, reach| ticks(middle, reach).into_iter().map(|(_, name)| name).collect::<Vec<_>>();
        assert_eq!(names(0.0, 47.9e-6), ["−40", "−20", "0", "20", "40"]);
        assert_eq!(names(0.0, 1.5e-6), ["−1.5", "−1.0", "−0.5", "0.0", "0.5", "1.0", "1.5"]);
        assert_eq!(names(376e-6, 22e-6), ["360", "370", "380", "390"]);
        assert!(ticks(0.0, 0.0).is_empty() && ticks(0.0, f64::NAN).is_empty());
    }
}
