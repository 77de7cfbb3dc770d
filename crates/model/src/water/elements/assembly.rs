//! Matrices of the water, and its coupling with a plane face.

use std::f64::consts::TAU;

use super::{
    Baffle, Water,
    mesh::{Bilinear, Hemisphere},
    sparse::{Entries, Sparse},
};
use crate::{fea::element::edge, water::quadrature::gauss_legendre};

/// Where an unknown that is zero stands.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Q, H, M_Γ, T and which nodes carry unknowns; all integrals with 2πr.
#[derive(Debug, Clone)]
pub(super) struct Acoustics {
    pub mesh: Hemisphere,
    pub water: Water,
    /// Node → unknown ψ; [`NOWHERE`] where ψ = 0 beside the disc.
    pub unknown: Vec<u32>,
    pub unknowns: usize,
    pub auxiliary: usize,
    /// ∫NNᵀ/(ρc²), m⁴·s²/kg.
    pub compliance: Sparse,
    /// ∫∇N·∇Nᵀ/ρ, m⁴/kg.
    pub inertance: Sparse,
    /// ∫_Γ NNᵀ, m², by unknowns ψ.
    pub arc: Sparse,
    /// ∫_Γ ∂N ∂Nᵀ/(2ρ), rows η, columns ψ.
    pub tangential: Sparse,
    /// The same, rows and columns η.
    pub tangential_own: Sparse,
}

impl Acoustics {
    pub(crate) fn new(mesh: Hemisphere, water: Water, baffle: Baffle) -> Self {
        let mut is_free = vec![true; mesh.nodes.len()];
        if baffle == Baffle::Soft {
            // The disc's edge belongs to the free surface.
            for &node in &mesh.plane[mesh.on_disc - 1..] {
                is_free[node as usize] = false;
            }
        }
        let mut unknowns = 0;
        let unknown: Vec<u32> = is_free
            .iter()
            .map(|&free| {
                let own = if free { unknowns } else { NOWHERE };
                unknowns += u32::from(free);
                own
            })
            .collect();
        // η counts by its derivative along the arc only, on a soft baffle too: T has the constants in its null space, so that any one node may
        // be pinned, here the one on the axis.
        let last = mesh.arc.len() - 1;
        let own = |place: usize| if place == 0 { NOWHERE } else { place as u32 - 1 };

        let (mut compliance, mut inertance) = (Entries::new(), Entries::new());
        let gauss = 1.0 / 3f64.sqrt();
        for element in &mesh.elements {
            let corners = mesh.corners(element);
            for [xi, eta] in [[-gauss, -gauss], [gauss, -gauss], [gauss, gauss], [-gauss, gauss]] {
                let at = Bilinear::new(&corners, [xi, eta]);
                let weight = at.jacobian.abs() * TAU * at.place[0];
                for i in 0..4 {
                    for j in 0..4 {
                        let (row, column) = (unknown[element[i] as usize], unknown[element[j] as usize]);
                        if row == NOWHERE || column == NOWHERE {
                            continue;
                        }
                        let product = at.gradient[i][0] * at.gradient[j][0] + at.gradient[i][1] * at.gradient[j][1];
                        let stored = at.value[i] * at.value[j] / (water.density * water.sound_speed.powi(2));
                        compliance.push((row, column, weight * stored));
                        inertance.push((row, column, weight * product / water.density));
                    }
                }
            }
        }

        let (mut arc, mut tangential, mut tangential_own) = (Entries::new(), Entries::new(), Entries::new());
        let rule = gauss_legendre(2);
        for (place, side) in mesh.arc.windows(2).enumerate() {
            let [a, b] = [0, 1].map(|end| mesh.nodes[side[end] as usize]);
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let nodes = [unknown[side[0] as usize], unknown[side[1] as usize]];
            let own = [own(place), own(place + 1)];
            for &(x, weight) in &rule {
                let area = weight * length * TAU * (a[0] + x * (b[0] - a[0]));
                let (value, slope) = ([1.0 - x, x], [-1.0 / length, 1.0 / length]);
                for i in 0..2 {
                    for j in 0..2 {
                        let change = area * slope[i] * slope[j] / (2.0 * water.density);
                        if nodes[i] != NOWHERE && nodes[j] != NOWHERE {
                            arc.push((nodes[i], nodes[j], area * value[i] * value[j]));
                        }
                        if own[i] != NOWHERE && nodes[j] != NOWHERE {
                            tangential.push((own[i], nodes[j], change));
                        }
                        if own[i] != NOWHERE && own[j] != NOWHERE {
                            tangential_own.push((own[i], own[j], change));
                        }
                    }
                }
            }
        }
        let (unknowns, auxiliary) = (unknowns as usize, last);
        Self {
            compliance: Sparse::new(unknowns, compliance),
            inertance: Sparse::new(unknowns, inertance),
            arc: Sparse::new(unknowns, arc),
            tangential: Sparse::new(auxiliary, tangential),
            tangential_own: Sparse::new(auxiliary, tangential_own),
            mesh,
            water,
            unknown,
            unknowns,
            auxiliary,
        }
    }

    /// ∫ φ N dS over the disc for a shape φ(r), m² × its unit.
    pub(crate) fn face_load(&self, shape: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut out = vec![0.0; self.unknowns];
        let rule = gauss_legendre(6);
        for side in self.mesh.plane[..self.mesh.on_disc].windows(2) {
            let [from, to] = [0, 1].map(|end| self.mesh.nodes[side[end] as usize][0]);
            for &(x, weight) in &rule {
                let radius = from + x * (to - from);
                let area = weight * (to - from) * TAU * radius * shape(radius);
                for (node, value) in side.iter().zip([1.0 - x, x]) {
                    let place = self.unknown[*node as usize];
                    if place != NOWHERE {
                        out[place as usize] += area * value;
                    }
                }
            }
        }
        out
    }

    /// ∫ N_s N_f dS: rows the nodes of a face with quadratic sides (radii of vertex, middle, vertex, …, m), columns ψ. Exact for meshes that
    /// do not match.
    pub(crate) fn coupling(&self, radii: &[f64]) -> Sparse {
        let plane: Vec<f64> =
            self.mesh.plane[..self.mesh.on_disc].iter().map(|&n| self.mesh.nodes[n as usize][0]).collect();
        let mut cuts: Vec<f64> = plane.iter().copied().chain(radii.iter().copied().step_by(2)).collect();
        cuts.sort_by(f64::total_cmp);
        let mut entries = Entries::new();
        let rule = gauss_legendre(3);
        for piece in cuts.windows(2) {
            let (from, to) = (piece[0], piece[1]);
            let middle = 0.5 * (from + to);
            if !(to - from > 1e-12 * middle) {
                continue;
            }
            let within = |ends: &[f64]| ends.partition_point(|&end| end <= middle).clamp(1, ends.len() - 1) - 1;
            let wet = within(&plane);
            let vertices: Vec<f64> = radii.iter().copied().step_by(2).collect();
            let dry = within(&vertices);
            for &(x, weight) in &rule {
                let radius = from + x * (to - from);
                let area = weight * (to - from) * TAU * radius;
                let u = (radius - plane[wet]) / (plane[wet + 1] - plane[wet]);
                let t = (2.0 * radius - vertices[dry] - vertices[dry + 1]) / (vertices[dry + 1] - vertices[dry]);
                for (i, solid) in edge(t).into_iter().enumerate() {
                    for (j, fluid) in [1.0 - u, u].into_iter().enumerate() {
                        let place = self.unknown[self.mesh.plane[wet + j] as usize];
                        if place != NOWHERE {
                            entries.push(((2 * dry + i) as u32, place, area * solid * fluid));
                        }
                    }
                }
            }
        }
        Sparse::new(radii.len(), entries)
    }
}
