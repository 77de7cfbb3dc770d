//! Which model runs a scene.

use super::word::words;

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
