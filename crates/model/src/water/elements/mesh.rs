//! The mesh of a hemisphere of water.

use std::f64::consts::FRAC_PI_2;

use super::{ElementsError, WaterMesh};

/// Linear quadrilaterals between circles and rays, z ≥ 0: node 0 in the middle, then circle after circle from the axis to the baffle. The
/// disc's edge lies on a circle.
#[derive(Debug, Clone, PartialEq)]
pub struct Hemisphere {
    /// Nodes (r, z), m; r = 0 on the axis and z = 0 on the baffle exactly.
    pub nodes: Vec<[f64; 2]>,
    /// Elements: node on the inner circle, next on it, opposite on the outer one, the one before; innermost ones have the middle twice.
    pub elements: Vec<[u32; 4]>,
    /// Nodes of the absorbing arc from the axis to the baffle.
    pub arc: Vec<u32>,
    /// Nodes of the plane z = 0 from the axis out.
    pub plane: Vec<u32>,
    /// Those of the plane that lie on the disc, its edge included.
    pub on_disc: usize,
    /// Radius R, m.
    pub radius: f64,
}

impl Hemisphere {
    /// Mesh the water around a disc of that radius a (m).
    pub(crate) fn new(disc: f64, mesh: &WaterMesh) -> Result<Self, ElementsError> {
        let WaterMesh { radius, side } = *mesh;
        let refuse = |name, expected, found| Err(ElementsError::Mesh { name, expected, found });
        if !(disc > 0.0 && disc.is_finite()) {
            return refuse("disc radius, m", "finite and > 0", disc);
        }
        if !(radius > disc && radius.is_finite()) {
            return refuse("radius of the hemisphere, m", "finite and beyond the disc", radius);
        }
        if !(side > 0.0 && side <= 0.5 * disc && radius / side < 1000.0) {
            return refuse("side of an element, m", "above R/1000 and at most half the disc's radius", side);
        }
        let count = |length: f64| (length / side - 1e-9).ceil().max(1.0) as usize;
        let (inner, outer, angles) = (2 * count(disc), count(radius - disc), count(radius));
        let circle = |i: usize| {
            if i <= inner {
                disc * i as f64 / inner as f64
            } else {
                disc + (radius - disc) * (i - inner) as f64 / outer as f64
            }
        };
        let circles = inner + outer;
        let mut nodes = vec![[0.0, 0.0]];
        for i in 1..=circles {
            for j in 0..=angles {
                let (sine, cosine) = (FRAC_PI_2 * j as f64 / angles as f64).sin_cos();
                let r = if j == 0 { 0.0 } else { circle(i) * sine };
                let z = if j == angles { 0.0 } else { circle(i) * cosine };
                nodes.push([r, z]);
            }
        }
        let node = |i: usize, j: usize| if i == 0 { 0 } else { (1 + (i - 1) * (angles + 1) + j) as u32 };
        let elements = (0..circles)
            .flat_map(|i| (0..angles).map(move |j| [node(i, j), node(i, j + 1), node(i + 1, j + 1), node(i + 1, j)]))
            .collect();
        let arc = (0..=angles).map(|j| node(circles, j)).collect();
        let plane = (0..=circles).map(|i| node(i, angles)).collect();
        Ok(Self { nodes, elements, arc, plane, on_disc: inner + 1, radius })
    }

    /// The corners of an element, m.
    pub(super) fn corners(&self, element: &[u32; 4]) -> [[f64; 2]; 4] {
        element.map(|node| self.nodes[node as usize])
    }

    /// Nodes and weights that interpolate at a point (r, z), m; none outside the mesh.
    ///
    /// The bilinear map of the element is inverted by Newton's iteration.
    pub(crate) fn locate(&self, point: [f64; 2]) -> Option<[(u32, f64); 4]> {
        let tolerance = 1e-9;
        for element in &self.elements {
            let corners = self.corners(element);
            let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
            for corner in corners {
                for axis in 0..2 {
                    low[axis] = low[axis].min(corner[axis]);
                    high[axis] = high[axis].max(corner[axis]);
                }
            }
            let slack = tolerance * self.radius;
            if (0..2).any(|axis| point[axis] < low[axis] - slack || point[axis] > high[axis] + slack) {
                continue;
            }
            let mut at = [0.0, 0.0];
            for _ in 0..20 {
                let local = Bilinear::new(&corners, at);
                let miss = [0, 1].map(|axis| point[axis] - local.place[axis]);
                let [[a, b], [c, d]] = local.map;
                if local.jacobian == 0.0 {
                    break;
                }
                at[0] += (d * miss[0] - b * miss[1]) / local.jacobian;
                at[1] += (a * miss[1] - c * miss[0]) / local.jacobian;
                at = at.map(|x: f64| x.clamp(-1.5, 1.5));
            }
            let local = Bilinear::new(&corners, at);
            let reached = (0..2).all(|axis| (point[axis] - local.place[axis]).abs() <= slack);
            if reached && at.iter().all(|x| x.abs() <= 1.0 + 1e-6) {
                return Some([0, 1, 2, 3].map(|k| (element[k], local.value[k])));
            }
        }
        None
    }
}

/// A bilinear element at a point (ξ, η) of its square.
pub(super) struct Bilinear {
    pub value: [f64; 4],
    /// (∂N/∂r, ∂N/∂z), 1/m.
    pub gradient: [[f64; 2]; 4],
    pub place: [f64; 2],
    /// ∂(r, z)/∂(ξ, η): `map[a][b]`.
    map: [[f64; 2]; 2],
    pub jacobian: f64,
}

impl Bilinear {
    pub(crate) fn new(corners: &[[f64; 2]; 4], [xi, eta]: [f64; 2]) -> Self {
        let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let value = signs.map(|[x, y]| 0.25 * (1.0 + x * xi) * (1.0 + y * eta));
        let slope = signs.map(|[x, y]| [0.25 * x * (1.0 + y * eta), 0.25 * y * (1.0 + x * xi)]);
        let mut place = [0.0; 2];
        let mut map = [[0.0; 2]; 2];
        for k in 0..4 {
            for a in 0..2 {
                place[a] += value[k] * corners[k][a];
                map[a][0] += corners[k][a] * slope[k][0];
                map[a][1] += corners[k][a] * slope[k][1];
            }
        }
        let jacobian = map[0][0] * map[1][1] - map[0][1] * map[1][0];
        let gradient = slope
            .map(|[x, y]| [(x * map[1][1] - y * map[1][0]) / jacobian, (y * map[0][0] - x * map[0][1]) / jacobian]);
        Self { value, gradient, place, map, jacobian }
    }
}
