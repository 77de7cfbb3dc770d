//! Mesh of a sphere: the half disc mapped to a strip, its two poles filled by butterflies.
//!
//! ```text
//! z + i r = a tanh((s + i t)/2) = a (sinh s + i sin t)/(cosh s + cos t),   0 ≤ t ≤ π/2
//! ```
//!
//! t = 0 is the axis, t = π/2 the sphere, s → ±∞ the poles; the map is conformal, so lines of constant s and t are orthogonal and
//! crowd towards both poles. With ζ = e^{−(s + i t)} it reads (z + i r)/a = (1 − ζ)/(1 + ζ): the cap s > S is the quarter disc |ζ| < e^{−S}.

use std::f64::consts::FRAC_PI_2;

use super::{
    Mesh, MeshError,
    butterfly::{self, Quarter},
    weave::Weave,
};
use crate::scene::DEFAULT_CONTACT_PATCH;

/// Grading p of the surface vertices r = r₀ (i/2n)^p, 1: makes the patch's last element as long as the strip's first is wide.
const GRADING: f64 = 1.6;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadMesh {
    /// Density n ≥ 2: a pole's patch has 2n elements along the surface and along the axis. 8 is quick, 12 the default, 16 to 24 a reference.
    pub density: usize,
    /// Radius r₀ of a polar patch over the bead's radius, 1, above 0 and at most 0.5.
    pub patch_radius: f64,
}

impl BeadMesh {
    /// At this density, patch as shown to work.
    pub const fn of_density(density: usize) -> Self {
        Self { density, patch_radius: DEFAULT_CONTACT_PATCH }
    }

    fn check(&self, radius: f64) -> Result<(), MeshError> {
        let refuse = |name, expected, found| Err(MeshError::Parameter { body: "bead", name, expected, found });
        if self.density < 2 || self.density > 200 {
            return refuse("a density", "from 2 to 200", self.density as f64);
        }
        if !(radius > 0.0 && radius.is_finite()) {
            return refuse("a radius (m)", "above 0", radius);
        }
        if !(self.patch_radius > 0.0 && self.patch_radius <= 0.5) {
            return refuse("a patch radius over the bead's", "above 0 and at most 0.5", self.patch_radius);
        }
        Ok(())
    }
}

/// Growth of neighbouring layers: 1.15 up to n = 12, then closer to 1, so that finer meshes are finer everywhere.
pub(super) fn growth(density: usize) -> f64 {
    1.0 + 0.15 * (12.0 / density as f64).min(1.0)
}

/// Largest layer over the width of a strip's element, both in the strip's own coordinates: 0.26 rad of the equator at n = 12.
const LARGEST_ASPECT: f64 = 4.0;

/// Mesh of a bead centred at the origin, mirror symmetric about z = 0 to the last bit, with a node at its centre.
///
/// - `radius`: a, m
///
/// Boundaries: `front`, the patch of the pole at z < 0 that faces the piston, and `back`, the patch of the other pole, both from the pole
/// outwards; `side`, the rest of the surface, from `front` to `back`. On a patch every middle node has the mean r of its neighbours, so
/// nodal forces of a uniform pressure are as 1 : 4 and 0 at the pole.
pub fn bead(radius: f64, settings: &BeadMesh) -> Result<Mesh, MeshError> {
    settings.check(radius)?;
    let n = settings.density;
    let patch = radius * settings.patch_radius;
    let on_sphere = |r: f64| [r, ((radius - r) * (radius + r)).sqrt()];
    // |ζ| of a point of the sphere: tan of half its angle from the pole.
    let zeta = |r: f64| r / (radius + on_sphere(r)[1]);
    let cap = zeta(patch);
    let graded = |i: usize| patch * (i as f64 / (2 * n) as f64).powf(GRADING);
    let mut fractions: Vec<f64> = (0..=2 * n).map(|i| zeta(graded(i)) / cap).collect();
    fractions[2 * n] = 1.0;

    // The half z ≥ 0. s runs from the cap to the equator.
    let end = -cap.ln();
    let width = FRAC_PI_2 / (2 * n) as f64;
    let growth = growth(n);
    let last_of_cap = -fractions[2 * n - 1].ln();
    let from_cap = butterfly::layers(end, growth * last_of_cap, growth, LARGEST_ASPECT * width);
    let lines: Vec<f64> = from_cap.iter().map(|edge| end - edge).collect();
    let strip = |s: f64, t: f64| {
        let scale = radius / (s.cosh() + t.cos());
        [scale * t.sin(), scale * s.sinh()]
    };
    let turn = |half_steps: usize| FRAC_PI_2 * half_steps as f64 / (4 * n) as f64;
    // Lines t = 0 and t = π/2 are the axis and the sphere, to the last bit.
    let strip_place = |s: f64, half_steps: usize| match half_steps {
        0 => [0.0, radius * (0.5 * s).tanh()],
        _ if half_steps == 4 * n => [radius / s.cosh(), radius * s.tanh()],
        _ => strip(s, turn(half_steps)),
    };

    let mut weave = Weave::default();
    let place = |[x, y]: [f64; 2]| {
        let (x, y) = (cap * x, cap * y);
        if x == 0.0 {
            return on_sphere(2.0 * radius * y / (1.0 + y * y));
        }
        let scale = radius / ((1.0 + x).powi(2) + y * y);
        [2.0 * y * scale, (1.0 - x * x - y * y) * scale]
    };
    let curve = |weave: &mut Weave, quarter: &Quarter| {
        for side in quarter.along_y.windows(2) {
            let middle = 0.5 * (weave.place(side[0])[0] + weave.place(side[1])[0]);
            weave.curve(side[0], side[1], on_sphere(middle));
        }
        for (q, side) in quarter.arc.windows(2).enumerate() {
            weave.curve(side[0], side[1], strip_place(end, 2 * q + 1));
        }
    };
    let quarter = butterfly::fill(&mut weave, &fractions, None, place, curve);

    let mut before = quarter.arc.clone();
    let mut side = vec![before[2 * n]];
    for pair in lines.windows(2) {
        let line: Vec<u32> = (0..=2 * n).map(|q| weave.vertex(strip_place(pair[1], 2 * q))).collect();
        for q in 0..=2 * n {
            weave.curve(before[q], line[q], strip_place(0.5 * (pair[0] + pair[1]), 2 * q));
            if q < 2 * n {
                weave.curve(line[q], line[q + 1], strip_place(pair[1], 2 * q + 1));
            }
        }
        for q in 0..2 * n {
            weave.quadrilateral([before[q], before[q + 1], line[q + 1], line[q]]);
        }
        side.push(line[2 * n]);
        before = line;
    }
    weave.boundary("back", &quarter.along_y);
    weave.boundary("half side", &side);
    let mut mesh = weave.mirrored(|name| if name == "back" { "front" } else { name }.to_owned()).finish();

    // From the front's patch to the equator, which both halves share, and on to the back's patch.
    let halves: Vec<Vec<u32>> =
        mesh.boundaries.iter().filter(|boundary| boundary.name == "half side").map(|half| half.nodes.clone()).collect();
    mesh.boundaries.retain(|boundary| boundary.name != "half side");
    mesh.boundaries.reverse();
    if let [back, front] = &halves[..] {
        let nodes = front.iter().chain(back.iter().rev().skip(1)).copied().collect();
        mesh.boundaries.push(super::Boundary { name: "side".to_owned(), nodes });
    }
    mesh.check()?;
    Ok(mesh)
}
