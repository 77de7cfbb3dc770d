//! How much of the published pressure a compliant horn tip explains.

use serde::Serialize;

use super::{Cell, OWN, PRINTED_PRESSURE, WaterOutcome};

/// A compliant tip, whose free motion is the printed drive, before the scene's own disc.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoadedTip {
    pub mass_kg: f64,
    pub quality: f64,
    /// The runs; where none could be made, why.
    pub cell: Cell,
}

/// How much of the factor between ours and the printed pressure a compliant tip explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Explained {
    /// Median pressure under the tip that moves as prescribed, Pa.
    pub prescribed_pa: f64,
    /// The tip of the least median pressure: number among the tips, and that pressure, Pa.
    pub least: (usize, f64),
    /// ln(prescribed/least) over ln(prescribed/printed), 1; below 0 where every tip makes it louder.
    pub share: f64,
}

impl WaterOutcome {
    /// What a compliant tip explains; none where none could be run.
    #[must_use]
    pub fn explained(&self) -> Option<Explained> {
        let own = self.combinations.iter().find(|outcome| outcome.combination == OWN)?;
        explained(own.printed()?.pressure_pa?.median, &self.tips)
    }
}

pub(super) fn explained(prescribed_pa: f64, tips: &[LoadedTip]) -> Option<Explained> {
    let medians = tips.iter().enumerate().filter_map(|(index, tip)| Some((index, tip.cell.pressure_pa?.median)));
    let least = medians.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let share = (prescribed_pa / least.1).ln() / (prescribed_pa / PRINTED_PRESSURE).ln();
    Some(Explained { prescribed_pa, least, share })
}
