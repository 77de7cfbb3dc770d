//! Why a disc, its water or a run in front of them failed.

use thiserror::Error;

use super::{
    chain::ChainOnWaterError, contact::PatchError, disc::DiscError, elements::ElementsError,
    rayleigh::field::FieldPointError,
};
use crate::ModelError;

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WaterError {
    #[error(transparent)]
    Disc(#[from] DiscError),
    #[error(transparent)]
    Elements(#[from] ElementsError),
    #[error(transparent)]
    FieldPoint(#[from] FieldPointError),
    #[error(transparent)]
    Chain(#[from] ChainOnWaterError),
    #[error(transparent)]
    Patch(#[from] PatchError),
}

impl From<WaterError> for ModelError {
    fn from(error: WaterError) -> Self {
        match error {
            WaterError::Chain(ChainOnWaterError::Stopped { time }) => Self::Stopped { time },
            error => Self::Water(Box::new(error)),
        }
    }
}
