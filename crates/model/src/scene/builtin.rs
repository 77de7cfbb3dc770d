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
pub const BUILT_IN: [BuiltIn; 4] = [
    BuiltIn { name: "rigid", toml: include_str!("builtin/rigid.toml") },
    BuiltIn { name: "annulus", toml: include_str!("builtin/annulus.toml") },
    BuiltIn { name: "chain", toml: include_str!("builtin/chain.toml") },
    BuiltIn { name: "water", toml: include_str!("builtin/water.toml") },
];

/// The built-in scene of that name.
pub(super) fn find(name: &str, place: Option<Place>) -> Result<&'static BuiltIn, SceneError> {
    BUILT_IN.iter().find(|scene| scene.name == name).ok_or_else(|| SceneError::UnknownScene {
        place,
        name: name.to_owned(),
        nearest: closest(name, BUILT_IN.iter().map(|scene| scene.name)).map(str::to_owned),
        known: BUILT_IN.iter().map(|scene| scene.name).collect(),
    })
}
