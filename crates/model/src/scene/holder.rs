//! Bead guide: forces on the beads from their surroundings.

use super::{ModelKind, Scene, Support};

/// Forces of the bead guide along the chain, on every bead alike.
///
/// ```text
/// F_i = −b v_i − F_c,i sgn(v_i)        F_c,i = F_c + μ (F_{i−1} tan θ_{i−1} + F_i tan θ_i)        sin θ = e/(a_i + a_{i+1})
/// ```
///
/// A bead at rest stays while the contacts push it with less than F_c,i. The clearance e sets neighbours across the bore at most so far from one another
/// that their line of centres is oblique by θ: the wall then carries the transverse part of their force (friction coefficient μ), and the axial stiffness of
/// a contact between beads falls by cos^(5/2) θ. Left out: rotation, tangential forces between beads, beads that move across the bore in time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Holder {
    /// Viscous drag b, N·s/m.
    pub drag: f64,
    /// Friction F_c under a constant load across the chain, N.
    pub friction_force: f64,
    /// Coefficient μ of friction with the wall, 1.
    pub friction_coefficient: f64,
    /// Clearance e of the bore, its diameter less that of the beads, m.
    pub clearance: f64,
    /// Velocity v_s over which friction turns its sign, F_c,i tanh(v/v_s), m/s; 0 is the exact law, with beads that stick.
    pub slip_velocity: f64,
}

/// `holder.slip_velocity` where a model has no exact law of friction, m/s.
pub const DEFAULT_SLIP_VELOCITY: f64 = 1e-3;

impl Holder {
    pub fn has_friction(&self) -> bool {
        self.friction_force > 0.0 || self.friction_coefficient > 0.0 && self.clearance > 0.0
    }

    pub fn acts(&self) -> bool {
        self.drag > 0.0 || self.has_friction()
    }

    /// sin θ of the line of centres of two beads of these radii (m).
    pub(crate) fn obliquity(&self, first: f64, second: f64) -> f64 {
        self.clearance / (first + second)
    }

    /// tan θ of the same.
    pub(crate) fn tangent(&self, first: f64, second: f64) -> f64 {
        let sine = self.obliquity(first, second);
        sine / (1.0 - sine * sine).sqrt()
    }
}

impl Scene {
    /// The bead guide, to change it; made where there was none.
    pub fn holder_mut(&mut self) -> &mut Holder {
        let slip_velocity = if is_exact(self.model.kind, &self.support) { 0.0 } else { DEFAULT_SLIP_VELOCITY };
        self.holder.get_or_insert(Holder { slip_velocity, ..Holder::default() })
    }
}

pub(super) fn is_exact(kind: ModelKind, support: &Support) -> bool {
    kind == ModelKind::Chain && support.disc().is_none()
}

#[cfg(test)]
mod tests {
    use super::super::load;

    #[test]
    fn what_is_stated_as_none_is_absent_and_a_steep_angle_is_the_chain_s_alone() {
        let sets = |sets: &[&str]| load("annulus", &sets.iter().map(|set| (*set).to_owned()).collect::<Vec<_>>());
        let none = ["holder.drag=0", "holder.friction_force=0", "holder.clearance=0"];
        assert_eq!(sets(&none).unwrap().holder, None);
        for model in ["chain", "reduced", "fea"] {
            let kind = format!("model.kind={model}");
            let slight = sets(&["holder.clearance=40um", "holder.friction_coefficient=0.2", &kind]);
            assert!(slight.unwrap().holder.is_some(), "{model}");
            let steep = sets(&["holder.clearance=200um", &kind]);
            assert_eq!(steep.is_ok(), model == "chain", "{model}: {steep:?}");
        }
    }
}
