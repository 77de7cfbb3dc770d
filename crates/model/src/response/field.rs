//! Fields at one instant: what every node of every body does.

use std::sync::Arc;

use thiserror::Error;

#[derive(Debug, Clone, PartialEq)]
pub struct FieldMesh {
    /// Points (r, z) at rest, m.
    pub points: Vec<[f64; 2]>,
    /// Quadratic quadrilaterals: four corners anticlockwise, then the middles of sides 1–2, 2–3, 3–4, 4–1.
    pub cells: Vec<[u32; 8]>,
}

/// One body at one instant. A quantity that was not computed is an empty list, in all bodies of the frame alike.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldBody {
    /// Its name, such as `bead3`.
    pub name: String,
    /// Its cells; equal bodies share them.
    pub mesh: Arc<FieldMesh>,
    /// z of the origin of its coordinates, m.
    pub offset: f64,
    /// Displacement (u_r, u_z) of every point, m.
    pub displacement: Vec<[f64; 2]>,
    /// Velocity (v_r, v_z) of every point, m/s.
    pub velocity: Vec<[f64; 2]>,
    /// Stress (rr, zz, θθ, rz) at every point, Pa, positive in tension.
    pub stress: Vec<[f64; 4]>,
    /// Von Mises stress at every point, Pa.
    pub von_mises: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub time: f64,
    pub bodies: Vec<FieldBody>,
}

#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FieldError {
    #[error(
        "field `{quantity}` of `{body}`: expected {expected} values, one a point, found {found}; give all or none in every body"
    )]
    Count { body: String, quantity: &'static str, expected: usize, found: usize },
    #[error("cells of `{body}`: expected point numbers below {points}, found {found}")]
    Point { body: String, points: usize, found: u32 },
}

impl FieldBody {
    /// A body at rest, without any computed quantity.
    pub fn at_rest(name: impl Into<String>, mesh: Arc<FieldMesh>, offset: f64) -> Self {
        Self {
            name: name.into(),
            mesh,
            offset,
            displacement: Vec::new(),
            velocity: Vec::new(),
            stress: Vec::new(),
            von_mises: Vec::new(),
        }
    }
}

impl Field {
    /// Which of displacement, velocity, stress and von Mises stress the frame carries.
    pub(crate) fn carries(&self) -> [bool; 4] {
        let any = |given: fn(&FieldBody) -> bool| self.bodies.iter().any(given);
        [
            any(|body| !body.displacement.is_empty()),
            any(|body| !body.velocity.is_empty()),
            any(|body| !body.stress.is_empty()),
            any(|body| !body.von_mises.is_empty()),
        ]
    }

    /// Refuse lists whose lengths do not fit together.
    pub fn check(&self) -> Result<(), FieldError> {
        let carried = self.carries();
        for body in &self.bodies {
            let named = || body.name.clone();
            let mesh = &*body.mesh;
            let expected = mesh.points.len();
            let lists = [
                ("displacement", body.displacement.len()),
                ("velocity", body.velocity.len()),
                ("stress", body.stress.len()),
                ("von_mises", body.von_mises.len()),
            ];
            for ((quantity, found), carried) in lists.into_iter().zip(carried) {
                if carried && found != expected {
                    return Err(FieldError::Count { body: named(), quantity, expected, found });
                }
            }
            if let Some(&found) = mesh.cells.iter().flatten().find(|point| **point as usize >= expected) {
                return Err(FieldError::Point { body: named(), points: expected, found });
            }
        }
        Ok(())
    }
}
