//! What the holder around the beads does to them.

use super::{ModelKind, Scene, Support, error::SceneError, reader::Reader};

/// Forces of the holder along the chain, on every bead alike.
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
    pub fn obliquity(&self, first: f64, second: f64) -> f64 {
        self.clearance / (first + second)
    }

    /// tan θ of the same.
    pub fn tangent(&self, first: f64, second: f64) -> f64 {
        let sine = self.obliquity(first, second);
        sine / (1.0 - sine * sine).sqrt()
    }
}

impl Scene {
    /// The holder, to change it; made where there was none.
    pub fn holder_mut(&mut self) -> &mut Holder {
        let slip_velocity = if is_exact(self.model.kind, &self.support) { 0.0 } else { DEFAULT_SLIP_VELOCITY };
        self.holder.get_or_insert(Holder { slip_velocity, ..Holder::default() })
    }
}

pub(super) fn is_exact(kind: ModelKind, support: &Support) -> bool {
    kind == ModelKind::Chain && !matches!(support, Support::Disc { .. })
}

const KEYS: [&str; 4] = ["holder.drag", "holder.friction_force", "holder.friction_coefficient", "holder.clearance"];

/// Largest sine of the angle between lines of centres and the axis in models whose contacts are along the axis.
const STRAIGHT: f64 = 0.05;

/// The holder that a scene asks for; `exact` where the model can do the exact law of friction, `meshed` where bodies are.
pub(super) fn read(
    reader: &Reader<'_>,
    (exact, meshed): (bool, bool),
    least_radius: f64,
) -> Result<Option<Holder>, SceneError> {
    if !KEYS.iter().any(|key| reader.has(key)) {
        reader.refuse_alone(&["holder.slip_velocity"], "holder.friction_force")?;
        return Ok(None);
    }
    let number = |key| Ok::<_, SceneError>(reader.given(key)?.unwrap_or(0.0));
    let slip_velocity = reader.given("holder.slip_velocity")?;
    let holder = Holder {
        drag: number(KEYS[0])?,
        friction_force: number(KEYS[1])?,
        friction_coefficient: number(KEYS[2])?,
        clearance: number(KEYS[3])?,
        slip_velocity: slip_velocity.unwrap_or(if exact { 0.0 } else { DEFAULT_SLIP_VELOCITY }),
    };
    if !exact && holder.has_friction() && holder.slip_velocity == 0.0 {
        let expected = "a positive velocity: the exact law (0) is of the chain (`model.kind` = \"chain\") before anything but a disc".to_owned();
        return Err(reader.out_of_range("holder.slip_velocity", expected, "0 m/s".to_owned()));
    }
    if holder.friction_coefficient > 0.0 && holder.clearance == 0.0 {
        let key = "holder.friction_coefficient";
        let expected = "`holder.clearance` beside it: straight chains do not press on the wall".to_owned();
        return Err(reader.out_of_range(key, expected, holder.friction_coefficient.to_string()));
    }
    // Half the radius is 14° between equal beads: what is left out is no longer small.
    if holder.clearance > 0.5 * least_radius {
        let expected = format!("at most half the least radius of a bead, {}", super::shown::length(0.5 * least_radius));
        return Err(reader.out_of_range("holder.clearance", expected, super::shown::length(holder.clearance)));
    }
    // Contacts of meshed bodies are along the axis: what the obliquity does to their compliance is left out, 0.3 % at this angle.
    if meshed && holder.clearance > STRAIGHT * 2.0 * least_radius {
        let expected = format!(
            "at most {}, an angle of {STRAIGHT} between equal beads: the models with meshed bodies leave out what the angle does to a contact's stiffness; \
             use model.kind=chain",
            super::shown::length(STRAIGHT * 2.0 * least_radius)
        );
        return Err(reader.out_of_range("holder.clearance", expected, super::shown::length(holder.clearance)));
    }
    // What is stated as none is none, and costs nothing.
    let acts = holder.acts() || holder.clearance > 0.0;
    Ok(Some(holder).filter(|_| acts))
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
