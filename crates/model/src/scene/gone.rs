//! Keys and words that are gone, and what takes their place.

use super::error::{Place, SceneError};

const BEADS: &str =
    "bodies of Gmsh files are gone: a bead is a sphere of its `radius`, meshed as finely as `model.mesh_density` says";
const SUPPORT: &str = "bodies of Gmsh files are gone: write `support.kind = \"annulus\"` with `support.ring_radius`, `support.section_radius` and \
                       `support.material`, or another kind";

/// Key, its word where only that is gone, and what to do.
const GONE: &[(&str, Option<&str>, &str)] = &[
    ("chain.mesh", None, BEADS),
    ("chain.mesh_unit", None, BEADS),
    ("chain.override.mesh", None, BEADS),
    ("chain.override.mesh_unit", None, BEADS),
    ("support.kind", Some("body"), SUPPORT),
    ("support.mesh", None, SUPPORT),
    ("support.mesh_unit", None, SUPPORT),
];

/// Why a key, or one word of it, is refused that once was one.
pub(super) fn gone(key: &str, word: Option<&str>, place: &Place) -> Option<SceneError> {
    let (_, _, instead) = GONE.iter().find(|(name, of, _)| *name == key && *of == word)?;
    Some(SceneError::Gone { place: place.clone(), key: key.to_owned(), word: word.map(str::to_owned), instead })
}
