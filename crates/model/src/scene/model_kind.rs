//! Which model runs a scene.

use super::{error::SceneError, reader::Reader, shown::time, word::words};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    Chain,
    Reduced,
    Fea,
}

words!(ModelKind { Chain = "chain", Reduced = "reduced", Fea = "fea" });

impl ModelKind {
    pub const fn is_meshed(self) -> bool {
        matches!(self, Self::Reduced | Self::Fea)
    }
}

pub(super) fn kind(reader: &Reader<'_>) -> Result<ModelKind, SceneError> {
    reader.word("model.kind")
}

pub(super) fn check_step(reader: &Reader<'_>, step: f64, frequency: f64) -> Result<(), SceneError> {
    // Five steps through the shortest half period of motion that the drive's own period leaves are no integration.
    let longest = 1.0 / (20.0 * frequency);
    if step <= longest {
        return Ok(());
    }
    let longest = time((longest * 1e9).floor() / 1e9);
    Err(reader.out_of_range("model.step", format!("at most {longest}, a twentieth of a drive period"), time(step)))
}
