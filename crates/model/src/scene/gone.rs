//! Keys and words that are gone, and what takes their place.

use super::error::{Place, SceneError};

const BEADS: &str =
    "bodies of Gmsh files are gone: a bead is a sphere of its `radius`, meshed as finely as `model.mesh_density` says";
const SUPPORT: &str = "bodies of Gmsh files are gone: write `support.kind = \"annulus\"` with `support.ring_radius`, `support.section_radius` and \
                       `support.material`, or another kind";

const NORMAL: &str = "moving contact normals are gone: those of the undeformed surfaces are kept, whose force is 0.19 % too large per µm of \
                      travel; leave it out";
const MASS: &str =
    "mass at the contact nodes is gone: with it the contact force does not converge as the step falls; leave it out";
const ELEMENTS: &str = "mixed elements are gone: all are 8-node quadrilaterals; leave it out";

/// Key, its word where only that is gone, and what to do.
const GONE: &[(&str, Option<&str>, &str)] = &[
    ("chain.mesh", None, BEADS),
    ("chain.mesh_unit", None, BEADS),
    ("chain.override.mesh", None, BEADS),
    ("chain.override.mesh_unit", None, BEADS),
    ("support.kind", Some("body"), SUPPORT),
    ("support.mesh", None, SUPPORT),
    ("support.mesh_unit", None, SUPPORT),
    ("support.normal", None, NORMAL),
    ("model.contact_mass", None, MASS),
    ("model.elements", None, ELEMENTS),
    (
        "model.integrator",
        Some("newmark"),
        "damped Newmark is gone: write \"hht\", which damps low frequencies far less",
    ),
];

/// Why a key, or one word of it, is refused that once was one.
pub(super) fn gone(key: &str, word: Option<&str>, place: &Place) -> Option<SceneError> {
    let (_, _, instead) = GONE.iter().find(|(name, of, _)| *name == key && *of == word)?;
    Some(SceneError::Gone { place: place.clone(), key: key.to_owned(), word: word.map(str::to_owned), instead })
}

/// Whether a key that is gone has the value that is left, as scenes written out before have it: it says nothing then.
pub(super) fn is_idle(key: &str, value: &str) -> bool {
    let left = [("support.normal", "fixed"), ("model.contact_mass", "massless"), ("model.elements", "quadrilaterals")];
    left.contains(&(key, value))
}
