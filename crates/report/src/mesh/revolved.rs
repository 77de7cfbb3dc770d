//! The chain as it stands in space: bodies of revolution with a quarter cut out, seen from the piston's side, without perspective.
//!
//! The quarter 0 < φ < 90° is cut out and the eye looks into it, so nothing ever stands before the two cut faces: surfaces are drawn from
//! the farthest on, the faces after them.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{
    Bench, RIGID, Standing, along_side,
    section::{outer_sides, sides},
};
use crate::figure::{Axis, Colour, Figure, Layer, PAGE_WIDTH_MM, Panel, Polygon, Stroke, extent};

/// Steps of the revolution over the three quarters that are left.
const STEPS: usize = 42;
/// Turn of the eye from the side towards the piston, rad.
const YAW: f64 = 0.5;
/// Height of the eye above the axis, rad.
const ELEVATION: f64 = 0.55;

/// The eye: directions in space (x to the right of the chain, y up, z along it).
struct Eye {
    right: [f64; 3],
    up: [f64; 3],
    towards: [f64; 3],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Eye {
    fn new() -> Self {
        let ((sy, cy), (se, ce)) = (YAW.sin_cos(), ELEVATION.sin_cos());
        let towards = [ce * cy, se, -ce * sy];
        // The chain lies level in the picture: its axis without what points at the eye.
        let length = (1.0 - towards[2] * towards[2]).sqrt();
        let right =
            [-towards[2] * towards[0], -towards[2] * towards[1], 1.0 - towards[2] * towards[2]].map(|x| x / length);
        let cross = |i: usize, j: usize| towards[i] * right[j] - towards[j] * right[i];
        Self { right, up: [-cross(1, 2), -cross(2, 0), -cross(0, 1)], towards }
    }

    fn on_sheet(&self, point: [f64; 3]) -> (f64, f64) {
        (dot(point, self.right), dot(point, self.up))
    }
}

/// The point (r, z) turned by φ; φ = 0 points at the eye's side, 90° up.
fn turned([r, z]: [f64; 2], (sine, cosine): (f64, f64)) -> [f64; 3] {
    [r * cosine, r * sine, z]
}

/// The revolved chain with the mesh on its cut faces.
#[must_use]
pub fn figure(bench: &Bench<'_>) -> Figure {
    let eye = Eye::new();
    let (_, [reach, _]) = bench.extent();
    let plates = bench.rigid_outlines();
    let mut surfaces: Vec<(f64, Polygon)> = Vec::new();
    for body in &bench.bodies {
        let colour = bench.colour(body.name).0;
        for outline in outlines(body, 0.04 * reach) {
            revolve(&outline, colour, &eye, &mut surfaces);
        }
    }
    for plate in &plates {
        let closed: Vec<[f64; 2]> = plate.iter().chain(&plate[..1]).copied().collect();
        revolve(&closed, RIGID.0, &eye, &mut surfaces);
    }
    surfaces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let surfaces: Vec<Polygon> = surfaces.into_iter().map(|(_, polygon)| polygon).collect();

    let mut faces = Vec::new();
    let mut strokes = Vec::new();
    for angle in [0.0, FRAC_PI_2] {
        let turn = if angle == 0.0 { (0.0, 1.0) } else { (1.0, 0.0) };
        let at = |place: [f64; 2]| eye.on_sheet(turned(place, turn));
        for body in &bench.bodies {
            let (colour, share) = bench.colour(body.name);
            for outline in outlines(body, 0.0) {
                let corners = outline.into_iter().map(at).collect();
                faces.push(Polygon { corners, fill: (colour, 0.5 * share) });
            }
            strokes.extend(sides(body).into_iter().map(|side| side.into_iter().map(at).collect::<Vec<_>>()));
        }
        for plate in &plates {
            let corners = plate.iter().map(|place| at(*place)).collect();
            faces.push(Polygon { corners, fill: (RIGID.0, 0.3) });
        }
    }
    let corners = || surfaces.iter().chain(&faces).flat_map(|polygon: &Polygon| &polygon.corners);
    let axis = |label: &str, pick: fn(&(f64, f64)) -> f64| {
        let (low, high) = extent(corners().map(pick));
        Axis::new(label, "mm").times(1e3).range(low - 0.1 * reach, high + 0.1 * reach)
    };
    let axes = (axis("Along the projected axis", |corner| corner.0), axis("Across", |corner| corner.1));
    let mut panel = Panel::new(axes.0, axes.1).equal_scales();
    let bodies = bench.names().into_iter().map(|name| (name, bench.colour(name).0));
    for (name, colour) in bodies.chain([("rigid", RIGID.0)]) {
        // An entry of the legend: nothing of it is seen.
        panel = panel.shapes(name, [Vec::new()], (colour, 0.6));
    }
    panel = panel
        .layer(Layer::Polygons { label: String::new(), polygons: surfaces })
        .layer(Layer::Polygons { label: String::new(), polygons: faces })
        .layer(Layer::Strokes { label: String::new(), strokes, stroke: Stroke::new(Colour::Black).width(0.08) });
    let title = "The chain revolved about its axis, a quarter cut out to show the mesh; parallel projection";
    Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel)
}

/// The closed outlines of a body's section, the body to the left, points at least `step` apart.
fn outlines(body: &Standing<'_>, step: f64) -> Vec<Vec<[f64; 2]>> {
    let place = |node: u32| body.place(node);
    let mut outer = outer_sides(body.mesh);
    let mut outlines = Vec::new();
    while let Some((&start, _)) = outer.first_key_value() {
        // A corner of the section must stay a corner: begin on the axis where there is one.
        let on_axis = outer.keys().copied().find(|node| place(*node)[0] == 0.0);
        let start = on_axis.unwrap_or(start);
        let mut points = vec![place(start)];
        let mut here = start;
        while let Some((middle, next)) = outer.remove(&here) {
            let [a, m, b] = [here, middle, next].map(place);
            for point in along_side(a, m, b) {
                let last = points[points.len() - 1];
                let leaves_axis = (point[0] == 0.0) != (last[0] == 0.0);
                if leaves_axis || (point[0] - last[0]).hypot(point[1] - last[1]) >= step {
                    points.push(point);
                }
            }
            here = next;
        }
        if points.len() > 2 {
            let first = points[0];
            points.push(first);
            outlines.push(points);
        }
    }
    outlines
}

/// The facets of a revolved outline that face the eye, with their distance towards it.
fn revolve(outline: &[[f64; 2]], colour: Colour, eye: &Eye, surfaces: &mut Vec<(f64, Polygon)>) {
    let turn = |step: usize| (FRAC_PI_2 + 1.5 * PI * step as f64 / STEPS as f64).sin_cos();
    for side in outline.windows(2) {
        let [a, b] = [side[0], side[1]];
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        if (a[0] == 0.0 && b[0] == 0.0) || length == 0.0 {
            continue;
        }
        // The body lies to the left of the side.
        let normal = [(b[1] - a[1]) / length, -(b[0] - a[0]) / length];
        for step in 0..STEPS {
            let half = (FRAC_PI_2 + 1.5 * PI * (step as f64 + 0.5) / STEPS as f64).sin_cos();
            let facing = dot(turned(normal, half), eye.towards);
            if facing <= 0.0 {
                continue;
            }
            let corners = [(a, step), (b, step), (b, step + 1), (a, step + 1)];
            let corners = corners.map(|(place, step)| turned(place, turn(step)));
            let depth = corners.iter().map(|corner| dot(*corner, eye.towards)).sum::<f64>();
            let corners = corners.iter().map(|corner| eye.on_sheet(*corner)).collect();
            // Darker where the surface turns away; in steps, so that equal neighbours merge.
            let share = 0.95 - 0.7 * (12.0 * facing).round() / 12.0;
            surfaces.push((depth, Polygon { corners, fill: (colour, share) }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_eye_looks_into_the_quarter_cut_out_at_a_level_chain() {
        let eye = Eye::new();
        for (a, b, product) in [
            (eye.right, eye.up, 0.0),
            (eye.right, eye.towards, 0.0),
            (eye.up, eye.towards, 0.0),
            (eye.right, eye.right, 1.0),
            (eye.up, eye.up, 1.0),
            (eye.towards, eye.towards, 1.0),
        ] {
            assert!((dot(a, b) - product).abs() < 1e-15);
        }
        let along = eye.on_sheet([0.0, 0.0, 1.0]);
        assert!(along.0 > 0.8 && along.1.abs() < 1e-15);
        assert!(eye.on_sheet([0.0, 1.0, 0.0]).1 > 0.5, "up is down");
        // Both cut faces, at φ = 0 looking up and at 90° looking out, are seen.
        assert!(eye.towards[0] > 0.1 && eye.towards[1] > 0.1);
    }
}
