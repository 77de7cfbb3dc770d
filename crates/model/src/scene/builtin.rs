//! The scenes that come with the program.

use super::error::{Place, SceneError};
use granchain_signal::closest;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    pub name: &'static str,
    /// The file, with the readings of the paper as comments.
    pub toml: &'static str,
}

pub const BUILT_IN: [BuiltIn; 5] = [
    BuiltIn { name: "rigid", toml: include_str!("builtin/rigid.toml") },
    BuiltIn { name: "annulus", toml: include_str!("builtin/annulus.toml") },
    BuiltIn { name: "chain", toml: include_str!("builtin/chain.toml") },
    BuiltIn { name: "water", toml: include_str!("builtin/water.toml") },
    BuiltIn { name: "impact", toml: include_str!("builtin/impact.toml") },
];

pub(super) fn find(name: &str, place: Option<Place>) -> Result<&'static BuiltIn, SceneError> {
    BUILT_IN.iter().find(|scene| scene.name == name).ok_or_else(|| SceneError::UnknownScene {
        place,
        name: name.to_owned(),
        nearest: closest(name, BUILT_IN.iter().map(|scene| scene.name)).map(str::to_owned),
        known: BUILT_IN.iter().map(|scene| scene.name).collect(),
    })
}
