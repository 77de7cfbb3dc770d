//! Mesh of the annulus that holds the last bead: a half disc revolved, graded towards the circle where the bead touches it.
//!
//! The patch about the contact point is a half disc bent to the surface, filled by two butterflies. From its rim layers lead to the
//! clamped side, by transfinite interpolation between rim, clamped side and the two arcs beside the patch (Gordon & Hall, 1973, Int. J.
//! Numer. Meth. Eng. 7, 461). Corners of the section are corners of elements with a right angle.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{
    Mesh, MeshError,
    bead::growth,
    butterfly::{self, Quarter},
    weave::Weave,
};
use crate::scene::AnnulusShape;

/// A half disc revolved about the axis, its flat side outwards and clamped, and the bead that lies on it.
///
/// Coordinates are the annulus's own: z = 0 is its plane of symmetry, the bead comes from z < 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfTorus {
    /// Radius R of the circle of the half discs' centres and of the flat side, m.
    pub ring_radius: f64,
    /// Radius b of the half disc, m, below R.
    pub section_radius: f64,
    /// Radius a of the bead, m, above R − b: it cannot fall through.
    pub bead_radius: f64,
}

impl HalfTorus {
    /// The resin annulus of the source paper under a 1 mm bead: R 0.55 mm, b 0.25 mm, a 0.5 mm.
    pub const fn published() -> Self {
        Self::under(&AnnulusShape::published(), 0.5e-3)
    }

    /// z of the bead's centre when it just touches, −√((a + b)² − R²), m.
    pub fn bead_centre(&self) -> f64 {
        let reach = self.bead_radius + self.section_radius;
        -((reach - self.ring_radius) * (reach + self.ring_radius)).sqrt()
    }

    /// Where the bead touches, (r, z), m.
    pub fn contact_point(&self) -> [f64; 2] {
        let [r, z] = self.normal();
        [self.ring_radius + self.section_radius * r, self.section_radius * z]
    }

    /// Outward unit normal (r, z) of the annulus at the contact point; it points to the bead's centre.
    pub fn normal(&self) -> [f64; 2] {
        let reach = self.bead_radius + self.section_radius;
        [-self.ring_radius / reach, self.bead_centre() / reach]
    }

    /// A ring under a bead of that radius, m.
    pub const fn under(shape: &AnnulusShape, bead_radius: f64) -> Self {
        Self { ring_radius: shape.ring_radius, section_radius: shape.section_radius, bead_radius }
    }

    /// Volume by Pappus, 2π (R − 4b/3π) πb²/2, m³.
    pub fn volume(&self) -> f64 {
        let b = self.section_radius;
        PI * PI * b * b * (self.ring_radius - 4.0 * b / (3.0 * PI))
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnnulusMesh {
    /// Density n ≥ 2, as that of a bead: the contact patch has 4⌈n/2⌉ elements along the surface, 24 at the default 12.
    pub density: usize,
    /// Half width of the contact patch along the surface, m.
    pub patch_half_width: f64,
}

impl AnnulusMesh {
    /// Half width of the contact patch, m: about that of the contact at 5 µm of approach.
    pub(crate) const PATCH_HALF_WIDTH: f64 = 30e-6;

    /// Quadrilaterals at this density, patch as shown to work.
    pub const fn of_density(density: usize) -> Self {
        Self { density, patch_half_width: Self::PATCH_HALF_WIDTH }
    }

    /// As [`AnnulusMesh::of_density`], with a patch for that ring: as wide as its contact grows at 5 µm of approach, which goes as √b, and no
    /// wider than its arc to the clamped corner allows.
    pub fn on(shape: &HalfTorus, density: usize) -> Self {
        let b = shape.section_radius;
        let grown = Self::PATCH_HALF_WIDTH * (b / AnnulusShape::published().section_radius).sqrt();
        let [_, toward_bead] = shape.normal();
        let arc = b * (PI - toward_bead.acos());
        Self { patch_half_width: grown.min(0.4 * b).min(0.4 * arc), ..Self::of_density(density) }
    }

    fn check(&self, shape: &HalfTorus) -> Result<(), MeshError> {
        let refuse = |name, expected, found| Err(MeshError::Parameter { body: "annulus", name, expected, found });
        let HalfTorus { ring_radius, section_radius, bead_radius } = *shape;
        if self.density < 2 || self.density > 200 {
            return refuse("a density", "from 2 to 200", self.density as f64);
        }
        if !(section_radius > 0.0 && section_radius.is_finite()) {
            return refuse("a section radius (m)", "above 0", section_radius);
        }
        if !(ring_radius > section_radius && ring_radius.is_finite()) {
            return refuse("a ring radius (m)", "above the section radius", ring_radius);
        }
        // Further out the bead would touch the clamping, not the half disc.
        if !(bead_radius > ring_radius - section_radius && bead_radius.is_finite()) {
            return refuse("a bead radius (m)", "above the radius of the annulus's opening", bead_radius);
        }
        if !(self.patch_half_width > 0.0 && self.patch_half_width <= 0.4 * section_radius) {
            return refuse(
                "a half width of the contact patch (m)",
                "above 0, at most 0.4 section radii",
                self.patch_half_width,
            );
        }
        Ok(())
    }
}

/// Grading p of the surface vertices towards the contact point, as i^p, 1: the force at 0.1 µm of approach is then within 0.1 % of that at
/// twice the density.
const GRADING: f64 = 1.5;

/// Largest layer over the section's radius at density 12, 1.
const LARGEST_LAYER: f64 = 0.3;

/// The section's circle and the contact point on it, in the angle φ of z − i (r − R) = b e^{iφ}: 0 and π at the corners, φ₀ > π/2.
struct Section {
    shape: HalfTorus,
    contact: f64,
    /// Half width of the patch over the section's radius.
    half_angle: f64,
}

impl Section {
    /// The point at an angle, a depth below the surface; the corners to the last bit.
    fn below(&self, angle: f64, depth: f64) -> [f64; 2] {
        let HalfTorus { ring_radius, section_radius, .. } = self.shape;
        let distance = section_radius - depth;
        if angle == 0.0 || angle == PI {
            return [ring_radius, distance.copysign(FRAC_PI_2 - angle)];
        }
        [ring_radius - distance * angle.sin(), distance * angle.cos()]
    }

    fn surface(&self, angle: f64) -> [f64; 2] {
        self.below(angle, 0.0)
    }

    /// From the half disc x² + y² ≤ 1, y ≥ 0 to the contact patch: x along the surface towards the outer side, y into the body.
    fn patch(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let depth = y * self.half_angle * self.shape.section_radius;
        self.below(self.contact + x * self.half_angle, depth)
    }

    /// Vertex q of a line between the patch's rim and the clamped side, by transfinite interpolation.
    ///
    /// - `rim`: the vertices of the rim from its outer end to its inner
    /// - `shares`: how far the line has come along the surface from the outer and from the inner end, 0 to 1
    fn between(&self, rim: &[[f64; 2]], q: usize, (short, long): (f64, f64)) -> [f64; 2] {
        let last = rim.len() - 1;
        let u = q as f64 / last as f64;
        let v = short + u * (long - short);
        let (outer, inner) = (self.contact + self.half_angle, self.contact - self.half_angle);
        let (beside_short, beside_long) =
            (self.surface(outer + short * (PI - outer)), self.surface(inner - long * inner));
        let (far_short, far_long) = (self.surface(PI), self.surface(0.0));
        std::array::from_fn(|d| {
            let far = far_short[d] + u * (far_long[d] - far_short[d]);
            // How far the two arcs stand off their chords.
            let bulge_short = beside_short[d] - (rim[0][d] + short * (far_short[d] - rim[0][d]));
            let bulge_long = beside_long[d] - (rim[last][d] + long * (far_long[d] - rim[last][d]));
            rim[q][d] + v * (far - rim[q][d]) + (1.0 - u) * bulge_short + u * bulge_long
        })
    }

    /// The middle of the arc between two points of the circle.
    fn middle(&self, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        let angle = |[r, z]: [f64; 2]| (self.shape.ring_radius - r).atan2(z);
        self.surface(0.5 * (angle(a) + angle(b)))
    }
}

/// Edges of `count` layers from 0 to 1, the first `first` thick, the others in geometric progression.
fn progression(first: f64, count: usize) -> Vec<f64> {
    let edges = |ratio: f64| {
        let (mut edges, mut thickness) = (vec![0.0], first);
        for layer in 0..count {
            edges.push(edges[layer] + thickness);
            thickness *= ratio;
        }
        edges
    };
    let (mut low, mut high) = (0.1, 10.0);
    // The sum grows with the ratio; 60 halvings reach rounding.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if edges(middle)[count] < 1.0 { low = middle } else { high = middle }
    }
    let mut edges = edges(low);
    edges[count] = 1.0;
    edges
}

/// Mesh of the annulus.
///
/// Boundaries: `contact`, the patch about the contact point along the surface from the inner side (small r) to the outer; `clamped`, the
/// flat side, towards positive z. The corners belong to `clamped`.
pub fn annulus(shape: &HalfTorus, settings: &AnnulusMesh) -> Result<Mesh, MeshError> {
    settings.check(shape)?;
    let b = shape.section_radius;
    let [_, toward_bead] = shape.normal();
    let section = Section { shape: *shape, contact: toward_bead.acos(), half_angle: settings.patch_half_width / b };
    let n = settings.density.div_ceil(2);
    let growth = growth(settings.density);
    let fractions: Vec<f64> = (0..=2 * n).map(|i| (i as f64 / (2 * n) as f64).powf(GRADING)).collect();
    // Angles of the surface beside the patch: outwards to the corner at π, inwards and over the crest to the one at 0.
    let (outer, inner) = (section.contact + section.half_angle, section.contact - section.half_angle);
    if !(PI - outer > section.half_angle) {
        let expected = "below half the distance from the contact to the clamped corner";
        let (name, found) = ("a half width of the contact patch (m)", settings.patch_half_width);
        return Err(MeshError::Parameter { body: "annulus", name, expected, found });
    }

    let mut weave = Weave::default();
    let curve = |weave: &mut Weave, quarter: &Quarter| {
        for side in quarter.along_x.windows(2) {
            let middle = section.middle(weave.place(side[0]), weave.place(side[1]));
            weave.curve(side[0], side[1], middle);
        }
    };
    let outward = butterfly::fill(&mut weave, &fractions, None, |at| section.patch(at), curve);
    let inward_place = |[x, y]: [f64; 2]| section.patch([-x, y]);
    let shared = Some(&outward.along_y[..]);
    let inward = butterfly::fill(&mut weave, &fractions, shared, inward_place, curve);
    let rim: Vec<u32> = outward.arc.iter().chain(inward.arc.iter().rev().skip(1)).copied().collect();
    let rim_places: Vec<[f64; 2]> = rim.iter().map(|vertex| weave.place(*vertex)).collect();

    // Layers from the patch's rim to the clamped side, as thick at both ends of the rim, more so further on over the longer way.
    let first = growth * section.half_angle * (1.0 - fractions[2 * n - 1]);
    let largest = LARGEST_LAYER * (12.0 / settings.density as f64).min(2.0);
    let long: Vec<f64> = butterfly::layers(inner, first, growth, largest).iter().map(|edge| edge / inner).collect();
    let count = long.len() - 1;
    let short = progression(long[1] * inner / (PI - outer), count);
    let width = 4 * n;
    let mut lines = vec![rim];
    for k in 1..=count {
        let line = (0..=width).map(|q| {
            if q == 0 {
                // The last is the corner to the last bit.
                return section.surface(if k == count { PI } else { outer + short[k] * (PI - outer) });
            }
            if q == width {
                return section.surface(if k == count { 0.0 } else { inner - long[k] * inner });
            }
            section.between(&rim_places, q, (short[k], long[k]))
        });
        let line: Vec<[f64; 2]> = line.collect();
        lines.push(line.into_iter().map(|place| weave.vertex(place)).collect());
    }
    for pair in lines.windows(2) {
        for q in [0, width] {
            let middle = section.middle(weave.place(pair[0][q]), weave.place(pair[1][q]));
            weave.curve(pair[0][q], pair[1][q], middle);
        }
        for q in 0..width {
            weave.quadrilateral([pair[0][q], pair[0][q + 1], pair[1][q + 1], pair[1][q]]);
        }
    }
    let contact: Vec<u32> = inward.along_x.iter().rev().chain(&outward.along_x[1..]).copied().collect();
    weave.boundary("contact", &contact);
    weave.boundary("clamped", &lines[count]);
    let mesh = weave.finish();
    mesh.check()?;
    Ok(mesh)
}
