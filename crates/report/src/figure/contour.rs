//! Lines of equal value on a rectangular grid: marching squares with linear interpolation along the edges.

use super::Map;

/// The segments where `map` takes the value `level`, in the map's coordinates; a saddle is cut by the mean of its corners.
pub(super) fn segments(map: &Map, level: f64) -> Vec<[(f64, f64); 2]> {
    let columns = map.x.len();
    let value = |i: usize, j: usize| map.values[j * columns + i] - level;
    let mut segments = Vec::new();
    for j in 0..map.y.len().saturating_sub(1) {
        for i in 0..columns.saturating_sub(1) {
            // Corners anticlockwise from the lower left, and the crossing of the edge behind each.
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let values = corners.map(|(i, j)| value(i, j));
            let mut crossings = Vec::with_capacity(4);
            for edge in 0..4 {
                let next = (edge + 1) % 4;
                if (values[edge] > 0.0) != (values[next] > 0.0) {
                    let share = values[edge] / (values[edge] - values[next]);
                    let (from, to) = (corners[edge], corners[next]);
                    let along = |a: f64, b: f64| a + share * (b - a);
                    crossings.push((along(map.x[from.0], map.x[to.0]), along(map.y[from.1], map.y[to.1])));
                }
            }
            match crossings.as_slice() {
                [a, b] => segments.push([*a, *b]),
                [a, b, c, d] => {
                    // Crossings a…d lie on the bottom, right, top and left edge; the middle says which corners hang together.
                    let middle_above = values.iter().sum::<f64>() > 0.0;
                    if (values[0] > 0.0) == middle_above {
                        segments.extend([[*a, *b], [*c, *d]]);
                    } else {
                        segments.extend([[*a, *d], [*b, *c]]);
                    }
                }
                _ => {}
            }
        }
    }
    segments
}

/// Segments joined end to end into as few curves as their order allows.
pub(super) fn join(mut segments: Vec<[(f64, f64); 2]>, tolerance: f64) -> Vec<Vec<(f64, f64)>> {
    let near = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() <= tolerance && (a.1 - b.1).abs() <= tolerance;
    // Where the level passes through a grid point, a segment of no length comes out: it joins nothing.
    segments.retain(|[a, b]| !near(*a, *b));
    let mut curves = Vec::new();
    while let Some([start, end]) = segments.pop() {
        let mut curve = std::collections::VecDeque::from([start, end]);
        while let (Some(&head), Some(&tail)) = (curve.front(), curve.back()) {
            let joins =
                |segment: &[(f64, f64); 2]| segment.iter().any(|point| near(*point, head) || near(*point, tail));
            let Some(index) = segments.iter().position(joins) else { break };
            let [a, b] = segments.swap_remove(index);
            if near(a, tail) {
                curve.push_back(b);
            } else if near(b, tail) {
                curve.push_back(a);
            } else if near(a, head) {
                curve.push_front(b);
            } else {
                curve.push_front(a);
            }
        }
        curves.push(curve.into());
    }
    curves
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contour_of_a_paraboloid_is_one_closed_circle() {
        let axis: Vec<f64> = (0..41).map(|i| f64::from(i) * 0.05 - 1.0).collect();
        let values = axis.iter().flat_map(|y| axis.iter().map(move |x| x * x + y * y)).collect();
        let map = Map { x: axis.clone(), y: axis, values };
        let curves = join(segments(&map, 0.25), 1e-9);
        assert_eq!(curves.len(), 1);
        let (first, last) = (curves[0][0], curves[0][curves[0].len() - 1]);
        assert!((first.0 - last.0).hypot(first.1 - last.1) < 1e-9);
        for (x, y) in &curves[0] {
            // Linear interpolation of x² on a grid of step h errs by at most h²/8 / (2 r).
            assert!((x.hypot(*y) - 0.5).abs() < 0.05 * 0.05 / 8.0 / (2.0 * 0.5) * 2.0);
        }
    }
}
