//! A quarter disc filled by three blocks of n × n quadrilaterals each, its layers along a strip.
//!
//! The quarter disc x, y ≥ 0, x² + y² ≤ 1 has 2n elements along each of its three sides. A square block sits in the corner, two blocks
//! lead from its outer sides to the arc. The corner's grading along both straight sides fades to even spacing inside, so elements stay
//! near square where the sides are graded.

use std::f64::consts::FRAC_PI_2;

use super::weave::Weave;

/// Place of the inner block's far corner along the diagonal, over the place of its near corners on the sides: angles near 120° there.
const CORNER: f64 = 0.8;

/// The vertices on the three sides, 2n + 1 each.
pub(super) struct Quarter {
    pub along_x: Vec<u32>,
    pub along_y: Vec<u32>,
    /// Along the arc, from x to y.
    pub arc: Vec<u32>,
}

/// Fill a quarter disc.
///
/// - `fractions`: distances of the 2n + 1 vertices on the straight sides from the corner, from 0 to 1
/// - `place`: from the quarter disc to (r, z)
/// - `shared`: vertices along y made before, by the neighbour
/// - `curve`: tells the weave the middles of the sides that are not straight, given the finished sides, before any element is made
pub(super) fn fill(
    weave: &mut Weave,
    fractions: &[f64],
    shared: Option<&[u32]>,
    place: impl Fn([f64; 2]) -> [f64; 2],
    curve: impl Fn(&mut Weave, &Quarter),
) -> Quarter {
    let n = fractions.len() / 2;
    let near = fractions[n];
    let far = CORNER * near;
    let side = |x: f64, index: usize, weave: &mut Weave, at: [f64; 2]| match shared {
        // On the shared side x = 0.
        Some(vertices) if x == 0.0 => vertices[index],
        _ => weave.vertex(place(at)),
    };

    // The square block, vertices [i][j]: i along x, j along y.
    let share = |i: usize| i as f64 / n as f64;
    let graded = |i: usize| fractions[i] / near;
    let mut square = vec![vec![0; n + 1]; n + 1];
    for (i, column) in square.iter_mut().enumerate() {
        for (j, vertex) in column.iter_mut().enumerate() {
            let u = graded(i) + (share(i) - graded(i)) * share(j);
            let v = graded(j) + (share(j) - graded(j)) * share(i);
            let at = [near * u * (1.0 - v) + far * u * v, near * v * (1.0 - u) + far * u * v];
            *vertex = side(at[0], j, weave, at);
        }
    }
    // From the square's outer sides to the arc, vertices [k][q]: k outwards, q from x to y.
    let rim = |q: usize| if q <= n { square[n][q] } else { square[2 * n - q][n] };
    let rim_place = |q: usize| {
        let along =
            |t: f64, from: [f64; 2], to: [f64; 2]| [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
        if q <= n { along(share(q), [near, 0.0], [far, far]) } else { along(share(q - n), [far, far], [0.0, near]) }
    };
    let mut fan = vec![(0..=2 * n).map(rim).collect::<Vec<_>>()];
    for (k, fraction) in fractions.iter().copied().enumerate().skip(n + 1) {
        let outwards = (fraction - near) / (1.0 - near);
        let ring = (0..=2 * n).map(|q| {
            let angle = FRAC_PI_2 * q as f64 / (2 * n) as f64;
            let ([x, y], (sine, cosine)) = (rim_place(q), angle.sin_cos());
            let at = match q {
                0 => [fraction, 0.0],
                _ if q == 2 * n => [0.0, fraction],
                _ => [x + outwards * (cosine - x), y + outwards * (sine - y)],
            };
            side(at[0], k, weave, at)
        });
        fan.push(ring.collect());
    }

    let quarter = Quarter {
        along_x: (0..n).map(|i| square[i][0]).chain(fan.iter().map(|ring| ring[0])).collect(),
        along_y: (0..n).map(|j| square[0][j]).chain(fan.iter().map(|ring| ring[2 * n])).collect(),
        arc: fan[n].clone(),
    };
    curve(weave, &quarter);
    for block in [&square, &fan] {
        for lines in block.windows(2) {
            for j in 0..lines[0].len() - 1 {
                weave.quadrilateral([lines[0][j], lines[1][j], lines[1][j + 1], lines[0][j + 1]]);
            }
        }
    }
    quarter
}

/// Edges of layers that fill `total`, from 0 to it: the first at most `first`, each next at most `growth` times the one before and none
/// larger than `largest`.
pub(super) fn layers(total: f64, first: f64, growth: f64, largest: f64) -> Vec<f64> {
    let mut edges = vec![0.0];
    let (mut edge, mut thickness) = (0.0, first.min(largest));
    while edge < total {
        edge += thickness;
        edges.push(edge);
        thickness = (thickness * growth).min(largest);
    }
    let scale = total / edge;
    for edge in &mut edges {
        *edge *= scale;
    }
    // Rounding must not leave the last edge beside its place.
    if let Some(last) = edges.last_mut() {
        *last = total;
    }
    edges
}
