//! The scenes that come with the program.

use super::error::{Place, SceneError};
use super::key::closest;

/// A scene that comes with the program: its name and its commented TOML text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// Name, as in `--scene NAME`.
    pub name: &'static str,
    /// The file, with the readings of the paper as comments.
    pub toml: &'static str,
}

/// All scenes that come with the program.
pub const BUILT_IN: [BuiltIn; 3] = [
    BuiltIn { name: "rigid", toml: include_str!("builtin/rigid.toml") },
    BuiltIn { name: "annulus", toml: include_str!("builtin/annulus.toml") },
    BuiltIn { name: "chain", toml: include_str!("builtin/chain.toml") },
];

/// The scene of the paper that cannot be run yet.
pub const WATER: &str = "water";

pub(super) fn not_yet_available() -> SceneError {
    SceneError::NotYetAvailable {
        name: WATER,
        lacking: "the vitreous-carbon disc and the water behind it have no model here",
        instead: "for its chain and drive alone use `--scene chain --set drive.amplitude=3.96um` (rigid wall)",
    }
}

/// The built-in scene of that name.
pub(super) fn find(name: &str, place: Option<Place>) -> Result<&'static BuiltIn, SceneError> {
    if name == WATER {
        return Err(not_yet_available());
    }
    BUILT_IN.iter().find(|scene| scene.name == name).ok_or_else(|| SceneError::UnknownScene {
        place,
        name: name.to_owned(),
        nearest: closest(name, BUILT_IN.iter().map(|scene| scene.name).chain([WATER])).map(str::to_owned),
        known: BUILT_IN.iter().map(|scene| scene.name).collect(),
    })
}
